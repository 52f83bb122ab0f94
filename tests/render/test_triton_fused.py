"""The GPU renderer against numpy and the reference in float64: on a GPU, or in Triton's interpreter without one."""

import os
import subprocess
import sys
from functools import partial
from itertools import pairwise
from pathlib import Path

import pytest
import torch

from sdf2vec import Layer, Scene, Shape, kernel_cache
from sdf2vec.blend import COMPOSITING
from sdf2vec.layer import Part
from sdf2vec.render import fused, triton_fused, triton_kernels
from sdf2vec.render.tensors import from_scene
from tests.render.agreement import assert_near_the_reference, outcome
from tests.scenes import FAMILIES, scene_of
from tests.triton_device import DEVICE, MARKS

pytestmark = MARKS


# --- whole scenes ------------------------------------------------------------------------------------------


def assert_same_function(scene, size, channels=4):
    tensors = from_scene(scene, device=DEVICE)
    assert_near_the_reference(triton_fused.composite, scene, tensors, size, channels)


@pytest.mark.parametrize("compositing", COMPOSITING)
@pytest.mark.parametrize("family", FAMILIES)
def test_same_function_as_the_reference(family, compositing):
    assert_same_function(scene_of(family, compositing, 6, 1, (20, 18)), (20, 18))


@pytest.mark.parametrize(
    ("compositing", "size", "transparent", "channels"),
    [
        ("over", (37, 21), True, 4),
        ("additive", (37, 21), True, 4),
        ("over", (33, 17), False, 3),
        ("additive", (1, 37), True, 3),
        ("over", (1, 1), False, 4),
        ("additive", (16, 16), False, 4),
    ],
)
def test_sizes_and_grounds(compositing, size, transparent, channels):
    assert_same_function(scene_of("plain", compositing, 8, 1, size, transparent), size, channels)


def circles(*rows):
    layers = (
        Layer((Shape.of("circle", color, center=center, radius=radius),), falloff, opacity)
        for center, radius, falloff, opacity, color in rows
    )
    return Scene(40, 24, tuple(layers), (0.2, 0.4, 0.6))


LARGE, SMALL = ((0, 0), 3.0, 0.0, 1.0, (0.1, 0.2, 0.3)), ((0.1, 0), 0.2, 0.1, 0.5, (0.9, 0.5, 0.1))
AWAY, SOFT = ((5, 5), 0.2, 0.1, 1.0, (0.9, 0.5, 0.1)), ((0, 0.5), 0.3, 2.0, 0.3, (0, 1, 0))
TINY = ((0.3, 0.3), 1e-5, 0.0, 1.0, (1, 1, 1))


@pytest.mark.parametrize(
    "scene",
    [
        circles(LARGE, SMALL),
        circles(SMALL, LARGE),
        circles(SMALL, LARGE, SOFT),
        circles(AWAY),
        circles(TINY, SOFT),
    ],
    ids=["opaque below", "opaque on top", "opaque between", "off the canvas", "tiny and very soft"],
)
def test_special_scenes(scene):
    assert_same_function(scene, (40, 24))


def test_a_scene_without_layers():
    image = triton_fused.composite(from_scene(Scene(3, 2, (), (0.25, 0.5, 0.75)), device=DEVICE), 3, 2)
    assert image[:, 1, 2].tolist() == [0.25, 0.5, 0.75, 1.0]


def test_equal_input_gives_equal_output_also_in_chunks_of_tiles(monkeypatch):
    scene = scene_of("plain", layers=6, seed=6)
    results = []
    for scratch in (triton_fused.SCRATCH, triton_fused.SCRATCH, 4 * 4096):
        monkeypatch.setattr(triton_fused, "SCRATCH", scratch)
        image, grads = outcome(triton_fused.composite, from_scene(scene, device=DEVICE), (40, 30))
        results.append([image, *(grad for _, grad in grads)])
    for other in results[1:]:
        assert all(torch.equal(a, b) for a, b in zip(results[0], other, strict=True))


def test_room_for_more_pairs_than_there_are_changes_nothing():
    scene = scene_of("plain", layers=6, seed=6)
    room = triton_fused.Room(1000)
    renders = [partial(triton_fused.composite, room=given) for given in (None, room)]
    one, other = (outcome(render, from_scene(scene, device=DEVICE), (40, 30)) for render in renders)
    assert torch.equal(one[0], other[0])
    assert all(torch.equal(a, b) for (_, a), (_, b) in zip(one[1], other[1], strict=True))
    assert room.needed is not None
    assert 6 <= int(room.needed) < 1000


def test_room_for_fewer_pairs_than_there_are_is_kept_and_said(monkeypatch):
    """What lies behind it in memory stays as it is."""
    launch, behind = triton_fused._launch, []

    def in_larger_memory(kernel, programs, *arguments):
        if kernel.__name__ != "find_pairs":
            launch(kernel, programs, *arguments)
            return
        *others, most = arguments
        given = others[-3:]
        larger = [torch.cat([each, each.new_full((200,), -7)]) for each in given]
        launch(kernel, programs, *others[:-3], *larger, most)
        for each, own in zip(given, larger, strict=True):
            each.copy_(own[:most])
            behind.append(own[most:])

    monkeypatch.setattr(triton_fused, "_launch", in_larger_memory)
    scene = scene_of("plain", layers=6, seed=6)
    rooms = [triton_fused.Room(pairs) for pairs in (1000, 3, 0)]
    for room in rooms:
        outcome(partial(triton_fused.composite, room=room), from_scene(scene, device=DEVICE), (40, 30))
    needed = [room.needed for room in rooms if room.needed is not None]
    assert needed[0] > 3
    assert needed == [needed[0]] * 3
    assert len(behind) == 9
    assert all((each == -7).all() for each in behind)


@pytest.mark.parametrize(
    ("starts", "most", "chunks"),
    [
        ([0, 2, 5, 5, 9], 9, [(0, 4, 9)]),
        ([0, 2, 5, 5, 9], 5, [(0, 3, 5), (3, 1, 4)]),
        ([0, 2, 5, 5, 9], 0, [(0, 1, 2), (1, 1, 3), (2, 1, 0), (3, 1, 4)]),
        ([0, 0], 0, [(0, 1, 0)]),
    ],
)
def test_chunks_of_tiles(starts, most, chunks):
    room = torch.empty(starts[-1])
    bins = triton_fused._Bins(torch.tensor(starts), torch.empty(len(starts) - 1), room, room, room, room)
    assert triton_fused._chunks(bins, most) == chunks


def bins_of(composite, tensors):
    tensors.background.requires_grad_()
    return composite(tensors, 56, 40).grad_fn.bins


@pytest.mark.parametrize("family", FAMILIES)
def test_bins_are_those_of_the_cpu(family):
    """Up to rounding: a layer that only just touches a tile may be in one and not in the other."""
    compositing = "additive" if family == "cut" else "over"  # what the CPU's tests have compiled
    scene = scene_of(family, compositing, layers=20, seed=21)
    tensors = from_scene(scene, device=DEVICE)
    bins, wanted = bins_of(triton_fused.composite, tensors), bins_of(fused.composite, from_scene(scene))
    order = torch.cat([group.order for group in tensors.groups])
    starts, layers = bins.starts.tolist(), order[bins.layers.long()].tolist()
    for tile, (start, end) in enumerate(pairwise(starts)):
        ours, theirs = layers[start:end], wanted.layers[wanted.starts[tile] : wanted.starts[tile + 1]]
        assert ours == sorted(ours)
        assert len(set(ours) ^ set(theirs.tolist())) <= 1


# --- texts and files ---------------------------------------------------------------------------------------


def test_a_text_holds_only_the_structures_it_is_for():
    text = triton_kernels.text(((Part("circle", "linear"),),), "over", 3)
    assert "# linear circle" in text
    assert "ellipse" not in text
    compile(text, "kernels", "exec")


def test_without_a_cache_folder_kernels_are_in_a_temporary_file(tmp_path, monkeypatch):
    (tmp_path / "file").write_text("not a folder")
    monkeypatch.setenv("SDF2VEC_CACHE", str(tmp_path / "file" / "inside"))
    kernel_cache._warn_once.cache_clear()
    with pytest.warns(RuntimeWarning, match="anew in every run"):
        module = kernel_cache.load_file(f"{triton_kernels.text(((Part('circle'),),), 'over', 4)}# {tmp_path}")
    assert module.__file__ is not None
    assert "def forward_tiles" in Path(module.__file__).read_text()


COMPILE = """
import sys
import triton
from triton.backends.compiler import GPUTarget
from triton.compiler import ASTSource
from sdf2vec.render import triton_kernels
from sdf2vec.layer import Part

POINTERS = "starts visible layers kinds places layer_starts ranges full".split()
NUMBERS = "width height columns lines first_tile most".split()
LONG = "groups order ends keys".split()


def signature(name):
    if name in ("pixel", "WIDTH"):
        return {"pixel": "fp32", "WIDTH": "constexpr"}[name]
    return "i32" if name in NUMBERS else "*i32" if name in POINTERS else "*i64" if name in LONG else "*fp32"


cases = (
    ("over", 4, ((Part("gabor"),), (Part("triangle"), Part("displaced", join="union")))),
    ("additive", 3, ((Part("box", "linear"), Part("triangle", join="subtraction")),)),
)
for compositing, channels, structures in cases:
    module = triton_kernels.load(structures, compositing, channels)
    for name in ("measure_layers", "find_pairs", "forward_tiles", "backward_tiles", "reduce_pairs"):
        kernel = getattr(module, name)
        types = {argument: signature(argument) for argument in kernel.arg_names}
        constants = {"WIDTH": 32} if "WIDTH" in types else {}
        source = ASTSource(fn=kernel, signature=types, constexprs=constants)
        options = {"num_warps": 4, "enable_fp_fusion": True}
        machine = triton.compile(source, target=GPUTarget("cuda", 80, 32), options=options)
        print(name, len(machine.asm["cubin"]) > 0)
"""


def test_kernels_compile_for_a_gpu_that_is_not_there(tmp_path):
    """The interpreter takes what the compiler refuses (types, branches); this takes all the way to machine code."""
    environment = {**os.environ, "SDF2VEC_CACHE": str(tmp_path), "TRITON_CACHE_DIR": str(tmp_path / "triton")}
    environment.pop("TRITON_INTERPRET", None)
    result = subprocess.run(
        [sys.executable, "-c", COMPILE], env=environment, capture_output=True, text=True, check=False
    )
    assert result.returncode == 0, result.stderr
    assert result.stdout.split()[1::2] == ["True"] * 10

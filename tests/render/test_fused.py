"""The fused renderer against the reference in float64: values, derivatives, threads."""

import pytest
import torch
from hypothesis import Phase, assume, given, settings
from hypothesis import strategies as st

from sdf2vec import Layer, Scene, Shape
from sdf2vec.blend import COMPOSITING, JOINS
from sdf2vec.layer import Part
from sdf2vec.paints import PAINTS
from sdf2vec.render import draw, fused, kernels, reference, tiling
from sdf2vec.render.tensors import from_scene
from sdf2vec.shapes import KINDS
from tests.render.agreement import VALUES, assert_near_the_reference, is_well_conditioned, outcome
from tests.scenes import FAMILIES, scene_of

MODULES = [  # every structure takes some seconds to compile, so not all
    *(("plain", "over"), ("plain", "additive"), ("union", "over"), ("cut", "additive")),
    *(("patches", "over"), ("patches", "additive")),
]


def assert_same_function(scene, size, channels=4):
    assert_near_the_reference(fused.composite, scene, from_scene(scene), size, channels)


SIZES = st.sampled_from([(60, 40), (1, 1), (1, 37), (33, 17), (16, 16), (50, 71)])


@pytest.mark.parametrize(("family", "compositing"), MODULES)
@given(st.integers(0, 10**6), st.integers(1, 14), st.booleans(), SIZES)
@settings(max_examples=8, deadline=None, derandomize=True, phases=[Phase.explicit, Phase.generate])
def test_same_function_as_the_reference(family, compositing, seed, layers, transparent, size):
    scene = scene_of(family, compositing, layers, seed, size, transparent)
    assume(is_well_conditioned(scene, size))
    assert_same_function(scene, size)


def test_scenes_that_single_precision_cannot_tell_are_known():
    """One whose derivative is 1 % off, and one in which it is 0.03 % off."""
    assert not is_well_conditioned(scene_of("cut", "additive", 14, 0, (33, 17)), (33, 17))
    assert not is_well_conditioned(scene_of("union", "over", 11, 599, (50, 71)), (50, 71))
    assert is_well_conditioned(scene_of("cut", "additive", 14, 1, (33, 17)), (33, 17))


def test_families_have_everything():
    parts = [part for structures in FAMILIES.values() for structure in structures for part in structure]
    assert {part.kind for part in parts} == set(KINDS)
    assert {part.paint for part in parts} == set(PAINTS)
    assert {part.join for part in parts} == {"", *JOINS}
    assert [{name for name, _ in MODULES}, {name for _, name in MODULES}] == [set(FAMILIES), set(COMPOSITING)]


def test_three_channels():
    assert_same_function(scene_of("plain", seed=5), (45, 31), channels=3)


def circles(*circles_, compositing="over"):
    layers = tuple(
        Layer((Shape.of("circle", color, center=center, radius=radius),), falloff, opacity)
        for center, radius, falloff, opacity, color in circles_
    )
    far = Layer((Shape.of("box", center=(9, 9), half_size=(0.1, 0.1), angle=0, corner_radius=0),))
    return Scene(64, 64, (far, *layers), (0.2, 0.4, 0.6), compositing)


@pytest.mark.parametrize(
    "scene",
    [
        circles(((0, 0), 3.0, 0.0, 1.0, (0.1, 0.2, 0.3)), ((0.1, 0), 0.2, 0.1, 0.5, (0.9, 0.5, 0.1))),
        circles(((0.1, 0), 0.2, 0.1, 0.5, (0.9, 0.5, 0.1)), ((0, 0), 3.0, 0.0, 1.0, (0.1, 0.2, 0.3))),
        circles(((5, 5), 0.2, 0.1, 1.0, (0.9, 0.5, 0.1))),
        circles(((0.3, 0.3), 1e-5, 0.0, 1.0, (1, 1, 1)), ((-0.5, 0.5), 0.3, 2.0, 0.3, (0, 1, 0))),
    ],
    ids=["opaque below", "opaque on top hides the rest", "off the canvas", "tiny and very soft"],
)
def test_special_scenes(scene):
    assert_same_function(scene, (64, 64))


def test_a_scene_without_layers():
    image = fused.composite(from_scene(Scene(3, 2, (), (0.25, 0.5, 0.75))), 3, 2)
    assert image[:, 1, 2].tolist() == [0.25, 0.5, 0.75, 1.0]


def test_the_number_of_threads_changes_nothing(monkeypatch):
    scene = scene_of("union", layers=40, seed=12)
    results = []
    for count in ("1", "2", "3"):
        monkeypatch.setenv("SDF2VEC_THREADS", count)
        image, grads = outcome(fused.composite, from_scene(scene), (90, 70))
        results.append([image, *(grad for _, grad in grads)])
    for other in results[1:]:
        assert all(torch.equal(a, b) for a, b in zip(results[0], other, strict=True))


@pytest.mark.parametrize(("family", "compositing"), MODULES)
def test_bins_hold_every_pixel_that_is_covered(family, compositing):
    """Culling by tile loses nothing: where the reference covers a pixel, its tile lists the layer."""
    scene = scene_of(family, compositing, layers=25, seed=21)
    tensors = from_scene(scene)
    x, y, pixel = reference.canvas(tensors, 80, 64)
    bins = binned(tensors, 80, 64)
    for group in tensors.groups:
        cover, _ = reference.group_coverage(group, scene.compositing, x, y, pixel)
        for layer, covered in zip(group.order.tolist(), cover.reshape(-1, 64, 80), strict=True):
            for tile in range(5 * 4):
                top, left = tile // 5 * 16, tile % 5 * 16
                listed = layer in bins.layers[bins.starts[tile] : bins.starts[tile + 1]]
                assert listed or float(covered[top : top + 16, left : left + 16].max()) == 0.0


def binned(tensors, width, height):
    leaf = tensors.background.requires_grad_()
    image = fused.composite(tensors, width, height)
    assert leaf.requires_grad
    return image.grad_fn.bins  # type: ignore[union-attr]


# --- compiling ---------------------------------------------------------------------------------------------


def test_structures_are_compiled_by_themselves():
    """A scene of several needs no other kernels than scenes of each alone; equal paints fill tiles alike."""
    circle, box = (kernels.drawing((Part(kind),), "over", 3) for kind in ("circle", "box"))
    assert circle[tiling.DRAW] != box[tiling.DRAW]
    assert circle[tiling.FILL] == box[tiling.FILL]
    assert circle[tiling.FILL] != kernels.drawing((Part("circle", "linear"),), "over", 3)[tiling.FILL]


def test_large_scenes_are_drawn_by_the_fused_renderer_and_look_the_same(monkeypatch):
    scene = scene_of("plain", seed=5)
    dense = draw.draw(scene, 50, 40)
    assert torch.equal(dense, reference.render(scene, 50, 40))
    monkeypatch.setattr(draw, "LARGE", 0)
    assert 0.0 < float((draw.draw(scene, 50, 40) - dense).abs().max()) <= VALUES

"""Every layout of a shader shows the same picture, on real engines; lists and packed numbers leave nothing out."""

import dataclasses
import random
from functools import cache

import numpy as np
import pytest
import torch

import sdf2vec
from sdf2vec import Joint, Layer, Scene, Sdf2vecError, Shape
from sdf2vec.engines import glslang_validate
from sdf2vec.export import packing
from sdf2vec.export.exported import Exported
from sdf2vec.export.layouts import FILE, MODULE, OLD, TEXT_LIMIT, choose
from sdf2vec.export.options import Options
from sdf2vec.export.shader import files_beside, shader
from sdf2vec.export.table_text import short, words_of
from sdf2vec.export.tiles import COARSEST, bin_layers, scene_grid
from sdf2vec.render import reference
from sdf2vec.render.reference import group_coverage
from sdf2vec.render.tensors import from_scene
from sdf2vec.roundtrip import ROUND_TRIPS, SHADERTOY_HEAD, SHADERTOY_TAIL, Pixels, compare
from sdf2vec.shapes import KINDS
from tests.scenes import random_scene

EXACT = ("table", "tiled", "data")
SIZES = [(201, 130), (24, 17)]  # the lists hold for the first
SAME = 0.01  # levels


@pytest.fixture(autouse=True)
def _quick_packing(monkeypatch):
    """A few thousand pixels tell enough about how many bits a small scene wants."""
    monkeypatch.setattr(packing, "SAMPLE", 1 << 17)


@cache
def made(scene, target, layout, framing) -> Exported:
    """An export, made once for all sizes."""
    return sdf2vec.exported(scene, target, layout=layout, framing=framing)


def draw(scene, target, size, layout, framing="fit") -> Pixels:
    return ROUND_TRIPS[target][0].draw(made(scene, target, layout, framing), scene, *size)


def smoothed(scene):
    """A scene without sharp joins, across which colours jump: a seam that moves by any little is an error there."""
    joined = [
        dataclasses.replace(
            layer, joints=tuple(Joint(joint.join, max(joint.smoothness, 0.02)) for joint in layer.joints)
        )
        for layer in scene.layers
    ]
    return dataclasses.replace(scene, layers=tuple(joined))


@cache
def many(count, seed=0, width=60, height=40):
    """Small soft triangles and boxes, without unions."""
    r = random.Random(seed)
    layers = []
    for i in range(count):
        x, y, s = r.uniform(-0.8, 0.8), r.uniform(-0.5, 0.5), r.uniform(0.01, 0.06)
        color = (r.random(), r.random(), r.random())
        shape = (
            Shape("triangle", (x - s, y - s, x + s, y, x, y + s), color)
            if i % 2
            else Shape("box", (x, y, s, 0.5 * s, 3 * x, 0.0), color)
        )
        layers.append(Layer((shape,), r.choice([0.0, 0.01, 0.03]), r.choice([1.0, 0.6])))
    return Scene(width, height, tuple(layers), (0.2, 0.4, 0.6))


# --- the same picture ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("compositing", ["over", "additive"])
@pytest.mark.parametrize("kinds", [("triangle",), tuple(KINDS)])
def test_layouts_agree(kinds, compositing, require_engine):
    require_engine("opengl")
    scene = random_scene(kinds, compositing, layers=20, seed=4)
    for size in SIZES:
        readable = draw(scene, "glsl", size, "readable")
        for layout in EXACT:
            difference = 255 * np.abs(draw(scene, "glsl", size, layout) - readable).max()
            assert difference <= SAME, (layout, size)


@pytest.mark.parametrize("compositing", ["over", "additive"])
def test_storage_buffer_agrees_with_statements(compositing, require_engine):
    require_engine("webgpu")
    scene = random_scene(compositing=compositing, layers=20, seed=5, transparent=True)
    for size in SIZES:
        difference = draw(scene, "wgsl", size, "data") - draw(scene, "wgsl", size, "readable")
        assert 255 * np.abs(difference).max() <= SAME


@pytest.mark.parametrize("compositing", ["over", "additive"])
@pytest.mark.parametrize("kinds", [("circle",), tuple(KINDS)])
def test_packed_is_within_its_error(kinds, compositing, require_engine):
    require_engine("opengl")
    scene = smoothed(random_scene(kinds, compositing, layers=16, seed=7))
    made = sdf2vec.exported(scene, "shadertoy", layout="packed", framing="fit")
    assert 0.0 < made.error <= packing.LIMIT
    for size in SIZES:
        result = compare(ROUND_TRIPS["shadertoy"][0], made, scene, size)
        assert result.largest_error <= packing.LIMIT + 0.05, size


@pytest.mark.parametrize("join", ["subtraction", "intersection"])
def test_what_cuts_a_layer_may_lie_far_outside(join, require_engine):
    """A small circle and the edge of one a hundred times as large, packed."""
    require_engine("opengl")
    shapes = (Shape("circle", (0, 0, 0.2), (1, 0, 0)), Shape("circle", (20.0, 0.05, 20.0)))
    scene = Scene(60, 40, (Layer(shapes, 0.02, 1.0, (Joint(join, 0.0),)),), (0, 0, 1))
    made = sdf2vec.exported(scene, "shadertoy", layout="packed", framing="fit")
    assert compare(ROUND_TRIPS["shadertoy"][0], made, scene, (150, 100)).largest_error <= 1.0


def test_many_shapes(require_engine):
    """1200 shapes, against the dense reference, finer and coarser than the lists are made for."""
    require_engine("opengl")
    require_engine("webgpu")
    scene = many(1200)
    for target in ("glsl", "wgsl"):
        made = shader(scene, target, Options())
        assert made.choice.layout == "data"
        assert made.choice.tiles is not None
        assert made.choice.tiles.depth < 60
        whole = Exported(made.text, files_beside(made, ""))
        for size in ((150, 102), (48, 20)):
            drawn = ROUND_TRIPS[target][0].draw(whole, scene, *size)
            assert error_at_some_pixels(scene, drawn) <= 0.05


def error_at_some_pixels(scene, drawn, count=300):
    """Largest difference, in levels, from the dense reference in float64."""
    height, width, _ = drawn.shape
    tensors = from_scene(scene, torch.float64)
    chosen = torch.from_numpy(np.random.default_rng(0).choice(height * width, count, replace=False))
    x, y, pixel = reference.canvas(tensors, width, height)
    with torch.no_grad():
        expected = reference.displayed(reference.composite_points(tensors, x[chosen], y[chosen], pixel))
    return 255 * np.abs(drawn.reshape(-1, 4)[chosen] - expected.numpy().T).max()


def test_constant_tables_have_a_limit(require_engine):
    require_engine("glslang")
    text = shader(many(700), "glsl", Options(layout="tiled")).text
    assert glslang_validate(text) is None
    for layout in ("table", "tiled"):
        with pytest.raises(Sdf2vecError, match="too many shapes for a constant table; use data"):
            shader(many(1100), "glsl", Options(layout=layout))


@pytest.mark.parametrize("layout", [*EXACT, "packed"])
@pytest.mark.parametrize("size", [(1, 1), (100, 10), (3, 200)])
def test_odd_canvases(layout, size, require_engine, monkeypatch):
    require_engine("opengl")
    monkeypatch.setattr(packing, "SAMPLE", 1 << 21)  # a picture that is a strip of the canvas
    scene = smoothed(random_scene(width=size[0], height=size[1], seed=8, layers=9))
    made = sdf2vec.exported(scene, "glsl", layout=layout)
    for canvas in (size, (50, 130)):
        result = compare(ROUND_TRIPS["glsl"][0], made, scene, canvas)
        assert result.largest_error <= (1.0 if layout == "packed" else 0.1), canvas


@pytest.mark.parametrize("layers", [0, 1])
@pytest.mark.parametrize("layout", ["readable", *EXACT, "packed"])
def test_hardly_any_shapes(layout, layers, require_engine):
    require_engine("opengl")
    scene = random_scene(("circle",), layers=layers, seed=3)
    made = sdf2vec.exported(scene, "glsl", layout=layout)
    result = compare(ROUND_TRIPS["glsl"][0], made, scene, (140, 110))
    assert result.largest_error <= made.error + 0.1


# --- framing and motion -------------------------------------------------------------------------------------


@pytest.mark.parametrize("layout", ["readable", "tiled", "packed"])
def test_cover_cuts_what_fit_would_not_fill(layout, require_engine):
    """A canvas twice as wide as the picture shows its middle rows, as large as twice the width would."""
    require_engine("opengl")
    scene = random_scene(("circle",), seed=2, width=100, height=100)
    covered = draw(scene, "shadertoy", (400, 200), layout, framing="cover")
    whole = draw(scene, "shadertoy", (400, 400), layout)
    np.testing.assert_allclose(covered, whole[100:300], atol=1e-5)


@pytest.mark.parametrize("transparent", [False, True])
@pytest.mark.parametrize(
    ("target", "layout"),
    [
        ("shadertoy", "readable"),
        ("shadertoy", "tiled"),
        ("shadertoy", "packed"),
        ("glsl", "data"),
        ("wgsl", "readable"),
    ],
)
def test_crop_shows_the_ground_around_the_picture(target, layout, transparent, require_engine):
    """On wider and on higher canvases; what lies within the frame stays as it is."""
    require_engine(ROUND_TRIPS[target][0].engine)
    scene = random_scene(("circle",), seed=2, width=100, height=100, transparent=transparent)
    ground = [0.0] * 4 if scene.background is None else [*scene.background, 1.0]
    for size, place in (((400, 200), np.s_[:, 100:300]), ((100, 160), np.s_[30:130, :])):
        cropped = draw(scene, target, size, layout, framing="crop")
        fitted = draw(scene, target, size, layout)
        np.testing.assert_allclose(cropped[place], fitted[place], atol=1e-5)
        outside = np.ones(cropped.shape[:2], bool)
        outside[place] = False
        np.testing.assert_allclose(cropped[outside], np.broadcast_to(ground, (outside.sum(), 4)), atol=1e-5)
        assert np.abs(fitted[outside] - ground).max() > 0.1


def test_what_is_pasted_is_cropped_unless_told():
    scene = random_scene(("circle",), seed=2)
    assert sdf2vec.export(scene, "shadertoy") == sdf2vec.export(scene, "shadertoy", framing="crop")
    for target in ("glsl", "wgsl"):
        assert sdf2vec.export(scene, target) == sdf2vec.export(scene, target, framing="fit")
    assert "cropped" not in str(sdf2vec.export(scene, "shadertoy", framing="cover"))


@pytest.mark.parametrize("layout", ["readable", "table", "tiled", "packed"])
def test_animated_shapes_move_a_little_and_alike(layout, require_engine):
    require_engine("opengl")
    scene = random_scene(layers=9, seed=2)
    made = shader(scene, "shadertoy", Options(layout=layout, animate=True)).text
    assert "iTime" in made
    fixed = shader(scene, "shadertoy", Options(layout="readable", animate=True)).text
    moved = [_at_time(text, 7.5) for text in (made, fixed)]
    assert np.abs(moved[0] - moved[1]).max() * 255 <= (2.0 if layout == "packed" else SAME)
    assert 0.01 < np.abs(moved[0] - _at_time(made, 0.3)).max() < 0.9


def _at_time(text, seconds):
    made = Exported(text.replace("iTime", str(seconds)))
    return ROUND_TRIPS["shadertoy"][0].draw(made, Scene(1, 1, ()), 150, 110)


def test_only_a_shadertoy_moves():
    with pytest.raises(Sdf2vecError, match="shadertoy"):
        shader(random_scene(seed=1), "glsl", Options(animate=True))


# --- lists --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("compositing", ["over", "additive"])
@pytest.mark.parametrize("across", [1, 3, 8])
def test_lists_hold_all_that_is_seen(compositing, across):
    """Points all over a cell, and beyond the border: a layer with coverage there is listed, or hidden."""
    scene = dataclasses.replace(random_scene(compositing=compositing, layers=40, seed=11), width=90)
    (tiles,) = bin_layers(scene, [scene_grid(scene, across)])
    x = torch.from_numpy(np.linspace(-1.4, 1.4, 71)).repeat(71)
    y = torch.from_numpy(np.linspace(-1.2, 1.2, 71)).repeat_interleave(71)
    cells = _cell_of(tiles.grid, x.numpy(), y.numpy())
    cover = _coverages(scene, x, y)  # [L, P]
    opaque = [scene.compositing == "over" and layer.opacity == 1.0 for layer in scene.layers]
    for cell in range(tiles.grid.cells):
        listed = tiles.entries[tiles.starts[cell] : tiles.starts[cell + 1]]
        assert (np.diff(listed) > 0).all()
        here = cover[:, cells == cell]
        hidden = max((i for i in range(len(here)) if opaque[i] and (here[i] == 1).all()), default=0)
        missed = set(np.nonzero(here.max(axis=1) > 0)[0]) - set(listed.tolist())
        assert all(layer < hidden for layer in missed), cell
    assert tiles.depth <= len(scene.layers)


def _cell_of(grid, x, y):
    column = np.clip(np.floor((x - grid.low[0]) * grid.per_unit), 0, grid.columns - 1)
    row = np.clip(np.floor((y - grid.low[1]) * grid.per_unit), 0, grid.rows - 1)
    return (row * grid.columns + column).astype(int)


def _coverages(scene, x, y):
    found: dict[int, np.ndarray] = {}
    for group in from_scene(scene, torch.float64).groups:
        cover, _ = group_coverage(group, scene.compositing, x, y, torch.tensor(COARSEST, dtype=torch.float64))
        found |= dict(zip(group.order.tolist(), cover.numpy(), strict=True))
    return np.stack([found[i] for i in range(len(found))])


def test_lists_are_short_where_shapes_are_small_or_hidden():
    (small,) = bin_layers(many(300), [scene_grid(many(300), 8)])
    assert small.depth < 25
    cover_all = Layer((Shape.of("circle", (1, 0, 0), center=(0, 0), radius=5),), 0.1)
    hidden = Scene(60, 40, (*many(50).layers, cover_all))
    (lists,) = bin_layers(hidden, [scene_grid(hidden, 8)])
    inner = [lists.entries[lists.starts[t] : lists.starts[t + 1]].tolist() for t in (15, 16, 40)]
    assert inner == [[50]] * 3


# --- numbers ------------------------------------------------------------------------------------------------


def test_joined_numbers_read_back():
    numbers = [5, 0, 1023, 7, 8]
    words = words_of(numbers, 10, 3)
    assert [words[k // 3] >> (k % 3 * 10) & 1023 for k in range(5)] == numbers


def test_precision_is_what_the_error_wants():
    """A picture whose error is known: each field halves its own with every bit."""

    def error(precision):
        steps = (precision.places, precision.falloff - 4, precision.color, precision.opacity)
        return sum(2.0 ** (7 - step) for step in steps)

    chosen, found = packing.choose_precision(error, 0.9)
    assert found == error(chosen) <= 0.9
    assert error(chosen.finer("places", -2).finer("color", -2)) > 0.9


@pytest.mark.parametrize(
    ("value", "text"),
    [(0.5, ".5"), (-0.25, "-.25"), (1.0, "1"), (0.0, "0"), (-3.5, "-3.5"), (10.0, "10"), (1e-7, "1e-7")],
)
def test_short_numbers(value, text):
    assert short(value) == text
    assert float(text) == value


# --- the choice ---------------------------------------------------------------------------------------------


def test_the_choice_follows_size_and_host():
    few, some, lots = random_scene(layers=6), many(300), many(1200)
    assert choose(few, "auto", FILE).layout == "readable"
    assert choose(some, "auto", FILE).layout == "tiled"
    assert choose(lots, "auto", FILE).layout == "data"
    assert choose(lots, "auto", MODULE).layout == "data"
    assert choose(lots, "auto", OLD).layout == "readable"
    with pytest.raises(Sdf2vecError, match="choose from readable, data"):
        choose(few, "packed", MODULE)


def test_the_choice_is_said():
    made = shader(many(300), "glsl", Options())
    assert made.about.startswith("layout tiled (")
    assert "warning" not in made.about
    large = shader(many(700), "glsl", Options(layout="tiled"))
    assert len(large.text) > TEXT_LIMIT
    assert "warning: more than 64 KiB" in large.about


def test_files_beside_the_text_hold_the_data():
    scene = many(20)
    made = shader(scene, "wgsl", Options(layout="data"))
    assert made.data is not None
    files = sdf2vec.exported(scene, "wgsl", layout="data").beside
    assert set(files) == {".wgsl.bin", ".wgsl.data.js"}
    np.testing.assert_array_equal(np.frombuffer(files[".wgsl.bin"], "<f4"), made.data.ravel())
    assert b"Float32Array" in files[".wgsl.data.js"]
    assert sdf2vec.exported(scene, "wgsl", layout="readable").beside == {}
    alone = shader(many(4096), "glsl", Options(alone=True))
    assert alone.data is None


# --- validators ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("compositing", ["over", "additive"])
@pytest.mark.parametrize("layout", ["readable", *EXACT, "packed"])
@pytest.mark.parametrize("version", ["es300", "330"])
def test_glslang_accepts_every_layout(layout, version, compositing, require_engine):
    require_engine("glslang")
    for kinds in (("triangle",), tuple(KINDS)):
        scene = random_scene(kinds, compositing, layers=6, seed=10)
        assert glslang_validate(shader(scene, "glsl", Options(layout=layout, glsl=version)).text) is None
        if layout != "data" and version == "es300":  # which a Shadertoy is whatever the version
            text = shader(scene, "shadertoy", Options(layout=layout, animate=True)).text
            assert glslang_validate(SHADERTOY_HEAD + text + SHADERTOY_TAIL) is None


@pytest.mark.parametrize("compositing", ["over", "additive"])
def test_glslang_accepts_es_100(compositing, require_engine):
    require_engine("glslang")
    text = shader(random_scene(compositing=compositing, layers=12), "glsl", Options(glsl="es100")).text
    assert text.startswith("#version 100\n")
    assert glslang_validate(text) is None

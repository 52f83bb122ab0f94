"""What each construction draws is the render, as resvg draws it."""

import math
import re

import numpy as np
import pytest
from skimage.morphology import dilation, footprint_rectangle

from sdf2vec import Layer, Scene, Shape
from sdf2vec.export.svg.blur import best_blur, trial_of
from sdf2vec.export.svg.canvas import Canvas
from sdf2vec.export.svg.outlines import distance_to, edge_of
from sdf2vec.render.reference import render
from sdf2vec.scene import Joint
from sdf2vec.shapes import KINDS
from tests.export.svg.drawings import (
    BLACK,
    NAMESPACE,
    ORANGE,
    SHARP,
    WHITE,
    Parameters,
    circle,
    drawn_in,
    off_in,
    parsed,
    scene_of,
    tags,
    triangle,
)
from tests.scenes import SOFT, random_scene


@pytest.fixture
def levels_off(require_engine):
    """Differences in levels of 255, [H, W, 4], between resvg's drawing and the render, both premultiplied."""
    require_engine("resvg")

    def difference(scene, width=None, height=None):
        return 255 * np.abs(off_in("resvg", scene, (width, height) if width else None))

    return difference


def away_from_edges(scene, falloff_pixels=3):
    """Pixels [H, W] whose neighbourhood a sharp scene leaves in one colour."""
    image = render(scene).numpy()
    edge = np.zeros(image.shape[1:], bool)
    for axis in (1, 2):
        change = np.abs(np.diff(image, axis=axis)).max(axis=0) > 1e-3
        edge |= np.pad(change, [(0, 1), (0, 0)] if axis == 1 else [(0, 0), (0, 1)])
    return ~dilation(edge, footprint_rectangle((falloff_pixels, falloff_pixels)))


@pytest.mark.parametrize("background", [(0.2, 0.3, 0.4), None], ids=["opaque", "transparent"])
@pytest.mark.parametrize("falloff", [0.05, 0.3, 1.5])
def test_soft_circles_are_gradients_that_say_the_coverage(levels_off, falloff, background):
    layers = [
        circle(-0.3, 0.1, 0.2, ORANGE, falloff, 0.8),
        circle(0.2, -0.1, 0.35, (0.1, 0.9, 0.3), falloff),
        circle(0.6, 0.3, 0.01, (0.9, 0.1, 0.9), falloff, 0.9),
    ]
    for layer in layers:
        scene = scene_of(layer, background=background)
        assert levels_off(scene).max() <= 4
        assert levels_off(scene, 300, 200).max() <= 4
    scene = scene_of(*layers, background=background)
    root = parsed(scene)
    assert len(root.findall(f".//{NAMESPACE}radialGradient")) == 3
    assert "filter" not in tags(root)
    assert levels_off(scene).max() <= 7


def test_soft_ellipses_too(levels_off):
    shape = Shape.of("ellipse", ORANGE, center=(0.1, 0.05), radii=(0.5, 0.15), angle=0.7)
    scene = scene_of(Layer((shape,), 0.1, 0.9))
    assert "filter" not in tags(parsed(scene))
    assert levels_off(scene).max() <= 4


@pytest.mark.parametrize("falloff", [0.0, 0.01])
@pytest.mark.parametrize("kind", SOFT)
def test_sharp_shapes_away_from_their_edges(levels_off, kind, falloff):
    scene = scene_of(Layer((Shape.of(kind, ORANGE, **SHARP[kind]),), falloff, 0.8), background=(0.2, 0, 0.5))
    inner = away_from_edges(scene)
    assert 0.5 < inner.mean() < 0.99
    off = levels_off(scene)
    assert off[inner].max() <= 1
    assert off.max() < 55  # an edge in the wrong place by half a pixel would be off by 102


def test_sharp_unions_are_traced(levels_off):
    shapes = tuple(Shape.of("circle", ORANGE, center=(x, 0.0), radius=0.2) for x in (-0.2, 0.2))
    scene = scene_of(Layer.union(shapes, 0.05, 0.0))
    assert len(parsed(scene).findall(f".//{NAMESPACE}path")) == 1
    off = levels_off(scene)
    assert off[away_from_edges(scene)].max() <= 1
    assert off.max() < 50


def test_a_union_around_a_hole(levels_off):
    ring = [
        Shape.of("circle", WHITE, center=(0.3 * math.cos(a), 0.3 * math.sin(a)), radius=0.08)
        for a in np.arange(0, 6.2, 0.4)
    ]
    scene = scene_of(Layer.union(ring, 0.01, 0.0))
    assert levels_off(scene)[50, 75, :3].max() == 0
    assert levels_off(scene)[away_from_edges(scene)].max() <= 1


@pytest.mark.parametrize("falloff", [0.03, 0.08, 0.5])
@pytest.mark.parametrize(("kind", "largest"), [("box", 4), ("triangle", 4), ("displaced", 64)])
def test_soft_shapes_alone(levels_off, kind, largest, falloff):
    """White on black: the worst case. Slices say the coverage; bands have steps."""
    scene = scene_of(Layer((Shape.of(kind, WHITE, **SHARP[kind]),), falloff))
    for size in [(150, 100), (300, 200), (450, 300)]:
        assert levels_off(scene, *size).max() <= largest
        assert levels_off(scene, *size).mean() <= 2


def test_slices_have_no_seams(levels_off):
    """Translucent slices that shared or missed a row of pixels would be off by up to 64 levels there."""
    sides = [(0.3 * math.cos(a), 0.3 * math.sin(a)) for a in (0.3, 2.2, 4.4)]
    layer = Layer((Shape.of("triangle", WHITE, a=sides[0], b=sides[1], c=sides[2]),), 0.1, 0.5)
    for size in [(150, 100), (297, 198), (615, 410)]:
        assert levels_off(scene_of(layer), *size).max() <= 3


@pytest.mark.parametrize("kind", ["box", "triangle"])
def test_blurs_where_they_are_near_enough(levels_off, kind):
    """A shape of little contrast is blurred in one element; portable drawings never have a filter."""
    layer = Layer((Shape.of(kind, (0.25, 0.25, 0.25), **SHARP[kind]),), 0.2)
    scene = scene_of(layer, background=(0.2, 0.2, 0.2), width=600, height=400)
    assert parsed(scene).findall(f".//{NAMESPACE}feGaussianBlur")
    assert levels_off(scene).max() <= 3
    assert "filter" not in tags(parsed(scene, svg_profile="portable"))


@pytest.mark.parametrize("kind", ["box", "triangle"])
def test_a_fitted_blur_is_nearer_than_a_plain_one(kind):
    """Sharper corners undo what the blur takes off them; compared by the same Gaussian on a grid."""
    layer = Layer((Shape.of(kind, WHITE, **SHARP[kind]),), 0.2)
    canvas = Canvas.of(scene_of(layer, width=600, height=400))
    fitted = best_blur(layer, canvas)
    assert fitted is not None
    rounded = edge_of(layer, 0.5)
    assert rounded is not None
    trial = trial_of(layer, canvas)
    plain = trial.judged(rounded, distance_to(rounded, trial.grid), trial.deviation(1.0))
    assert fitted.error < 0.6 * plain.error


def test_a_traced_shape_larger_than_the_canvas(levels_off):
    """Only what can be seen is traced: neither the memory nor the time grows with the shape."""
    numbers: Parameters = {"center": (0, 30), "radius": 30, "amplitude": 0.05, "frequency": (20, 20)}
    sharp = scene_of(Layer((Shape.of("displaced", ORANGE, **numbers),), 0.0))
    assert levels_off(sharp)[away_from_edges(sharp)].max() <= 1
    everywhere: Parameters = {"center": (0, 0), "radius": 1000, "amplitude": 0.05, "frequency": (20, 20)}
    for falloff in (0.0, 0.3):
        filled = scene_of(Layer((Shape.of("displaced", ORANGE, **everywhere),), falloff))
        assert levels_off(filled).max() <= 1
    nowhere: Parameters = {"center": (500, 0), "radius": 10, "amplitude": 0.05, "frequency": (20, 20)}
    assert "path" not in tags(parsed(scene_of(Layer((Shape.of("displaced", ORANGE, **nowhere),), 0.1))))


@pytest.mark.parametrize(
    "points",
    [
        [(-0.3, 0), (0.3, 0), (-0.3, 0)],
        [(-0.3, 0), (-0.3, 0), (0.3, 0)],
        [(0.3, 0), (-0.3, 0), (0, 0)],
        [(-0.3, 0), (0, 0), (0.3, 0)],
    ],
)
def test_triangles_without_area_are_drawn_as_lines(points):
    """The distance to a segment: at falloff f its outline is a stadium of radius f / 2, 3/4 of a pixel here.

    A hundredth less is written, so that half circles are whole although their ends are rounded.
    """
    (element,) = drawn_in(parsed(scene_of(triangle(*points, falloff=0.015))))
    arcs = re.findall(r"A\.74 \.74 0 0 1 (\S+) ([^LZ]+)", element.get("d", ""))
    ends = {(float(x), round(float(y), 2)) for x, y in arcs if abs(float(x) - 75) > 1}
    assert ends == {(45.0, 49.25), (105.0, 50.75)} or ends == {(45.0, 49.25), (105.0, 49.25), (105.0, 50.75)}


def test_a_point_of_a_triangle_is_no_error():
    parsed(scene_of(triangle((0, 0), (0, 0), (0, 0), falloff=0.015)))
    parsed(scene_of(triangle((0, 0), (0, 0), (0, 0), falloff=0.5)))


def test_a_mixed_scene(levels_off):
    """Without unions, whose colours are averaged, and without opacity where outlines cross."""
    kept = [layer for layer in random_scene(layers=20, seed=5).layers if len(layer.shapes) == 1]
    assert {layer.shapes[0].kind for layer in kept} == set(KINDS)
    assert levels_off(Scene(120, 80, tuple(kept), ORANGE)).mean() < 1.5


@pytest.mark.parametrize("size", [(1, 1), (1, 40), (40, 1)])
def test_thin_canvases(levels_off, size):
    width, height = size
    scene = Scene(width, height, (circle(0, 0, 0.4, ORANGE, falloff=2),), BLACK)
    root = parsed(scene)
    assert root.get("viewBox") == f"0 0 {width} {height}"
    assert levels_off(scene, 20 * width, 20 * height).max() <= 3


def test_smaller_than_any_pixel():
    shape = Shape.of("ellipse", WHITE, center=(0, 0), radii=(1e-6, 1e-6), angle=0)
    for falloff in (0.0, 0.1, 64.0):
        root = parsed(scene_of(Layer((shape,), falloff), width=1, height=1))
        assert drawn_in(root)


@pytest.mark.parametrize("size", [None, (96, 64), (303, 202)])
def test_holes_are_where_they_are_rendered(require_engine, size):
    """A turned ellipse and a round box cut out of a box, and a polygon beside it."""
    require_engine("resvg")
    box = Shape.of("box", ORANGE, center=(-0.1, 0), half_size=(0.5, 0.4), angle=0.1, corner_radius=0.1)
    hole = Shape.of("ellipse", ORANGE, center=(-0.3, 0.05), radii=(0.2, 0.08), angle=0.6)
    window = Shape.of("box", ORANGE, center=(0.15, 0), half_size=(0.1, 0.2), angle=-0.3, corner_radius=0.03)
    beside = Shape.of("triangle", ORANGE, a=(0.6, -0.2), b=(0.7, 0.3), c=(0.5, 0.3))
    joints = (Joint("subtraction"), Joint("subtraction"), Joint("union"))
    scene = Scene(150, 100, (Layer((box, hole, window, beside), 0.0, 0.9, joints),), (0.2, 0.3, 0.4))
    off = off_in("resvg", scene, size)
    assert -10 * np.log10(np.square(off).mean()) > 36
    assert abs(float(off.mean())) < 0.5 / 255


def ellipse(x, y, radii, angle):
    return Shape.of("ellipse", ORANGE, center=(x, y), radii=radii, angle=angle)


@pytest.mark.parametrize("engine", ["resvg", "cairosvg", "chromium"])
@pytest.mark.parametrize("digit", range(5))
def test_rings_are_round_whatever_their_ends_are_rounded_to(engine, digit, require_engine):
    """Each half is an arc from end to end: one of a radius too large by next to nothing would be flat."""
    require_engine(engine)
    off, radius = 0.0002 * digit, 0.3 + 0.00015 * digit
    rings = [
        Layer((ellipse(x, off, *outer), ellipse(x, off, *hole)), 0.0, 1.0, (Joint("subtraction"),))
        for x, outer, hole in (
            (-0.4 + off, ((radius, radius), 0.0), ((0.1, 0.1), 0.0)),
            (0.35 + off, ((0.12 + off, radius), 0.4), ((0.15, 0.05), 0.4 + math.pi / 2)),
        )
    ]
    scene = Scene(384, 256, tuple(rings), (0.2, 0.3, 0.4))
    for size in (None, (576, 384)):
        error = off_in(engine, scene, size)
        assert -10 * np.log10(np.square(error).mean()) > 38
        assert abs(float(error.mean())) < 0.5 / 255

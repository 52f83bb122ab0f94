"""Lines of a pixel or two: on pictures drawn in numpy."""

import numpy as np
import pytest
import torch

from sdf2vec import fit
from sdf2vec.api import render
from sdf2vec.fit.constraints import least_length
from sdf2vec.fit.descents import Sizes, fine_enough
from sdf2vec.fit.hairlines import hairlines
from sdf2vec.fit.joining import topped
from sdf2vec.fit.peeling import peeled
from sdf2vec.fit.region_graph import Regions
from sdf2vec.fit.surroundings import Surroundings, View
from sdf2vec.image import Picture
from sdf2vec.render.tensors import from_scene, to_scene
from sdf2vec.scene import Scene
from tests.fit.drawn import (
    BLUE,
    GREEN,
    RED,
    SIDE,
    bare,
    box,
    disc,
    painted,
    points,
    search_of,
    sharp_box,
    view_of,
)

X, Y = points()
GREY = np.array([0.8, 0.8, 0.8])


def line(x0, y0, x1, y1, width):
    """A line with square ends, from its middle to its middle."""
    length = np.hypot(x1 - x0, y1 - y0)
    along = ((X - x0) * (x1 - x0) + (Y - y0) * (y1 - y0)) / length
    across = ((X - x0) * (y1 - y0) - (Y - y0) * (x1 - x0)) / length
    return (along > 0) & (along < length) & (abs(across) < width / 2)


def told(pixels):
    """The layers of a picture's hairlines, from the bottom up, and how many regions are parts of them."""
    regions = Regions.of(pixels)
    around = Surroundings.of(bare(), 0, view_of(pixels))
    groups, parts = hairlines(regions, around, search_of().kinds)
    scene = to_scene(topped(bare(), reversed(groups)), SIDE, SIDE)
    return list(scene.layers), int(parts.sum())


def ends_of(layer):
    """The ends of a bar's middle line, in pixels."""
    x, y, half, _, angle, *_ = layer.shapes[0].parameters
    middle, way = np.array([x, y]), half * np.array([np.cos(angle), np.sin(angle)])
    return sorted(((np.array([middle - way, middle + way]) + 0.5) * SIDE).tolist())


@pytest.mark.parametrize("width", [1.0, 1.5, 2.5])
@pytest.mark.parametrize("slant", [(12.3, 20.4, 80.7, 61.2), (12.0, 48.5, 84.0, 48.5)])
def test_a_line_is_a_bar_where_it_is_and_as_wide(slant, width):
    x0, y0, x1, y1 = slant
    (layer,), _ = told(painted((line(x0, y0, x1, y1, width), BLUE, 1.0)))
    assert layer.shapes[0].kind == "box"
    assert layer.shapes[0].color == pytest.approx(BLUE, abs=0.3 if width == 1.0 else 0.1)
    assert np.abs(np.array(ends_of(layer)) - [(x0, y0), (x1, y1)]).max() < 1.2
    assert 2 * layer.shapes[0].parameters[3] * SIDE == pytest.approx(width, rel=0.35)


def test_lines_of_other_colours_go_on_below_those_that_cross_them():
    pixels = painted(
        (line(10, 30.5, 86, 30.5, 1.0), GREY, 1.0),
        (line(10, 60.5, 86, 60.5, 1.0), GREY, 1.0),
        (line(20, 12, 76, 84, 1.6), RED, 1.0),
    )
    layers, _ = told(pixels)
    assert len(layers) == 3
    scene = Scene(SIDE, SIDE, tuple(layers), (1.0, 1.0, 1.0))
    assert -10 * np.log10(np.mean((render(scene) - pixels) ** 2)) > 32


def test_an_outline_of_a_disc_is_a_ring_although_it_lies_between_two_colours():
    pixels = painted((disc(48, 48, 30.75), (0.0, 0.0, 0.0), 1.0), (disc(48, 48, 29.25), GREEN, 1.0))
    (ring,), _ = told(pixels)
    assert [shape.kind for shape in ring.shapes] == ["circle", "circle"]
    outer, inner = (shape.parameters[2] * SIDE for shape in ring.shapes)
    assert (outer + inner) / 2 == pytest.approx(30.0, abs=0.1)
    assert outer - inner == pytest.approx(1.5, abs=0.2)


def test_a_line_that_is_partly_a_region_is_one():
    """Where it is aligned with pixels it is wide enough to be one, elsewhere not."""
    bent = line(10, 20, 60, 20, 2.0) | line(60, 20, 84, 80, 2.0)
    regions = Regions.of(painted((bent, BLUE, 1.0)))
    assert len(regions.colors) > 1
    layers, parts = told(painted((bent, BLUE, 1.0)))
    assert [layer.shapes[0].kind for layer in layers] == ["box"] * 2
    assert parts == len(regions.colors) - 1


@pytest.mark.parametrize(
    "pixels",
    [
        painted((box(20, 20, 70, 60), BLUE, 1.0), (disc(60, 60, 20), RED, 1.0)),
        painted((disc(30, 30, 1.2), BLUE, 1.0), (disc(60, 50, 1.5), BLUE, 1.0)),
        np.where(np.random.default_rng(0).random((SIDE, SIDE, 1)) < 0.1, 0.0, np.ones((SIDE, SIDE, 3))),
        painted(
            (line(10, 4, 80, 4, 1.5), RED, 1.0),
            (((X % 8 - 4) ** 2 + (Y % 8 - 4) ** 2 < 3) & (Y > 12), BLUE, 1.0),
        ),
    ],
    ids=["wide shapes", "dots", "noise", "a line among dots"],
)
def test_what_is_no_line_is_left(pixels):
    assert told(pixels) == ([], 0)


def test_a_picture_of_thin_lines_is_taken_apart():
    """Its rest, too: what lies under the lines has its outline."""
    pixels = painted((box(20, 20, 76, 70), GREEN, 1.0), (line(8, 90, 90, 8, 1.5), RED, 1.0))
    layers = to_scene(peeled(bare(), [view_of(pixels)], search_of()), SIDE, SIDE).layers
    assert [layer.shapes[0].color for layer in layers] == [
        pytest.approx(GREEN, abs=0.01),
        pytest.approx(RED, abs=0.1),
    ]


def test_lengths_may_be_less_than_a_pixel_where_some_are():
    def least(width):
        scene = Scene(SIDE, SIDE, (sharp_box(BLUE, 10, 40, 80, 40 + width),), (1.0, 1.0, 1.0))
        return least_length(from_scene(scene), scene.pixel) * SIDE

    assert least(1.5) == pytest.approx(0.5, abs=1e-3)
    assert least(3.0) == pytest.approx(1.0, abs=1e-3)


def test_a_chart_is_its_lines():
    """As wide as they are: lines of less than two pixels would be made wider."""
    pixels = painted(
        (line(14, 8, 14, 80, 1.2), (0.2, 0.2, 0.2), 1.0),
        (line(14, 80.3, 90, 80.3, 1.2), (0.2, 0.2, 0.2), 1.0),
        (line(16, 70, 50, 30, 1.5), RED, 1.0),
        (line(50, 30, 88, 44, 1.5), RED, 1.0),
    )
    scene = fit(Picture(pixels.astype(np.float32)), seed=0)
    assert len(scene.layers) == 4
    assert {shape.kind for layer in scene.layers for shape in layer.shapes} <= {"box", "arc"}
    assert -10 * np.log10(np.mean((render(scene) - pixels) ** 2)) > 38


@pytest.mark.parametrize(("width", "is_fine"), [(1.5, True), (8.0, False)])
def test_all_descend_where_thin_lines_are_seen(width, is_fine):
    views = [View(torch.zeros(3, side, side), None) for side in (24, 48, SIDE)]
    layers = tuple(sharp_box(BLUE, 10, top, 80, top + width) for top in (20, 50))
    scene = from_scene(Scene(SIDE, SIDE, layers, (1.0, 1.0, 1.0)))
    sizes, search = fine_enough(Sizes(*views), search_of(), scene)
    assert sizes.joint is (views[2] if is_fine else views[1])
    assert search.least * SIDE == pytest.approx(0.5 if is_fine else 1.0)

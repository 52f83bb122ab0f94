"""Paints: what colour is where, by hand, in the frame of every kind."""

import math

import numpy as np
import pytest
import torch

from sdf2vec import Layer, Scene, Shape
from sdf2vec.expr import const, constant, var, vec2, vec3
from sdf2vec.graph import components_of, scalarize
from sdf2vec.layer import Formula, P, Part
from sdf2vec.lower.torch import compile_torch
from sdf2vec.operation import VEC2
from sdf2vec.paints import BASE, FLAT, PAINTS, Ramp, Rings, linear_paint, radial_paint
from sdf2vec.render.reference import render
from sdf2vec.shapes import KINDS

FIRST, LAST = (1.0, 0.25, 0.0), (0.0, 0.5, 1.0)

# kind, numbers, the point where the x axis of its frame is −1, and where it is 1, by hand
ENDS = [
    ("circle", (0.1, 0.2, 0.3), (-0.2, 0.2), (0.4, 0.2)),
    ("ellipse", (0.1, 0.2, 0.4, 0.2, math.pi / 2), (0.1, -0.2), (0.1, 0.6)),
    (
        "box",
        (0.0, 0.0, 0.5, 0.1, math.pi / 4, 0.05),
        (-0.5 * math.sqrt(0.5),) * 2,
        (0.5 * math.sqrt(0.5),) * 2,
    ),
    ("triangle", (-0.3, 0.0, 0.5, 0.1, 0.1, 0.4), (-0.3, 0.2), (0.5, 0.2)),  # of the box around it
    # of the box around it
    ("rounded_triangle", (-0.2, 0.0, 0.4, 0.1, 0.1, 0.4, 0.1), (-0.3, 0.2), (0.5, 0.2)),
    ("arc", (-0.3, 0.1, 0.3, 0.1, -0.2, 0.1), (-0.4, 0.0), (0.4, 0.0)),  # of the box around it
    ("displaced", (0.0, 0.1, 0.3, 0.05, 9.0, 9.0), (-0.35, 0.1), (0.35, 0.1)),
    ("gaussian", (0.1, 0.0, 0.2, 0.4, math.pi), (0.3, 0.0), (-0.1, 0.0)),
    ("gabor", (0.1, 0.0, 0.2, 0.4, 0.0, 9.0, 0.0), (-0.1, 0.0), (0.3, 0.0)),
]


def color_at(shape, x, y):
    """[3, P] in float64."""
    formula = Formula.of((Part(shape.kind, shape.paint),))
    inputs = [*components_of(P), *formula.uniforms]
    numbers = (x, y, 0.001, *Layer((shape,)).numbers)
    found = compile_torch([formula.color], inputs)(
        *(torch.as_tensor(value, dtype=torch.float64) for value in numbers)
    )
    return np.stack([part.expand(len(x)).numpy() for part in found])


def test_every_kind_has_a_frame_by_hand():
    assert {row[0] for row in ENDS} == set(KINDS)


@pytest.mark.parametrize(("kind", "numbers", "start", "end"), ENDS, ids=[row[0] for row in ENDS])
def test_a_linear_paint_goes_along_the_axis_of_the_frame(kind, numbers, start, end):
    """With direction (1/2, 0): its first colour at −1, half of each in the middle, its last at 1 and beyond."""
    shape = Shape(kind, numbers, FIRST, "linear", (*LAST, 0.5, 0.0, 0.0))
    shares = np.array([-0.5, 0.0, 0.25, 0.5, 1.0, 1.5])
    x, y = (a + shares * (b - a) for a, b in zip(start, end, strict=True))
    want = np.outer(FIRST, 1 - shares.clip(0, 1)) + np.outer(LAST, shares.clip(0, 1))
    np.testing.assert_allclose(color_at(shape, x, y), want, atol=1e-6)


def test_the_direction_says_how_steep_and_where_to():
    """t = 1/2 + q·direction: a quarter turn goes down the frame's y axis, twice as long twice as fast."""
    shape = Shape("ellipse", (0, 0, 0.4, 0.2, 0.0), FIRST, "linear", (*LAST, 0.0, 1.0, 0.0))
    y = np.array([-0.2, -0.1, -0.05, 0.0, 0.05, 0.1, 0.2])
    share = (0.5 + y / 0.2).clip(0, 1)
    want = np.outer(FIRST, 1 - share) + np.outer(LAST, share)
    np.testing.assert_allclose(color_at(shape, 0.17 + 0 * y, y), want, atol=1e-12)


def test_no_direction_is_half_of_each():
    shape = Shape("circle", (0, 0, 0.4), FIRST, "linear", (*LAST, 0.0, 0.0, 0.0))
    np.testing.assert_allclose(color_at(shape, np.array([9.0]), np.array([-9.0])), [[0.5], [0.375], [0.5]])


def test_a_shape_of_no_size_has_a_colour():
    shape = Shape("triangle", (0.1,) * 6, FIRST, "linear", (*LAST, 0.5, 0.5, 0.0))
    assert np.isfinite(color_at(shape, np.array([0.1, 0.2]), np.array([0.1, 5.0]))).all()


def test_a_shift_moves_the_middle():
    """t = 1/2 + q·direction + shift: with a direction of one half and a shift of 1/4 from −3/2 to 1/2 of the frame."""
    shape = Shape("circle", (0, 0, 0.4), FIRST, "linear", (*LAST, 0.5, 0.0, 0.25))
    x = 0.4 * np.array([-2.0, -1.5, -0.5, 0.0, 0.5, 1.0])
    share = np.array([0.0, 0.0, 0.5, 0.75, 1.0, 1.0])
    want = np.outer(FIRST, 1 - share) + np.outer(LAST, share)
    np.testing.assert_allclose(color_at(shape, x, 0 * x), want, atol=1e-12)


@pytest.mark.parametrize("shift", [0.0, 0.7, -3.0])
@pytest.mark.parametrize("direction", [(0.5, 0.0), (0.3, -0.4), (-2.0, 1.0)])
def test_the_ramp_is_where_the_colours_end(direction, shift):
    gradient = PAINTS["linear"].gradient
    assert gradient is not None
    ramp = gradient(FIRST, LAST, direction, shift)
    assert isinstance(ramp, Ramp)
    slope, middle, stops = ramp
    steepness = slope[0] ** 2 + slope[1] ** 2
    for share, color in stops:
        side = share - middle
        point = (side * slope[0] / steepness, side * slope[1] / steepness)
        found = linear_paint(vec2(*point), vec3(*FIRST), vec3(*LAST), vec2(*direction), const(shift))
        assert [constant(part) for part in scalarize(found)] == pytest.approx(color)


@pytest.mark.parametrize(("kind", "numbers", "start", "end"), ENDS, ids=[row[0] for row in ENDS])
def test_a_radial_paint_ends_where_the_frame_does(kind, numbers, start, end):
    """With a steepness of 1: its first colour in the middle of the frame, its last at −1, at 1 and beyond."""
    shape = Shape(kind, numbers, FIRST, "radial", (*LAST, 0.0, 0.0, 1.0, 1.0, 0.0))
    shares = np.array([-0.5, 0.0, 0.25, 0.5, 0.75, 1.0, 1.5])
    x, y = (a + shares * (b - a) for a, b in zip(start, end, strict=True))
    risen = np.abs(2.0 * shares - 1.0).clip(0, 1)
    want = np.outer(FIRST, 1 - risen) + np.outer(LAST, risen)
    np.testing.assert_allclose(color_at(shape, x, y), want, atol=1e-6)


def test_a_radial_paint_is_around_its_focus():
    """t = |(q − focus)·steepness| + shift, on a disc of radius 0.4: along x twice as fast as along y."""
    shape = Shape("circle", (0, 0, 0.4), FIRST, "radial", (*LAST, 0.5, -0.25, 2.0, 1.0, -0.5))
    x, y = 0.4 * np.array([[0.5, 0.75, 1.0, 0.5, 0.5, 0.8], [-0.25, -0.25, -0.25, 0.75, 1.25, 0.55]])
    share = np.array([0.0, 0.0, 0.5, 0.5, 1.0, 0.5])
    want = np.outer(FIRST, 1 - share) + np.outer(LAST, share)
    np.testing.assert_allclose(color_at(shape, x, y), want, atol=1e-12)


@pytest.mark.parametrize("shift", [0.0, 0.7, -3.0])
@pytest.mark.parametrize("turn", [0.0, 0.7, 2.0])
def test_the_rings_are_where_the_colours_end(turn, shift):
    gradient = PAINTS["radial"].gradient
    assert gradient is not None
    rings = gradient(FIRST, LAST, (0.2, -0.1), (0.3, 4.0), shift)
    assert isinstance(rings, Rings)
    (x, y), (across, down), lowest, stops = rings
    assert stops == ((0.0, FIRST), (1.0, LAST))
    for share in (max(0.0, lowest), 1.0):
        reach = share - lowest
        point = (x + reach * math.cos(turn) / across, y + reach * math.sin(turn) / down)
        found = radial_paint(
            vec2(*point), vec3(*FIRST), vec3(*LAST), vec2(0.2, -0.1), vec2(0.3, 4.0), const(shift)
        )
        wanted = [(1 - share) * first + share * last for first, last in zip(FIRST, LAST, strict=True)]
        assert [constant(part) for part in scalarize(found)] == pytest.approx(wanted)


THIRD = (0.5, 1.0, 0.25)
# along x of the frame, around its middle
OWN = {"linear3": (0.5, 0.0, 0.0), "radial3": (0.0, 0.0, 1.0, 1.0, 0.0)}


@pytest.mark.parametrize("stop", [0.25, 0.6])
def test_three_colours_along_a_line(stop):
    """By hand: at half of the way from one stop to the next half of each colour, at the ends and beyond these alone."""
    shape = Shape("circle", (0, 0, 0.4), FIRST, "linear3", (*THIRD, *LAST, stop, *OWN["linear3"]))
    shares = np.array([-0.5, 0.0, stop / 2, stop, (stop + 1) / 2, 1.0, 1.5])
    first, third, last = np.array([FIRST, THIRD, LAST])
    want = [first, first, (first + third) / 2, third, (third + last) / 2, last, last]
    np.testing.assert_allclose(color_at(shape, 0.8 * shares - 0.4, 0 * shares).T, want, atol=1e-6)


def test_three_colours_around_a_point():
    shape = Shape("circle", (0, 0, 0.4), FIRST, "radial3", (*THIRD, *LAST, 0.25, *OWN["radial3"]))
    shares = np.array([0.0, 0.125, 0.25, 0.625, 1.0, 1.5])
    first, third, last = np.array([FIRST, THIRD, LAST])
    want = [first, (first + third) / 2, third, (third + last) / 2, last, last]
    np.testing.assert_allclose(color_at(shape, 0 * shares, 0.4 * shares).T, want, atol=1e-6)


@pytest.mark.parametrize("paint", OWN)
def test_a_gradient_of_three_colours_has_three_stops(paint):
    """Which are where the paint has their colours."""
    shape = Shape("circle", (0, 0, 0.4), FIRST, paint, (*THIRD, *LAST, 0.25, *OWN[paint]))
    gradient = PAINTS[paint].gradient
    assert gradient is not None
    stops = gradient(*shape.painted().values()).stops
    assert stops == ((0.0, FIRST), (0.25, THIRD), (1.0, LAST))
    shares = np.array([share for share, _ in stops])
    x = 0.4 * (2 * shares - 1 if paint == "linear3" else shares)
    np.testing.assert_allclose(color_at(shape, x, 0 * x).T, [color for _, color in stops], atol=1e-6)


def test_all_paints_begin_with_a_colour_and_one_is_flat():
    assert all(paint.parameters[0] is BASE for paint in PAINTS.values())
    assert [name for name, paint in PAINTS.items() if paint.is_flat] == [FLAT]
    q, color = var("q", VEC2), BASE.variable()
    assert PAINTS[FLAT].color(q, color) is color


def test_a_picture_of_a_linear_paint():
    """A box beyond the canvas whose red goes from 0 to 1 across the canvas."""
    shape = Shape("box", (0, 0, 2.5, 9, 0, 0), (0, 0, 0), "linear", (1, 0, 0, 1, 0, 0))
    want = np.tile((np.arange(10) + 0.5) / 10, (4, 1))
    np.testing.assert_allclose(render(Scene(10, 4, (Layer((shape,)),)))[0], want, atol=1e-6)

"""Fills: a colour, a paint's gradient, the gradient nearest to a union's colours."""

import math
from typing import Any

import numpy as np
import pytest

from sdf2vec import Layer, Scene, Shape
from sdf2vec.export.svg.canvas import Canvas
from sdf2vec.export.svg.display import LinearGradient, RadialGradient, Stop
from sdf2vec.export.svg.union_gradient import fill_of, gradient_of, mean_color, nearest_gradient
from tests.export.svg.drawings import Parameters

CANVAS = Canvas.of(Scene(300, 200, (), None))
RED, BLUE = (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)
PLACE: Parameters = {"center": (0, 0), "radius": 0.25}


def test_one_colour_is_that_colour():
    shape = Shape.of("circle", RED, **PLACE)
    assert fill_of(Layer((shape,), 0.1), CANVAS) == (RED, 0.0)
    assert fill_of(Layer((shape,), 0.1), CANVAS, 255.0 / 2).fill == (1.5, 0.5, 0.5)
    assert gradient_of(shape, CANVAS) is None


def test_a_linear_paint_is_its_gradient():
    """A direction of one half goes from −1 to 1 of the frame: from edge to edge of the disc."""
    shape = Shape.of("circle", RED, paint="linear", color_end=BLUE, direction=(0.5, 0), **PLACE)
    ramp = gradient_of(shape, CANVAS)
    assert isinstance(ramp, LinearGradient)
    assert ramp.start == pytest.approx((100.0, 100.0))
    assert ramp.end == pytest.approx((200.0, 100.0))
    assert [stop.color for stop in ramp.stops] == [RED, BLUE]
    assert fill_of(Layer((shape,), 0.1), CANVAS) == (ramp, 0.0)
    assert mean_color(shape) == (0.5, 0.0, 0.5)


def test_a_shifted_paint_is_a_shifted_gradient():
    """With a shift of one quarter half of each is halfway from the middle to where it begins."""
    values = {"paint": "linear", "color_end": BLUE, "shift": 0.25, **PLACE}
    ramp = gradient_of(Shape.of("circle", RED, direction=(0.5, 0), **values), CANVAS)
    assert isinstance(ramp, LinearGradient)
    assert ramp.start == pytest.approx((75.0, 100.0))
    assert ramp.end == pytest.approx((175.0, 100.0))
    assert gradient_of(Shape.of("circle", RED, direction=(0, 0), **values), CANVAS) == (0.25, 0.0, 0.75)


def test_a_radial_paint_is_its_gradient():
    """On a turned ellipse: from a point that is off along both axes, to ellipses twice as large."""
    angle = math.atan2(0.8, 0.6)
    values: dict[str, Any] = {"paint": "radial", "color_end": BLUE, "steepness": (0.5, 0.5)}
    place: Parameters = {"center": (0.1, 0), "radii": (0.4, 0.2), "angle": angle}
    rings = gradient_of(Shape.of("ellipse", RED, focus=(0.5, 0.25), **values, **place), CANVAS)
    assert isinstance(rings, RadialGradient)
    assert rings.center == pytest.approx((186.0, 138.0))
    assert rings.radii == pytest.approx((160.0, 80.0))
    assert rings.angle == pytest.approx(angle)
    assert rings.stops == (Stop(0.0, RED), Stop(1.0, BLUE))


@pytest.mark.parametrize(
    ("shift", "radius", "stops"),
    [
        (-1.0, 100.0, (Stop(0.5, RED), Stop(1.0, BLUE))),  # the first colour alone, halfway
        (0.5, 25.0, (Stop(0.0, (0.5, 0.0, 0.5)), Stop(1.0, BLUE))),
    ],
)
def test_a_shifted_radial_paint_begins_elsewhere(shift, radius, stops):
    values: dict[str, Any] = {
        "paint": "radial",
        "color_end": BLUE,
        "steepness": (1, 1),
        "focus": (0, 0),
        "shift": shift,
    }
    rings = gradient_of(Shape.of("circle", RED, **values, **PLACE), CANVAS)
    assert isinstance(rings, RadialGradient)
    assert rings.radii == pytest.approx((radius, radius))
    assert rings.stops == stops


GREEN = (0.0, 1.0, 0.0)
THREE: dict[str, Any] = {"color_middle": GREEN, "color_end": BLUE, "stop": 0.25}


def test_a_paint_of_three_colours_has_three_stops():
    shape = Shape.of("circle", RED, paint="linear3", direction=(0.5, 0), shift=0.0, **THREE, **PLACE)
    ramp = gradient_of(shape, CANVAS)
    assert isinstance(ramp, LinearGradient)
    assert ramp.start == pytest.approx((100.0, 100.0))
    assert ramp.end == pytest.approx((200.0, 100.0))
    assert ramp.stops == (Stop(0.0, RED), Stop(0.25, GREEN), Stop(1.0, BLUE))


@pytest.mark.parametrize(
    ("shift", "radius", "stops"),
    [
        (0.0, 50.0, (Stop(0.0, RED), Stop(0.25, GREEN), Stop(1.0, BLUE))),
        (-1.0, 100.0, (Stop(0.5, RED), Stop(0.625, GREEN), Stop(1.0, BLUE))),
        (0.125, 43.75, (Stop(0.0, (0.5, 0.5, 0.0)), Stop(1 / 7, GREEN), Stop(1.0, BLUE))),
        (0.625, 18.75, (Stop(0.0, (0.0, 0.5, 0.5)), Stop(1.0, BLUE))),  # it begins beyond the second
    ],
)
def test_a_radial_paint_of_three_colours_has_those_that_are_seen(shift, radius, stops):
    values: dict[str, Any] = {"focus": (0, 0), "steepness": (1, 1), "shift": shift}
    rings = gradient_of(Shape.of("circle", RED, paint="radial3", **values, **THREE, **PLACE), CANVAS)
    assert isinstance(rings, RadialGradient)
    assert rings.radii == pytest.approx((radius, radius))
    assert [stop.offset for stop in rings.stops] == pytest.approx([stop.offset for stop in stops])
    assert [stop.color for stop in rings.stops] == [stop.color for stop in stops]


@pytest.mark.parametrize(("steepness", "shift", "color"), [(1.0, 1.5, BLUE), (0.0, 0.25, (0.75, 0.0, 0.25))])
def test_a_radial_paint_of_one_colour_is_that_colour(steepness, shift, color):
    values: dict[str, Any] = {"paint": "radial", "color_end": BLUE, "focus": (0, 0), "shift": shift}
    shape = Shape.of("circle", RED, steepness=(steepness, steepness), **values, **PLACE)
    assert gradient_of(shape, CANVAS) == color


def test_two_colours_of_a_union_lie_along_a_line():
    left, right = (
        Shape.of("circle", color, center=(x, 0), radius=0.2) for x, color in ((-0.2, RED), (0.2, BLUE))
    )
    fill, error = fill_of(Layer.union((left, right), 0.1, 0.05), CANVAS)
    assert isinstance(fill, LinearGradient)
    assert abs(fill.end[1] - fill.start[1]) < 0.01 * abs(fill.end[0] - fill.start[0])
    first, *_, last = sorted(
        (place, stop.color)
        for place, stop in zip(
            np.linspace(fill.start[0], fill.end[0], len(fill.stops)), fill.stops, strict=True
        )
    )
    assert first[1][0] > 0.9 > 0.1 > first[1][2]
    assert last[1][2] > 0.9 > 0.1 > last[1][0]
    assert 0 < error < 20


def test_the_nearest_gradient_of_a_gradient_is_itself():
    r = np.random.default_rng(0)
    places = r.uniform(-1, 1, (500, 2))
    along = places @ np.array([0.6, 0.8])
    wanted = np.stack([along, 1 - along, 0.5 + 0 * along], axis=1)
    knots, values, error = nearest_gradient(places, wanted, np.ones(500))
    assert error < 2e-3
    assert values[:, 0] == pytest.approx(knots @ np.array([0.6, 0.8]), abs=0.02)

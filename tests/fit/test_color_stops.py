"""Stops of a gradient: colours between them by hand, and stops that are told from colours."""

from __future__ import annotations

import numpy as np
import pytest

from sdf2vec.fit.color_stops import MIDDLES, NO_MIDDLE, ColorStops, main_axis, nearest_stops

COLORS = np.array([[1.0, 0.0, 0.2], [0.0, 0.5, 0.2], [0.0, 1.0, 0.6]], np.float32)
STOPS = ColorStops(np.array([1.0, 2.0, 4.0]), COLORS)


def test_colours_between_stops_and_beyond():
    first, middle, last = COLORS
    want = [first, first, (first + middle) / 2, middle, middle + 0.75 * (last - middle), last, last]
    np.testing.assert_allclose(STOPS.at(np.array([0.0, 1.0, 1.5, 2.0, 3.5, 4.0, 9.0])), want, atol=1e-6)
    np.testing.assert_allclose(STOPS.middle, middle + 0.25 * (last - middle), atol=1e-6)


def test_what_is_beyond_some_values_is_cut_off():
    cut = STOPS.within(1.5, 3.0)
    assert cut.values.tolist() == [1.5, 2.0, 3.0]
    np.testing.assert_allclose(cut.colors, STOPS.at(cut.values))


def test_what_is_of_one_colour_at_the_ends_needs_no_stop():
    first, middle, _ = COLORS
    longer = ColorStops(np.arange(5.0), np.array([first, first + 1 / 255, middle, middle, middle]))
    cut = longer.within(0.0, 9.0)
    assert cut.values.tolist() == [1.0, 2.0]
    np.testing.assert_allclose(cut.colors, longer.colors[1:3])


def test_a_gradient_may_begin_before_its_first_stop():
    first, middle, last = COLORS
    longer = STOPS.begun(0.5)
    assert longer.values.tolist() == [0.5, 2.0, 4.0]
    np.testing.assert_allclose(longer.colors, [first + 0.5 * (first - middle), middle, last], atol=1e-6)


def test_what_changes_lies_between_stops_of_two_colours():
    level = 1.0 / 255
    nearly = ColorStops(
        np.array([0.0, 1.0, 2.0]), np.array([[0.2] * 3, [0.8] * 3, [0.8 + level] * 3], np.float32)
    )
    assert nearly.changing(np.array([-0.5, 0.25, 0.75, 1.5, 1.75, 2.5, 3.0, 4.0])) == 0.25


def test_the_main_axis_is_the_direction_in_which_colours_differ():
    along = np.array([2.0, -1.0, 2.0]) / 3
    colors = 0.5 + np.linspace(-0.3, 0.3, 30)[:, None] * along + 0.01 * np.cos(np.arange(30))[:, None]
    found = main_axis(colors.astype(np.float32))
    assert abs(found @ along) > 0.99
    assert np.linalg.norm(found) == pytest.approx(1.0, abs=1e-6)


@pytest.mark.parametrize("count", [2, 3])
@pytest.mark.parametrize("stop", [0.2, 0.5, 0.8])
def test_stops_are_told_from_colours(count, stop):
    """Of places on a line, of which only a part is known where it begins: the factor of a second number."""
    rng = np.random.default_rng(3)
    one, other = rng.uniform(0, 1, (2, 900))
    stops = np.array([0.2, 0.2 + 0.9 * stop, 1.1]) if count == 3 else np.array([0.2, 1.1])
    value = one + 0.3 * other
    colors = np.stack([np.interp(value, stops, channel) for channel in COLORS[:count].T], axis=1)
    colors = (np.rint(colors * 255) / 255).astype(np.float32)
    numbers, found = nearest_stops(
        lambda numbers: one + numbers[0] * other,
        np.array([0.0]),
        (0.1,),
        colors,
        MIDDLES if count == 3 else NO_MIDDLE,
    )
    assert numbers[0] == pytest.approx(0.3, abs=0.01)
    assert found.values == pytest.approx(stops, abs=0.02)
    np.testing.assert_allclose(found.colors, COLORS[:count], atol=0.02)


def test_stops_may_start_in_any_order():
    values = np.linspace(0.0, 1.0, 400)
    colors = np.stack([np.interp(values, (0.0, 0.3, 0.6, 1.0), (0.1, 0.9, 0.2, 0.8))] * 3, axis=1)
    _, found = nearest_stops(
        lambda numbers: values + 0 * numbers[0],
        np.array([0.0]),
        (0.1,),
        colors.astype(np.float32),
        ((0.65, 0.25),),
    )
    assert found.values[1:3] == pytest.approx([0.3, 0.6], abs=0.01)


def test_one_colour_has_stops_of_that_colour():
    colors = np.full((50, 3), 0.25, np.float32)
    values = np.linspace(0.0, 1.0, 50)
    _, found = nearest_stops(lambda numbers: values + numbers[0], np.array([0.0]), (0.1,), colors, MIDDLES)
    assert (np.diff(found.values) > 0).all()
    np.testing.assert_allclose(found.colors, 0.25, atol=1e-6)

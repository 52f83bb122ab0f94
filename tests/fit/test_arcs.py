"""Circles that an outline runs along: found on coverage that numpy draws."""

import numpy as np
import pytest

from sdf2vec.fit.arcs import Arc, arcs

y, x = np.mgrid[:80, :90].astype(float)
EVERYWHERE = np.ones(x.shape)


def within(distance):
    """Coverage by the distance of each pixel from an edge."""
    return np.clip(0.5 - distance, 0.0, 1.0)


def disc(across, down, radius):
    return within(np.hypot(x - across, y - down) - radius)


def half(turn, along):
    """What lies on one side of a line, by the direction of its normal and how far it is from the first pixel."""
    return within(np.cos(turn) * x + np.sin(turn) * y - along)


def told(found):
    return [(arc.x, arc.y, arc.radius, arc.is_outer) for arc in found]


@pytest.mark.parametrize("hard", [False, True])
def test_a_disc_is_its_own_circle(hard):
    coverage = disc(40.3, 38.7, 25)
    found = arcs((coverage > 0.5) * 1.0 if hard else coverage, EVERYWHERE)
    assert told(found) == [pytest.approx((40.3, 38.7, 25, True), abs=0.15)]


def test_a_crescent_lies_in_one_circle_and_outside_of_another():
    found = arcs(np.minimum(disc(40, 40, 30), 1 - disc(55, 40, 28)), EVERYWHERE)
    assert told(found) == [
        pytest.approx((40, 40, 30, True), abs=0.15),
        pytest.approx((55, 40, 28, False), abs=0.15),
    ]


def test_a_sector_of_a_ring_has_both_of_its_circles():
    """The corners are round by a pixel, so that the shorter arc tells its circle less well."""
    ring = np.minimum(disc(45, 40, 34), 1 - disc(45, 40, 20))
    found = arcs(np.minimum(ring, np.minimum(half(0.3, 50), half(-1.2, 2))), EVERYWHERE)
    outer, inner = told(found)
    assert outer == pytest.approx((45, 40, 34, True), abs=1.0)
    assert inner == pytest.approx((45, 40, 20, False), abs=1.5)


def test_two_arcs_of_one_circle_are_told_as_one():
    """A disc without a bar across its middle: two bows."""
    bar = within(np.abs(y - 40) - 6)
    (found,) = arcs(np.minimum(disc(45, 40, 30), 1 - bar), EVERYWHERE)
    assert (found.x, found.y, found.radius) == pytest.approx((45, 40, 30), abs=0.15)


def test_where_the_outline_is_not_known_it_tells_nothing():
    """What hides a disc has a round edge, too."""
    hiding = disc(60, 40, 20)
    found = arcs(np.minimum(disc(36, 40, 26), 1 - hiding), 1 - hiding)
    assert told(found) == [pytest.approx((36, 40, 26, True), abs=0.3)]


@pytest.mark.parametrize(
    "coverage",
    [
        within(np.maximum(np.abs(x - 40) - 20, np.abs(y - 40) - 10)),
        np.minimum(half(0.0, 60), np.minimum(half(2.3, 20), half(-2.0, -20))),
        np.zeros(x.shape),
        EVERYWHERE,
        disc(40, 40, 1.2),
    ],
    ids=["box", "triangle", "nothing", "everything", "speck"],
)
def test_what_has_no_round_outline_has_no_circle(coverage):
    assert arcs(coverage, EVERYWHERE) == []


def test_a_wedge_goes_along_the_ends_of_what_is_seen():
    """From 20 to 110 degrees within a radius of 30."""
    ends = np.radians((20, 110))
    turn = np.arctan2(y - 40, x - 45)
    seen = (np.hypot(x - 45, y - 40) < 30) & (turn > ends[0]) & (turn < ends[1])
    found = Arc(45, 40, 30, True, 0).wedge(seen.astype(np.float64))
    assert found is not None
    is_within, (middle, one, other) = found
    assert is_within
    assert middle.tolist() == [45, 40]
    assert np.arctan2(*(one - middle)[::-1]) == pytest.approx(ends[0], abs=0.03)
    assert np.arctan2(*(other - middle)[::-1]) == pytest.approx(ends[1], abs=0.03)
    assert np.linalg.norm((one + other) / 2 - middle) == pytest.approx(33, abs=0.01)


def test_of_most_of_a_disc_the_wedge_is_what_is_not_seen():
    """The gap lies around the direction to the left, where angles begin anew."""
    seen = (np.hypot(x - 45, y - 40) < 30) & (np.abs(np.arctan2(y - 40, x - 45)) < np.radians(150))
    found = Arc(45, 40, 30, True, 0).wedge(seen.astype(np.float64))
    assert found is not None
    is_within, (middle, one, other) = found
    assert not is_within
    assert np.linalg.norm((one + other) / 2 - middle) == pytest.approx(33, abs=0.01)
    assert ((one + other) / 2 - middle)[0] == pytest.approx(-33, abs=0.5)


@pytest.mark.parametrize("turn", [180, 359, 0])
def test_of_half_a_disc_of_all_and_of_nothing_there_is_no_wedge(turn):
    seen = (np.hypot(x - 45, y - 40) < 30) & (np.degrees(np.arctan2(y - 40, x - 45)) % 360 < turn)
    assert Arc(45, 40, 30, True, 0).wedge(seen.astype(np.float64)) is None

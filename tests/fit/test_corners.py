"""Corners of outlines, and triangles between them: on polygons whose corners are known."""

import numpy as np
import pytest

from sdf2vec.fit.corners import corners, triangles

FINER = 4
y, x = (np.mgrid[: 80 * FINER, : 90 * FINER] + 0.5) / FINER - 0.5  # the middle of the first pixel is 0, 0
EVERYWHERE = np.ones((80, 90))
SLANTED = [(12.0, 60.0), (30.0, 20.0), (58.0, 20.0), (40.0, 60.0)]
ARROW = [(15.0, 30.0), (45.0, 30.0), (45.0, 12.0), (78.0, 40.0), (45.0, 68.0), (45.0, 50.0), (15.0, 50.0)]


def polygon(points):
    """Coverage [80, 90] of a polygon, by sixteen samples a pixel."""
    inside = np.zeros(x.shape, bool)
    for (ax, ay), (bx, by) in zip(points, [*points[1:], points[0]], strict=True):
        passes = (ay > y) != (by > y)
        inside ^= passes & (x < ax + (y - ay) * (bx - ax) / (by - ay if by != ay else 1.0))
    return inside.reshape(80, FINER, 90, FINER).mean(axis=(1, 3))


def nearest(found, wanted):
    """How far the nearest of some points is from each that is wanted."""
    return np.linalg.norm(np.array(wanted)[:, None] - found, axis=2).min(axis=1)


@pytest.mark.parametrize("points", [SLANTED, ARROW], ids=["slanted", "arrow"])
@pytest.mark.parametrize("hard", [False, True])
def test_the_corners_of_a_polygon_are_found(points, hard):
    coverage = polygon(points)
    found = corners((coverage > 0.5).astype(np.float64) if hard else coverage, EVERYWHERE)
    assert len(found) == len(points)
    assert nearest(found, points).max() < (1.2 if hard else 0.5)


def test_an_outline_that_goes_on_unseen_ends_where_it_is_hidden():
    hidden = (np.arange(90) > 40)[None] & np.ones((80, 1), bool)
    coverage = polygon(SLANTED) * ~hidden
    found = corners(coverage, np.where(hidden, 0.0, 1.0))
    assert nearest(found, SLANTED[:2]).max() < 0.6
    assert np.all(found[:, 0] < 42)


def test_what_is_round_has_too_many_corners():
    turn = np.linspace(0, 2 * np.pi, 60, endpoint=False)
    disc = np.stack([45 + 35 * np.cos(turn), 40 + 35 * np.sin(turn)], axis=1)
    assert len(corners(polygon(disc.tolist()), EVERYWHERE)) == 0


def test_nothing_has_no_corners_and_no_triangles():
    assert len(corners(0.0 * EVERYWHERE, EVERYWHERE)) == 0
    assert triangles(np.zeros((0, 2)), EVERYWHERE, EVERYWHERE, 3) == []


def test_the_triangle_that_covers_most_comes_first_and_none_that_covers_what_is_not_wanted():
    coverage = polygon(ARROW)
    found = triangles(np.array(ARROW), coverage, 4.0 * (1.0 - coverage), 3)
    assert sorted(map(tuple, found[0].tolist())) == [(45.0, 12.0), (45.0, 68.0), (78.0, 40.0)]
    for corner in found:
        across = (corner[1] - corner[0]), (corner[2] - corner[0])
        area = abs(across[0][0] * across[1][1] - across[0][1] * across[1][0]) / 2
        assert area <= coverage.sum()


@pytest.mark.parametrize("size", [(1, 1), (1, 2), (2, 1), (1, 4), (2, 2), (3, 3)])
def test_a_speck_is_nothing_to_stumble_over(size):
    speck = np.zeros((80, 90))
    speck[40 : 40 + size[0], 30 : 30 + size[1]] = 1.0
    found = corners(speck, EVERYWHERE)
    assert np.all(np.isfinite(found))
    assert np.all(np.abs(found - (30, 40)) < 6)

"""Curves and lines through contours whose shape is known."""

import numpy as np
import pytest

from sdf2vec import Scene
from sdf2vec.export.svg.bezier_fit import ASIDE, smooth_path, straight_path
from sdf2vec.export.svg.canvas import Canvas

CANVAS = Canvas.of(Scene(512, 512, (), None))


def along(contour):
    """Points [N, 2] along the curves and lines of a contour, which is closed."""
    t, start, found = np.linspace(0, 1, 33)[:, None], np.array(contour.start), []
    for segment in contour.segments:
        a, b, end = map(np.array, segment if len(segment) == 3 else (start, segment[-1], segment[-1]))
        found.append((1 - t) ** 3 * start + 3 * t * (1 - t) ** 2 * a + 3 * t**2 * (1 - t) * b + t**3 * end)
        start = end
    assert np.allclose(start, contour.start)
    return np.concatenate(found)


@pytest.mark.parametrize(("tolerance", "most"), [(0.05, 7), (0.15, 6), (0.5, 5)])
def test_a_circle_is_few_curves(tolerance, most):
    """A cubic is off by 27 parts of 100,000 of the radius from a quarter of a circle, by 1.8 % from half of one."""
    angles = np.linspace(0.0, 2 * np.pi, 401)
    circle = 256.0 + 100.0 * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    (contour,) = smooth_path([circle], tolerance, CANVAS).contours
    assert 3 <= len(contour.segments) <= most
    off = np.hypot(*(along(contour) - 256.0).T) - 100.0
    assert np.abs(off).max() <= tolerance + 0.05
    assert abs(off.mean()) <= 0.4 * tolerance


def test_corners_are_corners_and_straight_sides_are_lines():
    """A square one side of which is half a circle, traced in steps of half a unit, from the middle of a side on."""
    side, turn = np.arange(0.0, 100.0, 0.5), np.linspace(0.0, np.pi, 300, endpoint=False)
    ways = [
        (50 + side[:100], 0 * side[:100]),
        (100 + 50 * np.sin(turn), 50 - 50 * np.cos(turn)),
        (100 - side, 100 + 0 * side),
        (0 * side, 100 - side),
        (side[:101], 0 * side[:101]),
    ]
    points = 200.0 + np.concatenate([np.stack(way, axis=1) for way in ways])
    (contour,) = smooth_path([points], 0.05, CANVAS).contours
    lines = [segment for segment in contour.segments if len(segment) == 1]
    assert len(lines) == 3
    assert len(contour.segments) <= 3 + 5
    ends = np.array([contour.start, *(segment[-1] for segment in contour.segments)])
    for corner in ([200, 300], [200, 200]):
        assert np.abs(ends - corner).max(axis=1).min() <= 0.5
    x, y = (along(contour) - 200.0).T
    off = np.where(x > 100, np.hypot(x - 100, y - 50) - 50, -np.min([x, y, 100 - y], axis=0))
    assert np.abs(off).max() <= 0.05 + 0.1


def test_a_square_is_four_lines_aside_of_the_pixels():
    side = np.linspace(0.0, 1.0, 20, endpoint=False)
    ways = [(side, 0 * side), (1 + 0 * side, side), (1 - side, 1 + 0 * side), (0 * side, 1 - side)]
    points = np.concatenate([np.stack(way, axis=1) for way in ways])
    square = 10.0 + 40.0 * np.concatenate([points, points[:1]])
    (contour,) = straight_path([square], 0.05, CANVAS).contours
    corners = np.array([contour.start, *contour.points])
    assert np.allclose(corners, np.array([[10, 10], [50, 10], [50, 50], [10, 50]]) + ASIDE)


def test_a_speck_has_its_own_points():
    points = np.array([[1.0, 1.0], [3.0, 0.5], [4.0, 2.0], [2.5, 3.5]])
    (contour,) = smooth_path([np.concatenate([points, points[:1]])], 0.05, CANVAS).contours
    assert np.allclose([contour.start, *(end for *_, end in contour.segments)], points)


def test_what_has_no_area_is_left_out():
    assert smooth_path([np.array([[1.0, 1.0], [1.0, 1.0]])], 0.05, CANVAS).contours == ()

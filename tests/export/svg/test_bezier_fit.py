"""Curves and lines through contours whose shape is known."""

import numpy as np

from sdf2vec import Scene
from sdf2vec.export.svg.bezier_fit import ASIDE, smooth_path, straight_path
from sdf2vec.export.svg.canvas import Canvas

CANVAS = Canvas.of(Scene(512, 512, (), None))


def test_a_circle_is_some_curves():
    angles = np.linspace(0.0, 2 * np.pi, 401)
    circle = 256.0 + 100.0 * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    (contour,) = smooth_path([circle], 0.05, CANVAS).contours
    assert 4 <= len(contour.segments) <= 40
    t = np.linspace(0, 1, 33)[:, None]
    start = np.array(contour.start)
    for segment in contour.segments:
        a, b, end = map(np.array, segment)
        curve = (1 - t) ** 3 * start + 3 * t * (1 - t) ** 2 * a + 3 * t**2 * (1 - t) * b + t**3 * end
        assert np.abs(np.hypot(*(curve - 256.0).T) - 100.0).max() <= 0.05 + 0.1
        start = end
    assert np.allclose(start, contour.start)


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

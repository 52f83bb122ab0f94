"""Outlines as convex polygons with round corners, by hand."""

import math

import numpy as np
import pytest

from sdf2vec import Layer, Scene, Shape
from sdf2vec.export.svg.canvas import Canvas
from sdf2vec.export.svg.outlines import convex, core, distance_to, edge_of, placed, sharpened, sides, upright
from sdf2vec.export.svg.sampling import SampleGrid
from sdf2vec.outlines import EllipseOutline, PolygonOutline, RectangleOutline

SQUARE = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])


def test_normals_point_outwards_whatever_the_orientation():
    for corners in (SQUARE, SQUARE[::-1]):
        found = sorted(tuple(normal.tolist()) for *_, normal in sides(convex(corners)))
        assert found == [(-1.0, 0.0), (0.0, -1.0), (0.0, 1.0), (1.0, 0.0)]


def test_what_has_no_area_is_its_two_ends():
    assert convex(np.array([[0.0, 0.0], [3.0, 0.0], [1.0, 0.0]])).tolist() in (
        [[0, 0], [3, 0]],
        [[3, 0], [0, 0]],
    )
    assert convex(np.array([[2.0, 2.0]] * 3)).tolist() == [[2.0, 2.0]]
    assert sides(np.array([[2.0, 2.0]])) == []


def test_the_core_of_a_rounded_rectangle_is_smaller_by_the_radius():
    found = core(RectangleOutline((1.0, 0.0), (0.5, 0.3), math.pi / 2, 0.1))
    assert found is not None
    points, rounding = found
    assert rounding == 0.1
    assert sorted(np.round(points, 9).tolist()) == [[0.8, -0.4], [0.8, 0.4], [1.2, -0.4], [1.2, 0.4]]
    assert core(EllipseOutline((0.0, 0.0), (1.0, 1.0))) is None


def test_distances_to_a_rounded_square():
    grid = SampleGrid(np.array([0.5, 2.0, 4.0]), np.array([0.5, 5.0]), 1.0)
    want = np.array([[-0.5, 1.0, 3.0], [4.0, math.hypot(1, 4), 5.0]]) - 0.25
    assert np.allclose(distance_to(PolygonOutline(tuple(map(tuple, SQUARE)), 0.25), grid), want)


def test_sharper_corners_keep_the_sides():
    """A rounding of 0.2 taken away moves a square's corners out by 0.2 along both axes."""
    sharp = sharpened(PolygonOutline(tuple(map(tuple, SQUARE)), 0.2), 0.0)
    assert isinstance(sharp, PolygonOutline)
    assert sharp.rounding == 0
    assert sorted(np.round(sharp.points, 9).tolist()) == [[-0.2, -0.2], [-0.2, 1.2], [1.2, -0.2], [1.2, 1.2]]
    rounded = RectangleOutline((0.0, 0.0), (1.0, 1.0), 0.0, 0.4)
    assert sharpened(rounded, 0.5) == RectangleOutline((0.0, 0.0), (1.0, 1.0), 0.0, 0.2)


def test_only_turned_rectangles_are_told_as_polygons():
    straight = RectangleOutline((0.0, 0.0), (0.5, 0.3), 0.0, 0.1)
    assert upright(straight) is straight
    turned = upright(RectangleOutline((0.0, 0.0), (0.5, 0.3), 0.5, 0.1))
    assert isinstance(turned, PolygonOutline)
    assert turned.rounding == 0.1


def test_an_edge_in_user_units():
    layer = Layer((Shape.of("circle", (1, 0, 0), center=(0.25, 0), radius=0.25),), 0.1)
    edge = edge_of(layer, 0.5)
    assert edge is not None
    found = placed(edge, Canvas.of(Scene(300, 200, (), None)))
    assert isinstance(found, EllipseOutline)
    assert found.center == (200.0, 100.0)
    assert found.radii == pytest.approx((60.0, 60.0))
    union = Layer.union((*layer.shapes, *layer.shapes), 0.1, 0.1)
    assert edge_of(union, 0.5) is None

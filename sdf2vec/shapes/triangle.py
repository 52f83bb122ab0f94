"""Triangles, with sharp corners or with corners that are arcs of circles around three points."""

from __future__ import annotations

import math

from ..expr import Expr, absolute, clamp, dot, fixed, length, maximum, minimum, select, sqrt, vec2, vec4
from ..function import function, let
from ..kind import SMALLEST, Kind
from ..operation import FLOAT, VEC2
from ..outlines import Outline, Point, PolygonOutline
from ..units import LENGTH, Parameter
from .common import TINY, cross, position


@function("sdSide", start=VEC2, edge=VEC2, turn=FLOAT)
def sd_side(start: Expr, edge: Expr, turn: Expr) -> Expr:
    """Squared distance to an edge, and a number that is positive on the inner side of its line."""
    # moving along the edge does not change the smallest distance, so `along` counts as constant
    along = fixed(clamp(dot(start, edge) / maximum(dot(edge, edge), TINY), 0.0, 1.0))
    q = let("q", start - edge * along)
    return vec2(dot(q, q), turn * cross(start, edge))


@function("sdTriangle", p=VEC2, a=VEC2, b=VEC2, c=VEC2)
def sd_triangle(p: Expr, a: Expr, b: Expr, c: Expr) -> Expr:
    """Exact distance to a triangle (after Inigo Quilez, "2D distance functions")."""
    ab, bc, ca = let("ab", b - a), c - b, let("ca", a - c)
    turn = let("turn", select(cross(ab, ca) < 0.0, -1.0, 1.0))
    sides = [sd_side(p - start, edge, turn) for start, edge in ((a, ab), (b, bc), (c, ca))]
    nearest = let("nearest", minimum(minimum(sides[0], sides[1]), sides[2]))
    return sqrt(nearest.x) * select(nearest.y > 0.0, -1.0, 1.0)


def _triangle_extent(margin: Expr, a: Expr, b: Expr, c: Expr) -> Expr:
    low, high = minimum(minimum(a, b), c), maximum(maximum(a, b), c)
    return vec4(low - vec2(margin), high + vec2(margin))


def _triangle_area(a: Expr, b: Expr, c: Expr) -> Expr:
    return 0.5 * absolute(cross(b - a, c - a))


def _triangle_thickness(a: Expr, b: Expr, c: Expr) -> Expr:
    """The smallest height."""
    longest = maximum(maximum(length(b - a), length(c - b)), length(a - c))
    return 2.0 * _triangle_area(a, b, c) / maximum(longest, SMALLEST)


def _triangle_outline(offset: float, a: Point, b: Point, c: Point) -> Outline:
    return PolygonOutline((a, b, c), offset)


def _rounded_distance(p: Expr, a: Expr, b: Expr, c: Expr, corner_radius: Expr) -> Expr:
    return sd_triangle(p, a, b, c) - corner_radius


def _rounded_extent(margin: Expr, a: Expr, b: Expr, c: Expr, corner_radius: Expr) -> Expr:
    return _triangle_extent(corner_radius + margin, a, b, c)


def _rounded_area(a: Expr, b: Expr, c: Expr, corner_radius: Expr) -> Expr:
    around = length(b - a) + length(c - b) + length(a - c)
    return _triangle_area(a, b, c) + corner_radius * (around + math.pi * corner_radius)


def _rounded_thickness(a: Expr, b: Expr, c: Expr, corner_radius: Expr) -> Expr:
    return _triangle_thickness(a, b, c) + 2.0 * corner_radius


def _rounded_outline(offset: float, a: Point, b: Point, c: Point, corner_radius: float) -> Outline:
    return PolygonOutline((a, b, c), offset + corner_radius)


TRIANGLE = Kind(
    "triangle",
    (position("a", (0.0, -1.4)), position("b", (1.2, 0.7)), position("c", (-1.2, 0.7))),
    sd_triangle,
    _triangle_extent,
    _triangle_area,
    _triangle_thickness,
    exact=True,
    outline=_triangle_outline,
)

ROUNDED_TRIANGLE = Kind(
    "rounded_triangle",
    (
        position("a", (0.0, -1.1)),
        position("b", (0.9, 0.5)),
        position("c", (-0.9, 0.5)),
        Parameter("corner_radius", LENGTH, (0.3,)),
    ),
    _rounded_distance,
    _rounded_extent,
    _rounded_area,
    _rounded_thickness,
    exact=True,
    outline=_rounded_outline,
)

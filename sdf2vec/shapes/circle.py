"""Circles."""

from __future__ import annotations

import math

from ..expr import Expr, length, vec2
from ..function import function
from ..kind import Kind
from ..operation import FLOAT, VEC2
from ..outlines import EllipseOutline, Outline, Point
from .common import box_around, position, size


@function("sdCircle", p=VEC2, radius=FLOAT)
def sd_circle(p: Expr, radius: Expr) -> Expr:
    """Exact distance to a circle."""
    return length(p) - radius


def _circle_distance(p: Expr, center: Expr, radius: Expr) -> Expr:
    return sd_circle(p - center, radius)


def _circle_extent(margin: Expr, center: Expr, radius: Expr) -> Expr:
    return box_around(center, vec2(radius + margin))


def circle_area(center: Expr, radius: Expr) -> Expr:
    """What it covers."""
    return math.pi * radius * radius


def circle_thickness(center: Expr, radius: Expr) -> Expr:
    """Its width."""
    return 2.0 * radius


def _circle_outline(offset: float, center: Point, radius: float) -> Outline:
    return EllipseOutline(center, (radius + offset, radius + offset))


CIRCLE = Kind(
    "circle",
    (position("center"), size("radius", 1.0)),
    _circle_distance,
    _circle_extent,
    circle_area,
    circle_thickness,
    exact=True,
    outline=_circle_outline,
)

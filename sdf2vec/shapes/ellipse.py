"""Ellipses."""

from __future__ import annotations

import math

from ..expr import Expr, length, maximum, vec2
from ..function import function, let
from ..kind import SMALLEST, Kind, rotate
from ..operation import VEC2
from ..outlines import EllipseOutline, Outline, Point
from .common import angle_named, box_around, direction, position, size, smaller_component, turned_frame


@function("sdEllipse", p=VEC2, radii=VEC2)
def sd_ellipse(p: Expr, radii: Expr) -> Expr:
    """Field of a scaled circle: 0 on the ellipse, exact along the shorter axis, too small elsewhere."""
    r = let("r", maximum(radii, SMALLEST))
    return (length(p / r) - 1.0) * smaller_component(r)


def ellipse_distance(p: Expr, center: Expr, radii: Expr, angle: Expr) -> Expr:
    """The field of a scaled circle that is turned."""
    return sd_ellipse(rotate(p - center, direction(angle)), radii)


def ellipse_extent(margin: Expr, center: Expr, radii: Expr, angle: Expr) -> Expr:
    """A box around what is within a margin of an ellipse, by that field."""
    r = maximum(radii, SMALLEST)
    grown = r + r * (margin / smaller_component(r))
    along, across = direction(angle) * grown.x, direction(angle) * grown.y
    half = vec2(length(vec2(along.x, across.y)), length(vec2(along.y, across.x)))
    return box_around(center, half)


def _ellipse_area(center: Expr, radii: Expr, angle: Expr) -> Expr:
    return math.pi * radii.x * radii.y


def ellipse_thickness(center: Expr, radii: Expr, *rest: Expr) -> Expr:
    """Twice the shorter half axis."""
    return 2.0 * smaller_component(radii)


def _ellipse_outline(offset: float, center: Point, radii: Point, angle: float) -> Outline:
    grown = 1.0 + offset / min(radii)
    return EllipseOutline(center, (radii[0] * grown, radii[1] * grown), angle)


ELLIPSE = Kind(
    "ellipse",
    (position("center"), size("radii", 1.25, 0.8), angle_named("angle")),
    ellipse_distance,
    ellipse_extent,
    _ellipse_area,
    ellipse_thickness,
    exact=False,
    outline=_ellipse_outline,
    own_frame=turned_frame,
)

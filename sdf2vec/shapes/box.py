"""Boxes, with corners that may be round."""

from __future__ import annotations

import math

from ..expr import Expr, absolute, length, maximum, minimum, vec2
from ..function import function, let
from ..kind import Kind, rotate
from ..operation import FLOAT, VEC2
from ..outlines import Outline, Point, RectangleOutline
from ..units import LENGTH, Parameter
from .common import angle_named, box_around, direction, position, size, smaller_component, turned_frame


@function("sdBox", p=VEC2, half_size=VEC2, corner_radius=FLOAT)
def sd_box(p: Expr, half_size: Expr, corner_radius: Expr) -> Expr:
    """Exact distance to a box whose corners are rounded within half_size."""
    r = let("r", minimum(corner_radius, smaller_component(half_size)))
    q = let("q", absolute(p) - half_size + r)
    return length(maximum(q, 0.0)) + minimum(maximum(q.x, q.y), 0.0) - r


def _box_distance(p: Expr, center: Expr, half_size: Expr, angle: Expr, corner_radius: Expr) -> Expr:
    return sd_box(rotate(p - center, direction(angle)), half_size, corner_radius)


def _box_extent(margin: Expr, center: Expr, half_size: Expr, angle: Expr, corner_radius: Expr) -> Expr:
    r = minimum(corner_radius, smaller_component(half_size))
    core = half_size - r
    turned = absolute(direction(angle))
    half = vec2(turned.x * core.x + turned.y * core.y, turned.y * core.x + turned.x * core.y)
    return box_around(center, half + (r + margin))


def _box_area(center: Expr, half_size: Expr, angle: Expr, corner_radius: Expr) -> Expr:
    r = minimum(corner_radius, smaller_component(half_size))
    return 4.0 * half_size.x * half_size.y - (4.0 - math.pi) * r * r


def _box_thickness(center: Expr, half_size: Expr, angle: Expr, corner_radius: Expr) -> Expr:
    return 2.0 * smaller_component(half_size)


def _box_outline(
    offset: float, center: Point, half_size: Point, angle: float, corner_radius: float
) -> Outline:
    radius = max(min(corner_radius, *half_size) + offset, 0.0)
    return RectangleOutline(center, (half_size[0] + offset, half_size[1] + offset), angle, radius)


BOX = Kind(
    "box",
    (
        position("center"),
        size("half_size", 1.0, 0.75),
        angle_named("angle"),
        Parameter("corner_radius", LENGTH, (0.1,)),
    ),
    _box_distance,
    _box_extent,
    _box_area,
    _box_thickness,
    exact=True,
    outline=_box_outline,
    at_most=(("corner_radius", "half_size"),),
    own_frame=turned_frame,
)

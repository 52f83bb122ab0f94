"""What several shapes are made with."""

from __future__ import annotations

from ..expr import Expr, cos, minimum, sin, vec2, vec4
from ..kind import Frame
from ..outlines import Point
from ..units import ANGLE, LENGTH, POSITION, Parameter

TINY = 1e-20  # keeps squared lengths away from 0


def position(name: str, start: Point = (0.0, 0.0)) -> Parameter:
    """A point; the start is that of a shape of size 1 at the origin."""
    return Parameter(name, POSITION, start)


def size(name: str, *start: float) -> Parameter:
    """One length or two that are more than 0."""
    return Parameter(name, LENGTH, start, positive=True)


def angle_named(name: str) -> Parameter:
    """How far a shape is turned."""
    return Parameter(name, ANGLE)


def direction(angle: Expr) -> Expr:
    """The vector of length 1 at an angle."""
    return vec2(cos(angle), sin(angle))


def cross(a: Expr, b: Expr) -> Expr:
    """The third component of the cross product of two vectors."""
    return a.x * b.y - a.y * b.x


def smaller_component(v: Expr) -> Expr:
    """The smaller of two numbers."""
    return minimum(v.x, v.y)


def box_around(center: Expr, half: Expr) -> Expr:
    """A box (low x, low y, high x, high y) by its middle and half its size."""
    return vec4(center - half, center + half)


def turned_frame(center: Expr, half: Expr, angle: Expr, *rest: Expr) -> Frame:
    """What a turned shape is painted in."""
    return Frame(center, direction(angle), half)

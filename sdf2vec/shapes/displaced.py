"""Circles with a wavy edge."""

from __future__ import annotations

from ..expr import Expr, absolute, length, sin, vec2
from ..function import function
from ..kind import Kind
from ..operation import FLOAT, VEC2
from ..units import FREQUENCY, LENGTH, Parameter
from .circle import circle_area, circle_thickness
from .common import box_around, position, size


@function("sdDisplacedCircle", p=VEC2, radius=FLOAT, amplitude=FLOAT, frequency=VEC2)
def sd_displaced_circle(p: Expr, radius: Expr, amplitude: Expr, frequency: Expr) -> Expr:
    """Circle with its radius displaced by two sine waves; the slope is up to 1 + amplitude·frequency."""
    wave = sin(frequency.x * p.x) * sin(frequency.y * p.y)
    return length(p) - radius - amplitude * wave


def _displaced_distance(p: Expr, center: Expr, radius: Expr, amplitude: Expr, frequency: Expr) -> Expr:
    return sd_displaced_circle(p - center, radius, amplitude, frequency)


def _displaced_extent(margin: Expr, center: Expr, radius: Expr, amplitude: Expr, frequency: Expr) -> Expr:
    return box_around(center, vec2(radius + absolute(amplitude) + margin))


def _displaced_area(center: Expr, radius: Expr, amplitude: Expr, frequency: Expr) -> Expr:
    return circle_area(center, radius)


def _displaced_thickness(center: Expr, radius: Expr, amplitude: Expr, frequency: Expr) -> Expr:
    return circle_thickness(center, radius)


def _displaced_slope(center: Expr, radius: Expr, amplitude: Expr, frequency: Expr) -> Expr:
    return 1.0 + absolute(amplitude) * length(frequency)


DISPLACED = Kind(
    "displaced",
    (
        position("center"),
        size("radius", 1.0),
        Parameter("amplitude", LENGTH, (0.2,)),
        Parameter("frequency", FREQUENCY, (1.5, 1.5)),
    ),
    _displaced_distance,
    _displaced_extent,
    _displaced_area,
    _displaced_thickness,
    exact=False,
    slope=_displaced_slope,
)

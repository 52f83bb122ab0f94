"""What colour a shape has at a point.

To add a paint, write its colour as an expression and add one entry to `PAINTS`; renderers, gradients and exports
follow. Every paint begins with `color`; its other parameters are its own.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

from .expr import Expr, clamp, dot, length, mix
from .function import function
from .operation import FLOAT, VEC2, VEC3
from .units import COLOR, DIRECTION, RISE, SHIFT, Parameter


class Ramp(NamedTuple):
    """A linear gradient: how it rises from 0 to 1 along the axes of a shape's frame, what it is in the frame's middle,
    its colours at 0 and at 1.
    """

    slope: tuple[float, float]
    middle: float
    first: tuple[float, float, float]
    last: tuple[float, float, float]


class Rings(NamedTuple):
    """A radial gradient: where it is lowest in a shape's frame, how it rises to 1 from there along both axes, what it
    is there, its colours at 0 and at 1.
    """

    focus: tuple[float, float]
    slope: tuple[float, float]
    lowest: float
    first: tuple[float, float, float]
    last: tuple[float, float, float]


@dataclass(frozen=True, eq=False)
class Paint:
    """`color(q, color, *own)` is the colour (vec3) at a point q of the shape's frame, in which the shape reaches from
    about −1 to 1 along both axes. `own` are the parameters after `color`. `gradient(color, *own)` is for vector
    formats: that which it is.
    """

    name: str
    color: Callable[..., Expr]
    own: tuple[Parameter, ...] = ()
    gradient: Callable[..., Ramp | Rings] | None = None

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """All of them."""
        return (BASE, *self.own)

    @property
    def is_flat(self) -> bool:
        """Whether the colour is the same everywhere."""
        return not self.own


BASE = Parameter("color", COLOR, (0.0, 0.0, 0.0))


@function("linearPaint", q=VEC2, color=VEC3, color_end=VEC3, direction=VEC2, shift=FLOAT)
def linear_paint(q: Expr, color: Expr, color_end: Expr, direction: Expr, shift: Expr) -> Expr:
    """From one colour to another along a direction of the shape's frame; without a shift half of each at its middle."""
    return mix(color, color_end, clamp(0.5 + shift + dot(q, direction), 0.0, 1.0))


@function("radialPaint", q=VEC2, color=VEC3, color_end=VEC3, focus=VEC2, steepness=VEC2, shift=FLOAT)
def radial_paint(q: Expr, color: Expr, color_end: Expr, focus: Expr, steepness: Expr, shift: Expr) -> Expr:
    """From the colour at a point of the shape's frame to another one along ellipses around it."""
    return mix(color, color_end, clamp(shift + length((q - focus) * steepness), 0.0, 1.0))


PAINTS: dict[str, Paint] = {
    paint.name: paint
    for paint in (
        Paint("flat", lambda q, color: color),
        Paint(
            "linear",
            linear_paint,
            (
                Parameter("color_end", COLOR, (0.0, 0.0, 0.0)),
                Parameter("direction", DIRECTION, (0.5, 0.0)),
                Parameter("shift", SHIFT, optional=True, since=2),
            ),
            gradient=lambda color, color_end, direction, shift: Ramp(
                direction, 0.5 + shift, color, color_end
            ),
        ),
        Paint(
            "radial",
            radial_paint,
            (
                Parameter("color_end", COLOR, (0.0, 0.0, 0.0)),
                Parameter("focus", SHIFT, (0.0, 0.0)),
                Parameter("steepness", RISE, (1.0, 1.0)),
                Parameter("shift", SHIFT, optional=True, since=2),
            ),
            gradient=lambda color, color_end, focus, steepness, shift: Rings(
                focus, steepness, shift, color, color_end
            ),
        ),
    )
}
FLAT = "flat"

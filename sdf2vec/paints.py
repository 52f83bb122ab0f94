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
from .units import COLOR, DIRECTION, RISE, SHIFT, STOP, Parameter

# shares of the way, rising, and the colours there
Stops = tuple[tuple[float, tuple[float, float, float]], ...]


class Ramp(NamedTuple):
    """A linear gradient: how it rises from 0 to 1 along the axes of a shape's frame, what it is in the frame's middle,
    its colours from 0 to 1.
    """

    slope: tuple[float, float]
    middle: float
    stops: Stops


class Rings(NamedTuple):
    """A radial gradient: where it is lowest in a shape's frame, how it rises to 1 from there along both axes, what it
    is there, its colours from 0 to 1.
    """

    focus: tuple[float, float]
    slope: tuple[float, float]
    lowest: float
    stops: Stops


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


def along(q: Expr, direction: Expr, shift: Expr) -> Expr:
    """How far a point is along a direction of the shape's frame: without a shift one half in its middle."""
    return 0.5 + shift + dot(q, direction)


def around(q: Expr, focus: Expr, steepness: Expr, shift: Expr) -> Expr:
    """How far a point is from another one of the shape's frame, by ellipses around it."""
    return shift + length((q - focus) * steepness)


def two_colors(share: Expr, color: Expr, color_end: Expr) -> Expr:
    """From one colour at 0 to another at 1."""
    return mix(color, color_end, clamp(share, 0.0, 1.0))


@function("threeColors", share=FLOAT, color=VEC3, color_middle=VEC3, color_end=VEC3, stop=FLOAT)
def three_colors(share: Expr, color: Expr, color_middle: Expr, color_end: Expr, stop: Expr) -> Expr:
    """From one colour at 0 to another at a stop, and from there to a third one at 1."""
    return two_colors((share - stop) / (1.0 - stop), two_colors(share / stop, color, color_middle), color_end)


@function("linearPaint", q=VEC2, color=VEC3, color_end=VEC3, direction=VEC2, shift=FLOAT)
def linear_paint(q: Expr, color: Expr, color_end: Expr, direction: Expr, shift: Expr) -> Expr:
    """From one colour to another along a direction of the shape's frame."""
    return two_colors(along(q, direction, shift), color, color_end)


@function("radialPaint", q=VEC2, color=VEC3, color_end=VEC3, focus=VEC2, steepness=VEC2, shift=FLOAT)
def radial_paint(q: Expr, color: Expr, color_end: Expr, focus: Expr, steepness: Expr, shift: Expr) -> Expr:
    """From the colour at a point of the shape's frame to another one around it."""
    return two_colors(around(q, focus, steepness, shift), color, color_end)


END = Parameter("color_end", COLOR, (0.0, 0.0, 0.0))
MIDDLE = Parameter("color_middle", COLOR, (0.0, 0.0, 0.0))
WHERE = Parameter("stop", STOP, (0.5,))
SHIFTED = Parameter("shift", SHIFT, optional=True, since=2)
ALONG = Parameter("direction", DIRECTION, (0.5, 0.0)), SHIFTED
AROUND = Parameter("focus", SHIFT, (0.0, 0.0)), Parameter("steepness", RISE, (1.0, 1.0)), SHIFTED

PAINTS: dict[str, Paint] = {
    paint.name: paint
    for paint in (
        Paint("flat", lambda q, color: color),
        Paint(
            "linear",
            linear_paint,
            (END, *ALONG),
            lambda color, end, direction, shift: Ramp(direction, 0.5 + shift, ((0.0, color), (1.0, end))),
        ),
        Paint(
            "radial",
            radial_paint,
            (END, *AROUND),
            lambda color, end, focus, steepness, shift: Rings(
                focus, steepness, shift, ((0.0, color), (1.0, end))
            ),
        ),
        Paint(
            "linear3",
            lambda q, color, middle, end, stop, *line: three_colors(
                along(q, *line), color, middle, end, stop
            ),
            (MIDDLE, END, WHERE, *ALONG),
            lambda color, middle, end, stop, direction, shift: Ramp(
                direction, 0.5 + shift, ((0.0, color), (stop, middle), (1.0, end))
            ),
        ),
        Paint(
            "radial3",
            lambda q, color, middle, end, stop, *rings: three_colors(
                around(q, *rings), color, middle, end, stop
            ),
            (MIDDLE, END, WHERE, *AROUND),
            lambda color, middle, end, stop, focus, steepness, shift: Rings(
                focus, steepness, shift, ((0.0, color), (stop, middle), (1.0, end))
            ),
        ),
    )
}
FLAT = "flat"

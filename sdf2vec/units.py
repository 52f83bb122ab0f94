"""What a number of a scene is: its range, its learning rate, where it starts, what a fit may make of it, its codec.

A unit is one record. Tensors are only ever used through their methods, so that nothing here needs torch.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

from .expr import Expr, const, length, operation, var
from .function import function, let
from .graph import components_of
from .operation import FLOAT, VECTOR, Type

LONGEST_CANVAS = 65536.0  # scene units: the longest canvas there can be; anything larger is a mistake
MARGIN = 0.3  # scene units that a position may leave the canvas by
LONGEST = 1.5  # longest sides of the canvas
LEAST_SMOOTHNESS = 1e-3  # scene units: of a join that is smooth at all
HIGHEST_FREQUENCY = 60.0  # radians per scene unit
STEEPEST = 10.0  # of a gradient: ranges of colour across half a shape
FARTHEST = 6.0  # of those by which its middle is off that of the shape
FIRST_STOP = 0.01  # share of a gradient from its middle colour to that of an end, at least
NEAREST_STOP = 0.02  # the same where a fit may move it
FAINTEST = 0.02  # opacity where colours are not signed: below it a shape would stop learning
GRAIN = 0.001  # scene units: falloffs much below it are packed in equal steps
GEOMETRY_DECIMALS = 6
COLOR_DECIMALS = 5
ROOT_DECIMALS = 4  # of the ends between which the roots of lengths are fractions


class Room(NamedTuple):
    """What a fit has to hold its numbers in: the canvas and a pixel in scene units, and ranges."""

    size: tuple[float, float]
    pixel: float
    falloff: tuple[float, float] = (0.0, LONGEST)
    signed: bool = False  # colours −1..1


class Placed(NamedTuple):
    """Where shapes start: centres [N, 2] and sizes [N] in scene units, turns [N] in radians; tensors.

    Before they are turned, shapes are scaled along x and along y by factors `stretches` [N, 2], or by one for all.
    """

    centers: Any
    sizes: Any
    turns: Any
    stretches: Any = 1.0


class Fractions(NamedTuple):
    """What fractions 0..1 of a packed scene are fractions of: the layer's box of cells, and ranges by unit."""

    corner: Expr  # vec2
    box: Expr  # vec2
    ranges: Mapping[str, tuple[float, float]]


Within = tuple[tuple[float, float], ...]  # least and most of each number of a parameter, or of all


def _itself(value: Any) -> Any:
    return value


@dataclass(frozen=True)
class Codec:
    """How a packed scene says a number: `decode` gives its value from a fraction 0..1.

    `precision`: whose bits it has: "place" (as many as the layer's edge needs) or those of a field of its own. The
    `root` of a value, or of many, is linear in its fraction; `value` is that of a root. `formula`: the same as an
    expression. A number is near the one of its unit that stands `stride` numbers before it in the same shape, if that
    is not 0.
    """

    decode: Callable[[Expr, Fractions], Expr]
    precision: str = "place"
    root: Callable[[Any], Any] = _itself
    value: Callable[[Any], Any] = _itself
    formula: Callable[[Expr], Expr] = _itself
    stride: int = 0

    def step(self, value: Any, start: float, end: float, most: int) -> Any:
        """Which of the steps 0 to `most` between two roots a value lies at, not rounded, and beyond the ends, too."""
        return (self.root(value) - start) * (most / (end - start) if end > start else 0.0)

    def said(self, step: Any, start: float, end: float, most: int) -> Any:
        """The value of a step."""
        return self.value(start + (end - start) * step / most)


@dataclass(frozen=True, eq=False)
class Unit:
    """What a number is.

    `low` and `high` bound it in a scene, where it has so many `decimals`. `rate` is Adam's for one step on a canvas
    of area 1; it grows with the power `scaling` of the square root of the canvas' area, and falls with the number of
    layers where they are `crowded`. `start(values, placed)` is where a parameter starts, [N, width], whose values are
    for a shape of size 1 at the origin. `within(positive, room)`: the least and the most that a fit may make of each of
    its numbers, or of all. Values a `period` apart are one, if that is not 0; of those that `rest` a 0 stays.
    """

    name: str
    low: float
    high: float
    rate: float
    within: Callable[[bool, Room], Within]
    codec: Codec
    start: Callable[[tuple[float, ...], Placed], Any] | None = None
    decimals: int = GEOMETRY_DECIMALS
    scaling: int = 0
    crowded: bool = False
    period: float = 0.0
    rests: bool = False

    def project(self, values: Any, positive: bool, room: Room) -> None:
        """Moves a fit's values [N, width], a tensor, into their range, in place."""
        if self.period:
            values.remainder_(self.period)
            return
        kept = values.clone() if self.rests else values
        within = self.within(positive, room)
        for ends, some in zip(within, [values] if len(within) == 1 else values.unbind(-1), strict=True):
            some.clamp_(*ends)
        if self.rests:
            values.copy_(values.where(kept != 0.0, kept))


@dataclass(frozen=True)
class Parameter:
    """One parameter of a shape, a paint or a layer.

    `start` is the value for a shape of size 1 at the origin: what `unit.start` takes. A file need not have it if it
    is `optional`, and compact files do from the version `since` on. The unit's least value is excluded where it is
    `positive`.
    """

    name: str
    unit: Unit
    start: tuple[float, ...] = (0.0,)
    positive: bool = False
    optional: bool = False
    since: int = 1

    @property
    def width(self) -> int:
        """How many numbers it is."""
        return len(self.start)

    @property
    def type(self) -> Type:
        return VECTOR[self.width]

    @property
    def usual(self) -> float | tuple[float, ...]:
        """Its value where it is optional and a file has none."""
        return self.values_from(self.start)

    def variable(self, suffix: str = "") -> Expr:
        """A variable of its name."""
        return var(self.name + suffix, self.type)

    def scalars(self, suffix: str = "") -> tuple[Expr, ...]:
        """The float variables behind `variable`."""
        return components_of(self.variable(suffix))

    def constant(self, values: Sequence[float]) -> Expr:
        """Its value as a constant expression."""
        exprs = [const(value) for value in values]
        return exprs[0] if self.width == 1 else operation(self.type.value, *exprs)

    def values_from(self, numbers: Sequence[float]) -> float | tuple[float, ...]:
        """Its value as users have it: a float, or a tuple of several."""
        return tuple(numbers) if self.width > 1 else numbers[0]


# --- where numbers start ------------------------------------------------------------------------------------


def _turned(values: tuple[float, ...], placed: Placed) -> Any:
    return _turned_vectors(placed.turns.new_tensor(values)[None], placed)


def _turned_vectors(vectors: Any, placed: Placed) -> Any:
    across = vectors.flip(1) * vectors.new_tensor((-1.0, 1.0))
    return placed.turns.cos()[:, None] * vectors + placed.turns.sin()[:, None] * across


def _start_alike(values: tuple[float, ...], placed: Placed) -> Any:
    return placed.turns.new_tensor(values).repeat(len(placed.turns), 1)


def _start_length(values: tuple[float, ...], placed: Placed) -> Any:
    sized = placed.sizes.new_tensor(values) * placed.sizes[:, None]
    return sized * placed.stretches if len(values) == 2 else sized


def _start_position(values: tuple[float, ...], placed: Placed) -> Any:
    return placed.centers + _turned_vectors(_start_length(values, placed), placed)


def _start_angle(values: tuple[float, ...], placed: Placed) -> Any:
    return placed.turns.new_tensor(values) + placed.turns[:, None]


def _start_frequency(values: tuple[float, ...], placed: Placed) -> Any:
    return placed.sizes.new_tensor(values) / placed.sizes[:, None]


# --- what a fit may make of them -----------------------------------------------------------------------------


def _position_within(positive: bool, room: Room) -> Within:
    return tuple((-side / 2 - MARGIN, side / 2 + MARGIN) for side in room.size)


def _length_within(positive: bool, room: Room) -> Within:
    return ((room.pixel if positive else 0.0, LONGEST * max(room.size)),)


def _offset_within(positive: bool, room: Room) -> Within:
    longest = LONGEST * max(room.size)
    return ((-longest, longest),)


def _always_within(low: float, high: float) -> Callable[[bool, Room], Within]:
    return lambda positive, room: ((low, high),)


def _color_within(positive: bool, room: Room) -> Within:
    return ((-1.0 if room.signed else 0.0, 1.0),)


def _opacity_within(positive: bool, room: Room) -> Within:
    return ((-1.0 if room.signed else FAINTEST, 1.0),)


def _falloff_within(positive: bool, room: Room) -> Within:
    return (room.falloff,)


# --- how a packed scene says them ----------------------------------------------------------------------------


ROOT = 16


@function("grown", root=FLOAT)
def grown(root: Expr) -> Expr:
    """A length from its root: its 16th power, so that steps are shares of it, but equal where it is below `GRAIN`."""
    power = root
    for name in ("square", "fourth", "eighth"):
        power = let(name, power * power)
    return power * power - GRAIN


def _grown(root: Any) -> Any:
    return root**ROOT - GRAIN


def _root(length: Any) -> Any:
    return (length + GRAIN) ** (1.0 / ROOT)


def _place_in_box(v: Expr, of: Fractions) -> Expr:
    return of.corner + of.box * v


def _share_of_span(v: Expr, of: Fractions) -> Expr:
    return length(of.box) * v


def _signed_share_of_span(v: Expr, of: Fractions) -> Expr:
    return length(of.box) * (2.0 * v - 1.0)


def _between(unit: str) -> Callable[[Expr, Fractions], Expr]:
    """A value between the least and the largest of the scene."""

    def decode(v: Expr, of: Fractions) -> Expr:
        low, high = of.ranges[unit]
        if (low, high) == (0.0, 1.0):
            return v
        least = const(low) if v.type is FLOAT else operation(f"vec{v.type.width}", low)
        return least + v * (high - low)

    return decode


def _grown_between(unit: str) -> Callable[[Expr, Fractions], Expr]:
    """A length between the least and the largest of the scene, in steps that are the larger the longer it is."""

    def decode(v: Expr, of: Fractions) -> Expr:
        if len(set(of.ranges[unit])) == 1:
            return const(of.ranges[unit][0])
        low, high = (round(_root(end), ROOT_DECIMALS) for end in of.ranges[unit])
        return grown(low + v * (high - low))

    return decode


_PLACE, _SPAN = Codec(_place_in_box, stride=2), Codec(_share_of_span)
_TURN = Codec(lambda v, of: v * math.tau)


# --- the units -----------------------------------------------------------------------------------------------

POSITION = Unit(
    "position",
    -LONGEST_CANVAS,
    LONGEST_CANVAS,
    0.01,
    _position_within,
    _PLACE,
    _start_position,
    scaling=1,
    crowded=True,
)
LENGTH = Unit(
    "length", 0.0, LONGEST_CANVAS, 0.003, _length_within, _SPAN, _start_length, scaling=1, crowded=True
)
OFFSET = Unit(  # a length to one side or the other
    "offset",
    -LONGEST_CANVAS,
    LONGEST_CANVAS,
    0.006,
    _offset_within,
    Codec(_signed_share_of_span),
    _start_length,
    scaling=1,
    crowded=True,
)
ANGLE = Unit(
    "angle",
    -1000.0,
    1000.0,
    0.03,
    _always_within(0.0, math.tau),
    _TURN,
    _start_angle,
    period=math.tau,
)
FREQUENCY = Unit(
    "frequency",
    -1000.0,
    1000.0,
    0.3,
    _always_within(-HIGHEST_FREQUENCY, HIGHEST_FREQUENCY),
    Codec(_between("frequency")),
    _start_frequency,
    scaling=-1,
)
DIRECTION = Unit(
    "direction",
    -1000.0,
    1000.0,
    0.06,
    _always_within(-STEEPEST, STEEPEST),
    Codec(_between("direction")),
    _turned,
)
SHIFT = Unit(
    "shift",
    -1000.0,
    1000.0,
    0.06,
    _always_within(-FARTHEST, FARTHEST),
    Codec(_between("shift")),
    _start_alike,
)
RISE = Unit(  # of a gradient to all sides
    "rise",
    0.0,
    1000.0,
    0.06,
    _always_within(0.0, STEEPEST),
    Codec(_between("rise")),
    _start_alike,
)
STOP = Unit(  # where a gradient has its middle colour
    "stop",
    FIRST_STOP,
    1.0 - FIRST_STOP,
    0.02,
    _always_within(NEAREST_STOP, 1.0 - NEAREST_STOP),
    Codec(_between("stop")),
    _start_alike,
)
COLOR = Unit(
    "color",
    -1.0,
    1.0,
    0.014,
    _color_within,
    Codec(_between("color"), "color", stride=1),
    decimals=COLOR_DECIMALS,
    crowded=True,
)
OPACITY = Unit(
    "opacity",
    -1.0,
    1.0,
    0.01,
    _opacity_within,
    Codec(_between("opacity"), "opacity"),
    decimals=COLOR_DECIMALS,
    crowded=True,
)
FALLOFF = Unit(
    "falloff",
    0.0,
    LONGEST_CANVAS,
    0.01,
    _falloff_within,
    Codec(_grown_between("falloff"), "falloff", _root, _grown, grown),
    scaling=1,
    crowded=True,
)
SMOOTHNESS = Unit(
    "smoothness",
    0.0,
    LONGEST_CANVAS,
    0.003,
    _always_within(LEAST_SMOOTHNESS, LONGEST),
    Codec(_grown_between("smoothness"), "falloff", _root, _grown, grown),
    scaling=1,
    crowded=True,
    # what is sharp stays so; what is not does not become so by chance, for no derivative would lead back
    rests=True,
)
BACKGROUND = Unit(
    "background",
    0.0,
    1.0,
    0.01,
    _always_within(0.0, 1.0),
    Codec(_between("color"), "color", stride=1),
    decimals=COLOR_DECIMALS,
)

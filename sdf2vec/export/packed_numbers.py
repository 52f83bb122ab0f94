"""The numbers of one packed layer: each a fraction of what it may be, as a whole number of so many bits."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from statistics import fmean

from ..units import ANGLE, GEOMETRY_DECIMALS, Parameter
from .layouts import WORD
from .packed_bits import PLACE, Precision

# of the components of a parameter: where its fractions are 0, and where 1
Ends = tuple[list[float], list[float]]


class Coder:
    """Collects whole numbers with their bits, for one layer; each method returns the value that its number says."""

    def __init__(self, ends: Callable[[Parameter], Ends], precision: Precision, count: int) -> None:
        self.numbers: list[tuple[int, int]] = []
        self.bits = 0
        self.ends, self.precision, self.count = ends, precision, count

    def whole(self, value: int, bits: int) -> int:
        self.numbers.append((value, bits))
        self.bits += bits
        return value

    def fill(self, bits: int) -> None:
        """Nothing, up to so many bits in all."""
        while self.bits < bits:
            self.whole(0, min(WORD, bits - self.bits))

    def value(self, value: float, parameter: Parameter) -> float:
        """A parameter of one component."""
        (said,) = self.values([value], parameter)
        return said

    def level(self, values: Sequence[float], parameter: Parameter) -> float:
        """One value for all components of a parameter."""
        low, high = (end[0] for end in self.ends(parameter))
        bits = getattr(self.precision, parameter.unit.codec.precision)
        return _legal(self._said(fmean(values), low, high, bits, parameter), parameter)

    def values(self, values: Sequence[float], parameter: Parameter) -> list[float]:
        """All components of a parameter."""
        codec = parameter.unit.codec
        bits = self.count if codec.precision == PLACE else getattr(self.precision, codec.precision)
        ends = zip(values, *self.ends(parameter), strict=True)
        return [_legal(self._said(value, low, high, bits, parameter), parameter) for value, low, high in ends]

    def _said(self, value: float, low: float, high: float, bits: int, parameter: Parameter) -> float:
        """What the fraction with so many bits stands for that comes nearest to a value."""
        codec, most = parameter.unit.codec, (1 << bits) - 1
        value = value % math.tau if parameter.unit is ANGLE else value
        start, end = codec.root(low), codec.root(high)
        step = round(min(max(codec.step(value, start, end, most), 0.0), most))
        said: float = codec.said(self.whole(step, bits), start, end, most)
        return said


def _legal(value: float, parameter: Parameter) -> float:
    """What a scene takes: a length that must be positive may have become 0."""
    least = parameter.unit.low + (10.0**-GEOMETRY_DECIMALS if parameter.positive else 0.0)
    return min(max(value, least), parameter.unit.high)

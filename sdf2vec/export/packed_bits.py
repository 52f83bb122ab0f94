"""Where each number of a packed scene is in its bits, and the bits as words."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import NamedTuple

from ..paints import PAINTS
from ..shapes import KINDS
from ..units import COLOR, Parameter
from .layouts import WORD
from .records import Variant

COUNT_BITS = 7  # of the number of shapes in a layer
PLACE = "place"  # the precision of what lies in a layer's box: bits by how sharp its edge is


class Boxes(NamedTuple):
    """Bits with which each layer says its box: the cells that it may touch, and how many more bits than the least its
    fractions of that box have.
    """

    cell: int
    choice: int

    @property
    def is_shared(self) -> bool:
        """Whether all layers have the same."""
        return self.cell == 0

    @property
    def across(self) -> int:
        """Cells along a side of the grid."""
        return 1 << self.cell

    @property
    def spread(self) -> int:
        """How many more bits than the least a fraction may have."""
        return (1 << self.choice) - 1


OWN = Boxes(cell=4, choice=3)  # a box for each layer: a pixel elsewhere skips it
SHARED = Boxes(cell=0, choice=0)  # one box for all: nothing is skipped, and nothing says where


@dataclass(frozen=True)
class Precision:
    """Bits of each field. `places` is how finely positions are said: −log2 of the step, in falloffs."""

    places: float = 4.0
    falloff: int = 8
    color: int = 7
    opacity: int = 7

    def finer(self, field: str, steps: float = 1) -> Precision:
        return replace(self, **{field: getattr(self, field) + steps})


def by_precision(parameters: Iterable[Parameter]) -> list[Parameter]:
    """Parameters in the order in which a packed shape has them: those of a precision of their own first."""
    return sorted(parameters, key=lambda parameter: parameter.unit.codec.precision == PLACE)


@dataclass(frozen=True)
class Layout:
    """Where the numbers of a packed layer are.

    A layer is: its box of cells and bits more than the least, if it has its own; variant (or with joins: number of
    shapes), falloff, opacity; then its shapes: (variant, join, smoothness,) colours, places. With joins all shapes of
    a layer are as long as the longest could be. Where all colours are grey, a single fraction says one.
    """

    variants: tuple[Variant, ...]
    joins: tuple[str, ...]
    boxes: Boxes = OWN
    is_grey: bool = False

    @property
    def is_plain(self) -> bool:
        """Whether all layers are as long as each other and are drawn by one statement."""
        return self.boxes.is_shared and len(self.variants) == 1 and not self.joins

    def width(self, parameter: Parameter) -> int:
        """How many fractions say a parameter."""
        return 1 if self.is_grey and parameter.unit is COLOR else parameter.width

    @property
    def variant_bits(self) -> int:
        return (len(self.variants) - 1).bit_length() if self.variants else 0

    @property
    def join_bits(self) -> int:
        return (len(self.joins) - 1).bit_length() if self.joins else 0

    @property
    def head(self) -> int:
        """Bits before the falloff."""
        return 4 * self.boxes.cell + self.boxes.choice + (COUNT_BITS if self.joins else self.variant_bits)

    def before_shapes(self, precision: Precision) -> int:
        """Bits before the first shape."""
        return self.head + precision.falloff + precision.opacity

    def before_numbers(self, precision: Precision) -> int:
        """Bits of a shape before its colours."""
        return self.variant_bits + self.join_bits + precision.falloff if self.joins else 0

    def counts(self, variant: Variant) -> tuple[int, int]:
        """How many fractions of a shape have the colours' precision, and how many that of places."""
        parameters = (*PAINTS[variant.paint].parameters, *KINDS[variant.kind].parameters)
        places = sum(self.width(p) for p in parameters if p.unit.codec.precision == PLACE)
        return sum(map(self.width, parameters)) - places, places

    def most(self) -> tuple[int, int]:
        """The most of either that any variant has."""
        counts = [self.counts(variant) for variant in self.variants]
        return max((c for c, _ in counts), default=0), max((p for _, p in counts), default=1)

    def longest(self, precision: Precision, count: int) -> int:
        """Bits of the longest shape whose places have so many."""
        colors, places = self.most()
        return self.before_numbers(precision) + colors * precision.color + places * count

    def window(self, precision: Precision, count: int) -> int:
        """Words that a shader looks at for a shape whose places have so many bits, and what is before it."""
        longest = WORD + self.before_shapes(precision) + self.longest(precision, count)
        return -(-longest // WORD) + 1


class Stream:
    """Bits one after another, as words."""

    def __init__(self) -> None:
        self._value = 0
        self.bits = 0

    def put(self, value: int, bits: int) -> None:
        assert 0 <= value < 1 << bits, f"{value} has more than {bits} bits"
        self._value |= value << self.bits
        self.bits += bits

    def words(self, least: int) -> tuple[int, ...]:
        """All words, and empty ones up to so many."""
        count = max(-(-self.bits // WORD), least)
        raw = self._value
        mask = (1 << WORD) - 1
        return tuple((raw >> (WORD * i)) & mask for i in range(count))

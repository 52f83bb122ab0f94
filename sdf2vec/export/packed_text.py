"""The parts of a shader that read a packed scene: what its template takes."""

from __future__ import annotations

import math
from typing import Any

from ..expr import Expr, const, length, var, vec2
from ..graph import called_once, opened, substitute
from ..layer import JOIN, LOOK, STILL, P, shape_at
from ..lower.shader import Dialect, expression, statements
from ..operation import VEC2
from ..paints import PAINTS
from ..scene import Scene
from ..shapes import KINDS
from ..units import Parameter
from .layouts import WORD
from .packed_bits import COUNT_BITS, PLACE, by_precision
from .packing import BOX, CORNER, Packed, decoded
from .records import FIELD, Form, Variant, drawn_by, joined_by


class PackedText:
    """The text of a packed scene; `motion` is added to distances. What is called at one place only is written there."""

    def __init__(self, packed: Packed, scene: Scene, dialect: Dialect, motion: Expr = STILL) -> None:
        self.packed, self.dialect = packed, dialect
        self.layout = layout = packed.layout
        self.is_shared = layout.boxes.is_shared
        form = Form(layout.variants, layout.joins, scene.compositing)
        opacity, falloff = (self._field(parameter) for parameter in LOOK)
        drawn = drawn_by(form, var("float(kind)"), opacity, falloff, motion)
        fields = [self._at(variant) for variant in layout.variants]
        joins = [joined_by(layout.joins, var("float(join)"), self._smoothness())] if layout.joins else []
        if layout.is_plain:
            drawn, fields = substitute(drawn, {FIELD: self._within_shared(fields[0])}), []
        once = called_once([drawn, *fields, *joins])
        self.drawn, *self.fields = (opened(formula, once) for formula in (drawn, *fields))
        self.joined = [opened(formula, once) for formula in joins]

    @property
    def roots(self) -> list[Expr]:
        """All formulas of the text."""
        return [self.drawn, *self.joined, *self.fields]

    def _within_shared(self, field: Expr) -> Expr:
        """A formula with the numbers of the one box of all layers, a square."""
        side = 1.0 / self.packed.grid.per_unit
        corner = vec2(*map(const, self.packed.grid.low))
        return substitute(
            field, {length(BOX): const(side * math.sqrt(2.0)), BOX: const(side), CORNER: corner}
        )

    def part(self) -> dict[str, Any]:
        """What the template takes."""
        packed, bits, layout, boxes = self.packed, self.packed.precision, self.layout, self.layout.boxes
        corner, low, high = vec2(*map(const, packed.grid.low)), var("low", VEC2), var("high", VEC2)
        side = 1.0 / packed.grid.per_unit
        values = {
            "place": (P - corner) * packed.grid.per_unit,
            "corner": corner if self.is_shared else corner + low * side,
            "box": vec2(const(side)) if self.is_shared else (high - low) * side,
        }
        start = layout.before_shapes(bits)
        count = packed.least + boxes.spread
        return {
            **{name: self._say(value) for name, value in values.items()},
            "drawn": statements("c = {};", self.drawn, self.dialect),
            "plain": self.layout.is_plain,
            "words": packed.words,
            "word": WORD,
            "end": packed.bits,
            "shared": self.is_shared,
            "cell": boxes.cell,
            "choice": boxes.choice,
            "least": packed.least,
            "head": 4 * boxes.cell + boxes.choice,
            "variant": layout.variant_bits,
            "count": COUNT_BITS,
            "start": start,
            "size": self._size(),
            "window": 0 if packed.is_short else layout.window(bits, count),
            "most": layout.most()[1],
            "variants": [
                (*layout.counts(variant), statements("return {};", field, self.dialect))
                for variant, field in zip(layout.variants, self.fields, strict=not self.layout.is_plain)
            ],
            "color": bits.color,
            **self._joined_part(),
        }

    def _joined_part(self) -> dict[str, Any]:
        if not self.joined:
            return {"joined": []}
        return {
            "joined": statements("s = {};", self.joined[0], self.dialect),
            "join": self.layout.join_bits,
            "before": self.layout.before_numbers(self.packed.precision),
        }

    def _size(self) -> str:
        """Bits of one shape, of its kind and `n`."""
        bits, layout = self.packed.precision, self.layout
        if layout.joins:
            colors, places = layout.most()
            return self._sum(layout.before_numbers(bits) + colors * bits.color, places)
        counts = [layout.counts(variant) for variant in layout.variants]
        *others, last = [self._sum(colors * bits.color, places) for colors, places in counts]
        return "".join(f"kind == {i} ? {text} : " for i, text in enumerate(others)) + last

    def _sum(self, bits: int, places: int) -> str:
        """So many bits, and those of some places."""
        return str(bits + places * self.packed.least) if self.is_shared else f"{bits} + {places} * n"

    def _field(self, parameter: Parameter) -> Expr:
        """The layer's opacity or falloff."""
        bits, place = self.packed.precision, self.layout.head
        width = bits.opacity if parameter is LOOK[0] else bits.falloff
        place += bits.falloff if parameter is LOOK[0] else 0
        return decoded(parameter, [_part("start", place, width)], self.packed.ranges)

    def _smoothness(self) -> Expr:
        place = self.layout.variant_bits + self.layout.join_bits
        return decoded(JOIN, [_part("j", place, self.packed.precision.falloff)], self.packed.ranges)

    def _at(self, variant: Variant) -> Expr:
        """Colour and field of a shape whose colours are at the place `at`; the others are in `v`, or behind."""
        kind, paint = KINDS[variant.kind], PAINTS[variant.paint]
        bits, colors, places = self.packed.precision.color, 0, 0
        start = self.layout.before_shapes(self.packed.precision) if self.layout.is_plain else 0
        values: dict[Parameter, Expr] = {}
        for parameter in by_precision((*paint.parameters, *kind.parameters)):
            fractions = []
            for _ in range(self.layout.width(parameter)):
                if parameter.unit.codec.precision == PLACE:
                    fractions.append(self._place(start + colors * bits, places))
                    places += 1
                else:
                    fractions.append(self._part(start + colors * bits, bits))
                    colors += 1
            values[parameter] = decoded(parameter, fractions, self.packed.ranges)
        parameters = [values[parameter] for parameter in kind.parameters]
        return shape_at(kind, paint, parameters, [values[parameter] for parameter in paint.parameters])

    def _place(self, before: int, index: int) -> Expr:
        """One fraction of those behind so many bits."""
        least = self.packed.least
        return self._part(before + index * least, least) if self.is_shared else var(f"v[{index}]")

    def _part(self, further: int, bits: int) -> Expr:
        """The fraction of a shape that is so many bits further, where all layers are as long from their start."""
        return _part("start" if self.layout.is_plain else "at", further, bits)

    def _say(self, value: Expr) -> str:
        return expression(value, self.dialect)


def _part(place: str, further: int, bits: int) -> Expr:
    """The fraction that is so many bits further than a place."""
    return var(f"part({place}{f' + {further}' if further else ''}, {bits})")

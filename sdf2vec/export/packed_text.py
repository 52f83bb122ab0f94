"""The parts of a shader that read a packed scene: what its template takes."""

from __future__ import annotations

from typing import Any

from ..expr import Expr, const, var, vec2
from ..graph import opened
from ..layer import JOIN, LOOK, STILL, P, shape_at
from ..lower.shader import Dialect, expression
from ..operation import VEC2
from ..paints import PAINTS
from ..scene import Scene
from ..shapes import KINDS
from ..units import Parameter
from .layouts import WORD
from .packed_bits import COUNT_BITS, PLACE, by_precision
from .packing import Packed, decoded
from .records import Form, Variant, drawn_by, joined_by


class PackedText:
    """The text of a packed scene; `motion` is added to distances."""

    def __init__(self, packed: Packed, scene: Scene, dialect: Dialect, motion: Expr = STILL) -> None:
        self.packed, self.dialect = packed, dialect
        self.layout = layout = packed.layout
        self.form = Form(layout.variants, layout.joins, scene.compositing)
        self.is_shared = layout.boxes.is_shared
        opacity, falloff = (self._field(parameter) for parameter in LOOK)
        self.drawn = opened(drawn_by(self.form, var("float(kind)"), opacity, falloff, motion))
        self.joined = joined_by(layout.joins, var("float(join)"), var("smoothness")) if layout.joins else None
        self.fields = [self._at(variant) for variant in layout.variants]

    @property
    def roots(self) -> list[Expr]:
        """All formulas of the text."""
        own = [self._field(LOOK[1]), *([self._smoothness()] if self.joined else [])]
        return [self.drawn, *([self.joined] if self.joined else []), *self.fields, *own]

    def part(self) -> dict[str, Any]:
        """What the template takes."""
        packed, bits, layout, boxes = self.packed, self.packed.precision, self.layout, self.layout.boxes
        corner, low, high = vec2(*map(const, packed.grid.low)), var("low", VEC2), var("high", VEC2)
        side = 1.0 / packed.grid.per_unit
        values = {
            "place": (P - corner) * packed.grid.per_unit,
            "corner": corner if self.is_shared else corner + low * side,
            "box": vec2(const(side)) if self.is_shared else (high - low) * side,
            "drawn": self.drawn,
        }
        start = layout.before_shapes(bits)
        count = packed.least + boxes.spread
        return {
            **{name: self._say(value) for name, value in values.items()},
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
            "window": layout.window(bits, count),
            "most": layout.most()[1],
            "variants": [
                (*layout.counts(variant), self._say(field))
                for variant, field in zip(layout.variants, self.fields, strict=True)
            ],
            "color": bits.color,
            **self._joined_part(),
        }

    def _joined_part(self) -> dict[str, Any]:
        if self.joined is None:
            return {"joined": ""}
        return {
            "joined": self._say(self.joined),
            "join": self.layout.join_bits,
            "smoothness": self._say(self._smoothness()),
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
        values: dict[Parameter, Expr] = {}
        for parameter in by_precision((*paint.parameters, *kind.parameters)):
            fractions = []
            for _ in range(self.layout.width(parameter)):
                if parameter.unit.codec.precision == PLACE:
                    fractions.append(self._place(colors * bits, places))
                    places += 1
                else:
                    fractions.append(_part("at", colors * bits, bits))
                    colors += 1
            values[parameter] = decoded(parameter, fractions, self.packed.ranges)
        parameters = [values[parameter] for parameter in kind.parameters]
        return shape_at(kind, paint, parameters, [values[parameter] for parameter in paint.parameters])

    def _place(self, before: int, index: int) -> Expr:
        """One fraction of those behind so many bits."""
        least = self.packed.least
        return _part("at", before + index * least, least) if self.is_shared else var(f"v[{index}]")

    def _say(self, value: Expr) -> str:
        return expression(value, self.dialect)


def _part(place: str, further: int, bits: int) -> Expr:
    """The fraction that is so many bits further than a place."""
    return var(f"part({place}{f' + {further}' if further else ''}, {bits})")

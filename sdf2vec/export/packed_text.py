"""The parts of a shader that read a packed scene: what its template takes."""

from __future__ import annotations

from typing import Any

from ..expr import Expr, const, var, vec2
from ..layer import JOIN, LOOK, STILL, P, shape_at
from ..lower.shader import Dialect, expression
from ..operation import VEC2
from ..paints import PAINTS
from ..scene import Scene
from ..shapes import KINDS
from ..units import Parameter
from .layouts import WORD
from .packed_bits import CELL_BITS, CHOICE_BITS, COUNT_BITS, PLACE, Layout, by_precision
from .packing import Packed, decoded
from .records import Form, Variant, drawn_by, joined_by


class PackedText:
    """The text of a packed scene; `motion` is added to distances."""

    def __init__(self, packed: Packed, scene: Scene, dialect: Dialect, motion: Expr = STILL) -> None:
        self.packed, self.dialect = packed, dialect
        self.form = Form(packed.variants, packed.joins, scene.compositing)
        self.layout = Layout(packed.variants, packed.joins)
        opacity, falloff = (self._field(parameter) for parameter in LOOK)
        self.drawn = drawn_by(self.form, var("float(kind)"), opacity, falloff, motion)
        self.joined = joined_by(packed.joins, var("float(join)"), var("smoothness")) if packed.joins else None
        self.fields = [self._at(variant) for variant in packed.variants]

    @property
    def roots(self) -> list[Expr]:
        """All formulas of the text."""
        own = [self._field(LOOK[1]), *([self._smoothness()] if self.joined else [])]
        return [self.drawn, *([self.joined] if self.joined else []), *self.fields, *own]

    def part(self) -> dict[str, Any]:
        """What the template takes."""
        packed, bits, layout = self.packed, self.packed.precision, self.layout
        corner, low, high = vec2(*map(const, packed.grid.low)), var("low", VEC2), var("high", VEC2)
        values = {
            "place": (P - corner) * packed.grid.per_unit,
            "corner": corner + low * (1.0 / packed.grid.per_unit),
            "box": (high - low) * (1.0 / packed.grid.per_unit),
            "drawn": self.drawn,
        }
        start = layout.before_shapes(bits)
        count = packed.least + 2**CHOICE_BITS - 1
        longest = WORD + start + layout.longest(bits, count)
        return {
            **{name: self._say(value) for name, value in values.items()},
            "words": packed.words,
            "word": WORD,
            "end": packed.bits,
            "cell": CELL_BITS,
            "choice": CHOICE_BITS,
            "least": packed.least,
            "head": 4 * CELL_BITS + CHOICE_BITS,
            "variant": layout.variant_bits,
            "count": COUNT_BITS,
            "start": start,
            "size": self._size(),
            "window": -(-longest // WORD) + 1,
            "most": layout.most()[1],
            "variants": [
                (*layout.counts(variant), self._say(field))
                for variant, field in zip(packed.variants, self.fields, strict=True)
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
        if self.packed.joins:
            colors, places = layout.most()
            return f"{layout.before_numbers(bits) + colors * bits.color} + {places} * n"
        counts = [layout.counts(variant) for variant in self.packed.variants]
        *others, last = [f"{colors * bits.color} + {places} * n" for colors, places in counts]
        return "".join(f"kind == {i} ? {text} : " for i, text in enumerate(others)) + last

    def _field(self, parameter: Parameter) -> Expr:
        """The layer's opacity or falloff."""
        bits, place = self.packed.precision, self.layout.head
        width = bits.opacity if parameter is LOOK[0] else bits.falloff
        place += bits.falloff if parameter is LOOK[0] else 0
        return decoded(parameter, [var(f"part(start + {place}, {width})")], self.packed.ranges)

    def _smoothness(self) -> Expr:
        place = self.layout.variant_bits + self.layout.join_bits
        fraction = var(f"part(j + {place}, {self.packed.precision.falloff})")
        return decoded(JOIN, [fraction], self.packed.ranges)

    def _at(self, variant: Variant) -> Expr:
        """Colour and field of a shape whose colours are at the place `at`, its other fractions in `v`."""
        kind, paint = KINDS[variant.kind], PAINTS[variant.paint]
        bits, colors, places = self.packed.precision.color, 0, 0
        values: dict[Parameter, Expr] = {}
        for parameter in by_precision((*paint.parameters, *kind.parameters)):
            fractions = []
            for _ in range(parameter.width):
                if parameter.unit.codec.precision == PLACE:
                    fractions.append(var(f"v[{places}]"))
                    places += 1
                else:
                    fractions.append(var(f"part(at + {colors * bits}, {bits})"))
                    colors += 1
            values[parameter] = decoded(parameter, fractions, self.packed.ranges)
        parameters = [values[parameter] for parameter in kind.parameters]
        return shape_at(kind, paint, parameters, [values[parameter] for parameter in paint.parameters])

    def _say(self, value: Expr) -> str:
        return expression(value, self.dialect)

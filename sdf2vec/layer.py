"""The one formula of a layer: from a point and the layer's numbers to its coverage and colour, with bounds for culling.

A layer is a sequence of shapes joined left to right. Everything that draws takes it from here: the reference and the
fused renderers, shader texts, records and lists of layers, and what samples layers for an SVG.

    distance   d = join(d1, d2, …)                      coverage of its own for a patch
    cover      a = coverage(d, falloff, pixel)
    paint      c = the shapes' paints, mixed by the joins
    draw       below' = compositing(below, c, opacity, a)
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from typing import NamedTuple

from .blend import COMPOSITING, JOINS, coverage, reach, saturation, union_reach
from .expr import Expr, Operand, const, maximum, minimum, var, vec3, vec4
from .function import let
from .graph import scalarize
from .kind import Kind
from .operation import VEC2
from .paints import FLAT, PAINTS, Paint
from .shapes import KINDS
from .units import FALLOFF, OPACITY, SMOOTHNESS, Parameter

ROW_OPACITY = 1  # place of the opacity among `Formula.uniforms`
NEVER = 1e9  # scene units: a distance that is never met
LOOK = (Parameter("opacity", OPACITY, (1.0,), optional=True), Parameter("falloff", FALLOFF, optional=True))
JOIN = Parameter("smoothness", SMOOTHNESS, optional=True)
WORDS = ("kind", "paint", "join", "shapes")  # what a scene file says of a shape or a layer besides numbers
STILL = const(0.0)
P, PIXEL = var("p", VEC2), var("pixel")


class Part(NamedTuple):
    """One shape of a layer: names of its kind, its paint, and its join to those before it ("" for the first)."""

    kind: str
    paint: str = FLAT
    join: str = ""

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """All of its numbers, in the order of a layer's row. Raises ValueError for a name that means two of them."""
        joined = (JOIN,) if self.join else ()
        painted = _named_apart(KINDS[self.kind], PAINTS[self.paint]) if self.adds else ()
        return (*joined, *painted, *KINDS[self.kind].parameters)

    @property
    def adds(self) -> bool:
        """Whether it may make the layer larger, and its colour is seen."""
        return not self.join or JOINS[self.join].adds


@cache
def _named_apart(kind: Kind, paint: Paint) -> tuple[Parameter, ...]:
    """The parameters of a paint, which no parameter of the kind it is put on shares a name with, nor a layer's."""
    words = [*WORDS, *(parameter.name for parameter in (*LOOK, JOIN, *paint.parameters, *kind.parameters))]
    twice = [name for name, count in Counter(words).items() if count > 1]
    if twice:
        raise ValueError(
            f"the kind {kind.name} with the paint {paint.name}: two things are called {', '.join(twice)}; "
            "scene files tell them apart by name"
        )
    return paint.parameters


Structure = tuple[Part, ...]  # of a layer: all that decides its formula


class Slot(NamedTuple):
    """A parameter of a layer (`part` is None) or of one of its parts."""

    part: int | None
    parameter: Parameter

    @property
    def suffix(self) -> str:
        """What makes its variable's name unlike those of the other parts."""
        return "" if self.part is None else f"_{self.part}"


LOOK_SLOTS = OPACITY_SLOT, FALLOFF_SLOT = Slot(None, LOOK[0]), Slot(None, LOOK[1])


@cache
def slots(structure: Structure) -> tuple[Slot, ...]:
    """What a layer's row of numbers holds, in order: opacity, falloff, then each part's smoothness, paint, shape."""
    own = (Slot(index, parameter) for index, part in enumerate(structure) for parameter in part.parameters)
    return (*LOOK_SLOTS, *own)


@cache
def row_width(structure: Structure) -> int:
    """How many numbers a layer's row has."""
    return sum(slot.parameter.width for slot in slots(structure))


class Row(NamedTuple):
    """One value, constant or variable, for each slot of a layer."""

    values: dict[Slot, Expr]

    def of(self, part: int | None, name: str) -> Expr:
        """The value of a parameter."""
        return next(v for s, v in self.values.items() if s.part == part and s.parameter.name == name)

    def some(self, part: int, parameters: Sequence[Parameter]) -> list[Expr]:
        """The values of some parameters of a part."""
        return [self.values[Slot(part, parameter)] for parameter in parameters]


def variable_row(structure: Structure) -> Row:
    """A variable for each slot."""
    return Row({slot: slot.parameter.variable(slot.suffix) for slot in slots(structure)})


def constant_row(structure: Structure, numbers: Sequence[float]) -> Row:
    """The numbers of one layer as constants."""
    rest = iter(numbers)
    values = {}
    for slot in slots(structure):
        values[slot] = slot.parameter.constant([next(rest) for _ in range(slot.parameter.width)])
    return Row(values)


@dataclass(frozen=True)
class Formula:
    """The formula of all layers of a structure, in the values of a row. `motion` is added to distances."""

    structure: Structure
    row: Row
    motion: Expr = STILL

    @classmethod
    def of(cls, structure: Structure) -> Formula:
        """In variables."""
        return cls(structure, variable_row(structure))

    def __str__(self) -> str:
        return ", ".join(
            " ".join(word for word in (part.join, part.paint, part.kind) if word) for part in self.structure
        )

    @property
    def uniforms(self) -> tuple[Expr, ...]:
        """The row's float variables, in order, after the size of a pixel."""
        return (PIXEL, *(s for slot in slots(self.structure) for s in slot.parameter.scalars(slot.suffix)))

    @cached_property
    def _joined(self) -> Expr:
        """Colour and signed distance of several parts together, vec4."""
        found = vec4(self._color_of(0), _field_at(self._kind(0), self._parameters(0)))
        for index, part in enumerate(self.structure[1:], 1):
            other = vec4(self._color_of(index), _field_at(self._kind(index), self._parameters(index)))
            found = JOINS[part.join].formula(found, other, self.row.of(index, JOIN.name))
        return let("joined", found)

    def _color_of(self, index: int) -> Expr:
        """The colour of one part, vec3; black where it is not seen."""
        part = self.structure[index]
        if not part.adds:
            return vec3(0.0)
        paint = PAINTS[part.paint]
        values = self.row.some(index, paint.parameters)
        return _color_at(self._kind(index), paint, self._parameters(index), values)

    @cached_property
    def color(self) -> Expr:
        """The colour, vec3."""
        joined = self._joined if len(self.structure) > 1 else None
        return self._color_of(0) if joined is None else vec3(joined.x, joined.y, joined.z)

    @cached_property
    def distance(self) -> Expr:
        """The signed distance, of a patch that to where one standard deviation ends."""
        if len(self.structure) > 1:
            return self._joined.w + self.motion
        return self._kind(0).distance(P, *self._parameters(0)) + self.motion

    def cover(self, compositing: str) -> Expr:
        """Coverage, 0..1; −1..1 where colours are signed."""
        kind = self._kind(0)
        field = self.distance if kind.patch is None else _field_at(kind, self._parameters(0))
        return cover_of(kind, field, self.row.of(None, "falloff"), compositing)

    @property
    def opacity(self) -> Expr:
        return self.row.of(None, "opacity")

    @property
    def is_solid(self) -> bool:
        """Whether coverage can be 1 in a whole region, with a colour that no other part has a share in."""
        return self._kind(0).patch is None and len(self._adding) == 1

    @property
    def _adding(self) -> list[int]:
        """The parts that may make the layer larger."""
        return [index for index, part in enumerate(self.structure) if part.adds]

    def draw(self, below: Expr, compositing: str) -> Expr:
        """What the layer makes of what is below it (premultiplied, vec4)."""
        return COMPOSITING[compositing].draw(below, self.color, self.opacity, self.cover(compositing))

    def fill(self, below: Expr, compositing: str) -> Expr:
        """The same where coverage is 1."""
        return COMPOSITING[compositing].draw(below, self.color, self.opacity, const(1.0))

    def bounds(self, slack: Operand = 0.0) -> tuple[Expr, ...]:
        """Box (low x, low y, high x, high y), distance from which coverage is 0, up to which 1, slope of the distance.

        They hold for every distance that is off by at most `slack`. Scalars.
        """
        outer, inner = self.reach
        slope = self._kind(0).slope(*self._parameters(0))
        for index in range(1, len(self.structure)):
            slope = maximum(slope, self._kind(index).slope(*self._parameters(index)))
        scalars = (outer + slack, inner - slack, slope)
        return (*self.extent(outer + slack), *(scalar for expr in scalars for scalar in scalarize(expr)))

    def extent(self, margin: Expr) -> list[Expr]:
        """A box (low x, low y, high x, high y) that holds every point with distance ≤ margin, for margin ≥ 0."""
        smoothest = const(0.0)
        for index in self._adding[1:]:
            smoothest = maximum(smoothest, self.row.of(index, JOIN.name))
        farther = margin + union_reach(len(self._adding), smoothest)
        boxes = [scalarize(self._kind(i).extent(farther, *self._parameters(i))) for i in self._adding]
        box = list(boxes[0])
        for other in boxes[1:]:
            picks = (minimum, minimum, maximum, maximum)
            box = [pick(a, b) for pick, a, b in zip(picks, box, other, strict=True)]
        return box

    @property
    def reach(self) -> tuple[Expr, Expr]:
        """The distances from which coverage is 0, and up to which it is 1."""
        patch, falloff = self._kind(0).patch, self.row.of(None, "falloff")
        if patch is not None:
            return patch.reach(PIXEL, *self._parameters(0)), const(-NEVER)
        return reach(falloff, PIXEL), saturation(falloff, PIXEL)

    def _kind(self, index: int) -> Kind:
        return KINDS[self.structure[index].kind]

    def _parameters(self, index: int) -> list[Expr]:
        return self.row.some(index, self._kind(index).parameters)


def shape_at(kind: Kind, paint: Paint, parameters: Sequence[Expr], values: Sequence[Expr]) -> Expr:
    """Colour and field (signed distance, for a patch coverage) of one shape at the point `p`, vec4."""
    return vec4(_color_at(kind, paint, parameters, values), _field_at(kind, parameters))


def _color_at(kind: Kind, paint: Paint, parameters: Sequence[Expr], values: Sequence[Expr]) -> Expr:
    return paint.color(P if paint.is_flat else kind.frame(*parameters).at(P), *values)


def _field_at(kind: Kind, parameters: Sequence[Expr]) -> Expr:
    if kind.patch is not None:
        return kind.patch.cover(P, PIXEL, *parameters)
    return kind.distance(P, *parameters)


def cover_of(kind: Kind, field: Expr, falloff: Expr, compositing: str) -> Expr:
    """Coverage from the field of a layer that begins with this kind; none where below 0, unless that is allowed."""
    if kind.patch is None:
        return coverage(field, falloff, PIXEL)
    return maximum(field, 0.0) if kind.patch.signed and not COMPOSITING[compositing].signed else field


def is_flat(structure: Structure) -> bool:
    """Whether all of a layer has one colour: that of its first part."""
    adding = [part for part in structure if part.adds]
    return len(adding) == 1 and PAINTS[adding[0].paint].is_flat

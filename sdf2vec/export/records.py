"""A scene as records of numbers, one a shape, which a shader reads in a loop.

What a shape's formulas compute from its parameters alone (the cosine of an angle, say) is in the record.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from typing import NamedTuple

import numpy as np

from ..arrays import Float32Array, Float64Array, IntArray
from ..blend import COMPOSITING, JOINS
from ..expr import Expr, component, const, operation, select, var, vec3
from ..graph import hoist, scalarize, substitute
from ..layer import PIXEL, STILL, P, cover_of, shape_at
from ..lower.numpy import Arrays, compile_numpy
from ..operation import VEC4, VECTOR
from ..paints import FLAT, PAINTS
from ..scene import Layer, Scene, Shape
from ..shapes import KINDS

OPACITY, FALLOFF, COUNT, SMOOTHNESS, JOIN = range(
    5
)  # places in a record; the last three in scenes with joins
BELOW, FIELD, OTHER = (
    var("c", VEC4),
    var("s", VEC4),
    var("o", VEC4),
)  # of a loop: what is below, a layer, its next shape
HEAD, OWN = (
    "r0",
    "q0",
)  # the first vec4 of a layer's record, and of the record of a shape that is joined to it


class Variant(NamedTuple):
    """What decides the formula of one shape: names of its kind and its paint."""

    kind: str
    paint: str = FLAT

    @property
    def expression(self) -> Expr:
        """Colour and field of a shape at the point `p`, in variables."""
        kind, paint = KINDS[self.kind], PAINTS[self.paint]
        return shape_at(kind, paint, kind.variables(), [p.variable() for p in paint.parameters])

    @property
    def scalars(self) -> tuple[Expr, ...]:
        """The float variables of its numbers: the paint's, then the kind's."""
        painted = (scalar for parameter in PAINTS[self.paint].parameters for scalar in parameter.scalars())
        return (*painted, *KINDS[self.kind].scalars())


def variant_of(shape: Shape) -> Variant:
    return Variant(shape.kind, shape.paint)


def variants_of(scene: Scene) -> tuple[Variant, ...]:
    """All that a scene has, in the order of KINDS; patches last."""
    found = {variant_of(shape) for layer in scene.layers for shape in layer.shapes}
    places = list(KINDS)
    return tuple(
        sorted(found, key=lambda v: (KINDS[v.kind].patch is not None, places.index(v.kind), v.paint))
    )


def joins_of(scene: Scene) -> tuple[str, ...]:
    """The joins that a scene has, in the order of JOINS."""
    found = {joint.join for layer in scene.layers for joint in layer.joints}
    return tuple(name for name in JOINS if name in found)


@dataclass(frozen=True)
class Form:
    """What the records of a scene hold: its variants, its joins by their number, and its compositing.

    A record is: opacity, falloff, (shapes in its layer, smoothness, join,) (variant,) numbers; in vec4s r0, r1, …
    """

    variants: tuple[Variant, ...]
    joins: tuple[str, ...]
    compositing: str

    @property
    def variant_place(self) -> int:
        """Where the number of the variant is."""
        return JOIN + 1 if self.joins else FALLOFF + 1

    @property
    def head(self) -> int:
        """How many numbers come before those of the formulas."""
        return self.variant_place + (len(self.variants) > 1)

    @property
    def stride(self) -> int:
        """How many vec4 a record has."""
        widest = max((_tabulated(variant).width for variant in self.variants), default=0)
        return -(-(self.head + widest) // 4)

    def fields(self) -> list[tuple[Variant, Expr]]:
        """Colour and field by variant, of the point `p` and the rows r0, r1, … of a record."""
        return [(variant, _tabulated(variant).field(self.head)) for variant in self.variants]

    def joined(self) -> Expr:
        """A layer so far (`s`) with its next shape (`o`), whose record begins with `q0`, `q1`."""
        return joined_by(self.joins, slot(JOIN, OWN), slot(SMOOTHNESS, OWN))

    def drawn(self, motion: Expr = STILL) -> Expr:
        """What a layer `s` whose record begins with `r0` makes of what is below it, `c`."""
        return drawn_by(self, slot(self.variant_place, HEAD), slot(OPACITY), slot(FALLOFF), motion)


def slot(place: int, row: str = HEAD) -> Expr:
    """The number at a place of a record whose first vec4 is called `row`."""
    return component(var(f"{row[0]}{place // 4}", VEC4), place % 4)


def joined_by(joins: Sequence[str], which: Expr, smoothness: Expr) -> Expr:
    """The layer `s` with a shape `o` joined to it, by the join of a number."""
    found = [JOINS[name].formula(FIELD, OTHER, smoothness) for name in joins]
    return _by_number(which, found)


def drawn_by(form: Form, which: Expr, opacity: Expr, falloff: Expr, motion: Expr = STILL) -> Expr:
    """What a layer `s` that begins with the variant of a number makes of `c`; `motion` is added to distances."""
    covers = []
    for variant in form.variants:
        kind = KINDS[variant.kind]
        covers.append(
            cover_of(kind, FIELD.w + motion if kind.patch is None else FIELD.w, falloff, form.compositing)
        )
    color = vec3(FIELD.x, FIELD.y, FIELD.z)
    return COMPOSITING[form.compositing].draw(BELOW, color, opacity, _by_number(which, covers))


def _by_number(which: Expr, choices: Sequence[Expr]) -> Expr:
    """The choice of a number; runs of equal ones are told apart from others only."""
    found = choices[-1] if choices else const(0.0)
    for number in range(len(choices) - 2, -1, -1):
        if choices[number] is not choices[number + 1]:
            found = select(which < number + 0.5, choices[number], found)
    return found


def form_of(scene: Scene) -> Form:
    """The records that a scene needs."""
    return Form(variants_of(scene), joins_of(scene), scene.compositing)


def records(scene: Scene, form: Form) -> Float32Array:
    """All records, [shapes, stride, 4]."""
    table = np.zeros((scene.shape_count, form.stride * 4), np.float32)
    heads = [row for layer in scene.layers for row in _heads(layer, form)]
    table[:, : form.head] = np.array(heads).reshape(len(table), form.head)
    members: dict[Variant, list[int]] = defaultdict(list)
    shapes = [shape for layer in scene.layers for shape in layer.shapes]
    for place, shape in enumerate(shapes):
        members[variant_of(shape)].append(place)
    for variant, places in members.items():
        tabulated = _tabulated(variant)
        own = tabulated.values([shapes[place] for place in places])
        table[places, form.head : form.head + tabulated.width] = own
    return table.reshape(scene.shape_count, form.stride, 4)


def first_records(layers: Sequence[Layer]) -> IntArray:
    """Which record each layer begins with, [L]."""
    return np.cumsum([0, *(len(layer.shapes) for layer in layers)], dtype=np.int64)[:-1]


def _heads(layer: Layer, form: Form) -> Iterator[list[float]]:
    """What the record of each shape of a layer begins with."""
    joints = [(0.0, 0), *((joint.smoothness, form.joins.index(joint.join)) for joint in layer.joints)]
    for shape, joint in zip(layer.shapes, joints, strict=True):
        row = [layer.opacity, layer.falloff]
        row += [len(layer.shapes), *joint] if form.joins else []
        row += [form.variants.index(variant_of(shape))] if len(form.variants) > 1 else []
        yield row


def record_scalars(variant: Variant) -> list[Expr]:
    """The numbers of a record after its head, as expressions of the variant's scalars."""
    return _tabulated(variant).scalars


class _Tabulated:
    """A variant's formula with all that depends neither on the point nor on the pixels read from a record."""

    def __init__(self, variant: Variant) -> None:
        self._symbolic, self._inputs = variant.expression, variant.scalars
        self._parts = hoist(self._symbolic, (P, PIXEL))
        self.scalars = [scalar for part in self._parts for scalar in scalarize(part)]
        self.width = len(self.scalars)

    def field(self, start: int) -> Expr:
        """The formula, its numbers from place `start` of a record on."""
        places = iter(range(start, start + self.width))
        return substitute(self._symbolic, {part: _take(part, places) for part in self._parts})

    def values(self, shapes: Sequence[Shape]) -> Float64Array:
        """The numbers of the records of some shapes, [shapes, width]."""
        rows = np.array([(*s.color, *s.paint_parameters, *s.parameters) for s in shapes])
        found = self._compiled(*rows.T)
        return np.stack([np.broadcast_to(column, len(shapes)) for column in found], axis=1)

    @cached_property
    def _compiled(self) -> Callable[..., Arrays]:
        return compile_numpy(self.scalars, self._inputs)


@cache
def _tabulated(variant: Variant) -> _Tabulated:
    return _Tabulated(variant)


def _take(part: Expr, places: Iterable[int]) -> Expr:
    found = [slot(place) for _, place in zip(range(part.type.width), places, strict=False)]
    return found[0] if len(found) == 1 else operation(VECTOR[len(found)].value, *found)

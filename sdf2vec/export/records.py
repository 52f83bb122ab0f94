"""A scene as records of numbers, one a shape, which a shader reads in a loop.

What a distance computes from its parameters alone (the cosine of an angle, say) is in the record.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from ..expr import VEC2, VEC4, Expr, component, const, constant, hoist, scalarize, substitute, var, vec2
from ..scene import Layer, Scene, Shape
from ..shapes import KINDS

Floats = NDArray[np.float32]

P = var("p", VEC2)
FALLOFF = 4  # place of the falloff in a record; before it are colour and opacity
UNION, SMOOTHNESS = 5, 6  # in scenes with unions


@dataclass(frozen=True)
class Form:
    """What the records of a scene hold: `kinds` by their number, and whether there are unions.

    A record is: colour (3), opacity, falloff, (union size, smoothness,) (kind,) parameters; in vec4s r0, r1, …
    """

    kinds: tuple[str, ...]
    unions: bool

    @property
    def kind_place(self) -> int:
        return SMOOTHNESS + 1 if self.unions else FALLOFF + 1

    @property
    def head(self) -> int:
        """How many numbers come before the parameters."""
        return self.kind_place + (len(self.kinds) > 1)

    @property
    def stride(self) -> int:
        """How many vec4 a record has."""
        widest = max((_tabulated(kind).width for kind in self.kinds), default=0)
        return -(-(self.head + widest) // 4)

    def distances(self) -> list[tuple[str, Expr]]:
        """Distance by kind, of a point `p` and the rows r1, r2, … of a record."""
        return [(kind, _tabulated(kind).distance(self.head)) for kind in self.kinds]

    def slot(self, place: int) -> str:
        """How a shader says the number at a place of a record."""
        return f"r{place // 4}.{'xyzw'[place % 4]}"


def form_of(scene: Scene) -> Form:
    """The records that a scene needs."""
    present = {layer.kind for layer in scene.layers}
    return Form(tuple(k for k in KINDS if k in present), any(len(layer.shapes) > 1 for layer in scene.layers))


def records(scene: Scene, form: Form) -> Floats:
    """All records, [shapes, stride, 4]."""
    table = np.zeros((scene.shape_count, form.stride * 4), np.float32)
    rows = (_record(layer, shape, form) for layer in scene.layers for shape in layer.shapes)
    for place, row in enumerate(rows):
        table[place, : len(row)] = row
    return table.reshape(scene.shape_count, form.stride, 4)


def first_records(layers: Sequence[Layer]) -> NDArray[np.int64]:
    """Which record each layer begins with, [L]."""
    return np.cumsum([0, *(len(layer.shapes) for layer in layers)], dtype=np.int64)[:-1]


def _record(layer: Layer, shape: Shape, form: Form) -> list[float]:
    row = [*shape.color, layer.opacity, layer.falloff]
    row += [len(layer.shapes), layer.smoothness] if form.unions else []
    row += [form.kinds.index(shape.kind)] if len(form.kinds) > 1 else []
    return [*row, *_tabulated(shape.kind).values(shape)]


def record_scalars(kind: str) -> list[Expr]:
    """The numbers of a record after its head, as expressions of the kind's scalars."""
    return _tabulated(kind).scalars


class _Tabulated:
    """A kind's distance with all that does not depend on the point read from a record."""

    def __init__(self, kind: str) -> None:
        self._symbolic = KINDS[kind].distance(P, *KINDS[kind].variables())
        self._parts = hoist(self._symbolic, P)
        self.scalars = [scalar for part in self._parts for scalar in scalarize(part)]
        self._inputs = KINDS[kind].scalars()
        self.width = len(self.scalars)

    def distance(self, start: int) -> Expr:
        """The distance, its numbers from place `start` of a record on."""
        slots = (component(var(f"r{i // 4}", VEC4), i % 4) for i in range(start, start + self.width))
        return substitute(self._symbolic, {part: _take(part, slots) for part in self._parts})

    def values(self, shape: Shape) -> list[float]:
        """The numbers of a shape's record."""
        values = dict(zip(self._inputs, map(const, shape.parameters), strict=True))
        return [constant(substitute(scalar, values)) for scalar in self.scalars]


@cache
def _tabulated(kind: str) -> _Tabulated:
    return _Tabulated(kind)


def _take(part: Expr, slots: Iterator[Expr]) -> Expr:
    return vec2(next(slots), next(slots)) if part.type is VEC2 else next(slots)

"""Which shapes could be joined to a layer, where and how: found one at a time, the others as they are.

A picture is linear in what a layer covers, and what a layer covers goes with one shape's own coverage from nothing to
everything. So for each place among the joins, how wrong a picture is with one more shape is a weighted square of how
far that shape's coverage is from a mask; shapes of a kind are fitted to all such masks at once, with no formula but
their own.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import Any, NamedTuple

import numpy as np
import torch

from ..arrays import IntArray
from ..blend import JOINS, SHARPEST, SUBTRACTION
from ..deferred import deferred
from ..expr import const, var, vec3, vec4
from ..layer import FALLOFF_SLOT, JOIN, OPACITY_SLOT, Part, Slot, Structure, slots
from ..lower.torch import Tensors, compile_torch
from ..paints import BASE, FLAT
from ..render.tensors import Group
from ..units import COLOR, FALLOFF, OPACITY, SMOOTHNESS, Placed
from .initialization import start_of
from .laying import Laid
from .levenberg import Numbers, Tick
from .surroundings import Surroundings

ellipses_of: Callable[..., Any] = deferred("sdf2vec.fit.regions", "ellipses")  # scikit-image

KEPT = 6  # starts of a kind in an opening that are trained
SAME = 1e-4  # part of an error by which two starts differ at least
BLURS, STEPS = (3.0, 1.0), 4  # sizes of a pixel in pixels, one after the other; steps with each
START_SMOOTHNESS = 0.003  # scene units
EAGER = 0.25  # how much an error matters where a first shape is not wanted: what is too much can be cut out
ARC, ROUNDED = "arc", "rounded_triangle"
LONGER = 1.2  # than wide: most kinds of shape at their start
SHARP_AND_WHITE = {OPACITY: 1.0, FALLOFF: 0.0, COLOR: 1.0}
FAINT = 1e-8  # of a squared change of the picture


class Mask(NamedTuple):
    """What a shape should cover: with its coverage c [P], errors are (strength·c − amount)², and the rest."""

    strength: torch.Tensor  # [P]
    amount: torch.Tensor  # [P]
    rest: float

    @property
    def gain(self) -> torch.Tensor:
        """By how much the error falls where all is covered, [P]."""
        return self.strength * (2.0 * self.amount - self.strength)

    @property
    def best_gain(self) -> torch.Tensor:
        """The same where as much is covered as is best, [P]."""
        covered = self.amount.clamp_min(0.0).minimum(self.strength)
        return covered * (2.0 * self.amount - covered)

    def only(self, share: torch.Tensor) -> Mask:
        """Such that an error at a point matters so much, [P]."""
        return Mask(self.strength * share, self.amount * share, self.rest)

    def eager(self) -> Mask:
        """Such that too much matters less."""
        return self.only(torch.where(self.gain > 0, 1.0, EAGER))


@dataclass(frozen=True, eq=False)
class Opening:
    """A place for one more shape: its number among the parts, its join, its colour [1, 3], what it should cover."""

    layer: Group  # without the shape
    index: int
    join: str
    color: torch.Tensor
    mask: Mask

    def part(self, kind: str, paint: str) -> Part:
        """What is put there."""
        adds = not self.join or JOINS[self.join].adds
        return Part(kind, paint if adds else FLAT, self.join)

    def structure(self, part: Part) -> Structure:
        """The layer's with the part."""
        parts = self.layer.structure
        return (*parts[: self.index], part, *parts[self.index :])

    def filled(self, part: Part, shape: dict[str, torch.Tensor]) -> Group:
        """The layer with a part whose shape's numbers are given by name, [1, width] each."""
        values = {}
        here = Placed(torch.zeros(1, 2), torch.ones(1), torch.zeros(1))
        looks = {SMOOTHNESS.name: torch.full((1, 1), START_SMOOTHNESS), COLOR.name: self.color}
        for slot in slots(self.structure(part)):
            if slot.part == self.index:
                own = shape.get(slot.parameter.name)
                values[slot] = start_of(slot.parameter, here, looks) if own is None else own
            else:
                values[slot] = self.layer.values[_closed_up(slot, self.index)]
        return Group(self.structure(part), self.layer.order, values)


class Tried(NamedTuple):
    """A layer and its error."""

    layer: Group
    error: float


# --- openings ------------------------------------------------------------------------------------------------


def openings(layer: Group, around: Surroundings) -> Iterator[Opening]:
    """Where a shape can be joined to a layer, and where one can take another's place."""
    parts, base = layer.structure, layer.of(BASE.name, 0)
    for join, kind_of_join in JOINS.items():
        for index in range(1, len(parts) + 1):
            next_is_alike = index < len(parts) and parts[index].adds == kind_of_join.adds
            if not next_is_alike:  # else the next place is the same
                yield _opening(layer, index, join, base, around)
    yield from (in_place_of(layer, index, around) for index in range(len(parts)))


def in_place_of(layer: Group, index: int, around: Surroundings) -> Opening:
    """Where another shape can take the place of one of a layer."""
    part = layer.structure[index]
    color = layer.of(BASE.name, index if part.adds else 0)
    return _opening(without(layer, index), index, part.join, color, around)


def cut_from(layer: Group, around: Surroundings) -> Opening:
    """Where a shape can be cut out of a layer as it is."""
    return _opening(layer, len(layer.structure), SUBTRACTION, layer.of(BASE.name, 0), around)


def reductions(layer: Group) -> Iterator[Group]:
    """A layer without each of its parts, where another is left to begin with."""
    for index in range(len(layer.structure)):
        fewer = without(layer, index)
        if fewer.structure and fewer.structure[0].adds:
            first = fewer.structure[0]._replace(join="")
            values = {slot: v for slot, v in fewer.values.items() if slot != Slot(0, JOIN)}
            yield Group((first, *fewer.structure[1:]), fewer.order, values)


def joined_sharply(layer: Group) -> Group:
    """A layer whose shapes are joined without smoothness."""
    sharp = {
        slot: torch.zeros_like(tensor) for slot, tensor in layer.values.items() if slot.parameter is JOIN
    }
    return replace(layer, values={**layer.values, **sharp})


def without(layer: Group, index: int) -> Group:
    """A layer without one of its parts; the next one is not made the first."""
    parts = layer.structure
    values = {_closed_up(slot, index): tensor for slot, tensor in layer.values.items() if slot.part != index}
    return Group((*parts[:index], *parts[index + 1 :]), layer.order, values)


def _closed_up(slot: Slot, index: int) -> Slot:
    """Where the slot of another part is when the part of this number is gone."""
    if slot.part is None or slot.part < index:
        return slot
    return Slot(slot.part - 1, slot.parameter)


def alone(order: torch.Tensor, color: torch.Tensor, falloff: float, around: Surroundings) -> list[Opening]:
    """Where a layer begins anew in a colour [1, 3]: so that no more is covered than wanted, or all that is."""
    looks = {OPACITY_SLOT: torch.ones(1, 1), FALLOFF_SLOT: torch.full((1, 1), falloff)}
    near = _opening(Group((), order, looks), 0, "", color, around)
    return [near, Opening(near.layer, 0, "", color, near.mask.eager())]


def _opening(layer: Group, index: int, join: str, color: torch.Tensor, around: Surroundings) -> Opening:
    covers = [own_cover(layer, part, around) for part in range(len(layer.structure))]
    joins = [part.join for part in layer.structure]
    nothing, everything = (torch.full_like(around.points[0], end) for end in (0.0, 1.0))
    ends = [
        _joined([*joins[:index], join, *joins[index:]], [*covers[:index], end, *covers[index:]])
        for end in (nothing, everything)
    ]
    opacity = layer.opacity
    low, high = (around.wrong_with(end[None], color[..., None], opacity)[0] for end in ends)
    return Opening(layer, index, join, color, _mask(low, high))


def _mask(low: torch.Tensor, high: torch.Tensor) -> Mask:
    """From what is wrong [C, P] with nothing and with all covered."""
    change = high - low
    strength = change.square().mean(0).clamp_min(FAINT).sqrt()
    amount = -(change * low).mean(0) / strength
    return Mask(strength, amount, float((low.square().mean(0) - amount.square()).mean()))


def own_cover(layer: Group, index: int, around: Surroundings) -> torch.Tensor:
    """Coverage [P] of one part of a layer alone."""
    own = single(layer, index, Part(layer.structure[index].kind))
    return around.covers(own.structure, own.rows())[0]


def single(layer: Group, index: int, part: Part) -> Group:
    """One part of a layer as a layer of its own; black where it has no colour."""
    values = {}
    for slot in slots((part,)):
        place = slot if slot.part is None else Slot(index, slot.parameter)
        values[slot] = layer.values.get(place, torch.zeros(1, slot.parameter.width))
    return Group((part,), layer.order, values)


def _joined(joins: Sequence[str], covers: Sequence[torch.Tensor]) -> torch.Tensor:
    """Coverage [P] of parts together, from that of each: joined as if distances, sharply."""
    found = covers[0]
    for join, cover in zip(joins[1:], covers[1:], strict=True):
        found = 0.5 - _join(join)(0.5 - found, 0.5 - cover)[0]
    return found


@cache
def _join(join: str) -> Callable[..., Tensors]:
    """The distance that two distances make together."""
    distances = var("a"), var("b")
    a, b = (vec4(vec3(0.0), distance) for distance in distances)
    return compile_torch([JOINS[join].formula(a, b, const(SHARPEST)).w], distances)


# --- shapes for them -------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Proposer:
    """What shapes are made of and kept in: kinds, a paint, what randomness comes from, what numbers may be."""

    kinds: tuple[str, ...]
    paint: str
    generator: torch.Generator
    numbers: Callable[[Structure, Callable[[Slot], bool]], Numbers]
    tick: Tick

    def without(self, kind: str) -> Proposer:
        """The same for all other kinds, if there are any."""
        return replace(self, kinds=tuple(each for each in self.kinds if each != kind) or self.kinds)

    def candidates(self, places: Sequence[Opening], around: Surroundings) -> list[list[Tried]]:
        """For each opening a layer with the best shape of every kind in it; errors are estimates."""
        starts = [self.placed(place.mask.gain, around) for place in places]
        used = [index for index, placed in enumerate(starts) if len(placed.sizes)]
        found: list[list[Tried]] = [[] for _ in places]
        for kind in self.kinds if used else ():
            fitted = self._fitted(kind, [places[i].mask for i in used], [starts[i] for i in used], around)
            for index, (row, error) in zip(used, fitted, strict=True):
                place = places[index]
                layer = place.filled(place.part(kind, self.paint), _shape(kind, row))
                found[index].append(Tried(layer, error + place.mask.rest))
        return found

    def optima(
        self,
        kind: str,
        places: Sequence[Opening],
        starts: Sequence[Placed],
        around: Surroundings,
        kept: int,
    ) -> list[tuple[int, Group]]:
        """All that shapes of a kind come to from each opening's starts, with the opening, which has so many."""
        used = [index for index, start in enumerate(starts) if len(start.sizes)]
        if not used:
            return []
        masks, placed = [places[i].mask for i in used], [starts[i] for i in used]
        rows, _, counts = self._descended(kind, masks, placed, around, kept)
        spread = [index for index, count in zip(used, counts, strict=True) for _ in range(count)]
        part = places[0].part(kind, self.paint)
        return [
            (index, places[index].filled(part, _shape(kind, row)))
            for index, row in zip(spread, rows, strict=True)
        ]

    def sharpened(self, layer: Group, mask: Mask, around: Surroundings, steps: int) -> Group:
        """A layer after some steps of its outline towards a mask."""
        structure = layer.structure
        every = slots(structure)
        values = [
            torch.full_like(layer.values[slot], SHARP_AND_WHITE[slot.parameter.unit])
            if slot.parameter.unit in SHARP_AND_WHITE
            else layer.values[slot]
            for slot in every
        ]
        rows, numbers = torch.cat(values, dim=1), self.numbers(structure, _is_geometry)
        misses = _misses(structure, [mask], around)
        for blur in BLURS:
            rows, _ = misses.blurred(blur).descended(rows, numbers, steps, self.tick)
        moved = zip(every, rows.split([slot.parameter.width for slot in every], dim=1), strict=True)
        outline = {slot: tensor for slot, tensor in moved if _is_geometry(slot)}
        return replace(layer, values={**layer.values, **outline})

    def _fitted(
        self, kind: str, masks: Sequence[Mask], starts: Sequence[Placed], around: Surroundings
    ) -> list[tuple[torch.Tensor, float]]:
        """For each mask the row [U] of the layer of one shape that comes nearest to it, and its squared error."""
        rows, errors, counts = self._descended(kind, masks, starts, around, KEPT)
        return [
            (own[errors.argmin()], float(errors.min()))
            for own, errors in zip(rows.split(counts), errors.split(counts), strict=True)
        ]

    def _descended(
        self,
        kind: str,
        masks: Sequence[Mask],
        placed: Sequence[Placed],
        around: Surroundings,
        kept: int,
    ) -> tuple[torch.Tensor, torch.Tensor, list[int]]:
        """Rows [N, U] of layers of one shape, their squared errors [N], and how many belong to each mask."""
        structure = (Part(kind),)
        misses = _misses(structure, masks, around)
        fresh = [_rows(structure, each) for each in placed]
        missed = misses.of_each(_whose(fresh)).blurred(BLURS[0]).errors(torch.cat(fresh))
        errors = torch.from_numpy(missed).split([len(rows) for rows in fresh])
        best = [rows[_distinct(own)[:kept]] for rows, own in zip(fresh, errors, strict=True)]
        misses, rows = misses.of_each(_whose(best)), torch.cat(best)
        numbers = self.numbers(structure, _is_geometry)
        for blur in BLURS:
            rows, found = misses.blurred(blur).descended(rows, numbers, STEPS, self.tick)
        return rows, found, [len(own) for own in best]

    def placed(self, gain: torch.Tensor, around: Surroundings) -> Placed:
        """Where shapes start: along each region of what is wanted [P], the other way round, and turned at random."""
        pixel = around.points[2]
        found = torch.tensor(ellipses_of(around.plane(gain))).reshape(-1, 5)
        centers = around.places(found[:, :2] - 0.5)
        sizes = (found[:, 2] * found[:, 3]).sqrt() * pixel
        longer = (found[:, 2] / found[:, 3]).sqrt() / LONGER**0.5
        stretches = torch.stack([longer, 1.0 / longer], dim=1)
        turns = torch.rand(len(found), generator=self.generator) * 2 * torch.pi
        return Placed(
            centers.repeat(3, 1),
            sizes.repeat(3),
            torch.cat([found[:, 4], found[:, 4] + torch.pi, turns]),
            torch.cat([stretches, stretches, torch.ones_like(stretches)]),
        )


def _distinct(errors: torch.Tensor) -> torch.Tensor:
    """Places [K] of errors [N] from the least up, of equal ones but one: a start that is turned to no effect."""
    ranked, order = errors.sort(stable=True)
    return order[torch.cat([torch.ones(1, dtype=torch.bool), ranked.diff() > SAME * ranked[1:]])]


def _is_geometry(slot: Slot) -> bool:
    return slot.part is not None and slot.parameter.unit is not COLOR


def _shape(kind: str, row: torch.Tensor) -> dict[str, torch.Tensor]:
    """The numbers of a layer's only shape by name, [1, width] each, from the layer's row [U]."""
    every = slots((Part(kind),))
    values = row[None].split([slot.parameter.width for slot in every], dim=1)
    return {slot.parameter.name: v for slot, v in zip(every, values, strict=True) if _is_geometry(slot)}


def _rows(structure: Structure, placed: Placed) -> torch.Tensor:
    """Sharp opaque layers of one white shape at some places, [N, U]."""
    count = len(placed.sizes)
    looks = {
        unit.name: torch.full((count, width), SHARP_AND_WHITE[unit])
        for unit, width in ((OPACITY, 1), (FALLOFF, 1), (COLOR, 3))
    }
    return torch.cat([start_of(slot.parameter, placed, looks) for slot in slots(structure)], dim=1)


def _whose(rows: Sequence[torch.Tensor]) -> IntArray:
    """For each row of several [N, U] the number of those that it is one of."""
    return np.repeat(np.arange(len(rows), dtype=np.int64), [len(own) for own in rows])


def _misses(structure: Structure, masks: Sequence[Mask], around: Surroundings) -> Laid:
    """How far the coverage of layers of white shapes is from each mask."""
    strengths = torch.stack([mask.strength for mask in masks])[:, None]
    amounts = torch.stack([mask.amount for mask in masks])[:, None]
    nothing = torch.zeros(1, around.blocks.points)
    return Laid.of(structure, around.scene.compositing, around.blocks, nothing, strengths, amounts)

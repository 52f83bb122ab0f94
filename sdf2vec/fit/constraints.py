"""What a shape may become during a fit: ranges that keep it visible, on the canvas, and no sliver."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import cache, lru_cache
from itertools import accumulate
from typing import NamedTuple

import numpy as np
import torch

from ..arrays import Float32Array, Float64Array, IntArray
from ..blend import COMPOSITING
from ..graph import gradient, scalarize
from ..layer import Structure, slots
from ..lower.numpy import Arrays, compile_numpy
from ..lower.torch import Tensors, compile_torch
from ..render.tensors import Group, SceneTensors
from ..shapes import KINDS
from ..units import BACKGROUND, LENGTH, LONGEST, Room
from .descent_kernels import hold_rows

ALMOST = 0.999  # of the most that a number may be: there it still changes something
NEWTON_STEPS = 6  # towards the least thickness, at most
ENOUGH = 1.0001  # times the least thickness is aimed at: rounding must not leave a shape just below it
FLAT = 0.1  # squared derivative of a thickness, which is 1 and more unless the shape is next to a point
GOLDEN = 2.39996  # radians; multiples of it never meet


@torch.no_grad()
def project(tensors: SceneTensors, pixel: float, falloff: tuple[float, float] = (0.0, LONGEST)) -> None:
    """Moves every value into its range, in place; `pixel` is the size of a pixel of the picture in scene units."""
    room = room_of(tensors, pixel, falloff)
    for group in tensors.groups:
        project_group(group, room)
    BACKGROUND.project(tensors.background, False, room)
    tensors.background.clamp_(max=tensors.background[3].clone())  # premultiplied


def room_of(tensors: SceneTensors, pixel: float, falloff: tuple[float, float] = (0.0, LONGEST)) -> Room:
    """What the ranges of a scene's numbers depend on."""
    return Room(tensors.size, pixel, falloff, COMPOSITING[tensors.compositing].signed)


def least_length(tensors: SceneTensors, pixel: float) -> float:
    """The least that lengths of a scene may be, in scene units: a pixel, or half where it has one that is less. What is
    not even a pixel wide covers more of it in a render than it does.
    """
    return 0.5 * pixel if count_shorter(tensors, pixel) else pixel


def count_shorter(tensors: SceneTensors, length: float) -> int:
    """How many layers of a scene have a length, of those that must be positive, that is less."""
    return sum(int(_has_shorter(group, length).sum()) for group in tensors.groups)


def _has_shorter(group: Group, length: float) -> torch.Tensor:
    found = torch.zeros(len(group), dtype=torch.bool)
    for slot, values in group.values.items():
        if slot.parameter.unit is LENGTH and slot.parameter.positive:
            found |= (values < length).any(1).cpu()
    return found


def project_group(group: Group, room: Room) -> None:
    """Moves the values of some layers into their range, in place."""
    for slot, values in group.values.items():
        slot.parameter.unit.project(values, slot.parameter.positive, room)
    for index, part in enumerate(group.structure):
        for name, other in KINDS[part.kind].at_most:  # where it changes nothing, nothing would move it
            group.of(name, index).clamp_(max=ALMOST * group.of(other, index).amin(1, keepdim=True))


class Ranges(NamedTuple):
    """What the numbers of rows [G, U] may be: the same for a whole row at a time, which is in memory.

    `low` and `high` [U]; `period` [U] of what is a remainder, else 0; whether a 0 may `rest` [U]. The number
    `capped[k, 0]` is at most a share, `shares[k]`, of the least of those from `capped[k, 1]` to before `capped[k, 2]`.
    """

    low: Float32Array
    high: Float32Array
    period: Float32Array
    rests: IntArray
    capped: IntArray
    shares: Float32Array

    @classmethod
    def joined(cls, parts: Sequence[Ranges]) -> Ranges:
        """Those of rows one after the other in one."""
        starts = accumulate((len(part.low) for part in parts), initial=0)
        capped = [part.capped + start for part, start in zip(parts, starts, strict=False)]
        low, high, period, rests, _, shares = map(np.concatenate, zip(*parts, strict=True))
        return cls(low, high, period, rests, np.concatenate(capped), shares)

    def hold(self, rows: torch.Tensor) -> None:
        """Moves all numbers into their range, in place."""
        hold_rows(rows.numpy(), *self)


@lru_cache(1024)
def ranges_of(structure: Structure, room: Room) -> Ranges:
    """Those of layers of a structure."""
    ends: list[tuple[float, float]] = []
    period, rests = [], []
    for slot in slots(structure):
        unit, width = slot.parameter.unit, slot.parameter.width
        within = unit.within(slot.parameter.positive, room)
        ends += within * (width // len(within))
        period += [unit.period] * width
        rests += [unit.rests] * width
    low, high = np.array(ends, np.float32).T.copy()
    return Ranges(low, high, np.array(period, np.float32), np.array(rests, np.int64), *_caps(structure))


def _caps(structure: Structure) -> tuple[IntArray, Float32Array]:
    """Which numbers of a structure's rows are at most a share of the least of which others, and the shares."""
    starts = accumulate((slot.parameter.width for slot in slots(structure)), initial=0)
    columns = {
        (slot.part, slot.parameter.name): (start, start + slot.parameter.width)
        for slot, start in zip(slots(structure), starts, strict=False)
    }
    capped = [
        (column, *columns[index, other])
        for index, part in enumerate(structure)
        for name, other in KINDS[part.kind].at_most  # where it changes nothing, nothing would move it
        for column in range(*columns[index, name])
    ]
    return np.array(capped, np.int64).reshape(-1, 3), np.full(len(capped), ALMOST, np.float32)


def ground_ranges(room: Room) -> Ranges:
    """Those of a ground, premultiplied: no channel of it is more than its alpha."""
    ((low, high),) = BACKGROUND.within(False, room)
    capped = np.array([(channel, 3, 4) for channel in range(3)], np.int64)
    least, most = np.full(4, low, np.float32), np.full(4, high, np.float32)
    return Ranges(least, most, np.zeros(4, np.float32), np.zeros(4, np.int64), capped, np.ones(3, np.float32))


@torch.no_grad()
def enforce_min_thickness(tensors: SceneTensors, least: float) -> None:
    """Makes shapes thinner than `least` (scene units) that thick, in place, by the shortest way."""
    for group in tensors.groups:
        for index, part in enumerate(group.structure):
            columns = group.shape(index)
            numbers = torch.stack(columns).cpu().numpy().astype(np.float64)
            if _thicken(part.kind, numbers, least):
                for column, moved in zip(columns, torch.from_numpy(numbers), strict=True):
                    column.copy_(moved)


def _thicken(kind: str, numbers: Float64Array, least: float) -> bool:
    """Newton steps of shapes [K, G] along the gradient of their thickness, in place; whether there was need."""
    for step in range(NEWTON_STEPS):
        thickness, *slopes = np.broadcast_arrays(*_thickness(kind)(*numbers))
        thin = thickness < least
        if not thin.any():
            return step > 0
        slope = np.square(slopes).sum(0)
        reach = (ENOUGH * least - thickness) / np.maximum(slope, FLAT)
        for index, grad in enumerate(slopes):
            away = least * math.cos(GOLDEN * index)  # a point may grow in any way
            numbers[index] += np.where(thin, np.where(slope < FLAT, away, grad * reach), 0.0)
    return True


def too_small(tensors: SceneTensors, least_area: float) -> torch.Tensor:
    """The mean over all shapes of max(0, 1 − area/least_area)²; areas in scene units squared."""
    areas = torch.cat([area for group in tensors.groups for area in areas_of(group)])
    return (1.0 - areas / least_area).clamp(min=0.0).square().mean()


def areas_of(group: Group) -> list[torch.Tensor]:
    """The areas of a group's shapes when sharp, one [G] for each part, in scene units squared."""
    return [_measures(part.kind)(*group.shape(index))[0] for index, part in enumerate(group.structure)]


def thicknesses_of(tensors: SceneTensors) -> list[torch.Tensor]:
    """The least widths of a scene's shapes, one [G] for each part of each group, in scene units."""
    return [
        _measures(part.kind)(*group.shape(index))[1]
        for group in tensors.groups
        for index, part in enumerate(group.structure)
    ]


@cache
def _thickness(kind: str) -> Callable[..., Arrays]:
    """The thickness of shapes and its derivatives by each of their numbers."""
    own, scalars = KINDS[kind], KINDS[kind].scalars()
    (thickness,) = scalarize(own.thickness(*own.variables()))
    return compile_numpy([thickness, *gradient(thickness, scalars)], scalars)


@cache
def _measures(kind: str) -> Callable[..., Tensors]:
    """Area and thickness of a shape from its numbers."""
    variables = KINDS[kind].variables()
    found = [KINDS[kind].area(*variables), KINDS[kind].thickness(*variables)]
    return compile_torch(found, KINDS[kind].scalars())

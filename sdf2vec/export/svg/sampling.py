"""Distance, coverage and colour of a layer at points: what every construction is measured against."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache, lru_cache
from typing import NamedTuple

import numpy as np
import torch

from ...arrays import Float64Array
from ...blend import OVER, coverage, reach, saturation
from ...expr import const, constant, var
from ...graph import components_of, scalarize, substitute
from ...layer import PIXEL, Formula, P, Structure, constant_row
from ...lower.torch import compile_torch
from ...scene import Layer, Shape
from ...shapes import KINDS
from ...threads import threads_of_its_own

CHUNK = 1 << 15  # points computed at a time
MANY = 16  # shapes of a layer for which compiling takes longest: all is asked for at once


class Box(NamedTuple):
    """A box in scene units."""

    left: float
    top: float
    right: float
    bottom: float

    def clipped(self, other: Box) -> Box:
        """What it has in common with another; `empty` where that is nothing."""
        low = (max(self.left, other.left), max(self.top, other.top))
        return Box(*low, min(self.right, other.right), min(self.bottom, other.bottom))

    def grown(self, margin: float) -> Box:
        return Box(self.left - margin, self.top - margin, self.right + margin, self.bottom + margin)

    @property
    def longest(self) -> float:
        return max(self.right - self.left, self.bottom - self.top)

    @property
    def empty(self) -> bool:
        return self.left >= self.right or self.top >= self.bottom


class SampleGrid(NamedTuple):
    """Centres of square cells: x [X], y [Y], `step` apart, in scene units."""

    x: Float64Array
    y: Float64Array
    step: float


def grid_over(box: Box, step: float) -> SampleGrid:
    """A grid that covers a box."""
    columns = max(1, math.ceil((box.right - box.left) / step))
    rows = max(1, math.ceil((box.bottom - box.top) / step))
    return SampleGrid(
        np.asarray(box.left + (np.arange(columns) + 0.5) * step, np.float64),
        np.asarray(box.top + (np.arange(rows) + 0.5) * step, np.float64),
        step,
    )


# --- the edge ----------------------------------------------------------------------------------------------


@cache
def edge_range() -> tuple[float, float]:
    """The distances in falloffs up to which coverage is 1 and from which on it is 0."""
    full, none = (bound(const(1.0), const(0.0)) for bound in (saturation, reach))
    return constant(full), constant(none)


def edge_profile(distance: Float64Array) -> Float64Array:
    """Coverage by distance in falloffs: the curve that gradients follow."""
    (cover,) = _profile()(torch.as_tensor(distance))
    return np.asarray(cover.numpy())


@cache
def _profile() -> Callable[..., tuple[torch.Tensor, ...]]:
    distance = var("d")
    return compile_torch([coverage(distance, const(1.0), const(0.0))], [distance])


# --- a layer -----------------------------------------------------------------------------------------------


@lru_cache(maxsize=4096)  # asked again for each blur that is tried
def extent(layer: Layer, falloffs: float | None = None) -> Box:
    """A box that holds every point nearer to a layer than so many falloffs: all of its coverage by default."""
    formula = Formula(layer.structure, constant_row(layer.structure, layer.numbers))
    margin = formula.reach[0] if falloffs is None else const(layer.falloff * falloffs)
    left, top, right, bottom = (
        constant(substitute(side, {PIXEL: const(0.0)})) for side in formula.extent(margin)
    )
    return Box(left, top, right, bottom)


class ShapeFrame(NamedTuple):
    """The coordinates that a shape is painted in: their origin, the direction of x, half the size; scene units."""

    origin: Float64Array
    axis: Float64Array
    half: Float64Array


def frame_of(shape: Shape) -> ShapeFrame:
    """The frame of a shape."""
    kind = KINDS[shape.kind]
    row = [*shape.parameters]
    values = [p.constant([row.pop(0) for _ in range(p.width)]) for p in kind.parameters]
    frame = kind.frame(*values)
    parts = (frame.origin, frame.axis, frame.half)
    return ShapeFrame(*(np.array([constant(scalar) for scalar in scalarize(part)]) for part in parts))


def distances(layer: Layer, grid: SampleGrid) -> Float64Array:
    """Signed distances [Y, X] to a layer."""
    return np.asarray(_evaluate(layer, grid, 0.0, 1)[0])


def covers(layer: Layer, grid: SampleGrid, pixel: float) -> Float64Array:
    """Coverage [Y, X] of a layer for pixels of a size in scene units."""
    return np.asarray(_evaluate(layer, grid, pixel, 2)[1])


def cover_at(layer: Layer, places: Float64Array, pixel: float) -> Float64Array:
    """Coverage [N] of a layer at points [N, 2], for pixels of a size in scene units."""
    flat = [torch.tensor(value, dtype=torch.float64) for value in (pixel, *layer.numbers)]
    x, y = torch.from_numpy(np.ascontiguousarray(places)).T
    return np.asarray(_formula(layer.structure, 2)(x, y, *flat)[1].numpy())


def colors(layer: Layer, grid: SampleGrid) -> Float64Array:
    """The colour [3, Y, X] of a layer, which varies in a smooth union."""
    return _evaluate(layer, grid, 0.0, 5)[2:]


def _evaluate(layer: Layer, grid: SampleGrid, pixel: float, count: int) -> Float64Array:
    """The first `count` of distance, coverage, red, green, blue, at least: [count or more, Y, X]."""
    flat = [torch.tensor(value, dtype=torch.float64) for value in (pixel, *layer.numbers)]
    formula = _formula(layer.structure, 5 if len(layer.shapes) > MANY else count)
    columns = torch.from_numpy(grid.x)[None, :]
    chunks = torch.from_numpy(grid.y)[:, None].split(max(1, CHUNK // len(grid.x)))
    with threads_of_its_own():  # on such small pieces a second one mostly waits, for long when it has no core
        parts = [
            np.stack([part.expand(len(rows), len(grid.x)).numpy() for part in formula(columns, rows, *flat)])
            for rows in chunks
        ]
    return np.concatenate(parts, axis=1)


@cache
def _formula(structure: Structure, count: int) -> Callable[..., tuple[torch.Tensor, ...]]:
    formula = Formula.of(structure)
    wanted = [formula.distance, formula.cover(OVER), *scalarize(formula.color)][:count]
    return compile_torch(wanted, [*components_of(P), *formula.uniforms])

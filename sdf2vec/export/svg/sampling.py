"""Distance, coverage and colour of a layer at points: what every construction is measured against."""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import AbstractContextManager
from functools import cache
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...blend import coverage, reach, saturation, union_reach
from ...deferred import deferred
from ...expr import components_of, const, constant, scalarize, var
from ...scene import Layer
from ...shapes import KINDS
from ..constants import constants

if TYPE_CHECKING:
    import torch

Array = NDArray[np.float64]
CHUNK = 1 << 15  # points computed at a time

as_tensor: Callable[..., torch.Tensor] = deferred("torch", "as_tensor")
threads_of_its_own: Callable[[], AbstractContextManager[None]] = deferred(
    "sdf2vec.render.fused", "threads_of_its_own"
)
compile_torch: Callable[..., Callable[..., tuple[torch.Tensor, ...]]] = deferred(
    "sdf2vec.lower.torch", "compile_torch"
)
layer_kind = deferred("sdf2vec.render.kernels", "LayerKind")
layer_formula = deferred("sdf2vec.render.kernels", "Formula")


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

    x: Array
    y: Array
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


def edge_profile(distance: Array) -> Array:
    """Coverage by distance in falloffs: the curve that gradients follow."""
    (cover,) = _profile()(as_tensor(distance))
    return np.asarray(cover.numpy())


@cache
def _profile() -> Callable[..., tuple[torch.Tensor, ...]]:
    distance = var("d")
    return compile_torch([coverage(distance, const(1.0), const(0.0))], [distance])


# --- a layer -----------------------------------------------------------------------------------------------


def extent(layer: Layer, falloffs: float | None = None) -> Box:
    """A box that holds every point nearer to a layer than so many falloffs: all of its coverage by default."""
    margin = layer.falloff * (edge_range()[1] if falloffs is None else falloffs)
    farther = constant(union_reach(len(layer.shapes), const(layer.smoothness)))
    boxes = []
    for shape in layer.shapes:
        found = KINDS[shape.kind].extent(const(margin + farther), *constants(shape))
        boxes.append([constant(scalar) for scalar in scalarize(found)])
    lows, highs = np.array(boxes)[:, :2].min(axis=0), np.array(boxes)[:, 2:].max(axis=0)
    return Box(*lows.tolist(), *highs.tolist())


def distances(layer: Layer, grid: SampleGrid) -> Array:
    """Signed distances [Y, X] to a layer."""
    return np.asarray(_evaluate(layer, grid, 0.0, 1)[0])


def covers(layer: Layer, grid: SampleGrid, pixel: float) -> Array:
    """Coverage [Y, X] of a layer for pixels of a size in scene units."""
    return np.asarray(_evaluate(layer, grid, pixel, 2)[1])


def colors(layer: Layer, grid: SampleGrid) -> Array:
    """The colour [3, Y, X] of a layer, which varies in a smooth union."""
    return _evaluate(layer, grid, 0.0, 5)[2:]


def _evaluate(layer: Layer, grid: SampleGrid, pixel: float, count: int) -> Array:
    """The first `count` of distance, coverage, red, green, blue: [count, Y, X]."""
    numbers = [pixel, layer.falloff, layer.smoothness]
    for shape in layer.shapes:
        numbers += [*shape.parameters, *shape.color]
    flat = [as_tensor(np.float64(value)) for value in numbers]
    formula = _formula(layer.kind, len(layer.shapes), count)
    columns = as_tensor(grid.x)[None, :]
    chunks = as_tensor(grid.y)[:, None].split(max(1, CHUNK // len(grid.x)))
    with threads_of_its_own():  # on such small pieces a second one mostly waits, for long when it has no core
        parts = [
            np.stack([part.expand(len(rows), len(grid.x)).numpy() for part in formula(columns, rows, *flat)])
            for rows in chunks
        ]
    return np.concatenate(parts, axis=1)


@cache
def _formula(kind: str, union_size: int, count: int) -> Callable[..., tuple[torch.Tensor, ...]]:
    formula = layer_formula(layer_kind(kind, union_size))
    shapes = zip(formula.parameters, formula.colors, strict=True)
    numbers = [scalar for row, color in shapes for value in (*row, color) for scalar in components_of(value)]
    inputs = [*components_of(formula.point), formula.pixel, formula.falloff, formula.smoothness, *numbers]
    cover = coverage(formula.distance, formula.falloff, formula.pixel)
    return compile_torch([formula.distance, cover, *scalarize(formula.color)][:count], inputs)

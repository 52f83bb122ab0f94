"""Distance, coverage and colour of a layer at points: what every construction is measured against."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...blend import REACH, coverage
from ...expr import components_of, const, constant, scalarize
from ...scene import Layer
from ...shapes import KINDS
from ..constants import constants

if TYPE_CHECKING:
    import torch

Array = NDArray[np.float64]
CHUNK = 1 << 15  # points computed at a time


class Box(NamedTuple):
    """A box in scene units."""

    left: float
    top: float
    right: float
    bottom: float

    def clipped(self, other: Box) -> Box:
        """What it has in common with another; `empty` where that is nothing."""
        return Box(
            max(self.left, other.left),
            max(self.top, other.top),
            min(self.right, other.right),
            min(self.bottom, other.bottom),
        )

    def grown(self, margin: float) -> Box:
        return Box(self.left - margin, self.top - margin, self.right + margin, self.bottom + margin)

    @property
    def empty(self) -> bool:
        return self.left >= self.right or self.top >= self.bottom


class Grid(NamedTuple):
    """Centres of square cells: x [X], y [Y], `step` apart, in scene units."""

    x: Array
    y: Array
    step: float


def grid_over(box: Box, step: float) -> Grid:
    """A grid that covers a box."""
    columns = max(1, math.ceil((box.right - box.left) / step))
    rows = max(1, math.ceil((box.bottom - box.top) / step))
    return Grid(
        np.asarray(box.left + (np.arange(columns) + 0.5) * step, np.float64),
        np.asarray(box.top + (np.arange(rows) + 0.5) * step, np.float64),
        step,
    )


def extent(layer: Layer, falloffs: float = 0.5 + REACH) -> Box:
    """A box that holds every point nearer to a layer than so many falloffs: all of its coverage by default."""
    margin = falloffs * layer.falloff + layer.smoothness * math.log(len(layer.shapes))
    boxes = []
    for shape in layer.shapes:
        kind = KINDS[shape.kind]
        boxes.append([constant(s) for s in scalarize(kind.extent(const(margin), *constants(shape)))])
    lows, highs = np.array(boxes)[:, :2].min(axis=0), np.array(boxes)[:, 2:].max(axis=0)
    return Box(*lows.tolist(), *highs.tolist())


def distances(layer: Layer, grid: Grid) -> Array:
    """Signed distances [Y, X] to a layer."""
    return np.asarray(_evaluate(layer, grid, 0.0, 1)[0])


def covers(layer: Layer, grid: Grid, pixel: float) -> Array:
    """Coverage [Y, X] of a layer for pixels of a size in scene units."""
    return np.asarray(_evaluate(layer, grid, pixel, 2)[1])


def colors(layer: Layer, grid: Grid) -> Array:
    """The colour [3, Y, X] of a layer, which varies in a smooth union."""
    return _evaluate(layer, grid, 0.0, 5)[2:]


def _evaluate(layer: Layer, grid: Grid, pixel: float, count: int) -> Array:
    """The first `count` of distance, coverage, red, green, blue: [count, Y, X]."""
    import torch

    from ...render.fused import threads_of_its_own

    numbers = [pixel, layer.falloff, layer.smoothness]
    for shape in layer.shapes:
        numbers += [*shape.parameters, *shape.color]
    flat = [torch.tensor(value, dtype=torch.float64) for value in numbers]
    field = _formula(layer.kind, len(layer.shapes), count)
    columns = torch.from_numpy(grid.x)[None, :]
    chunks = torch.from_numpy(grid.y)[:, None].split(max(1, CHUNK // len(grid.x)))
    with threads_of_its_own():  # on such small pieces a second one mostly waits, for long when it has no core
        parts = [
            np.stack([part.expand(len(rows), len(grid.x)).numpy() for part in field(columns, rows, *flat)])
            for rows in chunks
        ]
    return np.concatenate(parts, axis=1)


@cache
def _formula(kind: str, union_size: int, count: int) -> Callable[..., tuple[torch.Tensor, ...]]:
    from ...lower.torch import compile_torch
    from ...render.kernels import Formula, LayerKind

    formula = Formula(LayerKind(kind, union_size))
    shapes = zip(formula.parameters, formula.colors, strict=True)
    numbers = [scalar for row, color in shapes for value in (*row, color) for scalar in components_of(value)]
    inputs = [*components_of(formula.point), formula.pixel, formula.falloff, formula.smoothness, *numbers]
    cover = coverage(formula.distance, formula.falloff, formula.pixel)
    return compile_torch([formula.distance, cover, *scalarize(formula.color)][:count], inputs)

"""Lists of the layers that each cell of a grid over the scene needs: what makes a shader of many shapes quick.

Coverage is exactly 0 beyond its reach and exactly 1 within its saturation, so leaving out what a cell can't see
changes nothing. Both depend on the size of a pixel; lists are made for `COARSEST`, and hold for all finer ones.
Cells at the border go on for ever outwards: the lists hold on a canvas of any shape.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np

from ..arrays import BoolArray, Float64Array, IntArray
from ..blend import COMPOSITING
from ..expr import var
from ..graph import components_of
from ..layer import Formula, P, Structure
from ..lower.numpy import Arrays, compile_numpy
from ..scene import Scene

COARSEST = 0.01  # scene units a pixel: lists hold where the picture's shortest side has 100 pixels or more
MARGIN = 1e-4  # cells: room for a shader's rounding where two cells meet


@dataclass(frozen=True)
class Grid:
    """Square cells over the scene, `per_unit` to a scene unit, from its corner `low`."""

    columns: int
    rows: int
    per_unit: float
    low: tuple[float, float]

    @property
    def cells(self) -> int:
        return self.columns * self.rows

    @property
    def high(self) -> tuple[float, float]:
        return self.low[0] + self.columns / self.per_unit, self.low[1] + self.rows / self.per_unit

    def middles(self) -> Float64Array:
        """The middle of each cell (its part within the scene), [cells, 2]."""
        x, y = np.meshgrid(np.arange(self.columns) + 0.5, np.arange(self.rows) + 0.5)
        return np.stack([x, y], axis=-1).reshape(-1, 2) / self.per_unit + self.low

    def regions(self) -> Float64Array:
        """What each cell covers, [cells, 4]: low x, low y, high x, high y; endless at the border."""
        x, y = self._edges(self.columns), self._edges(self.rows)
        x, y = x / self.per_unit + self.low[0], y / self.per_unit + self.low[1]
        lows = np.stack(np.meshgrid(x[0], y[0]), axis=-1).reshape(-1, 2)
        highs = np.stack(np.meshgrid(x[1], y[1]), axis=-1).reshape(-1, 2)
        return np.concatenate([lows, highs], axis=1)

    @staticmethod
    def _edges(count: int) -> Float64Array:
        """Lower and upper edges of the cells along one side, [2, count], in cells."""
        places = np.arange(count + 1, dtype=np.float64)
        low, high = places[:-1] - MARGIN, places[1:] + MARGIN
        low[0], high[-1] = -np.inf, np.inf
        return np.stack([low, high])


@dataclass(frozen=True, eq=False)
class Tiles:
    """`entries[starts[t]:starts[t + 1]]` are the layers of cell t (row by row), in draw order."""

    grid: Grid
    starts: IntArray  # [cells + 1]
    entries: IntArray  # [E]

    @property
    def depth(self) -> float:
        """Layers in a cell, on average."""
        return len(self.entries) / self.grid.cells


@dataclass(frozen=True, eq=False)
class Bounds:
    """Of every layer, in draw order: a box that holds its coverage, and within which distances it is 0 and 1."""

    boxes: Float64Array  # [L, 4]
    outer: Float64Array  # [L]
    inner: Float64Array  # [L]
    slopes: Float64Array  # [L]


def scene_grid(scene: Scene, across: int) -> Grid:
    """A grid with `across` cells along the shortest side."""
    width, height = scene.extent
    columns, rows = (max(1, int(np.ceil(side * across - 1e-9))) for side in (width, height))
    return Grid(columns, rows, float(across), (-0.5 * width, -0.5 * height))


def bin_layers(scene: Scene, grids: Sequence[Grid], slack: float = 0.0) -> list[Tiles]:
    """The layers that each cell of each grid needs; `slack` is how far edges may move, in scene units.

    Layers below one that hides them in the whole of a cell are left out there.
    """
    if not scene.layers:
        return [Tiles(grid, np.zeros(grid.cells + 1, np.int64), np.zeros(0, np.int64)) for grid in grids]
    bounds = layer_bounds(scene, slack)
    return [_binned(scene, grid, bounds) for grid in grids]


def _binned(scene: Scene, grid: Grid, bounds: Bounds) -> Tiles:
    regions = grid.regions()
    layers, cells = np.nonzero(_overlap(bounds.boxes, regions))  # by layer, so in draw order within each cell
    bounded: BoolArray = np.all(np.isfinite(regions), axis=1)[cells]
    leaves: BoolArray = np.any(bounds.boxes[:, :2] < np.array(grid.low), axis=1) | np.any(
        bounds.boxes[:, 2:] > np.array(grid.high), axis=1
    )
    distances = layer_distances(scene, layers, grid.middles()[cells])
    around = bounds.slopes[layers] * (0.5 + MARGIN) * 2.0**0.5 / grid.per_unit
    seen = (distances - around < bounds.outer[layers]) | (~bounded & leaves[layers])
    hiding = COMPOSITING[scene.compositing].hides
    opaque = np.array([hiding and layer.opacity == 1.0 for layer in scene.layers])
    hides = bounded & opaque[layers] & (distances + around < bounds.inner[layers])
    lowest = np.zeros(grid.cells, np.int64)
    np.maximum.at(lowest, cells[hides], layers[hides])
    kept = seen & (layers >= lowest[cells])
    layers, cells = layers[kept], cells[kept]
    starts = np.concatenate([[0], np.cumsum(np.bincount(cells, minlength=grid.cells))])
    return Tiles(grid, starts, layers[np.argsort(cells, kind="stable")])


def _overlap(boxes: Float64Array, regions: Float64Array) -> BoolArray:
    """Which boxes [L, 4] and regions [T, 4] meet, [L, T]."""
    low, high = boxes[:, None, :2], boxes[:, None, 2:]
    flags: BoolArray = np.all((low <= regions[None, :, 2:]) & (high >= regions[None, :, :2]), axis=2)
    return flags


def layer_bounds(scene: Scene, slack: float = 0.0) -> Bounds:
    """The bounds of all layers for pixels of at most `COARSEST`."""
    values = np.zeros((len(scene.layers), 7))
    for structure, places, rows in _groups(scene):
        measured = _measure(structure)(*rows, slack)
        values[places] = np.stack([np.broadcast_to(v, len(places)) for v in measured], axis=1)
    return Bounds(values[:, :4], values[:, 4], values[:, 5], values[:, 6])


def layer_distances(scene: Scene, layers: IntArray, points: Float64Array) -> Float64Array:
    """Distance of layer layers[i] at points[i]; [P], [P, 2] → [P]."""
    distances = np.zeros(len(layers))
    for structure, places, rows in _groups(scene):
        row_of = np.full(len(scene.layers), -1)
        row_of[places] = np.arange(len(places))
        wanted = np.nonzero(row_of[layers] >= 0)[0]
        chosen, (x, y) = row_of[layers[wanted]], points[wanted].T
        (distances[wanted],) = _distance(structure)(x, y, *(row[chosen] for row in rows))
    return distances


def _groups(scene: Scene) -> Iterator[tuple[Structure, IntArray, list[Float64Array]]]:
    """The layers of each structure: their places [G], and arrays [G] of what `Formula.uniforms` says."""
    members: dict[Structure, list[int]] = defaultdict(list)
    for index, layer in enumerate(scene.layers):
        members[layer.structure].append(index)
    for structure, places in members.items():
        rows = np.array([[COARSEST, *scene.layers[place].numbers] for place in places])
        yield structure, np.array(places), list(rows.T)


@cache
def _measure(structure: Structure) -> Callable[..., Arrays]:
    """Box, outer and inner distance and slope of a layer from its uniforms and the slack."""
    formula, slack = Formula.of(structure), var("slack")
    return compile_numpy(formula.bounds(slack), [*formula.uniforms, slack])


@cache
def _distance(structure: Structure) -> Callable[..., Arrays]:
    formula = Formula.of(structure)
    return compile_numpy([formula.distance], [*components_of(P), *formula.uniforms])

"""Distance, coverage and colour of a layer at points: what every construction is measured against."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache
from typing import NamedTuple

import numpy as np

from ...arrays import Float64Array
from ...blend import OVER, coverage, pixel_size, reach, saturation, scene_point
from ...expr import const, constant, var
from ...graph import components_of, scalarize
from ...layer import Formula, P, Structure
from ...lower.numpy import Arrays, compile_numpy
from ...operation import VEC2
from ...scene import Layer, Scene, Shape
from ...shapes import KINDS

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

    def places_in(self, box: Box) -> tuple[slice, slice]:
        """Which rows and columns have their centres in a box."""
        bottom, right = np.searchsorted(self.y, box.bottom), np.searchsorted(self.x, box.right)
        return slice(np.searchsorted(self.y, box.top), bottom), slice(
            np.searchsorted(self.x, box.left), right
        )

    def part(self, rows: slice, columns: slice) -> SampleGrid:
        """The cells of some rows and columns."""
        return SampleGrid(self.x[columns], self.y[rows], self.step)


def grid_over(box: Box, step: float) -> SampleGrid:
    """A grid that covers a box."""
    columns = max(1, math.ceil((box.right - box.left) / step))
    rows = max(1, math.ceil((box.bottom - box.top) / step))
    return SampleGrid(
        np.asarray(box.left + (np.arange(columns) + 0.5) * step, np.float64),
        np.asarray(box.top + (np.arange(rows) + 0.5) * step, np.float64),
        step,
    )


def canvas_grid(scene: Scene, width: int, height: int) -> SampleGrid:
    """The pixels of a scene's render."""
    columns, rows = np.arange(width) + 0.5, np.arange(height) + 0.5
    x, _, step = _canvas()(columns, 0.0, width, height, *scene.extent)
    _, y, _ = _canvas()(0.0, rows, width, height, *scene.extent)
    return SampleGrid(x, y, float(step))


@cache
def _canvas() -> Callable[..., Arrays]:
    pixel, resolution, size = var("pixel", VEC2), var("resolution", VEC2), var("size", VEC2)
    inputs = [scalar for vector in (pixel, resolution, size) for scalar in components_of(vector)]
    return compile_numpy([scene_point(pixel, resolution, size), pixel_size(resolution, size)], inputs)


# --- the edge ----------------------------------------------------------------------------------------------


@cache
def edge_range() -> tuple[float, float]:
    """The distances in falloffs up to which coverage is 1 and from which on it is 0."""
    full, none = (bound(const(1.0), const(0.0)) for bound in (saturation, reach))
    return constant(full), constant(none)


def edge_profile(distance: Float64Array) -> Float64Array:
    """Coverage by distance in falloffs: the curve that gradients follow."""
    return _profile()(distance)[0]


@cache
def _profile() -> Callable[..., Arrays]:
    distance = var("d")
    return compile_numpy([coverage(distance, const(1.0), const(0.0))], [distance])


# --- a layer -----------------------------------------------------------------------------------------------


def extent(layer: Layer, pixel: float = 0.0) -> Box:
    """A box that holds every point where a layer has coverage, for pixels of a size in scene units."""
    return Box(*map(float, _extent(layer.structure)(pixel, *layer.numbers)))


@cache
def _extent(structure: Structure) -> Callable[..., Arrays]:
    formula = Formula.of(structure)
    return compile_numpy(formula.extent(formula.reach[0]), formula.uniforms)


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


def distance_of(layer: Layer, places: Float64Array) -> Float64Array:
    """Signed distances [N] from a layer of points [N, 2]."""
    found = _formula(layer.structure, 1)(*places.T, 0.0, *layer.numbers)[0]
    return np.asarray(np.broadcast_to(found, len(places)), np.float64)


def covers(layer: Layer, grid: SampleGrid, pixel: float) -> Float64Array:
    """Coverage [Y, X] of a layer for pixels of a size in scene units."""
    return np.asarray(_evaluate(layer, grid, pixel, 2)[1])


def cover_at(layer: Layer, places: Float64Array, pixel: float) -> Float64Array:
    """Coverage [N] of a layer at points [N, 2], for pixels of a size in scene units."""
    return _formula(layer.structure, 2)(*places.T, pixel, *layer.numbers)[1]


def colors(layer: Layer, grid: SampleGrid) -> Float64Array:
    """The colour [3, Y, X] of a layer, which varies in a smooth union."""
    return _evaluate(layer, grid, 0.0, 5)[2:]


def _evaluate(layer: Layer, grid: SampleGrid, pixel: float, count: int) -> Float64Array:
    """The first `count` of distance, coverage, red, green, blue, at least: [count or more, Y, X]."""
    formula = _formula(layer.structure, 5 if len(layer.shapes) > MANY else count)
    rows = max(1, CHUNK // len(grid.x))
    parts = []
    for first in range(0, len(grid.y), rows):
        y = grid.y[first : first + rows, None]
        found = formula(grid.x, y, pixel, *layer.numbers)
        parts.append(np.stack([np.broadcast_to(part, (len(y), len(grid.x))) for part in found]))
    return np.concatenate(parts, axis=1)


@cache
def _formula(structure: Structure, count: int) -> Callable[..., Arrays]:
    formula = Formula.of(structure)
    wanted = [formula.distance, formula.cover(OVER), *scalarize(formula.color)][:count]
    return compile_numpy(wanted, [*components_of(P), *formula.uniforms])

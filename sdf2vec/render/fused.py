"""The fused renderer on the CPU: culled to tiles, forward and backward in generated kernels, many threads.

The same function as `reference`, in float32, and what fitting uses. Nothing of size layers × pixels is stored:
every 16 × 16 tile holds what its own layers need while it is being computed. The result does not depend on the
number of threads.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from torch.autograd.function import once_differentiable

from ..arrays import Float32Array, Int32Array, IntArray
from ..blend import COMPOSITING
from ..kernel_cache import Entry
from ..layer import Structure
from ..threads import in_threads, threads
from . import kernels, tiling
from .reference import canvas_axes
from .tensors import Group, SceneTensors
from .tiling import PIXELS, TILE


def composite(tensors: SceneTensors, width: int, height: int, channels: int = 4) -> torch.Tensor:
    """Premultiplied RGBA (or RGB, for 3 channels) before clamping, [channels, height, width], float32.

    Differentiable in every tensor of the scene.
    """
    if not tensors.groups:
        return tensors.background[:channels, None, None].expand(channels, height, width)
    canvas, rows = _canvas(tensors, width, height, channels)
    image: torch.Tensor = _Composite.apply(canvas, rows, tensors.background)
    return image


def _canvas(tensors: SceneTensors, width: int, height: int, channels: int) -> tuple[_Canvas, torch.Tensor]:
    """What a render needs, and the layers' rows of numbers in draw order."""
    axes = canvas_axes(tensors.size, -(-width // TILE) * TILE, -(-height // TILE) * TILE, width, height)
    structures = structures_of(tensors)
    _, index, rows = drawn_rows(tensors, float(axes[2]))
    hides = COMPOSITING[tensors.compositing].hides
    draws = [kernels.drawing(structure, tensors.compositing, channels) for structure in structures]
    measures = kernels.addresses([kernels.measuring(structure) for structure in structures])
    canvas = _Canvas(measures, draws, index, channels, width, height, *axes, hides=hides)
    return canvas, rows


def drawn_rows(tensors: SceneTensors, pixel: float) -> tuple[IntArray, IntArray, torch.Tensor]:
    """For each place in the draw order, its layer's: place when the groups follow each other, group, row of numbers."""
    order = torch.cat([group.order for group in tensors.groups]).argsort()
    groups = np.repeat(np.arange(len(tensors.groups)), list(map(len, tensors.groups)))[order.numpy()]
    return order.numpy(), groups, rows_of(tensors.groups, pixel)[order]


def structures_of(tensors: SceneTensors) -> tuple[Structure, ...]:
    """The structure of each group's layers."""
    return tuple(group.structure for group in tensors.groups)


def is_compiled(tensors: SceneTensors, channels: int) -> bool:
    """Whether the kernels for this scene are there; if not, the first render takes some seconds."""
    return not tensors.groups or kernels.is_compiled(structures_of(tensors), tensors.compositing, channels)


def bins_of(tensors: SceneTensors, width: int, height: int) -> Bins:
    """Which layers touch each tile of a canvas of this size."""
    canvas, rows = _canvas(tensors, width, height, 3)
    return _bin(canvas, _array(rows))


def extents_of(tensors: SceneTensors, width: int, height: int) -> tuple[torch.Tensor, torch.Tensor]:
    """The corners [L, 2] of the boxes outside of which the layers cover nothing, in scene units."""
    canvas, rows = _canvas(tensors, width, height, 3)
    boxes = torch.from_numpy(_bounds(canvas, _array(rows))[:, :4])
    return boxes[:, :2], boxes[:, 2:]


def rows_of(groups: list[Group], pixel: float) -> torch.Tensor:
    """One row of numbers a layer, [L, widest]: `layer.Formula.uniforms`."""
    rows = [uniform_rows(group, pixel) for group in groups]
    widest = max(row.shape[1] for row in rows)
    return torch.cat([torch.nn.functional.pad(row, (0, widest - row.shape[1])) for row in rows])


def uniform_rows(group: Group, pixel: float) -> torch.Tensor:
    """One row of numbers for each layer of a group, [G, U]: `layer.Formula.uniforms`."""
    return torch.cat([torch.full_like(group.opacity, pixel), *group.values.values()], dim=1)


@dataclass(frozen=True, eq=False)
class _Canvas:
    """What a render needs besides the numbers of the scene."""

    measures: IntArray  # where the entries of each structure are
    draws: Sequence[tuple[Entry, ...]]  # of each structure; compiled when something is drawn
    kinds: IntArray  # [L]
    channels: int
    width: int
    height: int
    x: Float32Array  # of the pixel centres, padded to whole tiles
    y: Float32Array
    pixel: np.float32
    hides: bool  # an opaque layer hides what is below it

    @property
    def columns(self) -> int:
        return len(self.x) // TILE

    @property
    def rows(self) -> int:
        return len(self.y) // TILE


@dataclass(frozen=True, eq=False)
class Bins:
    """Which layers touch each tile: those of tile t are layers[starts[t]:starts[t + 1]], in draw order."""

    starts: IntArray
    layers: Int32Array
    spans: Int32Array  # [pairs, 2] rows of the tile that the layer may touch; 0, 0 where it covers it


def _bin(canvas: _Canvas, rows: Float32Array) -> Bins:
    count, place = len(canvas.kinds), (canvas.x, canvas.y, canvas.pixel, canvas.columns)
    bounds, ranges = _bounds(canvas, rows), np.empty((count, 4), np.int64)
    most = tiling.find_ranges(bounds, *place, canvas.rows, ranges)
    tiles, layers, spans = np.empty(most, np.int32), np.empty(most, np.int32), np.empty((most, 2), np.int32)
    centers = np.empty((most, 2), np.float32)
    pairs = tiling.list_candidates(bounds, ranges, *place, tiles, layers, spans, centers)
    distances = np.empty(pairs, np.float32)
    tiling.measure_distances(canvas.measures, canvas.kinds, rows, layers, centers, distances)
    pairs = tiling.keep_touching(pairs, distances, bounds, tiles, layers, spans)
    starts = np.zeros(canvas.columns * canvas.rows + 1, np.int64)
    sorted_layers, sorted_spans = np.empty(pairs, np.int32), np.empty((pairs, 2), np.int32)
    tiling.sort_pairs(pairs, tiles, layers, spans, starts, np.empty_like(starts), sorted_layers, sorted_spans)
    return Bins(starts, sorted_layers, sorted_spans)


def _bounds(canvas: _Canvas, rows: Float32Array) -> Float32Array:
    """The bounds of every layer [L, 6]: `kernels.culling`."""
    bounds = np.empty((len(canvas.kinds), tiling.INNER + 1), np.float32)
    tiling.measure_bounds(canvas.measures, canvas.kinds, rows, bounds)
    return bounds


class _Composite(torch.autograd.Function):
    """The kernels as one differentiable operation."""

    @staticmethod
    def forward(ctx: Any, canvas: _Canvas, rows: torch.Tensor, background: torch.Tensor) -> torch.Tensor:
        numbers = _array(rows)
        bins = _bin(canvas, numbers)
        image = np.empty((canvas.channels, canvas.height, canvas.width), np.float32)
        place = (canvas.hides, canvas.x, canvas.y, canvas.columns)
        layers = (kernels.addresses(canvas.draws), canvas.kinds, numbers)
        shared = (bins.starts, bins.layers, bins.spans, *layers, _array(background), *place)
        in_threads(tiling.draw_tiles, *shared, image)
        ctx.canvas, ctx.bins, ctx.shared = canvas, bins, shared
        return torch.from_numpy(image)

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, cotangent: torch.Tensor) -> tuple[torch.Tensor | None, ...]:
        canvas, bins = ctx.canvas, ctx.bins
        width, longest = ctx.shared[5].shape[1], int(np.diff(bins.starts).max(initial=0))
        grads = np.zeros((len(bins.layers), width), np.float32)
        ground = np.zeros((len(bins.starts) - 1, 4), np.float32)
        kept = np.empty((threads(), longest, canvas.channels, PIXELS), np.float32)
        in_threads(tiling.draw_tiles_backward, kept, *ctx.shared, _array(cotangent), grads, ground)
        totals = np.zeros((len(canvas.kinds), width), np.float64)
        tiling.reduce_pairs(bins.layers, grads, totals)
        background = ground.sum(axis=0, dtype=np.float64)
        return None, *(torch.from_numpy(part.astype(np.float32)) for part in (totals, background))


def _array(tensor: torch.Tensor) -> Float32Array:
    return np.ascontiguousarray(tensor.detach().numpy(), dtype=np.float32)

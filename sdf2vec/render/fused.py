"""The fused renderer on the CPU: culled to tiles, forward and backward in generated kernels, many threads.

The same function as `reference`, in float32, and what fitting uses. Nothing of size layers × pixels is stored:
every 16 × 16 tile holds what its own layers need while it is being computed. The result does not depend on the
number of threads.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from types import ModuleType
from typing import Any, TypeVar

import numpy as np
import torch
from numpy.typing import NDArray
from torch.autograd.function import once_differentiable

from . import kernels
from .kernels import TILE, LayerKind
from .reference import canvas_axes
from .tensors import Group, SceneTensors

Floats = NDArray[np.float32]
T = TypeVar("T")
R = TypeVar("R")


def composite(tensors: SceneTensors, width: int, height: int, channels: int = 4) -> torch.Tensor:
    """Premultiplied RGBA (or RGB, for 3 channels) before clamping, [channels, height, width], float32.

    Differentiable in every tensor of the scene.
    """
    if not tensors.groups:
        return tensors.background[:channels, None, None].expand(channels, height, width)
    canvas, rows = _canvas(tensors, width, height)
    order = _draw_order(tensors)
    colors = torch.cat([group.colors[:, 0] for group in tensors.groups])[order]
    opacity = torch.cat([group.opacity for group in tensors.groups])[order]
    image: torch.Tensor = _Composite.apply(canvas, channels, rows, colors, opacity, tensors.background)
    return image


def _canvas(tensors: SceneTensors, width: int, height: int) -> tuple[_Canvas, torch.Tensor]:
    """What a render needs, and the layers' rows of uniforms in draw order."""
    axes = canvas_axes(tensors, -(-width // TILE) * TILE, -(-height // TILE) * TILE, width, height)
    kinds = kinds_of(tensors)
    module = kernels.load(kinds, tensors.compositing)
    order = _draw_order(tensors)
    index = np.repeat(np.arange(len(kinds)), [len(group.order) for group in tensors.groups])[order.numpy()]
    canvas = _Canvas(module, index, width, height, *axes, hides=tensors.compositing == "over")
    return canvas, _rows(tensors.groups, float(axes[2]))[order]


def _draw_order(tensors: SceneTensors) -> torch.Tensor:
    """For each place in the draw order, where that layer stands when the groups follow each other."""
    return torch.cat([group.order for group in tensors.groups]).argsort()


def kinds_of(tensors: SceneTensors) -> tuple[LayerKind, ...]:
    """The kinds of layer in a scene, one for each group."""
    return tuple(LayerKind(group.kind, group.union_size) for group in tensors.groups)


def is_compiled(tensors: SceneTensors) -> bool:
    """Whether the kernels for this scene are there; if not, the first render takes some seconds."""
    return not tensors.groups or kernels.is_compiled(kinds_of(tensors), tensors.compositing)


@contextmanager
def threads_of_its_own() -> Iterator[None]:
    """Torch on one thread meanwhile: its waiting threads would spin on the cores that the kernels need."""
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(before)


def bins_of(tensors: SceneTensors, width: int, height: int) -> Bins:
    """Which layers touch each tile of a canvas of this size."""
    canvas, rows = _canvas(tensors, width, height)
    return _bin(canvas, _array(rows))


def _rows(groups: list[Group], pixel: float) -> torch.Tensor:
    """One row of uniforms a layer, [L, widest], in the order that `kernels.Formula.uniforms` has them."""
    rows = [_group_rows(group, pixel) for group in groups]
    widest = max(row.shape[1] for row in rows)
    return torch.cat([torch.nn.functional.pad(row, (0, widest - row.shape[1])) for row in rows])


def _group_rows(group: Group, pixel: float) -> torch.Tensor:
    shapes = torch.cat(list(group.parameters.values()), dim=2).flatten(1)  # [G, K·P], shape by shape
    head = [torch.full_like(group.falloff, pixel)[:, None], group.falloff[:, None]]
    if group.union_size == 1:
        return torch.cat([*head, shapes], dim=1)
    return torch.cat([*head, group.smoothness[:, None], shapes, group.colors.flatten(1)], dim=1)


@dataclass(frozen=True)
class _Canvas:
    """What a render needs besides the numbers of the scene."""

    module: ModuleType
    kinds: NDArray[np.int64]  # [L]
    width: int
    height: int
    x: Floats  # of the pixel centres, padded to whole tiles
    y: Floats
    pixel: np.float32
    hides: bool  # an opaque layer hides what is below it

    @property
    def columns(self) -> int:
        return len(self.x) // TILE

    @property
    def rows(self) -> int:
        return len(self.y) // TILE


@dataclass(frozen=True)
class Bins:
    """Which layers touch each tile: those of tile t are layers[starts[t]:starts[t + 1]], in draw order."""

    starts: NDArray[np.int64]
    layers: NDArray[np.int32]
    full: NDArray[np.bool_]  # the layer covers all of the tile


def _bin(canvas: _Canvas, uniforms: Floats) -> Bins:
    module, count = canvas.module, len(canvas.kinds)
    limits, ranges = np.empty((count, 3), np.float32), np.empty((count, 4), np.int64)
    place = (canvas.x, canvas.y, canvas.pixel, canvas.columns)
    most = module.measure(canvas.kinds, uniforms, *place, canvas.rows, limits, ranges)
    tiles, layers, full = np.empty(most, np.int32), np.empty(most, np.int32), np.empty(most, np.bool_)
    pairs = module.find_pairs(canvas.kinds, uniforms, *place, limits, ranges, tiles, layers, full)
    starts = np.zeros(canvas.columns * canvas.rows + 1, np.int64)
    sorted_layers, sorted_full = np.empty(pairs, np.int32), np.empty(pairs, np.bool_)
    module.sort_pairs(pairs, tiles, layers, full, starts, sorted_layers, sorted_full)
    return Bins(starts, sorted_layers, sorted_full)


class _Composite(torch.autograd.Function):
    """The kernels as one differentiable operation."""

    @staticmethod
    def forward(
        ctx: Any,
        canvas: _Canvas,
        channels: int,
        uniforms: torch.Tensor,
        colors: torch.Tensor,
        opacity: torch.Tensor,
        background: torch.Tensor,
    ) -> torch.Tensor:
        arrays = [_array(tensor) for tensor in (uniforms, colors, opacity, background)]
        bins = _bin(canvas, arrays[0])
        image = np.empty((channels, canvas.height, canvas.width), np.float32)
        shared = (
            bins.starts,
            bins.layers,
            bins.full,
            canvas.kinds,
            *arrays,
            canvas.hides,
            canvas.x,
            canvas.y,
        )
        _in_threads(canvas.module.forward_tiles, *shared, canvas.columns, image)
        ctx.canvas, ctx.bins, ctx.shared = canvas, bins, shared
        return torch.from_numpy(image)

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, seed: torch.Tensor) -> tuple[torch.Tensor | None, ...]:
        canvas, bins = ctx.canvas, ctx.bins
        uniforms = ctx.shared[4]
        row = uniforms.shape[1]
        longest = int(np.diff(bins.starts).max(initial=0))
        grads = np.zeros((len(bins.layers), row + 4), np.float32)
        ground = np.zeros((len(bins.starts) - 1, 4), np.float32)
        _in_threads(
            canvas.module.backward_tiles, *ctx.shared, canvas.columns, _array(seed), longest, grads, ground
        )
        totals = np.zeros((len(uniforms), row + 4), np.float64)
        canvas.module.reduce_pairs(bins.layers, grads, totals)
        totals_32 = torch.from_numpy(totals.astype(np.float32))
        background = torch.from_numpy(ground.sum(axis=0, dtype=np.float64).astype(np.float32))
        return None, None, totals_32[:, :row], totals_32[:, row : row + 3], totals_32[:, row + 3], background


def _array(tensor: torch.Tensor) -> Floats:
    return np.ascontiguousarray(tensor.detach().numpy(), dtype=np.float32)


def _in_threads(function: Any, *arguments: Any) -> None:
    """Runs a kernel over all tiles, every thread taking each n-th."""
    count = threads()
    if count == 1:
        function(0, 1, *arguments)
        return
    for future in [_pool().submit(function, first, count, *arguments) for first in range(count)]:
        future.result()


def in_threads_each(function: Callable[[T], R], items: Iterable[T]) -> list[R]:
    """The function's results for all items, computed in the same threads that render."""
    return list(map(function, items) if threads() == 1 else _pool().map(function, items))


def threads() -> int:
    """How many threads render: `$SDF2VEC_THREADS`, or one for each core that this process may use."""
    asked = os.environ.get("SDF2VEC_THREADS", "")
    return max(1, int(asked)) if asked.isdigit() else available_cores()


@cache
def available_cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


@cache
def _pool() -> ThreadPoolExecutor:
    return ThreadPoolExecutor(max(available_cores(), threads()), thread_name_prefix="sdf2vec")

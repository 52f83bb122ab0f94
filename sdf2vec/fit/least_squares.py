"""All numbers of a scene at once, by least squares: the normal equations come from kernels, tile by tile.

A layer changes what is below it, and what it changes is seen through all that is above; so a tile's pixels depend on
the layers that touch it, and their derivatives are those of each layer alone, dimmed on the way up.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from itertools import accumulate

import numpy as np
import torch

from ..arrays import Float32Array, Float64Array, IntArray
from ..layer import Slot, row_width
from ..render import fused
from ..render.reference import canvas_axes
from ..render.tensors import SceneTensors
from ..render.tiling import PIXELS, TILE
from ..threads import in_threads, threads
from ..units import BACKGROUND, COLOR, Room
from .adam import rate_of
from .constraints import Ranges, enforce_min_thickness, ground_ranges, ranges_of, room_of
from .joining import LONGEST_STEP, Search, detached, layer_of, longest_steps
from .laying import entries
from .levenberg import Equations, Numbers, descend
from .normal_kernels import add_scene_products
from .surroundings import View, error_of


def improved(
    scene: SceneTensors, view: View, search: Search, steps: int, simple: bool = False
) -> SceneTensors:
    """A copy of the scene after so many steps down the squared error, all numbers together.

    Where it is `simple` what says that stays: what is opaque, sharp, upright or not rounded.
    """
    if not scene.groups:
        return scene
    problem = SceneProblem(detached(scene), view)
    room = room_of(scene, search.least, search.falloff)
    numbers = problem.numbers(room, is_simple if simple else lambda slot, value: False)
    row, _ = descend(problem.row(), problem, numbers, steps, search.tick)
    made = detached(problem.scene_of(row))
    enforce_min_thickness(made, search.pixel)
    return made


def count_numbers(scene: SceneTensors) -> int:
    """How many numbers a scene's layers have."""
    return sum(len(group) * row_width(group.structure) for group in scene.groups)


def is_simple(slot: Slot, value: float) -> bool:
    """Whether a number is one that need not be told."""
    return value in (0.0, 1.0) and slot.parameter.width == 1 and slot.parameter.unit is not COLOR


class SceneProblem:
    """How wrong a scene is with other numbers: a row [1, N] of its layers', group by group, and the ground's four."""

    def __init__(self, scene: SceneTensors, view: View) -> None:
        self.scene, self.view = scene, view
        self.channels = len(view.target)
        self.sides = height, width = view.sampled
        rows, columns = -(-height // TILE), -(-width // TILE)
        x, y, pixel = canvas_axes(scene.size, columns * TILE, rows * TILE, width, height)
        self.pixel = float(pixel)
        weights = torch.ones(view.target.shape[1:]) if view.weights is None else view.weights
        beyond = ((0, 0), (0, rows * TILE - height), (0, columns * TILE - width))
        target, matter = (
            np.pad(each.numpy().repeat(view.samples, 1).repeat(view.samples, 2), beyond)
            for each in (view.target, weights[None])
        )
        planes = np.concatenate([np.stack(np.broadcast_arrays(x, y[:, None])), matter, target])
        tiled = _tiled(planes)
        self.pixels = tiled[0], tiled[1], np.ascontiguousarray(tiled[3:].swapaxes(0, 1)), tiled[2]
        self.widths = [row_width(group.structure) for group in scene.groups]
        each = [width for width, group in zip(self.widths, scene.groups, strict=True) for _ in group.order]
        self.offsets = np.array([0, *accumulate(each)], np.int64)

    def row(self) -> torch.Tensor:
        """The scene's own numbers."""
        parts = [group.rows().flatten() for group in self.scene.groups]
        return torch.cat([*parts, self.scene.background])[None]

    def scene_of(self, row: torch.Tensor) -> SceneTensors:
        """The scene with other numbers, which are parts of the row."""
        ends = [len(group) * width for group, width in zip(self.scene.groups, self.widths, strict=True)]
        *parts, ground = row[0].split([*ends, 4])
        groups = [
            replace(group, values=layer_of(group.structure, group.order, part.view(len(group), -1)).values)
            for group, part in zip(self.scene.groups, parts, strict=True)
        ]
        return replace(self.scene, groups=groups, background=ground)

    def numbers(self, room: Room, stays: Callable[[Slot, float], bool]) -> Numbers:
        """Which move, how far in one step, and what all may be; the ground's move where it is opaque."""
        moves, steps, ranges = [], [], []
        for group in self.scene.groups:
            slots = [slot for slot in group.values for _ in range(slot.parameter.width)]
            for row in group.rows().tolist():
                moves += [not stays(slot, value) for slot, value in zip(slots, row, strict=True)]
            steps.append(longest_steps(group.structure, self.scene).repeat(len(group)))
            ranges += [ranges_of(group.structure, room)] * len(group)
        grounds = min(self.channels, 3) if self.scene.opaque else 0
        moves += [True] * grounds
        side = math.sqrt(self.scene.size[0] * self.scene.size[1])
        steps.append(torch.full((grounds,), rate_of(BACKGROUND, side, LONGEST_STEP)))
        return Numbers.where(moves, torch.cat(steps), Ranges.joined([*ranges, ground_ranges(room)]))

    def errors(self, rows: torch.Tensor) -> Float64Array:
        """The mean square [1]."""
        return np.array([error_of(self.scene_of(rows), self.view)])

    def normal(self, rows: torch.Tensor, free: IntArray) -> Equations:
        """The normal equations by the free numbers."""
        scene = self.scene_of(rows)
        height, width = self.sides
        bins = fused.bins_of(scene, width, height)
        order, kinds, packed = fused.drawn_rows(scene, self.pixel)
        most = int(np.diff(bins.starts).max(initial=1))
        total = int(self.offsets[-1]) + self.channels
        normal, right = np.zeros((threads(), total, total)), np.zeros((threads(), total))
        in_threads(
            add_scene_products,
            *self._layers(scene, order, kinds),
            packed.numpy(),
            bins.starts,
            bins.layers,
            *self.pixels,
            scene.background.numpy(),
            self.view.samples,
            *self._scratch(max(most, 1)),
            normal,
            right,
        )
        lower = normal.sum(axis=0)[np.ix_(free, free)]
        both = lower + np.tril(lower, -1).T
        return both[None], right.sum(axis=0)[free][None]

    def _layers(self, scene: SceneTensors, order: IntArray, kinds: IntArray) -> tuple[IntArray, ...]:
        """Kernels, and of each layer in draw order: which it has, how many numbers, and where they begin in a row."""
        kernels = [entries(group.structure, scene.compositing, self.channels)[1] for group in scene.groups]
        addresses = np.array([kernel.address for kernel in kernels], np.int64)
        return addresses, kinds, np.array(self.widths, np.int64)[kinds], self.offsets[order]

    def _scratch(self, most: int) -> tuple[Float32Array, Float32Array, IntArray]:
        """Room for so many layers of a tile."""
        count, widest = threads(), max(self.widths, default=0)
        below = np.empty((count, most + 1, self.channels, PIXELS), np.float32)
        sloped = np.empty((count, most, self.channels * (widest + 2), PIXELS), np.float32)
        return below, sloped, np.empty((count, 4, most * widest), np.int64)


def _tiled(planes: np.ndarray) -> Float32Array:
    """Planes [K, H, W] of whole tiles, tile by tile: [K, T, pixels]."""
    count, height, width = planes.shape
    tiles = planes.reshape(count, height // TILE, TILE, width // TILE, TILE).swapaxes(2, 3)
    return np.ascontiguousarray(tiles.reshape(count, -1, PIXELS), np.float32)

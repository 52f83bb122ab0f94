"""The layers of a scene laid on each other in other orders, or without some: how wrong a picture is then.

What a layer makes of what is below it is, at each pixel, a share of that and something more: both are worked out once.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
import torch

from ..arrays import Float32Array
from ..render.reference import canvas
from ..render.tensors import SceneTensors
from ..render.tiling import PIXELS
from ..threads import in_threads
from .laying import Blocks, entries
from .stacking_kernels import stack_layers
from .surroundings import View, residual_of_drawn

# values of all layers that are kept, twice 128 MiB; of more some at a time, anew whenever they are wanted
KEPT = 2**25
AT_ONCE = 2**21  # values of all pictures that are made at once


class Laying(NamedTuple):
    """What layers make of what is below them in some blocks of pixels, from the `first` on: `keeps` · below + `adds`,
    both [N, B, C, pixels] in draw order.
    """

    first: int
    keeps: Float32Array
    adds: Float32Array


@dataclass(frozen=True, eq=False)
class Stack:
    """The layers of a scene, and the picture that they are compared with."""

    scene: SceneTensors
    view: View

    @torch.no_grad()
    def errors(self, orders: Sequence[Sequence[int]]) -> list[float]:
        """The weighted mean squared errors with such layers only, each order by their places now, from below."""
        most = max(1, AT_ONCE // (len(self._blocks.x) * self._channels * PIXELS))
        chunks = (orders[start : start + most] for start in range(0, len(orders), most))
        return [error for chunk in chunks for error in self._errors(chunk)]

    def errors_without_each(self) -> list[float]:
        """The same without each layer alone."""
        every = range(self.scene.layer_count)
        return self.errors([[other for other in every if other != order] for order in every])

    def _errors(self, orders: Sequence[Sequence[int]]) -> list[float]:
        lengths = np.array([len(order) for order in orders], np.int64)
        places = np.zeros((len(orders), max(lengths)), np.int64)
        for row, order in zip(places, orders, strict=True):
            row[: len(order)] = order
        images = np.empty((len(orders), len(self._blocks.x), self._channels, PIXELS), np.float32)
        for laying in self._layings():
            in_threads(stack_layers, images, places, lengths, *laying, self.scene.background.numpy())
        drawn = self._blocks.flat(images).unflatten(2, self.view.sampled)
        errors: list[float] = residual_of_drawn(drawn, self.view).square().mean(dim=(1, 2, 3)).tolist()
        return errors

    def _layings(self) -> Iterator[Laying]:
        """What all layers make of what is below them, blocks after blocks."""
        blocks = len(self._blocks.x)
        step = max(1, KEPT // max(1, self.scene.layer_count * self._channels * PIXELS))
        if step >= blocks:
            yield self._kept
        else:
            yield from (self._laying(start, step) for start in range(0, blocks, step))

    @cached_property
    def _kept(self) -> Laying:
        return self._laying(0, len(self._blocks.x))

    def _laying(self, first: int, count: int) -> Laying:
        """That of so many blocks."""
        x, y, *_ = self._blocks
        some = self._blocks._replace(x=x[first : first + count], y=y[first : first + count])
        dark = np.zeros((len(some.x), self._channels, PIXELS), np.float32)
        shape = self.scene.layer_count, *dark.shape
        keeps, adds = np.empty(shape, np.float32), np.empty(shape, np.float32)
        for group in self.scene.groups:
            entry, _ = entries(group.structure, self.scene.compositing, self._channels)
            order, rows = group.order.numpy(), group.rows()
            adds[order] = some.laid(entry, rows, dark)
            keeps[order] = some.laid(entry, rows, np.ones_like(dark)) - adds[order]
        return Laying(first, keeps, adds)

    @cached_property
    def _blocks(self) -> Blocks:
        height, width = self.view.sampled
        x, y, pixel = canvas(self.scene, width, height)
        return Blocks.of((x, y, pixel))

    @property
    def _channels(self) -> int:
        return len(self.view.target)

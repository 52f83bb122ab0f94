"""Problems of least squares whose candidates are layers laid on one picture: solved by kernels."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import NamedTuple

import numpy as np
import torch
from torch.nn.functional import pad

from ..arrays import Float32Array, Float64Array, IntArray
from ..graph import gradient
from ..kernel_cache import Assembly, Entry
from ..layer import Formula, Structure, slots
from ..lower.block import Block
from ..lower.llvm import assembled, forward
from ..render.kernels import carried, drawn
from ..render.tiling import PIXELS
from ..threads import in_threads, threads
from ..units import COLOR, OPACITY
from .descent_kernels import descend_rows, lay_rows, sum_squares
from .levenberg import Descended, Numbers, Tick

Points = tuple[torch.Tensor, torch.Tensor, torch.Tensor]  # x [P], y [P], the size of a pixel []
WORTH_A_THREAD = 10**6  # values of pixels, about half a millisecond; to wake one takes up to a fifth


@cache
def entries(structure: Structure, compositing: str, channels: int) -> tuple[Entry, Entry]:
    """What a layer makes of what is below it: a row a channel. The same, followed by the derivatives of the first
    channel by each of the layer's numbers, then those of the second, …; last, of each by what is below in it.
    """
    block = drawn(Formula.of(structure), "laid", compositing, channels)
    slopes = [slope for output in block.outputs for slope in gradient(output, block.uniforms[1:])]
    through = [
        slope
        for output, below in zip(block.outputs, carried(channels), strict=True)
        for slope in gradient(output, [below])
    ]
    sloped = replace(block, name="sloped", outputs=(*block.outputs, *slopes, *through))
    assembly = Assembly(assembled([_text(each, channels) for each in (block, sloped)]))
    return assembly["laid"], assembly["sloped"]


def _text(block: Block, channels: int) -> str:
    return forward(block, {"x": 1, "y": 1, "below": channels, "found": len(block.outputs)}, PIXELS)


class Blocks(NamedTuple):
    """Points in blocks: x, y [B, pixels], the last filled up with 0; how many there are; the size of a pixel."""

    x: Float32Array
    y: Float32Array
    points: int
    pixel: float

    @classmethod
    def of(cls, points: Points) -> Blocks:
        """Those of x [P], y [P] and the size of a pixel []."""
        x, y, pixel = points
        return cls(_blocked(x), _blocked(y), len(x), float(pixel))

    def blurred(self, blur: float) -> Blocks:
        """The same with pixels so many times as large."""
        return self._replace(pixel=self.pixel * blur)

    def numbers(self, rows: torch.Tensor) -> Float32Array:
        """Rows [G, U] that begin with the size of a pixel, [G, 1 + U]."""
        numbers = np.empty((len(rows), 1 + rows.shape[1]), np.float32)
        numbers[:, 0], numbers[:, 1:] = self.pixel, rows.numpy()
        return numbers

    def laid(self, entry: Entry, rows: torch.Tensor, below: Float32Array) -> Float32Array:
        """What layers with rows [G, U] make of what is below them [B, C, pixels], [G, B, C, pixels]."""
        made = np.empty((len(rows), *below.shape), np.float32)
        most = 1 + made.size // WORTH_A_THREAD
        in_threads(lay_rows, made, entry.address, self.numbers(rows), self.x, self.y, below, most=most)
        return made

    def flat(self, values: Float32Array) -> torch.Tensor:
        """Values in blocks [G, B, C, pixels] as those of points, [G, C, P]."""
        return torch.from_numpy(values).transpose(1, 2).flatten(2)[..., : self.points]


def covers(structure: Structure, compositing: str, rows: torch.Tensor, blocks: Blocks) -> torch.Tensor:
    """Coverage [G, P] of layers with rows [G, U]: what is seen where they are white and opaque, on black."""
    white = rows.clone()
    white[:, _looks(structure)] = 1.0
    black = np.zeros((len(blocks.x), 1, PIXELS), np.float32)
    return blocks.flat(blocks.laid(entries(structure, compositing, 1)[0], white, black))[:, 0]


@cache
def _looks(structure: Structure) -> list[int]:
    """Which numbers of a row are colours or opacities."""
    units = (slot.parameter.unit for slot in slots(structure) for _ in range(slot.parameter.width))
    return [index for index, unit in enumerate(units) if unit in (COLOR, OPACITY)]


@dataclass(frozen=True, eq=False)
class Laid:
    """Candidates for a layer on what is below it [B, C, pixels]: what is wrong is `scale` · laid − `offset`.

    `scale` and `offset` [M, B, C, pixels] are each candidate's own, or the same for all, or as `which` [G] tells.
    """

    structure: Structure
    compositing: str
    blocks: Blocks
    below: Float32Array
    scale: Float32Array
    offset: Float32Array
    which: IntArray | None = None

    @classmethod
    def of(
        cls,
        structure: Structure,
        compositing: str,
        blocks: Blocks,
        below: torch.Tensor,
        scale: torch.Tensor,
        offset: torch.Tensor,
    ) -> Laid:
        """From what is below [C, P], scale and offset [M, C, P]."""
        planes = [np.ascontiguousarray(_blocked(each).swapaxes(-3, -2)) for each in (below, scale, offset)]
        return cls(structure, compositing, blocks, planes[0], planes[1], planes[2])

    def of_each(self, which: IntArray) -> Laid:
        """The same for candidates, each with the scale and offset of that number."""
        return replace(self, which=which)

    def blurred(self, blur: float) -> Laid:
        """The same with pixels so many times as large."""
        return replace(self, blocks=self.blocks.blurred(blur))

    def residuals(self, rows: torch.Tensor) -> torch.Tensor:
        """What is wrong, [G, C, P], with rows [G, U]."""
        which = self._which(len(rows))
        laid = self.blocks.laid(self._entries[0], rows, self.below)
        return self.blocks.flat(self.scale[which] * laid - self.offset[which])

    def errors(self, rows: torch.Tensor) -> Float64Array:
        """Mean squares [G] for rows [G, U]."""
        sums = np.zeros(len(rows))
        self._run(sum_squares, self._entries[:1], 1, 1, self.blocks.numbers(rows), sums)
        return sums / self._values

    def descended(self, rows: torch.Tensor, numbers: Numbers, steps: int, tick: Tick) -> Descended:
        """The rows after so many steps down these, each by itself, and what they are then; `tick` is told the least."""
        made, sums = self.blocks.numbers(rows), np.zeros(len(rows))
        count, free = threads(), len(numbers.free)
        self._run(
            descend_rows,
            self._entries,
            1 + made.shape[1],
            steps,
            made,
            steps,
            numbers.free,
            numbers.longest,
            *numbers.ranges,
            np.empty((count, made.shape[1]), np.float32),
            *np.empty((2, count, free, free)),
            *np.empty((2, count, free)),
            sums,
        )
        errors = torch.from_numpy(sums / self._values).to(rows.dtype)
        tick(float(errors.min()))
        return torch.from_numpy(made[:, 1:].copy()), errors

    def _run(
        self,
        kernel: Callable[..., object],
        entries: Sequence[Entry],
        values: int,
        times: int,
        numbers: Float32Array,
        *rest: object,
    ) -> None:
        """Calls a kernel with scratch for so many values of each channel of a pixel, which goes over all so often."""
        channels, count = self._channels, len(numbers)
        scratch = np.empty((threads(), channels * values, PIXELS), np.float32)
        addresses = (entry.address for entry in entries)
        x, y, *_ = self.blocks
        given = (*addresses, numbers, x, y, self.below, self._which(count), self.scale, self.offset, *rest)
        most = 1 + count * self._values * values * times // WORTH_A_THREAD
        in_threads(kernel, scratch, *given, most=most)

    def _which(self, count: int) -> IntArray:
        """Which scale and offset each candidate has."""
        if self.which is not None:
            return self.which
        return np.arange(count, dtype=np.int64) if len(self.scale) > 1 else np.zeros(count, np.int64)

    @property
    def _values(self) -> int:
        """How many are wrong or right."""
        return self.blocks.points * self._channels

    @property
    def _channels(self) -> int:
        channels: int = self.below.shape[1]
        return channels

    @property
    def _entries(self) -> tuple[Entry, Entry]:
        return entries(self.structure, self.compositing, self._channels)


def _blocked(tensor: torch.Tensor) -> Float32Array:
    """Values of points [..., P] in blocks [..., B, pixels], the last filled up with 0."""
    missing = -tensor.shape[-1] % PIXELS
    return _array(pad(tensor, (0, missing)).unflatten(-1, (-1, PIXELS)))


def _array(tensor: torch.Tensor) -> Float32Array:
    return np.ascontiguousarray(tensor.detach().numpy(), dtype=np.float32)

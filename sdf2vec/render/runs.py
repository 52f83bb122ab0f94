"""Layers drawn in runs, each blurred as one, as a filter on a group of an SVG does it. On the CPU, differentiable."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import torch
from torch.autograd.function import once_differentiable

from ..banded import Band, with_transposed
from .draw import composer
from .tensors import Group, SceneTensors

REACH = 3.5  # standard deviations that a blur reaches
NONE = 0.5  # pixels: a run of a smaller standard deviation is not blurred
FINENESS = 1.5  # samples in a standard deviation, at least, where they are wider than pixels
ALPHA = 3  # place of alpha among the channels


@dataclass(frozen=True, eq=False)
class Runs:
    """How many layers each run has, in the draw order, and its blur's standard deviation [R] in scene units."""

    counts: Sequence[int]
    deviations: torch.Tensor

    def composite(
        self, tensors: SceneTensors, width: int, height: int, channels: int, times: int = 1
    ) -> torch.Tensor:
        """A scene's layers in these runs: premultiplied, before clamping, [channels, height, width].

        Differentiable in the scene's tensors and in the standard deviations. `times`: how often it is drawn, about.
        """
        image, first = tensors.background[:channels, None, None].expand(channels, height, width), 0
        pixel = max(tensors.size[0] / width, tensors.size[1] / height)
        for number, count in enumerate(self.counts):
            part = _between(tensors, first, first + count)
            canvas = _Canvas.of(width, height, pixel, float(self.deviations[number].detach()))
            if number == 0:  # the ground is the same everywhere: the blur leaves it as it is
                image = canvas.drawn(replace(part, background=tensors.background), channels, times)
                image = canvas.blurred(image, self.deviations[number])
            else:
                light = canvas.drawn(part, ALPHA + 1, times)
                light = canvas.blurred(light, self.deviations[number])
                image = light[:channels] + image * (1.0 - light[ALPHA])
            first += count
        return image


def _between(tensors: SceneTensors, first: int, last: int) -> SceneTensors:
    """The layers at some places of the draw order, on no ground."""
    chosen = [(group, (group.order >= first) & (group.order < last)) for group in tensors.groups]
    groups = [_chosen(group, rows) for group, rows in chosen if rows.any()]
    return replace(tensors, groups=groups, background=torch.zeros_like(tensors.background))


def _chosen(group: Group, rows: torch.Tensor) -> Group:
    return group if rows.all() else group.each(lambda tensor: tensor[rows])


@dataclass(frozen=True)
class _Canvas:
    """The canvas of a run: of samples that are `step` pixels wide, for a blur hides what is finer, and with a margin
    of samples, for what is beyond the edge is blurred into the picture. `pixel` is in scene units.
    """

    width: int
    height: int
    pixel: float
    step: int
    margin: int

    @classmethod
    def of(cls, width: int, height: int, pixel: float, deviation: float) -> _Canvas:
        """For a blur of this standard deviation, in scene units."""
        pixels = deviation / pixel
        step = max(1, math.floor(pixels / FINENESS))
        margin = 0 if pixels < NONE else math.ceil(REACH * pixels / step)
        return cls(width, height, pixel, step, margin)

    @property
    def columns(self) -> int:
        return -(-self.width // self.step) + 2 * self.margin

    @property
    def rows(self) -> int:
        return -(-self.height // self.step) + 2 * self.margin

    def drawn(self, part: SceneTensors, channels: int, times: int) -> torch.Tensor:
        """A part of a scene, sharp, [channels, rows, columns]."""
        sample = self.step * self.pixel
        wider = replace(part, size=(self.columns * sample, self.rows * sample))
        return composer(wider, self.columns, self.rows, channels, times)(wider, self.columns, self.rows)

    def blurred(self, image: torch.Tensor, deviation: torch.Tensor) -> torch.Tensor:
        """The same blurred, at the pixels [channels, height, width]."""
        if not self.margin:
            return image
        # a sample is the mean of a square, which blurs as well, more than a pixel's
        variance = (deviation / self.pixel).square() - (self.step**2 - 1) / 12.0
        made: torch.Tensor = _Blur.apply(image, variance, self)  # type: ignore[no-untyped-call]
        return made

    @lru_cache(maxsize=8)  # noqa: B019 (canvases are equal and few)
    def bands(self, variance: float) -> tuple[Band, Band]:
        """What blurs down and across; variance in pixels squared."""
        return (
            with_transposed(self._weights(self.height, self.rows, variance)),
            with_transposed(self._weights(self.width, self.columns, variance)),
        )

    def _weights(self, pixels: int, samples: int, variance: float) -> torch.Tensor:
        """How much of each sample there is in each pixel [pixels, samples]."""
        at = torch.arange(pixels) + 0.5 - pixels / 2
        of = (torch.arange(samples) + 0.5 - samples / 2) * self.step
        squared = (at[:, None] - of).square() / variance
        # numbers next to nothing take processors long
        weights = torch.where(squared < REACH**2, (-0.5 * squared.clamp(max=REACH**2)).exp(), 0.0)
        return weights / weights.sum(1, keepdim=True)


class _Blur(torch.autograd.Function):
    """A Gaussian blur by two banded matrices, one for each axis."""

    @staticmethod
    def forward(ctx: Any, image: torch.Tensor, variance: torch.Tensor, canvas: _Canvas) -> torch.Tensor:
        down, across = ctx.bands = canvas.bands(float(variance))
        made: torch.Tensor = (across @ (down @ image).mT).mT
        ctx.save_for_backward(made)
        return made

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, cotangent: torch.Tensor) -> tuple[torch.Tensor | None, ...]:
        (made,) = ctx.saved_tensors
        down, across = (band.transposed for band in ctx.bands)
        image = down @ (across @ cotangent.mT).mT
        # what is blurred obeys the heat equation: by the variance it changes by half its Laplacian
        variance = 0.5 * (cotangent * _laplacian(made)).sum() if ctx.needs_input_grad[1] else None
        return image, variance, None


def _laplacian(image: torch.Tensor) -> torch.Tensor:
    """Of an image [C, H, W], as if it went on at its edges as it ends there."""
    padded = torch.nn.functional.pad(image[None], (1, 1, 1, 1), mode="replicate")[0]
    beside = padded[:, 1:-1, 2:] + padded[:, 1:-1, :-2] + padded[:, 2:, 1:-1] + padded[:, :-2, 1:-1]
    return beside - 4.0 * image

"""FLIP as a loss: `flip.error` with `flip.SMOOTH` and its derivative, in compiled loops over rows."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import torch

from .. import flip as paper
from ..arrays import Float32Array
from ..threads import in_threads_each
from .analytic_loss import AnalyticLoss
from .flip_kernels import COMPARE, LINEARISE, carry_back, compare, filter_across

ROWS = 16  # that one thread computes at a time


class Flip(AnalyticLoss):
    """Mean FLIP against a fixed target, [3, H, W] or [4, H, W] premultiplied; how the target looks is kept."""

    def __init__(self, target: torch.Tensor) -> None:
        self.softness = np.array(paper.SMOOTH, np.float32)
        seen = paper.appearance(target, paper.SMOOTH)
        self.target: Float32Array = torch.cat([seen.lab, seen.features], dim=1).numpy()  # [B, 5, H, W]
        filters = paper.filters_for(target.dtype, target.device)
        self.mixing = filters.opponents.numpy(), filters.to_opponent.numpy()
        self.across: Float32Array = filters.across.flatten(1).numpy()
        self.down: Float32Array = filters.down.flatten(1).numpy()
        self.turned = tuple(np.ascontiguousarray(each[:, ::-1]) for each in (self.across, self.down))
        height, width = target.shape[1:]
        ends = self.across.shape[1] - 1
        # Scratch, kept: fresh memory costs more.
        self.planes = np.empty((len(self.down), height, width), np.float32)
        self.seeds = np.empty_like(self.planes)
        self.scratch = tuple(np.empty((height, 3, width + ends), np.float32) for _ in range(2))
        self.wide = np.zeros((height, width + 2 * ends), np.float32)

    def value_and_gradient(self, render: Float32Array) -> tuple[float, Float32Array]:
        """Mean FLIP over the grounds and pixels, and its derivative by the render."""
        grounds = paper.over_grounds(torch.from_numpy(render)).numpy()
        results = [self._ground(image, target) for image, target in zip(grounds, self.target, strict=True)]
        scale = np.float32(1 / (len(grounds) * render[0].size))
        grad = np.empty_like(render)
        grad[:3] = sum(gradient for _, gradient in results) * scale
        if len(render) == 4:  # alpha takes from the white ground
            grad[3] = -results[1][1].sum(axis=0) * scale
        return sum(total for total, _ in results) * float(scale), grad

    def _ground(self, image: Float32Array, target: Float32Array) -> tuple[float, Float32Array]:
        height = image.shape[1]
        slopes, grad = np.empty_like(image), np.empty_like(image)
        rows = [(start, min(start + ROWS, height)) for start in range(0, height, ROWS)]

        def each(function: Callable[..., Any], *arguments: Any) -> float:
            return sum(in_threads_each(lambda part: function(*part, *arguments) or 0.0, rows))

        each(
            filter_across,
            LINEARISE.address,
            image,
            *self.mixing,
            self.across,
            *self.scratch,
            self.planes,
            slopes,
        )
        total = each(compare, COMPARE.address, self.planes, self.down, target, self.softness, self.seeds)
        across, down = self.turned
        scratch = (*self.scratch, self.wide)
        each(carry_back, self.seeds, *self.mixing, across, self.down, down, slopes, *scratch, grad)
        return total, grad

"""FLIP as a loss: `flip.error` with `flip.SMOOTH` and its derivative, in compiled loops over rows."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import torch

from .. import flip as paper
from ..render import compiled
from ..render.fused import in_threads_each
from .written import Floats, WrittenLoss

ROWS = 16  # that one thread computes at a time


class Numbers(NamedTuple):
    """The constants that the kernels need, in float32 each."""

    color_softness: Any
    feature_softness: Any
    color_exponent: Any
    feature_exponent: Any
    turn: Any  # powered colour distance up to which the errors rise steeply
    steep: Any  # slope up to there
    flat: Any  # slope from there on
    turning_error: Any
    lab_delta: Any
    lab_offset: Any


def numbers() -> Numbers:
    """The paper's constants and the loss' softness."""
    largest = paper.largest_distance() ** paper.COLOR_EXPONENT
    turn = paper.TURNING_SHARE * largest
    values = (
        paper.SMOOTH.color,
        paper.SMOOTH.feature,
        paper.COLOR_EXPONENT,
        paper.FEATURE_EXPONENT,
        turn,
        paper.TURNING_ERROR / turn,
        (1 - paper.TURNING_ERROR) / (largest - turn),
        paper.TURNING_ERROR,
        paper.LAB_DELTA,
        paper.LAB_OFFSET,
    )
    return Numbers(*map(np.float32, values))


class Flip(WrittenLoss):
    """Mean FLIP against a fixed target, [3, H, W] or [4, H, W] premultiplied; how the target looks is kept."""

    def __init__(self, target: torch.Tensor) -> None:
        self.kernels = compiled.load(Path(__file__).with_name("flip_kernels.py").read_text())
        self.numbers = numbers()
        seen = paper.appearance(target, paper.SMOOTH)
        self.target: Floats = torch.cat([seen.lab, seen.features], dim=1).numpy()  # [B, 5, H, W]
        filters = paper.filters_for(target.dtype, target.device)
        self.filters = (
            filters.to_planes.numpy(),
            filters.across.flatten(1).numpy(),
            filters.down.flatten(1).numpy(),
        )
        self.matrices = filters.to_rgb.numpy(), filters.to_xyz.numpy()
        planes = np.empty((len(filters.down), *target.shape[1:]), np.float32)
        self.planes, self.seeds = planes, np.empty_like(planes)  # scratch, kept: fresh memory costs more

    def value_and_gradient(self, render: Floats) -> tuple[float, Floats]:
        """Mean FLIP over the grounds and pixels, and its derivative by the render."""
        grounds = paper.over_grounds(torch.from_numpy(render)).numpy()
        results = [self._ground(image, target) for image, target in zip(grounds, self.target, strict=True)]
        scale = np.float32(1 / (len(grounds) * render[0].size))
        grad = np.empty_like(render)
        grad[:3] = sum(gradient for _, gradient in results) * scale
        if len(render) == 4:  # alpha takes from the white ground
            grad[3] = -results[1][1].sum(axis=0) * scale
        return sum(total for total, _ in results) * float(scale), grad

    def _ground(self, image: Floats, target: Floats) -> tuple[float, Floats]:
        to_planes, across, down = self.filters
        height = image.shape[1]
        slopes, grad = np.empty_like(image), np.empty_like(image)
        rows = [(start, min(start + ROWS, height)) for start in range(0, height, ROWS)]

        def each(function: Callable[..., float], *arguments: Any) -> float:
            return sum(in_threads_each(lambda part: function(*part, *arguments), rows))

        each(self.kernels.filter_across, image, to_planes, across, self.planes, slopes)
        total = each(
            self.kernels.compare, self.planes, down, *self.matrices, target, self.numbers, self.seeds
        )
        each(self.kernels.carry_back, self.seeds, to_planes, across, down, slopes, grad)
        return total, grad

"""Mean absolute and mean squared difference as losses, in compiled loops over rows."""

from __future__ import annotations

from functools import partial

import numpy as np
import torch

from ..arrays import Float32Array
from ..threads import in_threads_each
from .analytic_loss import AnalyticLoss
from .difference_kernels import COLORS, differences

ROWS = 32  # that one thread computes at a time


class Difference(AnalyticLoss):
    """The mean over all colours and pixels of so much of what is off and of its square, from a fixed target [C, H, W].

    Of premultiplied RGBA, on black and on white.
    """

    def __init__(self, linear: float, square: float, target: torch.Tensor) -> None:
        self.powers, self.target = (linear, square), np.ascontiguousarray(target.numpy(), np.float32)
        channels, height, width = self.target.shape
        self.scale = 1.0 / (COLORS * height * width * (1 if channels == COLORS else 2))
        self.rows = [(start, min(start + ROWS, height)) for start in range(0, height, ROWS)]

    def value_and_gradient(self, render: Float32Array) -> tuple[float, Float32Array]:
        grad = np.empty_like(render)
        rest = render, self.target, *self.powers, self.scale, grad
        return self.scale * sum(in_threads_each(lambda part: differences(*part, *rest), self.rows)), grad


Absolute = partial(Difference, 1.0, 0.0)
Squared = partial(Difference, 0.0, 1.0)

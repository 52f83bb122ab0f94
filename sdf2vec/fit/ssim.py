"""1 − SSIM as a loss: the same number as `metrics.ssim`, with a derivative of its own, many times faster."""

from __future__ import annotations

import numpy as np
import torch

from ..arrays import Float32Array
from ..metrics import gaussian_window
from ..threads import in_threads_each
from .analytic_loss import AnalyticLoss
from .ssim_kernels import local_means, similarity


class Dissimilarity(AnalyticLoss):
    """1 − SSIM against a fixed target, [C, H, W]; its local means are computed once."""

    def __init__(self, target: torch.Tensor) -> None:
        self.target: Float32Array = np.ascontiguousarray(target.numpy(), dtype=np.float32)
        height, width = self.target.shape[1:]
        self.across, self.down = (
            gaussian_window(side).numpy().astype(np.float32) for side in (width, height)
        )
        self.mean = np.stack([self._means(channel) for channel in self.target])
        self.square = np.stack([self._means(channel * channel) for channel in self.target])

    def _rows(self, channel: Float32Array) -> Float32Array:
        """Scratch: a channel filtered across."""
        return np.empty((channel.shape[0], channel.shape[1] - len(self.across) + 1), np.float32)

    def _means(self, channel: Float32Array) -> Float32Array:
        rows = self._rows(channel)
        out = np.empty((len(rows) - len(self.down) + 1, rows.shape[1]), np.float32)
        local_means(channel, self.across, self.down, rows, out)
        return out

    def value_and_gradient(self, render: Float32Array) -> tuple[float, Float32Array]:
        """1 − SSIM and its derivative by the render."""
        grad = np.empty_like(render)

        def channel(c: int) -> float:
            image, mean = render[c], self.mean[c]
            scratch = np.empty_like(image), self._rows(image), np.empty((3, *mean.shape), np.float32)
            window = self.across, self.down
            return float(similarity(image, self.target[c], mean, self.square[c], *window, *scratch, grad[c]))

        total = sum(in_threads_each(channel, range(len(render))))
        grad *= np.float32(-1.0 / self.mean.size)
        return 1.0 - total / self.mean.size, grad

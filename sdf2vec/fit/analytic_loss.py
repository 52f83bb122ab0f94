"""Losses that compute their own derivative, as functions that torch can differentiate once."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any

import numpy as np
import torch
from torch.autograd.function import once_differentiable

from ..arrays import Float32Array


class AnalyticLoss(ABC):
    """A loss of a render [C, H, W] that computes its own derivative, on the CPU."""

    @abstractmethod
    def value_and_gradient(self, render: Float32Array) -> tuple[float, Float32Array]:
        """The loss and its derivative by the render."""

    def __call__(self, render: torch.Tensor) -> torch.Tensor:
        value: torch.Tensor = _Function.apply(self, render)
        return value


class _Function(torch.autograd.Function):
    @staticmethod
    def forward(ctx: Any, loss: AnalyticLoss, render: torch.Tensor) -> torch.Tensor:
        pixels = np.ascontiguousarray(render.detach().numpy(), dtype=np.float32)
        value, ctx.gradient = loss.value_and_gradient(pixels)
        return torch.tensor(value, dtype=torch.float32)

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, seed: torch.Tensor) -> tuple[None, torch.Tensor]:
        return None, torch.from_numpy(ctx.gradient) * seed

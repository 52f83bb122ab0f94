"""Losses by name: each takes the render and the target, [C, H, W], and is 0 where they are equal."""

from __future__ import annotations

from collections.abc import Callable

import torch

from ..metrics import mse, ssim
from .presets import Loss


def l1(render: torch.Tensor, target: torch.Tensor) -> torch.Tensor:
    """Mean absolute difference."""
    return (render - target).abs().mean()


def dissimilarity(render: torch.Tensor, target: torch.Tensor) -> torch.Tensor:
    """1 − SSIM."""
    return 1.0 - ssim(render, target)


LOSSES: dict[str, Callable[[torch.Tensor, torch.Tensor], torch.Tensor]] = {
    "l1": l1,
    "mse": mse,
    "ssim": dissimilarity,
}


def total_loss(loss: Loss, render: torch.Tensor, target: torch.Tensor) -> torch.Tensor:
    """The weighted sum of named losses."""
    terms = [weight * LOSSES[name](render, target) for name, weight in loss]
    return torch.stack(terms).sum()

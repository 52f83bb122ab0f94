"""Losses by name. Each is made for a target, [C, H, W], and then takes renders; 0 where they are equal."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import torch

from ..flip import SMOOTH, appearance, error
from ..metrics import mse, ssim
from .flip import Flip
from .presets import Loss
from .ssim import Dissimilarity

Objective = Callable[[torch.Tensor], torch.Tensor]


def l1(target: torch.Tensor) -> Objective:
    """Mean absolute difference."""
    return lambda render: (render - target).abs().mean()


def squared(target: torch.Tensor) -> Objective:
    """Mean squared difference."""
    return partial(mse, target)


def dissimilarity(target: torch.Tensor) -> Objective:
    """1 − SSIM."""
    if target.device.type == "cpu" and target.dtype == torch.float32:
        return Dissimilarity(target)
    return lambda render: 1.0 - ssim(render, target)


def alternation(target: torch.Tensor) -> Objective:
    """Mean FLIP, smoothed such that it can be descended (`flip.SMOOTH`); within 0.001 of `flip.flip`."""
    if target.device.type == "cpu" and target.dtype == torch.float32:
        return Flip(target)
    seen = appearance(target, SMOOTH)
    return lambda render: error(appearance(render, SMOOTH), seen, SMOOTH).mean()


LOSSES: dict[str, Callable[[torch.Tensor], Objective]] = {
    "l1": l1,
    "mse": squared,
    "ssim": dissimilarity,
    "flip": alternation,
}


def objective(loss: Loss, target: torch.Tensor, weights: torch.Tensor | None = None) -> Objective:
    """The weighted sum of named losses, for one target.

    With `weights` [H, W], 0..1, every loss sees that share of each pixel's error only.
    """
    terms = [(weight, LOSSES[name](target)) for name, weight in loss]

    def total(render: torch.Tensor) -> torch.Tensor:
        return torch.stack([weight * term(render) for weight, term in terms]).sum()

    return total if weights is None else lambda render: total(target + weights * (render - target))

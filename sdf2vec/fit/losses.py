"""Losses by name. Each is made for a target, [C, H, W], and then takes renders; 0 where they are equal."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import torch

from ..flip import SMOOTH, appearance, error
from ..metrics import ssim
from .presets import Loss

Objective = Callable[[torch.Tensor], torch.Tensor]
LossMaker = Callable[[torch.Tensor], Objective]


def l1(target: torch.Tensor) -> Objective:
    """Mean absolute difference."""
    return lambda render: _on_grounds(render - target).abs().mean()


def squared(target: torch.Tensor) -> Objective:
    """Mean squared difference."""
    return lambda render: _on_grounds(render - target).square().mean()


def _on_grounds(wrong: torch.Tensor) -> torch.Tensor:
    """A difference [C, H, W], of premultiplied RGBA on black and on white [6, H, W].

    Else black would be laid where nothing should be: on black it is not seen.
    """
    return wrong if len(wrong) < 4 else torch.cat([wrong[:3], wrong[:3] - wrong[3:]])


def dissimilarity(target: torch.Tensor) -> Objective:
    """1 − SSIM."""
    return lambda render: 1.0 - ssim(render, target)


def alternation(target: torch.Tensor) -> Objective:
    """Mean FLIP, smoothed such that it can be descended (`flip.SMOOTH`); within 0.001 of `flip.flip`."""
    seen = appearance(target, SMOOTH)
    return lambda render: error(appearance(render, SMOOTH), seen, SMOOTH).mean()


LOSSES: dict[str, LossMaker] = {"l1": l1, "mse": squared, "ssim": dissimilarity, "flip": alternation}


def objective(
    loss: Loss,
    target: torch.Tensor,
    weights: torch.Tensor | None = None,
    faster: Mapping[str, LossMaker] | None = None,
) -> Objective:
    """The weighted sum of named losses, for one target; `faster`: what a backend has in place of `LOSSES`.

    With `weights` [H, W], 0..1, every loss sees that share of each pixel's error only.
    """
    makers = {**LOSSES, **(faster or {})}
    terms = [(weight, makers[name](target)) for name, weight in loss]

    def total(render: torch.Tensor) -> torch.Tensor:
        return torch.stack([weight * term(render) for weight, term in terms]).sum()

    return total if weights is None else lambda render: total(target + weights * (render - target))

"""A step of a fit: how wrong the scene is, with all derivatives; then Adam, and everything back into its range."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Protocol

import torch

from ..render.tensors import SceneTensors
from .adam import Adam

Composite = Callable[[SceneTensors, int, int, int], torch.Tensor]
Value = Callable[[Composite], torch.Tensor]  # what is descended, by a renderer


class Steps(Protocol):
    """Steps of a scene as long as its layers are the same tensors."""

    def slope(self) -> float:
        """What is descended; the derivatives are there afterwards."""

    def drop_what_is_not_finite(self) -> int:
        """Derivatives that are no numbers move nothing; in how many tensors some are."""

    def agreement(self) -> float:
        """`Adam.agreement` of these derivatives."""

    def move(self, factor: float) -> None:
        """A step down them, all rates scaled by a factor."""


class Plain:
    """Steps in which torch runs one operation after the other; `keep` brings the scene back into its range."""

    def __init__(self, value: Value, composite: Composite, optimizer: Adam, keep: Callable[[], None]) -> None:
        self.value, self.composite, self.optimizer, self.keep = value, composite, optimizer, keep

    def slope(self) -> float:
        self.optimizer.zero_grad()
        value = self.value(self.composite)
        value.backward()
        return float(value.detach())

    def drop_what_is_not_finite(self) -> int:
        grads = self.optimizer.grads
        if not grads or math.isfinite(float(torch.cat([grad.flatten() for grad in grads]).sum())):
            return 0
        lost = [grad for grad in grads if not math.isfinite(float(grad.sum()))]
        for grad in lost:
            grad.nan_to_num_(0.0, 0.0, 0.0)
        return len(lost)

    def agreement(self) -> float:
        return self.optimizer.agreement()

    def move(self, factor: float | torch.Tensor) -> None:
        self.optimizer.step(factor)
        self.keep()

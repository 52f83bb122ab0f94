"""Torch's Adam over tensors whose rows come and go, each at a rate of its own.

The functional form is used: the class imports torch's compiler at its first step, which takes a second.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

import torch
from torch.optim.adam import adam as adam_step

from ..blend import COMPOSITING
from ..render.tensors import SceneTensors
from ..units import BACKGROUND, OPACITY, Unit
from .presets import CROWDING, MANY

BETAS = (0.9, 0.9)
EPSILON = 1e-12


@dataclass(eq=False)
class Moving:
    """A tensor that is trained, and what Adam remembers of it: running means of the derivative and its square."""

    tensor: torch.Tensor
    rate: float
    mean: torch.Tensor
    square: torch.Tensor
    steps: torch.Tensor

    @classmethod
    def of(cls, tensor: torch.Tensor, rate: float) -> Moving:
        """With its running means at 0, as before the first step."""
        zero = torch.zeros_like(tensor).detach()
        return cls(tensor.detach_().requires_grad_(), rate, zero, zero.clone(), zero.new_zeros(()))

    def step(self, factor: float | torch.Tensor) -> None:
        """One step down the tensor's derivative, if there is any."""
        if self.tensor.grad is None:
            return
        adam_step(
            [self.tensor],
            [self.tensor.grad],
            [self.mean],
            [self.square],
            [],
            [self.steps],
            fused=True,
            amsgrad=False,
            maximize=False,
            weight_decay=0.0,
            beta1=BETAS[0],
            beta2=BETAS[1],
            lr=self.rate * factor,
            eps=EPSILON,
        )


class Adam:
    """Adam (Kingma and Ba 2015) with β₁ = β₂ = 0.9: a shape that moves soon meets other slopes."""

    def __init__(self, rates: Iterable[tuple[torch.Tensor, float]]) -> None:
        self.moving = [Moving.of(tensor, rate) for tensor, rate in rates]

    def zero_grad(self) -> None:
        """Forgets all derivatives."""
        for moving in self.moving:
            moving.tensor.grad = None

    @property
    def grads(self) -> list[torch.Tensor]:
        """All derivatives that are there."""
        return [moving.tensor.grad for moving in self.moving if moving.tensor.grad is not None]

    @torch.no_grad()
    def step(self, factor: float | torch.Tensor = 1.0) -> None:
        """One step, all rates scaled by a factor; as a tensor [] where it is to change in what is recorded."""
        for moving in self.moving:
            moving.step(factor)

    @torch.no_grad()
    def products(self) -> torch.Tensor:
        """Of all derivatives and their running means, in units of Adam's steps: their product, and both squared [3]."""
        told = [moving for moving in self.moving if moving.tensor.grad is not None]
        now = torch.cat([grad.flatten() for grad in self.grads])
        before, squares = (
            torch.cat([part.flatten() for part in parts])
            for parts in zip(*((moving.mean, moving.square) for moving in told), strict=True)
        )
        units = squares + EPSILON**2
        scaled = before / units
        return torch.stack([now.dot(scaled), now.dot(now / units), before.dot(scaled)])

    def agreement(self) -> float:
        """The cosine of the angle between the present derivative and the steps of late: near 1 where they are short.

        What hypergradient descent follows (Baydin et al. 2018). 0 before the first step.
        """
        return cosine(*self.products().tolist()) if self.grads else 0.0

    @torch.no_grad()
    def forget(self) -> None:
        """As before the first step."""
        for moving in self.moving:
            for memory in (moving.mean, moving.square, moving.steps):
                memory.zero_()

    def remembers(self, before: Adam) -> Adam:
        """Itself, with what another remembers of the same tensors."""
        old = {id(moving.tensor): moving for moving in before.moving}
        for moving in self.moving:
            if same := old.get(id(moving.tensor)):
                moving.mean, moving.square, moving.steps = same.mean, same.square, same.steps
        return self

    def replace(self, before: torch.Tensor, after: torch.Tensor, rows: torch.Tensor) -> None:
        """Puts a tensor in another's place: its first rows are these of the other; the rest's running means are 0."""
        for moving in self.moving:
            if moving.tensor is before:
                moving.tensor = after.requires_grad_()
                moving.mean, moving.square = (_kept(x, after, rows) for x in (moving.mean, moving.square))


def _kept(memory: torch.Tensor, after: torch.Tensor, rows: torch.Tensor) -> torch.Tensor:
    kept = torch.zeros_like(after).detach()
    kept[: len(rows)] = memory[rows.to(memory.device)]
    return kept


def cosine(both: float, one: float, other: float) -> float:
    """Of the angle between two vectors, by their product and the squares of both; 0 where one is nothing."""
    return both / math.sqrt(one * other) if one * other > 0 else 0.0


def rate_of(unit: Unit, canvas: float, crowd: float) -> float:
    """Adam's rate for a canvas of this size, the square root of its area; `crowd` is the factor for many layers."""
    return unit.rate * (crowd if unit.crowded else 1.0) * canvas**unit.scaling


def adam_over(tensors: SceneTensors, frozen: tuple[str, ...] = ()) -> Adam:
    """Adam over all that may move, each tensor at the rate of its unit; `frozen`: names of units that may not."""
    free = [(slot.parameter.unit, v) for group in tensors.groups for slot, v in group.values.items()]
    if not tensors.transparent:
        free.append((BACKGROUND, tensors.background))
    if tensors.opaque and not COMPOSITING[tensors.compositing].hides:  # what is added to alpha is never seen
        frozen = (*frozen, OPACITY.name)
    few = MANY / max(1, tensors.layer_count)
    crowd = few**CROWDING
    canvas = math.sqrt(tensors.size[0] * tensors.size[1])
    return Adam((tensor, rate_of(unit, canvas, crowd)) for unit, tensor in free if unit.name not in frozen)

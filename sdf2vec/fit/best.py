"""What a fit returns: the best state that it has seen, and nothing that is worse than a ground alone."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import torch

from ..blend import COMPOSITING
from ..render.tensors import Group, SceneTensors

FADES = (0.7, 0.4, 0.2, 0.1, 0.05)  # shares of what shapes add to the ground
UNSEEN = 1e-6  # mean squared error, 60 dB, below which 8 bits show no difference


class Best:
    """The state of a scene at which the loss was least, of steps that leave its layers the same."""

    def __init__(self, scene: SceneTensors) -> None:
        self.tensors = [scene.background, *(t for group in scene.groups for t in group.values.values())]
        self.least, self.state = math.inf, [tensor.detach() for tensor in self.tensors]

    def see(self, loss: float) -> None:
        """The loss of the state as it is now."""
        if loss < self.least:
            self.least, self.state = loss, [tensor.detach().clone() for tensor in self.tensors]

    @torch.no_grad()
    def restore(self, loss: float) -> None:
        """Goes back to it, in place, unless now, with this loss, the scene is as good."""
        if not loss <= self.least:  # what is no number is not
            for tensor, best in zip(self.tensors, self.state, strict=True):
                tensor.copy_(best)


def faded(
    scene: SceneTensors, ground: torch.Tensor, wrong: Callable[[SceneTensors], tuple[float, ...]]
) -> SceneTensors:
    """The scene where it is no worse than both its own ground alone and another one, premultiplied RGBA [4].

    Else with all shapes so faint, on the better ground, that it is not; or without shapes. `wrong`: measures of a
    scene, of which the first decides between grounds, and tells which errors nobody sees.
    """
    own = wrong(scene)
    if own[0] < UNSEEN:
        return scene
    bare = min((replace(scene, groups=[], background=g) for g in (scene.background, ground)), key=wrong)
    least = wrong(bare)

    def is_no_worse(found: tuple[float, ...]) -> bool:
        return all(one <= other for one, other in zip(found, least, strict=True))

    if is_no_worse(own):
        return scene
    linear = COMPOSITING[scene.compositing].linear_in
    for share in FADES:
        fainter = [_fainter(group, linear, share) for group in scene.groups]
        tried = replace(scene, groups=fainter, background=bare.background)
        if is_no_worse(wrong(tried)):
            return tried
    return bare


def _fainter(group: Group, linear: tuple[str, ...], share: float) -> Group:
    values = {
        slot: tensor.detach() * share if slot.parameter.unit.name in linear else tensor.detach()
        for slot, tensor in group.values.items()
    }
    return Group(group.structure, group.order, values)


def mean_color(target: torch.Tensor, weights: torch.Tensor | None) -> torch.Tensor:
    """The ground [4] with the least squared error for a picture [C, H, W], whose pixels matter so much [H, W]."""
    share = torch.ones_like(target[0]) if weights is None else weights.square()
    mean = (target * (share / share.sum())).sum(dim=(1, 2))
    return torch.cat([mean, mean.new_ones(4 - len(mean))])


def nearest_of_its_own(scene: SceneTensors, ground: torch.Tensor) -> torch.Tensor:
    """Of the colours that a scene has, the one nearest to a ground, with the ground's alpha."""
    own = torch.cat([colors.detach() for group in scene.groups for colors in group.colors])
    near = (own * ground[3] - ground[:3]).square().sum(1).argmin() if len(own) else None
    return ground if near is None else torch.cat([own[near] * ground[3], ground[3:]])

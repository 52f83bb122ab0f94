"""Which layers leave and which come: `prune` those that matter least, `densify` where most is missing.

What is decided is pure; `exchange` alone changes a scene, and Adam's state with it.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import torch

from ..blend import COMPOSITING
from ..render.tensors import Group, SceneTensors
from .adam import Adam
from .initialization import Layers, Places, groups_at, place, straight
from .matching_pursuit import canvas_of, find_discs
from .presets import Start

PROBES = 8  # random images that estimate what a layer does to the picture
ANYWHERE = Start("uniform")
IDLE = 0.1  # layers do less than this share of what each would have to do
MOST_IDLE = 4  # of them are moved at once
ROOM = 0.8  # size of a new shape, in radii of the disc whose place it takes: its falloff lies outside of that


def importance(
    image: torch.Tensor,
    tensors: SceneTensors,
    generator: torch.Generator,
    weights: torch.Tensor | None = None,
) -> list[torch.Tensor]:
    """How much the image changes, squared and summed, when a layer is left out: [G] for each group; an estimate.

    `weights` [H, W] scale the change at each pixel.

    The image [C, H, W], before clamping, depends linearly on a layer's opacity (under `additive`, on its colours, and
    its alpha on the opacity), so that its derivative times that is the change; random signs r give
    E[(Σ r·change)²] = Σ change² (Hutchinson).
    """
    leaves = [(i, leaf) for i, group in enumerate(tensors.groups) for leaf in _linear_in(group, tensors)]
    totals = [torch.zeros(len(group)) for group in tensors.groups]
    for _ in range(PROBES):
        signs = (torch.randint(0, 2, image.shape, generator=generator).float() * 2 - 1).to(image.device)
        if weights is not None:
            signs = signs * weights
        grads = torch.autograd.grad(
            (image * signs).sum(),  # torch imports a whole algebra system when it is given the signs
            [leaf for _, leaf in leaves],
            retain_graph=True,
            allow_unused=True,  # where nothing of a group is on the canvas
            materialize_grads=True,
        )
        changes = [torch.zeros_like(total) for total in totals]
        for (index, leaf), grad in zip(leaves, grads, strict=True):
            changes[index] += (leaf.detach() * grad).sum(1).cpu()
        totals = [total + change.square() for total, change in zip(totals, changes, strict=True)]
    return totals


def _linear_in(group: Group, tensors: SceneTensors) -> list[torch.Tensor]:
    """What an image is linear in, such that a group's layers are left out where it is 0; of that what can move."""
    named = {"opacity": [group.opacity], "color": group.colors}
    found = [tensor for name in COMPOSITING[tensors.compositing].linear_in for tensor in named[name]]
    return [tensor for tensor in found if tensor.requires_grad]


def idle(
    scores: Sequence[torch.Tensor],
    image: torch.Tensor,
    target: torch.Tensor,
    weights: torch.Tensor | None = None,
) -> int:
    """How many layers do next to nothing for an image, beside what it lacks of its target; few at a time."""
    flat = torch.cat(list(scores))
    lacking = image.detach() - target
    missing = float((lacking if weights is None else lacking * weights).square().sum())
    return min(int((flat < IDLE * missing / len(flat)).sum()), MOST_IDLE)


def prune(scores: Sequence[torch.Tensor], count: int) -> list[torch.Tensor]:
    """For each group, the rows that stay when the `count` layers with the lowest scores go."""
    flat = torch.cat(list(scores))
    stays = torch.ones(len(flat), dtype=torch.bool)
    stays[flat.argsort(stable=True)[:count]] = False
    parts = stays.split([len(score) for score in scores])
    return [part.nonzero()[:, 0] for part in parts]


def densify(
    image: torch.Tensor,
    target: torch.Tensor,
    count: int,
    tensors: SceneTensors,
    layers: Layers,
    generator: torch.Generator,
    weights: torch.Tensor | None = None,
) -> list[Group]:
    """New layers on top of all others, where they bring an image [C, H, W] nearest to its target.

    As many as `count`, fewer where no more would help. `weights` [H, W]: how much an error matters.
    """
    found = find_discs(canvas_of(image, target, weights, layers.signed), count)
    height, width = target.shape[1:]
    centers, sizes = found.placed(width, height, tensors.size, ROOM)
    if layers.signed:
        amounts = torch.nn.functional.pad(found.colors, (0, 4 - found.colors.shape[1]))
        colors = amounts.clamp(-1.0, 1.0)
    else:
        colors = straight(found.colors)
    return groups_at(Places(centers, sizes, colors), layers, generator, first=tensors.layer_count)


def anywhere(
    target: torch.Tensor, count: int, tensors: SceneTensors, layers: Layers, generator: torch.Generator
) -> list[Group]:
    """New layers on top of all others, at random, in the colours of a picture [C, H, W]."""
    groups = place(target.cpu(), tensors.size, layers, count, ANYWHERE, generator).groups
    for group in groups:
        group.order += tensors.layer_count
    return groups


def add(
    tensors: SceneTensors,
    optimizer: Adam,
    image: torch.Tensor,
    target: torch.Tensor,
    count: int,
    layers: Layers,
    generator: torch.Generator,
    weights: torch.Tensor | None = None,
) -> None:
    """New layers where they help most (see `densify`); anywhere, when none would help. In place."""
    full = tensors.layer_count + count
    _append(tensors, optimizer, densify(image, target, count, tensors, layers, generator, weights))
    rest = full - tensors.layer_count
    if rest > 0:
        _append(tensors, optimizer, anywhere(target, rest, tensors, layers, generator))


def _append(tensors: SceneTensors, optimizer: Adam, fresh: Sequence[Group]) -> None:
    exchange(tensors, optimizer, [torch.arange(len(group)) for group in tensors.groups], fresh)


def relocate(
    tensors: SceneTensors, optimizer: Adam, scores: Sequence[torch.Tensor], fresh: Sequence[Group]
) -> None:
    """Puts new layers in place of as many with the lowest scores ([G] for each group)."""
    exchange(tensors, optimizer, prune(scores, sum(len(group) for group in fresh)), fresh)


def exchange(
    tensors: SceneTensors,
    optimizer: Adam,
    stays: Sequence[torch.Tensor],
    fresh: Sequence[Group],
) -> None:
    """Keeps some rows of each group and adds new ones behind them, in the scene and in the optimizer's state.

    New layers' state is 0. The draw order is counted anew; a group that loses all rows remains, empty.
    """
    for index, rows in enumerate(stays):
        old = tensors.groups[index]
        new = next((group for group in fresh if group.structure == old.structure), None)
        kept = old.each(partial(_rows_of, rows))
        joined = kept if new is None else kept.joined(new.each(partial(_beside, old.order)))
        tensors.groups[index] = joined
        for before, after in zip(old.values.values(), joined.values.values(), strict=True):
            optimizer.replace(before, after, rows)
    present = {group.structure for group in tensors.groups}
    tensors.groups += [new for new in fresh if new.structure not in present]
    _renumber(tensors.groups)


def _rows_of(rows: torch.Tensor, tensor: torch.Tensor) -> torch.Tensor:
    return tensor.detach()[rows.to(tensor.device)]


def _beside(other: torch.Tensor, tensor: torch.Tensor) -> torch.Tensor:
    return tensor.to(other.device)


def _renumber(groups: Sequence[Group]) -> None:
    """Draw orders become 0, 1, 2, … without gaps."""
    orders = torch.cat([group.order for group in groups])
    ranks = torch.empty_like(orders)
    ranks[orders.argsort(stable=True)] = torch.arange(len(orders), device=orders.device)
    for group, order in zip(groups, ranks.split([len(g) for g in groups]), strict=True):
        group.order = order

"""Layers put in, left out and moved within the draw order of a scene."""

from __future__ import annotations

import operator
from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import torch

from ..render.tensors import SceneTensors
from .stacking import Stack
from .surroundings import View, covers_of, some

MOVED = 0.98  # of the error, at most, after a layer was moved
UNSEEN = 0.5 / 255  # coverage


def opened(scene: SceneTensors, order: int) -> SceneTensors:
    """The scene with room for a layer at a place of the draw order."""
    groups = [replace(group, order=group.order + (group.order >= order)) for group in scene.groups]
    return replace(scene, groups=groups)


def without(scene: SceneTensors, order: int) -> SceneTensors:
    """The scene without the layer at a place of the draw order."""
    fewer = some(scene, partial(operator.ne, order))
    groups = [replace(group, order=group.order - (group.order > order).long()) for group in fewer.groups]
    return replace(fewer, groups=groups)


def without_all(scene: SceneTensors, orders: list[int]) -> SceneTensors:
    """The scene without the layers at these places of the draw order, which rise."""
    for order in reversed(orders):
        scene = without(scene, order)
    return scene


@torch.no_grad()
def reordered(scene: SceneTensors, view: View) -> SceneTensors:
    """The scene with each layer at the place of the draw order where the error is least."""
    stack, beside = Stack(scene, view), touching(covers_of(scene, view))
    layers = list(range(scene.layer_count))
    (error,) = stack.errors([layers])
    for order in range(len(layers)):
        touched = [place for place, other in enumerate(layers) if beside[layers[order], other]]
        places = _other_places(order, [place - (place > order) for place in touched])
        tried = [moved(layers, order, place) for place in places]
        for each, found in zip(tried, stack.errors(tried), strict=True):
            if found < MOVED * error:
                layers, error = each, found
    return ordered(scene, layers)


def moved(layers: Sequence[int], order: int, place: int) -> list[int]:
    """Layers from below with one of them at another place."""
    others = [layer for each, layer in enumerate(layers) if each != order]
    return [*others[:place], layers[order], *others[place:]]


def ordered(scene: SceneTensors, layers: Sequence[int]) -> SceneTensors:
    """The scene with its layers in an order, by their places now, from below."""
    places = torch.tensor(layers, dtype=torch.int64).argsort()
    groups = [replace(group, order=places[group.order]) for group in scene.groups]
    return replace(scene, groups=groups)


def touching(covers: torch.Tensor) -> torch.Tensor:
    """Which layers are seen in the same places, [N, N], from their coverage [N, P]."""
    seen = (covers > UNSEEN).float()
    return ((seen @ seen.T) > 0).fill_diagonal_(False)


def _other_places(order: int, touched: list[int]) -> list[int]:
    """Where else among the other layers one may be, of all places that differ: right above one that it touches, or
    below all of them.
    """
    places = [*touched[:1], *(other + 1 for other in touched)]
    here = sum(other < order for other in touched)
    return [place for below, place in enumerate(places) if below != here]

"""Layers put in, left out and moved within the draw order of a scene."""

from __future__ import annotations

import operator
from dataclasses import replace
from functools import partial

import torch

from ..render.reference import layers_at
from ..render.tensors import SceneTensors
from .surroundings import View, error_of, points_of, some

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
    error, beside = error_of(scene, view), touching(scene, view)
    for order in range(scene.layer_count):
        start = scene
        touched = [other - (other > order) for other in beside[order].nonzero()[:, 0].tolist()]
        for place in _other_places(order, touched):
            tried = moved(start, order, place)
            found = error_of(tried, view)
            if found < MOVED * error:
                scene, error, beside = tried, found, touching(tried, view)
    return scene


def moved(scene: SceneTensors, order: int, place: int) -> SceneTensors:
    """The scene with one layer at another place of the draw order."""
    others = [other for other in range(scene.layer_count) if other != order]
    others.insert(place, order)
    places = torch.tensor(others).argsort()
    groups = [replace(group, order=places[group.order]) for group in scene.groups]
    return replace(scene, groups=groups)


def touching(scene: SceneTensors, view: View) -> torch.Tensor:
    """Which layers are seen in the same places, [N, N] in draw order."""
    covers, _ = layers_at(scene, *points_of(scene, view))
    seen = (covers > UNSEEN).float()
    return ((seen @ seen.T) > 0).fill_diagonal_(False)


def _other_places(order: int, touched: list[int]) -> list[int]:
    """Where else among the other layers one may be, of all places that differ: right above one that it touches, or
    below all of them.
    """
    places = [*touched[:1], *(other + 1 for other in touched)]
    here = sum(other < order for other in touched)
    return [place for below, place in enumerate(places) if below != here]

"""Strokes of one pen: long boxes that end in half discs, of one width where theirs hardly differ."""

from __future__ import annotations

import torch

from ..render.tensors import Group, SceneTensors
from .constraints import ALMOST
from .joining import Search, detached, inserted
from .least_squares import is_simple
from .simplify import UNSEEN
from .surroundings import Surroundings, View, error_of, layer_at

STEPS = 10  # of a box whose corners have become round
LONG = 1.5  # times as long as wide
ALIKE, SAME = 0.06, 1e-4  # logarithm of what widths of one pen differ by; of what they do when they are one
AS_GOOD = 1.1  # times the mean squared error, at most


def lined(scene: SceneTensors, view: View, search: Search, worst: float) -> SceneTensors:
    """The scene with long boxes as strokes, those with round corners or as wide as a stroke where that is as good,
    others where it is better; in one width where theirs hardly differ.
    """
    error = error_of(scene, view)
    limit = max(worst, AS_GOOD * error, error + 4.0 * UNSEEN)
    layers = [layer_at(scene, order) for order in range(scene.layer_count)]
    for layer in sorted((each for each in layers if _are_long(each).any()), key=_has_corners):
        around = Surroundings.of(scene, int(layer.order), view)
        made = inserted(scene, _rounded(layer, around, search))
        most = limit
        if _has_corners(layer) and not _has_pen(scene, layer):
            most = error_of(inserted(scene, _moved(layer, around, search)), view) - UNSEEN
        scene = made if error_of(made, view) <= most else scene
    made = detached(scene)
    for group in made.groups:
        in_one_width(group, group, ALIKE)
    return made if error_of(made, view) <= limit else scene


def _has_corners(box: Group) -> bool:
    """Whether a layer of a box is not rounded."""
    return not bool(box.of("corner_radius", 0).any())


def _has_pen(scene: SceneTensors, box: Group) -> bool:
    """Whether a scene has strokes that are about as wide as a box."""
    pens = [(group, own) for group in scene.groups if (own := strokes_of(group)).any()]
    return any(bool(((_widths(group)[own] / _widths(box)).log().abs() < ALIKE).any()) for group, own in pens)


def _rounded(layer: Group, around: Surroundings, search: Search) -> Group:
    """A layer of a box with round ends, whose other numbers have moved a little."""
    made = layer.each(lambda tensor: tensor.detach().clone())
    with_round_ends(made, torch.tensor([True]))
    found = _moved(made, around, search)
    with_round_ends(found, torch.tensor([True]))
    return found


def _moved(layer: Group, around: Surroundings, search: Search) -> Group:
    """A layer of a box, nearer to what it should be with the corners that it has."""
    still = {slot for slot, v in layer.values.items() if v.numel() == 1 and is_simple(slot, float(v))}
    corner = layer.of("corner_radius", 0)
    return search.trained(
        layer, around, STEPS, lambda slot: slot not in still and layer.values[slot] is not corner
    ).layer


def strokes_of(group: Group) -> torch.Tensor:
    """Which layers [G] of a group are strokes."""
    long = _are_long(group)
    if not bool(long.any()):
        return long
    return long & (group.of("corner_radius", 0) >= ALMOST**2 * _widths(group))[:, 0]


def _are_long(group: Group) -> torch.Tensor:
    """Which layers [G] are one box each that is longer than wide."""
    if [part.kind for part in group.structure] != ["box"]:
        return torch.zeros(len(group), dtype=torch.bool)
    return group.of("half_size", 0).amax(1) > LONG * _widths(group)[:, 0]


def _widths(group: Group) -> torch.Tensor:
    """Half the widths of boxes [G, 1]."""
    return group.of("half_size", 0).amin(1, keepdim=True)


@torch.no_grad()
def with_round_ends(group: Group, which: torch.Tensor) -> None:
    """Gives some boxes [G] round ends, in place."""
    if bool(which.any()):
        corners = group.of("corner_radius", 0)
        corners.copy_(torch.where(which[:, None], ALMOST * _widths(group), corners))


@torch.no_grad()
def in_one_width(group: Group, before: Group, alike: float = SAME) -> None:
    """Makes the widths of strokes, in place, those of others that were about as wide before."""
    left = strokes_of(group).nonzero()[:, 0]
    old = _widths(before)[:, 0].log() if len(left) else left
    while len(left):
        own = left[(old[left] - old[left[0]]).abs() < alike]
        width = _widths(group)[own, 0].median()
        sides = group.of("half_size", 0)
        sides[own, sides[own].argmin(1)] = width
        group.of("corner_radius", 0)[own] = ALMOST * width
        left = left[~torch.isin(left, own)]

"""Layers of a scene thought of again, now that others are there: found anew, exchanged, merged, cut."""

from __future__ import annotations

from functools import partial

import torch

from ..paints import BASE
from ..render.tensors import SceneTensors
from .candidates import Opening, cut_from, in_place_of
from .descents import AFTER, FEW, JOINT, Sizes, descended, softened
from .description import is_longer
from .draw_order import MOVED, opened, without_all
from .joining import Search, faults_of, inserted
from .offers import NEAR, instead_of
from .pruning import NEEDLESS, pruned
from .surroundings import Surroundings, View, error_of, layer_at

HELPS = 0.92  # of the error before, at most, after what is worth a round
THROUGH = 0.1  # of the error that a cut could take away where the picture is transparent, at least, for a try
WORST, SLIGHTLY = (
    0.1,
    0.01,
)  # of all that is wrong, where a layer is whose shapes are exchanged; that is found anew
TRIES = 12  # layers that are found anew in vain, one after the other
PROMISING = 3.0  # times the error before, of another shape in the place of one, the others as they were
RISE, SOFTER = (
    8.0,
    4.0,
)  # times the error before, at most, of one shape in the place of several; pixels, of edges from which all descend
RETHOUGHT = 2  # colours whose layers are found anew in a round, at most
MUCH = 10**-2.7  # mean squared error, 27 dB, of a scene that may be other than it was thought to be


def rethought(scene: SceneTensors, sizes: Sizes, search: Search, floor: float) -> SceneTensors:
    """The scene with one shape in the place of some of a colour, found now that others are there, if that is better."""
    error = error_of(scene, sizes.joint)
    if not 1 < scene.layer_count <= FEW or error <= max(MUCH, floor):
        return scene
    for orders in _alike(scene, sizes.search)[:RETHOUGHT]:
        made = _anew(scene, orders, sizes, search, floor)
        rise = HELPS if len(orders) == 1 else NEEDLESS
        if made is not None and error_of(made, sizes.joint) < rise * error:
            return pruned(made, sizes, search, floor)
    return scene


def replaced(scene: SceneTensors, sizes: Sizes, search: Search, floor: float) -> SceneTensors:
    """The scene with one layer after the other found anew, those first where most is wrong, while that helps."""
    error, worst = error_of(scene, sizes.joint), _faulty(scene, sizes.joint, SLIGHTLY)[:TRIES]
    while worst and error > floor:
        made = _anew(scene, [worst.pop(0)], sizes, search, floor)
        if made is not None and (now := error_of(made, sizes.joint)) < MOVED * error:
            scene, error, worst = made, now, _faulty(made, sizes.joint, SLIGHTLY)[:TRIES]
    return pruned(scene, sizes, search, floor)


def merged(scene: SceneTensors, sizes: Sizes, search: Search, worst: float) -> SceneTensors:
    """The scene with one shape in the place of several of a colour, which did the work of one that was not found, such
    as a soft disc: as long as no more is wrong than the worst, or, where more is already, the picture is told more
    shortly.
    """
    for orders in _alike(scene, sizes.search) if scene.layer_count <= FEW else ():
        made = _in_one(scene, orders, sizes, search, worst) if len(orders) > 1 else None
        if made is not None:
            return merged(made, sizes, search, worst)
    return scene


def _in_one(
    scene: SceneTensors, orders: list[int], sizes: Sizes, search: Search, worst: float
) -> SceneTensors | None:
    """The scene with one layer in the place of some, without what made up for them; None where that is no better."""
    made = _anew(scene, orders, sizes, search, worst)
    error = partial(error_of, view=sizes.joint)
    if made is None or error(made) > RISE * max(error(scene), worst):
        return None
    softer = softened(made, SOFTER, sizes.joint)
    made = min((descended(each, sizes.joint, search, JOINT) for each in (made, softer)), key=error)
    made = pruned(made, sizes, search, NEEDLESS * error(made))
    made = descended(made, sizes.joint, search, JOINT)
    if error(made) <= worst:
        return made
    return made if error(scene) > worst and is_longer(scene, made, sizes.last) else None


def _anew(
    scene: SceneTensors, orders: list[int], sizes: Sizes, search: Search, floor: float
) -> SceneTensors | None:
    """The scene with one layer, found anew, in the place of some, after a descent of all; None where nothing is."""
    rest = opened(without_all(scene, orders), orders[0])
    color = layer_at(scene, orders[0]).of(BASE.name, 0)
    other = instead_of(orders[0], color, Surroundings.of(rest, orders[0], sizes.search), search, floor)
    return None if other is None else descended(inserted(rest, other), sizes.joint, search, AFTER)


def _faulty(scene: SceneTensors, view: View, share: float) -> list[int]:
    """Places in the draw order of the layers where more than a share of all is wrong, the worst first."""
    faults = faults_of(scene, view)
    worst = sorted(range(len(faults)), key=faults.__getitem__, reverse=True)
    return [order for order in worst if faults[order] > share * sum(faults)]


def carved(scene: SceneTensors, sizes: Sizes, search: Search, floor: float) -> SceneTensors:
    """The scene with shapes cut out of its layers, one after the other, while that helps: nothing can be laid on a
    layer where the picture is transparent.
    """
    error = error_of(scene, sizes.joint)
    while scene.layer_count and error > floor:
        places = [Surroundings.of(scene, order, sizes.search) for order in range(scene.layer_count)]
        cuts = [cut_from(layer_at(scene, order), around) for order, around in enumerate(places)]
        gains = [_seen_through(*pair) for pair in zip(cuts, places, strict=True)]
        best = max(range(len(gains)), key=gains.__getitem__)
        place = places[best]
        cut = search.filled(cuts[best], place, place) if gains[best] >= THROUGH * error else None
        if cut is None:
            return scene
        made = descended(inserted(scene, cut.layer), sizes.joint, search, AFTER)
        now = error_of(made, sizes.joint)
        if now > HELPS * error:
            return scene
        scene, error = made, now
    return scene


def exchanged(scene: SceneTensors, sizes: Sizes, search: Search, share: float = WORST) -> SceneTensors:
    """The scene with other shapes, of any kind, in the places of those of the layers where more than a share of all is
    wrong, where that helps.
    """
    for order in _faulty(scene, sizes.search, share):
        coarse, fine = (Surroundings.of(scene, order, view) for view in (sizes.search, sizes.joint))
        for index in range(len(layer_at(scene, order).structure)):
            layer = layer_at(scene, order)
            promised = PROMISING * coarse.error(layer)
            best = search.filled(in_place_of(layer, index, coarse), coarse, fine, promised)
            if best and best.error < MOVED * fine.error(layer):
                scene = inserted(scene, best.layer)
    return descended(scene, sizes.joint, search, AFTER)


def _seen_through(cut: Opening, around: Surroundings) -> float:
    """By how much the mean squared error may fall where a layer is cut out and the picture is transparent."""
    channels = around.target.flatten(1)
    return float((cut.mask.best_gain * (1.0 - channels[3])).mean()) if len(channels) == 4 else 0.0


def _alike(scene: SceneTensors, view: View) -> list[list[int]]:
    """Places in the draw order of layers of about one colour, those first where most is wrong."""
    faults = faults_of(scene, view)
    found: list[tuple[torch.Tensor, list[int]]] = []
    for order in range(scene.layer_count):
        color = layer_at(scene, order).of(BASE.name, 0)
        same = [orders for other, orders in found if (color - other).square().sum() < NEAR]
        if same:
            same[0].append(order)
        else:
            found.append((color, [order]))
    return sorted((orders for _, orders in found), key=lambda orders: -sum(faults[order] for order in orders))

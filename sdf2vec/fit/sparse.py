"""Few shapes: those that a picture made of shapes is made of, found in rounds, on the CPU.

Each round offers shapes to what is missing, puts them in, descends with all of them, and takes out what is not needed.
A photograph is not made of few shapes: where too many would be needed the search gives up.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import partial

from ..render.tensors import SceneTensors
from .descents import FEW, JOINT, Sizes, all_improved, descended, fine_enough, softer
from .draw_order import opened
from .joining import Search, faults_of, inserted
from .mending import HELPS, carved, exchanged, replaced, rethought
from .offers import Offer, choices, offers
from .peeling import peeled
from .pruning import FLOOR, pruned
from .ramps import lowest
from .shadows import with_shadows
from .surroundings import Surroundings, View, error_of

PATIENCE, CLOSE = 2, 10**-3.9  # rounds; mean squared error, 39 dB, below which there is none for a second


@dataclass(frozen=True, eq=False)
class Round:
    """What a round has come to: the scene, its mean squared error, and that before."""

    scene: SceneTensors
    error: float
    before: float


def grow(
    scene: SceneTensors, sizes: Sizes, search: Search, most: int, floor: float = FLOOR
) -> Iterator[Round]:
    """The scene after each round that helped, alone or with those before it, until it has as many layers as `most`, is
    near enough, or is helped no more.
    """
    error = kept = error_of(scene, sizes.joint)
    count, wasted = scene.layer_count, 0
    while scene.layer_count < most and kept > floor and wasted < (PATIENCE if kept > CLOSE else 1):
        found = _better(_alternatives(scene, sizes, search, most, floor), sizes.joint, HELPS * kept)
        if found is None:
            return
        made, now = found
        if now <= HELPS * kept or made.layer_count < count:
            yield Round(made, now, kept)
            kept, count, wasted = now, made.layer_count, 0
        elif now < error:
            wasted += 1
        else:
            return
        scene, error = made, now


def _better(made: Iterable[SceneTensors], view: View, enough: float) -> tuple[SceneTensors, float] | None:
    """The first scene whose mean squared error is low enough, or that with the lowest; and the error."""
    best: tuple[SceneTensors, float] | None = None
    for scene in made:
        error = error_of(scene, view)
        best = (scene, error) if best is None or error < best[1] else best
        if error <= enough:
            break
    return best


def _alternatives(
    scene: SceneTensors, sizes: Sizes, search: Search, most: int, floor: float
) -> Iterator[SceneTensors]:
    """What a round may come to: with shapes that explain regions, the one that gains most, holes, other shapes."""
    for found in choices(_offers(scene, sizes.search, search, floor)):
        made = all_improved(_with(scene, found[: most - scene.layer_count]), sizes, search)
        yield rethought(pruned(made, sizes, search, floor), sizes, search, floor)
    if 0 < scene.layer_count <= FEW:
        yield carved(scene, sizes, search, floor)
        yield exchanged(scene, sizes, search)
        yield replaced(scene, sizes, search, floor)


def taken_apart(scene: SceneTensors, sizes: Sizes, search: Search, most: int) -> SceneTensors:
    """The scene, bare or with a ramp, with the layers that can be told by their outlines, after a descent of all, if
    that helps; as it is where they are more than `most`.
    """
    made = peeled(scene, sizes, search)
    if not scene.layer_count < made.layer_count <= most:
        return scene
    sizes, search = fine_enough(sizes, search, made)
    made = with_shadows(made, sizes, search, most)
    made = descended(softer(made, sizes.joint, search), sizes.joint, search, JOINT)
    return min(scene, made, key=partial(error_of, view=sizes.joint))


def _offers(scene: SceneTensors, view: View, search: Search, floor: float) -> list[Offer]:
    """New layers, for the bottom of the scene, its top, or next above the layer where most is wrong; the draw order is
    that of the scene without the others.
    """
    faults = faults_of(scene, view)
    above = max(range(len(faults)), key=faults.__getitem__, default=-1) + 1
    orders = sorted({lowest(scene), above, scene.layer_count})
    around = {order: Surroundings.of(opened(scene, order), order, view) for order in orders}
    return offers(around, search, floor)


def _with(scene: SceneTensors, found: list[Offer]) -> SceneTensors:
    """The scene with new layers."""
    for offer in sorted(found, key=lambda offer: -offer.order):
        scene = inserted(opened(scene, offer.order), offer.layer)
    return scene


def needed(made: Round, flat: bool, floor: float) -> float:
    """About how many more layers the picture needs: in flat colours each as much as now, else ever less."""
    gained = made.before - made.error
    if made.error <= floor:
        return 0.0
    if gained <= 0:
        return math.inf
    if flat:
        return made.error / gained
    return math.log(made.error / floor) / math.log(made.before / made.error)

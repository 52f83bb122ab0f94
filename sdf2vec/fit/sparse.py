"""Few shapes: those that a picture made of shapes is made of, found in rounds, on the CPU.

Each round offers shapes to what is missing, puts them in, descends with all of them, and takes out what is not needed.
A photograph is not made of few shapes: where too many would be needed the search gives up.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from typing import NamedTuple

import torch

from ..paints import BASE
from ..render.reference import layers_at
from ..render.tensors import SceneTensors
from ..units import FALLOFF
from .adam import adam_over
from .candidates import Opening, cut_from, in_place_of
from .constraints import enforce_min_thickness, project
from .joining import Search, detached, faults_of, inserted
from .least_squares import count_numbers, improved
from .offers import NEAR, Offer, choices, instead_of, offers
from .peeling import peeled
from .presets import Phase
from .ramps import lowest
from .surroundings import Surroundings, View, layer_at, points_of, residual_of, some

FLOOR = 10**-4.4  # mean squared error, 44 dB: below it nothing is missing
FEW = 24  # layers that are descended one by one, too
MOST_AT_ONCE = 1200  # numbers of layers whose least squares are solved
WORTH = 6  # steps of Adam, of one by least squares
EACH = 8  # steps of such a descent
JOINT = Phase("joint", 60, 0, rate=0.3, end_rate=0.02)
AFTER = Phase("after", 40, 0, rate=0.2, end_rate=0.02)  # one layer was taken out
LAST = Phase("last", 150, 0, rate=0.3, end_rate=0.01)
MOVED = 0.98  # of the error, at most, after a layer was moved in the draw order
UNSEEN = 0.5 / 255  # coverage
HELPS = 0.92  # of the error before, at most, after as many rounds as there is patience for
PATIENCE, CLOSE = 2, 10**-3.9  # rounds; mean squared error, 39 dB, below which there is none for a second
NEEDLESS = 1.05  # how much the error may rise by a layer taken out, after a descent
LITTLE = 0.25  # at most, by this share of what a layer explains in the mean
THROUGH = 0.1  # of the error that a cut could take away where the picture is transparent, at least, for a try
WORST = 0.1  # of all that is wrong, where a layer is whose shapes are exchanged
PROMISING = (
    3.0  # times the error before, of another shape in the place of one while the others are as they were
)
SOFT = 2.0  # pixels of the picture where all descend: edges that may become soft or sharp
SOFTENED, FOUND = 0.8, 10**-3  # of the error before, and mean squared error, at most, after edges became soft
RETHOUGHT = 2  # colours whose layers are found anew in a round, at most


class Sizes(NamedTuple):
    """The picture at the sizes that are looked at: where shapes are searched, where all descend, at the end."""

    search: View
    joint: View
    last: View


class Hope(NamedTuple):
    """Which layers may turn out to be needless: so many of those that matter least, without which the error rises at
    most so many times before a descent. The others begin that so soft or softer, in pixels of the picture where all
    descend: what is sharp stays sharp.
    """

    tried: int
    rise: float
    softness: float = 0.0


USUAL = Hope(2, 6.0)
THOROUGH = Hope(6, 1000.0, 8.0)  # at the end: of two that do the work of one, either matters


@dataclass(frozen=True)
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
        made = _descended(_with(scene, found[: most - scene.layer_count]), sizes, search)
        yield _rethought(pruned(made, sizes, search, floor), sizes, search, floor)
    if 0 < scene.layer_count <= FEW:
        yield _carved(scene, sizes, search, floor)
        yield _exchanged(scene, sizes, search)


def taken_apart(scene: SceneTensors, sizes: Sizes, search: Search, most: int) -> SceneTensors:
    """The bare scene with the layers that can be told by their outlines, after a descent of all, if that helps; as it
    is where they are more than `most`.
    """
    made = peeled(scene, sizes, search)
    if not 0 < made.layer_count <= most:
        return scene
    made = softer(descended(made, sizes.joint, search, JOINT), sizes.joint, search)
    made = descended(made, sizes.joint, search, JOINT)
    return min(scene, made, key=partial(error_of, view=sizes.joint))


def softer(scene: SceneTensors, view: View, search: Search) -> SceneTensors:
    """The scene after a descent from softer edges, if that is clearly better: what is sharp hardly becomes soft by
    itself. Not where much is missing, which softness would make up for.
    """
    made = descended(_softened(scene, SOFT, view), view, search, AFTER)
    helps = error_of(made, view) <= min(SOFTENED * error_of(scene, view), FOUND)
    return made if helps else scene


def finished(scene: SceneTensors, sizes: Sizes, search: Search) -> SceneTensors:
    """The scene after a last descent at the largest size; what is simple stays so."""
    made = descended(scene, sizes.last, search, LAST, simple=True)
    return min(scene, made, key=partial(error_of, view=sizes.last))


@torch.no_grad()
def error_of(scene: SceneTensors, view: View) -> float:
    """The weighted mean squared error."""
    return float(_wrong(scene, view))


def _wrong(scene: SceneTensors, view: View) -> torch.Tensor:
    return residual_of(scene, view).square().mean()


def _offers(scene: SceneTensors, view: View, search: Search, floor: float) -> list[Offer]:
    """New layers, for the bottom of the scene, its top, or next above the layer where most is wrong; the draw order is
    that of the scene without the others.
    """
    faults = faults_of(scene, view) if scene.groups else [0.0]
    above = max(range(len(faults)), key=faults.__getitem__) + 1
    orders = sorted({lowest(scene), min(above, scene.layer_count), scene.layer_count})
    around = {order: Surroundings.of(_opened(scene, order), order, view) for order in orders}
    return offers(around, search, floor)


def _opened(scene: SceneTensors, order: int) -> SceneTensors:
    """The scene with room for a layer at a place of the draw order."""
    groups = [replace(group, order=group.order + (group.order >= order)) for group in scene.groups]
    return replace(scene, groups=groups)


def _with(scene: SceneTensors, found: list[Offer]) -> SceneTensors:
    """The scene with new layers."""
    for offer in sorted(found, key=lambda offer: -offer.order):
        scene = inserted(_opened(scene, offer.order), offer.layer)
    return scene


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


# --- descents -------------------------------------------------------------------------------------------------


def _descended(scene: SceneTensors, sizes: Sizes, search: Search) -> SceneTensors:
    """The scene after a descent of each layer, where they are few, and of all together."""
    if scene.layer_count <= FEW:
        scene = _each_improved(scene, sizes.search, search)
    made = descended(scene, sizes.joint, search, JOINT)
    made = min(made, scene, key=partial(error_of, view=sizes.joint))
    return _reordered(made, sizes.joint) if made.layer_count <= FEW else made


def _each_improved(scene: SceneTensors, view: View, search: Search) -> SceneTensors:
    """The scene with each layer at its best place of the draw order, and nearer to what it should be."""
    scene = _reordered(scene, view)
    for order in range(scene.layer_count):
        scene = _improved(scene, order, view, search)
    return scene


@torch.no_grad()
def _reordered(scene: SceneTensors, view: View) -> SceneTensors:
    """The scene with each layer at the place of the draw order where the error is least."""
    error, touching = error_of(scene, view), _touching(scene, view)
    for order in range(scene.layer_count):
        layer, rest = layer_at(scene, order), without(scene, order)
        touched = [other - (other > order) for other in touching[order].nonzero()[:, 0].tolist()]
        for place in _other_places(order, touched):
            moved = inserted(_opened(rest, place), replace(layer, order=torch.tensor([place])))
            found = error_of(moved, view)
            if found < MOVED * error:
                scene, error, touching = moved, found, _touching(moved, view)
    return scene


def _touching(scene: SceneTensors, view: View) -> torch.Tensor:
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


@torch.no_grad()
def _improved(scene: SceneTensors, order: int, view: View, search: Search) -> SceneTensors:
    """The scene with one layer nearer to what it should be."""
    layer, around = layer_at(scene, order), Surroundings.of(scene, order, view)
    tried = search.trained(layer, around, EACH, lambda slot: True)
    better = tried.error < around.error(layer)
    return inserted(scene, tried.layer) if better else scene


def _rethought(scene: SceneTensors, sizes: Sizes, search: Search, floor: float) -> SceneTensors:
    """The scene with one shape in the place of some of a colour, found now that others are there, if that is better."""
    error = error_of(scene, sizes.joint)
    if not 1 < scene.layer_count <= FEW or error <= floor:
        return scene
    for orders in _alike(scene, sizes.search)[:RETHOUGHT]:
        opened = _opened(without_all(scene, orders), orders[0])
        color = layer_at(scene, orders[0]).of(BASE.name, 0)
        around = Surroundings.of(opened, orders[0], sizes.search)
        other = instead_of(orders[0], color, around, search, floor)
        if other is None:
            continue
        made = descended(inserted(opened, other), sizes.joint, search, AFTER)
        now = error_of(made, sizes.joint)
        if now < (HELPS if len(orders) == 1 else NEEDLESS) * error:
            return pruned(made, sizes, search, floor)
    return scene


def _carved(scene: SceneTensors, sizes: Sizes, search: Search, floor: float) -> SceneTensors:
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


def _exchanged(scene: SceneTensors, sizes: Sizes, search: Search) -> SceneTensors:
    """The scene with other shapes, of any kind, in the places of those of the worst layers where that helps."""
    faults = faults_of(scene, sizes.search)
    worst = [order for order, fault in enumerate(faults) if fault > WORST * sum(faults)]
    for order in worst:
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


def descended(
    scene: SceneTensors, view: View, search: Search, phase: Phase, simple: bool = False
) -> SceneTensors:
    """A copy of the scene after a phase of steps down the squared error, all numbers together; `simple` ones stay.

    By least squares where the numbers are few enough, of which a step is worth many of Adam's.
    """
    if count_numbers(scene) <= MOST_AT_ONCE:
        return improved(scene, view, search, phase.steps // WORTH, simple)
    scene = detached(scene)
    optimizer = adam_over(scene)
    with torch.enable_grad():
        for rate in phase.rates():
            optimizer.zero_grad()
            error = _wrong(scene, view)
            error.backward()
            optimizer.step(rate)
            project(scene, search.pixel, search.falloff)
            search.tick(float(error.detach()))
    enforce_min_thickness(scene, search.pixel)
    return detached(scene)


# --- what is not needed ---------------------------------------------------------------------------------------


def pruned(
    scene: SceneTensors, sizes: Sizes, search: Search, worst: float = FLOOR, hope: Hope = USUAL
) -> SceneTensors:
    """The scene without layers that it does as well without, or stays within the worst mean squared error."""
    error, bare = error_of(scene, sizes.joint), error_of(replace(scene, groups=[]), sizes.joint)
    while scene.layer_count:
        little = LITTLE * max(bare - error, 0.0) / scene.layer_count
        limit = max(error + min((NEEDLESS - 1.0) * error, little), worst)
        fewer = _bare(scene, sizes, search, limit, hope) if hope.softness else None
        fewer = fewer or _fewer(scene, sizes, search, limit, hope)
        if fewer is None:
            return scene
        scene, error = fewer
    return scene


def _bare(
    scene: SceneTensors, sizes: Sizes, search: Search, worst: float, hope: Hope
) -> tuple[SceneTensors, float] | None:
    """The scene without all smaller layers that touch one, and its error, if that is at most the worst.

    Together they may be the soft edge of that one.
    """
    covers, _ = layers_at(scene, *points_of(scene, sizes.joint))
    areas, touching = covers.sum(1), _touching(scene, sizes.joint)
    for order in areas.argsort(descending=True).tolist():
        smaller = (touching[order] & (areas < areas[order])).nonzero()[:, 0].tolist()
        if len(smaller) > 1:
            fewer, error = _settled(without_all(scene, smaller), sizes, search, hope)
            if error <= worst:
                return fewer, error
    return None


def _settled(scene: SceneTensors, sizes: Sizes, search: Search, hope: Hope) -> tuple[SceneTensors, float]:
    """The scene after a descent from softer edges, and its error."""
    scene = _softened(scene, hope.softness, sizes.joint)
    if scene.layer_count <= FEW // 2:
        scene = _each_improved(scene, sizes.search, search)
    scene = descended(scene, sizes.joint, search, AFTER)
    return scene, error_of(scene, sizes.joint)


def _fewer(
    scene: SceneTensors, sizes: Sizes, search: Search, worst: float, hope: Hope
) -> tuple[SceneTensors, float] | None:
    """The scene without one of the layers that matter least, and its error, if that is at most the worst."""
    rest = [without(scene, order) for order in range(scene.layer_count)]
    tried = [(error_of(fewer, sizes.joint), fewer) for fewer in rest]
    least = sorted(tried, key=lambda pair: pair[0])[: hope.tried]
    hopeful = [pair for pair in least if pair[0] <= hope.rise * worst]
    for error, fewer in sorted(hopeful, key=lambda pair: count_numbers(pair[1])):
        if error > worst and fewer.layer_count:
            fewer, error = _settled(fewer, sizes, search, hope)
        if error <= worst:
            return fewer, error
    return None


def _softened(scene: SceneTensors, pixels: float, view: View) -> SceneTensors:
    """The scene with no edge that is less soft than so many pixels of a view."""
    made, least = detached(scene), pixels / min(view.target.shape[1:])
    for group in made.groups:
        for slot, values in group.values.items():
            if slot.parameter.unit is FALLOFF:
                values.clamp_(min=least)
    return made


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

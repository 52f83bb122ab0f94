"""Layers that a scene does as well without, taken out: verified by the error after a descent of the rest."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

from ..render.tensors import SceneTensors
from .descents import AFTER, FEW, Sizes, descended, each_improved, softened
from .description import is_longer
from .draw_order import reordered, touching, without, without_all
from .joining import Search
from .least_squares import count_numbers
from .stacking import Stack
from .surroundings import covers_of, error_of, local_error

FLOOR = 10**-4.4  # mean squared error, 44 dB: below it nothing is missing
NEEDLESS = 1.05  # how much the error may rise by a layer taken out, after a descent
NEARLY = 1.2  # times that, after a descent of all, where one of each layer may help
SEEN = (6.0 / 255) ** 2  # by how much the mean of the squared errors nearby may rise
LITTLE = 0.25  # at most, by this share of what a layer explains in the mean


class Hope(NamedTuple):
    """Which layers may turn out to be needless: so many of those that matter least, without which the error rises at
    most so many times before a descent. The others begin that so soft or softer, in pixels of the picture where all
    descend: what is sharp stays sharp. Where it is to be `brief` the picture must be told as shortly without the layer.
    """

    tried: int
    rise: float
    softness: float = 0.0
    brief: bool = False


USUAL = Hope(2, 6.0)
BRIEF = Hope(4, 6.0, brief=True)
THOROUGH = Hope(6, 1000.0, 8.0)  # at the end: of two that do the work of one, either matters


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
    covers = covers_of(scene, sizes.joint)
    areas, beside = covers.sum(1), touching(covers)
    for order in areas.argsort(descending=True).tolist():
        smaller = (beside[order] & (areas < areas[order])).nonzero()[:, 0].tolist()
        if len(smaller) > 1:
            fewer, error = _settled(without_all(scene, smaller), sizes, search, worst, hope)
            if error <= worst and not _is_seen(fewer, scene, sizes):
                return fewer, error
    return None


def _is_seen(fewer: SceneTensors, scene: SceneTensors, sizes: Sizes) -> bool:
    """Whether somewhere a picture is clearly farther from a scene than from another."""
    one, other = (local_error(each, sizes.joint) for each in (fewer, scene))
    return float((one - other).max()) > SEEN


def _settled(
    scene: SceneTensors, sizes: Sizes, search: Search, worst: float, hope: Hope
) -> tuple[SceneTensors, float]:
    """The scene after a descent, and its error. Where layers are few each is first put where it serves best in the draw
    order: one may be there twice, once below what it lies on. Where the error is too high then each of them descends,
    too: from softer edges, or where not much is missing.
    """
    few = scene.layer_count <= FEW // 2
    scene = reordered(scene, sizes.joint) if few else scene
    made = descended(scene, sizes.joint, search, AFTER)
    error = error_of(made, sizes.joint)
    if error <= worst or not (hope.softness or (few and error <= NEARLY * worst)):
        return made, error
    if hope.softness:
        made = softened(scene, hope.softness, sizes.joint)
    made = each_improved(made, sizes.search, search) if few else made
    made = descended(made, sizes.joint, search, AFTER)
    return made, error_of(made, sizes.joint)


def _fewer(
    scene: SceneTensors, sizes: Sizes, search: Search, worst: float, hope: Hope
) -> tuple[SceneTensors, float] | None:
    """The scene without one of the layers that matter least, and its error, if that is at most the worst."""
    errors = Stack(scene, sizes.joint).errors_without_each()
    least = sorted(range(len(errors)), key=errors.__getitem__)[: hope.tried]
    hopeful = [
        (errors[order], without(scene, order)) for order in least if errors[order] <= hope.rise * worst
    ]
    for error, fewer in sorted(hopeful, key=lambda pair: count_numbers(pair[1])):
        if error > worst and fewer.layer_count:
            fewer, error = _settled(fewer, sizes, search, worst, hope)
        if error > worst or (hope.brief and is_longer(fewer, scene, sizes.joint)):
            continue
        if not (hope.softness and _is_seen(fewer, scene, sizes)):
            return fewer, error
    return None

"""All the numbers of a scene, or those of one layer after the other, brought nearer to a picture."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import torch

from ..blend import SUBTRACTION
from ..render.tensors import SceneTensors
from ..units import FALLOFF
from .adam import adam_over
from .constraints import count_shorter, enforce_min_thickness, least_length, project
from .draw_order import reordered
from .joining import Search, detached, inserted
from .least_squares import count_numbers, improved
from .presets import Phase
from .surroundings import Surroundings, View, error_of, layer_at, squared_error

FEW = 48  # layers that are descended one by one, too
MOST_AT_ONCE = 1200  # numbers of layers whose least squares are solved
WORTH = 6  # steps of Adam, of one by least squares
EACH = 8  # steps of such a descent
JOINT = Phase("joint", 60, 0, rate=0.3, end_rate=0.02)
AFTER = Phase("after", 40, 0, rate=0.2, end_rate=0.02)  # one layer was taken out
LAST = Phase("last", 150, 0, rate=0.3, end_rate=0.01)
SOFT = 2.0  # pixels of the picture where all descend: edges that may become soft or sharp
SOFTENED, FOUND = 0.8, 10**-3  # of the error before, and mean squared error, at most, after edges became soft
# pixels of falloff, where a picture is seen largest, of what may be sharp; times the error that it may then have
NEARLY_SHARP, ABOUT = 2.5, 1.5
THIN = 0.75  # pixels of the picture where all descend: half a width of which too little is seen there


class Sizes(NamedTuple):
    """The picture at the sizes that are looked at: where shapes are searched, where all descend, at the end."""

    search: View
    joint: View
    last: View


def fine_enough(sizes: Sizes, search: Search, scene: SceneTensors) -> tuple[Sizes, Search]:
    """The same where shapes may be as thin as those of a scene, and all descend where these are seen if most are so."""
    if 2 * count_shorter(scene, THIN * scene.size[1] / sizes.joint.target.shape[1]) > scene.layer_count:
        sizes = sizes._replace(joint=sizes.last)
    return sizes, replace(search, shortest=least_length(scene, search.pixel))


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
            error = squared_error(scene, view)
            error.backward()
            optimizer.step(rate)
            project(scene, search.least, search.falloff)
            search.tick(float(error.detach()))
    enforce_min_thickness(scene, search.pixel)
    return detached(scene)


def all_improved(scene: SceneTensors, sizes: Sizes, search: Search) -> SceneTensors:
    """The scene after a descent of each layer, where they are few, and of all together."""
    if scene.layer_count <= FEW:
        scene = each_improved(scene, sizes.search, search)
    made = descended(scene, sizes.joint, search, JOINT)
    made = min(made, scene, key=partial(error_of, view=sizes.joint))
    return reordered(made, sizes.joint) if made.layer_count <= FEW else made


def each_improved(scene: SceneTensors, view: View, search: Search) -> SceneTensors:
    """The scene with each layer at its best place of the draw order, and nearer to what it should be."""
    scene = reordered(scene, view)
    for order in range(scene.layer_count):
        scene = _improved(scene, order, view, search)
    return scene


@torch.no_grad()
def _improved(scene: SceneTensors, order: int, view: View, search: Search) -> SceneTensors:
    """The scene with one layer nearer to what it should be."""
    layer, around = layer_at(scene, order), Surroundings.of(scene, order, view)
    tried = search.trained(layer, around, EACH, lambda slot: True)
    better = tried.error < around.error(layer)
    return inserted(scene, tried.layer) if better else scene


def softer(scene: SceneTensors, view: View, search: Search) -> SceneTensors:
    """The scene after a descent from softer edges, if that is clearly better: what is sharp hardly becomes soft by
    itself. Not where much is missing, which softness would make up for.
    """
    made = descended(softened(scene, SOFT, view), view, search, AFTER)
    helps = error_of(made, view) <= min(SOFTENED * error_of(scene, view), FOUND)
    return made if helps else scene


def sharper(scene: SceneTensors, sizes: Sizes, search: Search, floor: float) -> SceneTensors:
    """The scene with all edges sharp that are nearly so, or else with some, after a descent, where it comes about as
    near, or below a mean squared error: soft ones tell what antialiasing does, which goes with the size at which they
    were found.
    """
    least = NEARLY_SHARP / min(sizes.last.target.shape[1:])
    nearly = [
        order for order in range(scene.layer_count) if 0.0 < float(layer_at(scene, order).falloff) < least
    ]
    if not nearly:
        return scene
    limit = max(ABOUT * error_of(scene, sizes.last), floor)

    def tried(scene: SceneTensors, orders: Sequence[int]) -> SceneTensors | None:
        made = descended(_sharpened(scene, orders, least), sizes.last, search, LAST, simple=True)
        return made if error_of(made, sizes.last) <= limit else None

    if made := tried(scene, nearly):
        return made
    for order in nearly if len(nearly) <= FEW else ():
        scene = tried(scene, [order]) or scene
    return scene


def _sharpened(scene: SceneTensors, orders: Sequence[int], least: float) -> SceneTensors:
    """A copy with the edges of some layers sharp that are less soft; they stay where coverage was one half."""
    made = detached(scene)
    for group in made.groups:
        chosen = torch.isin(group.order, torch.tensor(orders))[:, None] & (group.falloff < least)
        nearly = torch.where(chosen, group.falloff, 0.0)
        for slot, values in group.values.items():
            if slot.part is not None and slot.parameter.positive:
                inwards = group.structure[slot.part].join == SUBTRACTION
                values.add_(nearly * (-0.5 if inwards else 0.5)).clamp_(min=0.0)
        group.falloff.sub_(nearly)
    return made


def softened(scene: SceneTensors, pixels: float, view: View) -> SceneTensors:
    """The scene with no edge that is less soft than so many pixels of a view."""
    made, least = detached(scene), pixels / min(view.target.shape[1:])
    for group in made.groups:
        for slot, values in group.values.items():
            if slot.parameter.unit is FALLOFF:
                values.clamp_(min=least)
    return made


def finished(scene: SceneTensors, sizes: Sizes, search: Search) -> SceneTensors:
    """The scene after a last descent at the largest size; what is simple stays so."""
    made = descended(scene, sizes.last, search, LAST, simple=True)
    return min(scene, made, key=partial(error_of, view=sizes.last))

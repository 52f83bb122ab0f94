"""Shadows and glows: under what is opaque and sharp, the same shape, soft and translucent."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import torch

from ..layer import FALLOFF_SLOT, OPACITY_SLOT
from ..paints import BASE
from ..render.tensors import Group, SceneTensors
from .descents import FEW, JOINT, Sizes, descended
from .draw_order import opened
from .joining import Search, inserted
from .ramps import lowest
from .surroundings import Surroundings, error_of, layer_at

OPAQUE = 0.9  # opacity of what may cast one, at least
SHARP = 2.0  # pixels of the largest picture: the falloff of that, at most
FALLOFFS = 0.03, 0.08, 0.2  # scene units, of which the likeliest is taken
ENOUGH = 10**-4.0  # mean squared error, 40 dB, below which none is looked for
LEAST = 0.01  # share of all that is missing, that one takes away
EXPLAINED, NEARBY = 0.2, 0.02  # share of what is missing there, too; coverage of what is there
HELPS, FOUND = 0.8, 10**-3  # of the error before, and mean squared error, at most, with all of them
SEEN = 0.3  # of it, at least: the rest lies under other layers
FAINTEST, STRONGEST = 0.02, 0.95  # opacity
CLEAR = 0.1  # of what is below, by which an opacity is told
TINY = 1e-9


@torch.no_grad()
def with_shadows(scene: SceneTensors, sizes: Sizes, search: Search, most: int) -> SceneTensors:
    """The scene after a descent of all, with what its layers cast where that clearly helps, first what is seen most; up
    to `most` layers.
    """
    made, casting = descended(scene, sizes.joint, search, JOINT), list(range(scene.layer_count))
    error = error_of(made, sizes.joint)
    while 0 < len(casting) <= FEW and error > ENOUGH:
        more, left = _with_more(scene, casting, sizes, LEAST * error, most)
        if len(left) == len(casting):
            break
        more = descended(descended(more, sizes.joint, search, JOINT), sizes.joint, search, JOINT)
        now = error_of(more, sizes.joint)
        if now > min(HELPS * error, FOUND):
            break
        scene = made = more
        casting, error = left, now
    return made


def _with_more(
    scene: SceneTensors, casting: Sequence[int], sizes: Sizes, least: float, most: int
) -> tuple[SceneTensors, list[int]]:
    """The scene with what some of its layers cast, by their places in the draw order, where that takes away so much of
    the mean squared error; and the places of those of which nothing is seen yet.
    """
    places, left = list(casting), []
    gains = [_shadow(scene, place, sizes).gain for place in places]
    for index in sorted(range(len(places)), key=lambda index: -gains[index]):
        may = gains[index] >= least and scene.layer_count < most
        shadow = _shadow(scene, places[index], sizes) if may else None
        if shadow is None or shadow.gain < least:
            left.append(index)
            continue
        order = int(shadow.layer.order)
        scene = inserted(opened(scene, order), shadow.layer)
        places = [place + (place >= order) for place in places]
    return scene, [places[index] for index in left]


class Shadow(NamedTuple):
    """What a layer casts, at its place of the draw order, and by how much the mean squared error falls with it."""

    layer: Group
    gain: float


def _shadow(scene: SceneTensors, order: int, sizes: Sizes) -> Shadow:
    """What a layer casts: on what is next below it, or below all that there is."""
    layer = layer_at(scene, order)
    pixel = 1.0 / min(sizes.last.target.shape[1:])
    if float(layer.opacity) < OPAQUE or float(layer.falloff) > SHARP * pixel:
        return Shadow(layer, 0.0)
    cast = [
        _cast(layer, Surroundings.of(opened(scene, place), place, sizes.joint), place)
        for place in {order, lowest(scene)}
    ]
    return max(cast, key=lambda shadow: shadow.gain)


def _cast(layer: Group, around: Surroundings, place: int) -> Shadow:
    """What a layer casts at a place of the draw order."""
    through, missing = around.light - around.dark, around.residual.flatten(1)
    soft = [layer.setting(FALLOFF_SLOT, each) for each in FALLOFFS]
    covers = around.covers(layer.structure, torch.cat([layer.rows(), *(each.rows() for each in soft)]))
    beyond = covers[0] < NEARBY  # its own edge may be off by parts of a pixel
    covers = covers[1:] * beyond
    felt = covers[:, None] * through * around.weights
    power = felt.square().sum(2).clamp_min(TINY)
    amounts = (felt * missing).sum(2) / power  # by which the colour must change, by least squares
    gains = (amounts.square() * power).sum(1) / missing.numel()
    near = (covers > NEARBY) & (through.mean(0) > NEARBY)
    wrong = (missing.square().sum(0) * near).sum(1) / missing.numel()
    seen = (covers * through.mean(0)).sum(1) / covers.sum(1).clamp_min(TINY)
    gains = torch.where((gains > EXPLAINED * wrong) & (seen > SEEN), gains, 0.0)
    best = int(gains.argmax())
    under = (felt[best].square() * around.below).sum(1) / power[best]
    made = _colored(soft[best], amounts[best], under)
    return Shadow(replace(made, order=torch.full_like(layer.order, place)), float(gains[best]))


def _colored(layer: Group, change: torch.Tensor, under: torch.Tensor) -> Group:
    """A layer that changes premultiplied channels [C] by so much: of what is opaque the most translucent that can."""
    rest = 1.0 - under[3:]
    if len(rest) and rest > CLEAR:
        opacity = float(change[3] / rest)
    else:
        room = torch.where(change[:3] < 0, under[:3], 1.0 - under[:3]).clamp_min(TINY)
        opacity = float((change[:3].abs() / room).max())
    opacity = min(max(opacity, FAINTEST), STRONGEST)
    color = (under[:3] + change[:3] / opacity).clamp(0.0, 1.0)
    values = {
        slot: color.expand_as(value).clone() if slot.parameter is BASE else value
        for slot, value in layer.values.items()
    }
    return replace(layer, values=values).setting(OPACITY_SLOT, opacity)

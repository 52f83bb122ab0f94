"""Shadows and glows: under what is opaque and sharp, the same shape, soft and translucent."""

from __future__ import annotations

from dataclasses import replace

import torch

from ..layer import LOOK, Slot
from ..paints import BASE
from ..render.tensors import Group, SceneTensors
from .descents import JOINT, Sizes, descended
from .draw_order import opened
from .joining import Search, inserted
from .surroundings import Surroundings, error_of, layer_at

OPAQUE = 0.9  # opacity of what may cast one, at least
SHARP = 2.0  # pixels of the largest picture: the falloff of that, at most
FALLOFFS = 0.03, 0.08, 0.2  # scene units, of which the likeliest is taken
ENOUGH = 10**-4.0  # mean squared error, 40 dB, below which none is looked for
LEAST = 0.01  # share of all that is missing, that one takes away
EXPLAINED, NEARBY = 0.2, 0.02  # share of what is missing there, too; coverage of what is there
HELPS, FOUND = 0.8, 10**-2.5  # of the error before, and mean squared error, at most, with all of them
FAINTEST, STRONGEST = 0.02, 0.95  # opacity
TINY = 1e-9
OPACITY, FALLOFF = (Slot(None, parameter) for parameter in LOOK)


@torch.no_grad()
def with_shadows(scene: SceneTensors, sizes: Sizes, search: Search) -> SceneTensors:
    """The scene after a descent of all, with what its layers cast where that clearly helps."""
    bare = descended(scene, sizes.joint, search, JOINT)
    before = error_of(bare, sizes.joint)
    if before <= ENOUGH:
        return bare
    made, order = scene, 0
    for _ in range(scene.layer_count):
        shadow = _shadow(made, order, sizes, LEAST * before)
        if shadow is not None:
            made = inserted(opened(made, order), shadow)
            order += 1
        order += 1
    if made is scene:
        return bare
    made = descended(descended(made, sizes.joint, search, JOINT), sizes.joint, search, JOINT)
    return made if error_of(made, sizes.joint) <= min(HELPS * before, FOUND) else bare


def _shadow(scene: SceneTensors, order: int, sizes: Sizes, least: float) -> Group | None:
    """What a layer casts, to be put in its place of the draw order, below it; None if that is not seen."""
    layer = layer_at(scene, order)
    pixel = 1.0 / min(sizes.last.target.shape[1:])
    if float(layer.opacity) < OPAQUE or float(layer.falloff) > SHARP * pixel:
        return None
    around = Surroundings.of(opened(scene, order), order, sizes.joint)
    through, missing = around.light - around.dark, around.residual.flatten(1)
    soft = [
        replace(layer, values={**layer.values, FALLOFF: torch.full_like(layer.falloff, each)})
        for each in FALLOFFS
    ]
    covers = around.covers(layer.structure, torch.cat([each.rows() for each in soft]))
    felt = covers[:, None] * through * around.weights
    power = felt.square().sum(2).clamp_min(TINY)
    amounts = (felt * missing).sum(2) / power  # by which the colour must change, by least squares
    gains = (amounts.square() * power).sum(1) / missing.numel()
    near = (covers > NEARBY) & (through.mean(0) > NEARBY)
    wrong = (missing.square().sum(0) * near).sum(1) / missing.numel()
    gains = torch.where(gains > EXPLAINED * wrong, gains, 0.0)
    best = int(gains.argmax())
    if gains[best] < least:
        return None
    under = (felt[best].square() * around.below).sum(1) / power[best]
    return _colored(soft[best], amounts[best, :3], under[:3])


def _colored(layer: Group, change: torch.Tensor, under: torch.Tensor) -> Group | None:
    """A layer that changes a colour [3] by so much, the most translucent that can; None where that is hardly seen."""
    room = torch.where(change < 0, under, 1.0 - under).clamp_min(TINY)
    opacity = min(float((change.abs() / room).max()), STRONGEST)
    if opacity < FAINTEST:
        return None
    color = (under + change / opacity).clamp(0.0, 1.0)
    values = {
        slot: color.expand_as(value).clone() if slot.parameter is BASE else value
        for slot, value in layer.values.items()
    }
    return replace(layer, values={**values, OPACITY: torch.full_like(layer.opacity, opacity)})

"""As few decimals as a picture needs: rounded as coarsely as hardly changes the render."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace

import torch
from msgspec import structs

from ..image import Picture
from ..render import fused
from ..render.tensors import Group, SceneTensors, from_scene, to_scene
from ..scene import Scene
from ..units import BACKGROUND, COLOR, Unit
from .constraints import thicknesses_of
from .loop import Callback, fit_picture
from .settings import Settings, preset_of
from .views import view_of

RESOLUTION = 512  # pixels squared
LOSS = 0.002  # of the mean squared error, that rounding may add: less than 0.01 dB
GOING_ON = 0.5  # of a preset's steps, for a fit that goes on from one of about as many shapes
UNSEEN = (0.1 / 255) ** 2  # mean squared change of a render that is always allowed: a tenth of a level


def fit_concisely(
    picture: Picture, settings: Settings, callback: Callback, found: Scene | None = None
) -> Scene:
    """A fit of so many shapes, with no more digits than it needs.

    `found`: what a fit of about as many came to, or of up to twice or half as many. Going on from it takes half the
    steps, and comes as near. Not where a fit begins with other short ones, or ends with trials.
    """
    preset = None
    if found and not (len(settings.kinds) > 1 or settings.cuts or settings.trials):
        settings, preset = structs.replace(settings, start=found), preset_of(settings).paced(GOING_ON)
    return concise(fit_picture(picture, settings, callback, preset), picture, settings)


def concise(scene: Scene, picture: Picture, settings: Settings) -> Scene:
    """The scene with all numbers of a unit rounded to as few decimals as its nearness to the picture allows.

    How far its render moves by that is measured, unit by unit, and how much farther from the picture that is. Colours
    that were chosen stay what they are.
    """
    view = view_of(picture.premultiplied, settings, RESOLUTION)
    tensors = from_scene(scene)
    wrong = _apart(_drawn(tensors, view.target.shape), view.target)
    still = (COLOR, BACKGROUND) if settings.palette or settings.colors else ()
    units = _units_of(tensors, still)
    allowed = max(LOSS * wrong, UNSEEN) / max(len(units), 1)
    for unit in units:
        tensors = _coarsest(tensors, unit, view.target, allowed, 1.0 / min(picture.width, picture.height))
    return to_scene(tensors, scene.width, scene.height)


def _units_of(scene: SceneTensors, without: Collection[Unit]) -> list[Unit]:
    """What a scene's numbers are, in the order in which they come."""
    every = [slot.parameter.unit for group in scene.groups for slot in group.values]
    return [unit for unit in dict.fromkeys([*every, BACKGROUND]) if unit not in without]


def _coarsest(
    scene: SceneTensors, unit: Unit, target: torch.Tensor, allowed: float, pixel: float
) -> SceneTensors:
    """The scene with the numbers of a unit rounded as far as that moves its render, and away from a target, by no more
    than is allowed.
    """
    before = _drawn(scene, target.shape)
    farthest = _apart(before, target) + allowed
    for decimals in range(unit.decimals - 1, 0, -1):
        tried = _rounded(scene, unit, decimals, pixel)
        drawn = _drawn(tried, target.shape)
        if _apart(drawn, before) > allowed or _apart(drawn, target) > farthest:
            break
        scene = tried
    return scene


def _rounded(scene: SceneTensors, unit: Unit, decimals: int, pixel: float) -> SceneTensors:
    """The scene with the numbers of a unit rounded; what must be positive stays so, and nothing gets too thin."""
    if unit is BACKGROUND and scene.opaque:
        return replace(scene, background=scene.background.round(decimals=decimals))
    thickness = [_thickness(scene, group) for group in scene.groups]
    rounded = replace(scene, groups=[_rounded_group(group, unit, decimals) for group in scene.groups])
    thin = [
        _thickness(rounded, group) < before.clamp(max=pixel)
        for group, before in zip(rounded.groups, thickness, strict=True)
    ]
    kept = [_unless(*groups) for groups in zip(thin, rounded.groups, scene.groups, strict=True)]
    return replace(rounded, groups=kept)


def _thickness(scene: SceneTensors, group: Group) -> torch.Tensor:
    """The least width of each layer's shapes, [G], in scene units."""
    return torch.stack(thicknesses_of(replace(scene, groups=[group]))).amin(0)


def _unless(which: torch.Tensor, new: Group, old: Group) -> Group:
    """The new layers but for some, which stay the old ones."""
    values = {
        slot: torch.where(which[:, None], old.values[slot], tensor) for slot, tensor in new.values.items()
    }
    return Group(new.structure, new.order, values)


def _rounded_group(group: Group, unit: Unit, decimals: int) -> Group:
    values = {
        slot: tensor.round(decimals=decimals).clamp_min(
            10.0**-decimals if slot.parameter.positive else unit.low
        )
        if slot.parameter.unit is unit
        else tensor
        for slot, tensor in group.values.items()
    }
    return Group(group.structure, group.order, values)


def _apart(a: torch.Tensor, b: torch.Tensor) -> float:
    """Mean squared difference."""
    return float((a - b).square().mean())


@torch.no_grad()
def _drawn(scene: SceneTensors, shape: torch.Size) -> torch.Tensor:
    channels, height, width = shape
    return fused.composite(scene, width, height, channels)

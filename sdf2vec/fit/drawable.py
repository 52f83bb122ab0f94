"""A scene as a small drawing can say it: corners on a grid, few softnesses, colours and opacities in steps."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np
import torch

from ..arrays import Float64Array
from ..blend import EDGE_DEVIATION, SUBTRACTION
from ..clusters import clustered
from ..grain import Drawable, Grain, is_of_pixels
from ..layer import Slot
from ..render.tensors import Group, SceneTensors, from_scene, to_scene
from ..scene import Scene
from ..shapes import KINDS
from ..steps import Steps
from ..units import COLOR, FALLOFF, OPACITY, POSITION
from .pens import in_one_width
from .presets import MSE, Phase
from .runs import Softening
from .settling import GOING_ON, PHASES, Kept, Settling, Views, descend
from .surroundings import error_of

HARDLY = 0.45  # pixels: an edge of a smaller standard deviation is drawn sharp
# Pixels, of the narrowest blurs. Of those from 1 on renderers make about the same. On the CPU Chromium draws the first
# sharp and the second as the third; so it comes as near as without these two.
NARROWEST = (0.62, 0.85, 1.1, 1.5)
LEAST_FREE = 1.8  # pixels, from which on softnesses are free
LEAST = 2.15  # pixels, of a free one: renderers have nothing between it and the narrowest ones
BLURRED = (  # of layers that are blurred in runs, no longer each by its falloff: at first nothing settles
    Phase("blurring", 140, 256, rate=0.3, end_rate=0.15, loss=MSE),
    Phase("settling", 130, 256, rate=0.15, end_rate=0.08, loss=MSE),
    Phase("settling", 80, 320, rate=0.08, end_rate=0.02, loss=MSE),
)
FINE = (256, 320, 384)  # pixels squared, of these phases, where a run needs them
FINER = 1.3  # pixels: one of a smaller standard deviation does
GROWTH = 1.1  # of a triangle's spread, where its edge moves outwards
TRIANGLES = ("triangle", "rounded_triangle")
# what a shape is larger by; others have corners
GROWING = ("radius", "radii", "half_size", "corner_radius", "half_width")
TINY = 1e-12


def rounded(scene: Scene, grain: Grain) -> Drawable:
    """The scene with all numbers such that a drawing of this grain can say them."""
    if is_of_pixels(scene):
        return Drawable(scene)
    tensors = from_scene(scene)
    softening, settling = _begun(tensors, scene, grain)
    if softening:
        softening.settle()
    for group in settling:
        group.settle(1.0)
    return _ended(tensors, scene, softening)


def drawable(scene: Scene, views: Views, grain: Grain, coarser: Scene | None = None) -> Drawable:
    """The same, as near to a picture, which is given at any resolution, as it comes by descending meanwhile: of what is
    near to it already descending may lose more than rounding alone.

    `coarser`: what came of the scene for a coarser drawing. Going on from it ends nearer, and takes half the time.
    """
    if is_of_pixels(scene):
        return Drawable(scene)
    tensors = from_scene(coarser or scene)
    softening, settling = _begun(tensors, scene, grain)
    phases: Sequence[Phase] = GOING_ON if coarser else PHASES
    if softening:
        phases = _blur(tensors, softening, views, scene)
    descend(tensors, settling, views, scene, frozen=(FALLOFF.name,), phases=phases, softening=softening)
    made = _ended(tensors, scene, softening)
    if softening:
        return made
    view = views(phases[-1].resolution)
    return min(made, rounded(scene, grain), key=lambda each: error_of(from_scene(each.scene), view))


def blurred(scene: Scene, views: Views, grain: Grain) -> Drawable:
    """The scene in the runs of a grain, as near to a picture as it comes, before its numbers are rounded."""
    tensors = from_scene(scene)
    softening, _ = _begun(tensors, scene, grain)
    if softening:
        _blur(tensors, softening, views, scene)
    return _ended(tensors, scene, softening)


def _blur(tensors: SceneTensors, softening: Softening, views: Views, scene: Scene) -> list[Phase]:
    """Descends in runs until they have the blurs that they keep; the phases that are left."""
    first, *rest = BLURRED
    if softening.sharpest < FINER:
        first, *rest = (replace(phase, resolution=side) for phase, side in zip(BLURRED, FINE, strict=True))
    descend(tensors, (), views, scene, frozen=(FALLOFF.name,), phases=(first,), softening=softening)
    softening.settle()
    return rest


def _begun(tensors: SceneTensors, scene: Scene, grain: Grain) -> tuple[Softening | None, list[Settling]]:
    """The runs of a scene, if the grain has any, and its groups; their layers have the falloffs of their classes from
    now on, in place, or none.
    """
    softening, count = None, tensors.layer_count
    grain = grain.for_scene(scene)
    if grain.runs and any(_softest(group) > HARDLY * scene.pixel for group in tensors.groups):
        softening = Softening.of(tensors, scene.pixel, grain.runs)
        for group in tensors.groups:
            _grow(group, 0.5 * group.falloff, scene.pixel)
            group.falloff.zero_()
    elif count:
        own = torch.cat([group.falloff for group in from_scene(scene).groups])
        _soften(tensors, own, scene.pixel, grain.softnesses)
    settling = [
        Settling(group, _steps(group, grain, tensors.size), partial(_unfold, group, grain))
        for group in tensors.groups
    ]
    return softening, settling


def _softest(group: Group) -> float:
    """The largest standard deviation of a group's edges, in scene units."""
    return EDGE_DEVIATION * float(group.falloff.max())


def _ended(tensors: SceneTensors, scene: Scene, softening: Softening | None) -> Drawable:
    in_one_width(tensors.groups, from_scene(scene).groups)
    runs = softening.ended if softening else ()
    return Drawable(to_scene(tensors, scene.width, scene.height), runs)


# --- softnesses -----------------------------------------------------------------------------------------------


def softnesses(deviations: Float64Array, count: int) -> Float64Array:
    """For each standard deviation in pixels [N] that of its class, 0 for a sharp edge: the narrowest ones that
    renderers blur by, and k-means of the logarithms of the others.
    """
    found = np.zeros_like(deviations)
    narrow = (deviations >= HARDLY) & (deviations < LEAST_FREE)
    steps = np.log(NARROWEST)
    nearest = np.abs(np.log(deviations[narrow])[:, None] - steps).argmin(axis=1)
    found[narrow] = np.exp(steps[nearest])
    wide = deviations >= LEAST_FREE
    if wide.any():
        logs = np.log(np.maximum(deviations[wide], LEAST))
        found[wide] = np.exp(clustered(logs, count))
    return found


@torch.no_grad()
def _soften(tensors: SceneTensors, falloffs: torch.Tensor, pixel: float, count: int) -> None:
    """Gives each layer the falloff of the class of its own [N, 1], in place; where coverage is one half stays."""
    before = torch.cat([group.falloff for group in tensors.groups])
    deviations = (EDGE_DEVIATION / pixel * falloffs[:, 0]).double().numpy()
    after = torch.from_numpy(softnesses(deviations, count) * (pixel / EDGE_DEVIATION)).float()[:, None]
    sizes = [len(group) for group in tensors.groups]
    for group, old, new in zip(tensors.groups, before.split(sizes), after.split(sizes), strict=True):
        _grow(group, 0.5 * (old - new), pixel)
        group.falloff.copy_(new)


def _grow(group: Group, margin: torch.Tensor, pixel: float) -> None:
    """Moves the sharp edges of a group's shapes by [G, 1], about, so that the layers become larger, in place."""
    for index, part in enumerate(group.structure):
        own = -margin if part.join == SUBTRACTION else margin
        lengths = [slot for slot in group.values if slot.part == index and slot.parameter.name in GROWING]
        for slot in lengths:
            values = group.values[slot]
            least = values.clamp(max=pixel if slot.parameter.positive else 0.0)  # thin ones get no thinner
            values.copy_(torch.maximum(values + own, least))
        if not lengths:
            corners = [
                slot for slot in group.values if slot.part == index and slot.parameter.unit is POSITION
            ]
            places = torch.stack([group.values[slot] for slot in corners], 1)
            for slot, moved in zip(corners, _grown(places, own).unbind(1), strict=True):
                group.values[slot].copy_(moved)


def _grown(corners: torch.Tensor, margin: torch.Tensor) -> torch.Tensor:
    """Corners [G, N, 2] whose spread along both of their own axes has grown as a strip's of that margin [G, 1]."""
    middle = corners.mean(1, keepdim=True)
    arms = corners - middle
    variances, axes = torch.linalg.eigh(arms.mT @ arms / 12.0)
    spreads = variances.clamp(min=TINY).sqrt()
    scales = (spreads + margin * (GROWTH / math.sqrt(3.0))).clamp(min=0.3 * spreads) / spreads
    grown: torch.Tensor = middle + (arms @ axes * scales[:, None]) @ axes.mT
    return grown


# --- the grid -------------------------------------------------------------------------------------------------


def _steps(group: Group, grain: Grain, size: tuple[float, float]) -> dict[Slot, Steps]:
    """What a drawing can say of a group's numbers; all else is written as it is."""
    of_unit = {
        COLOR: Steps(0.0, 1.0 / grain.colors),
        OPACITY: Steps(0.0, 1.0 / grain.opacities, least=1.0),
    }
    radii: list[Slot] = []
    if _has_outline(group):
        middle = torch.tensor(size, dtype=torch.float64) * 0.5
        of_unit[POSITION] = Steps(-middle, 1.0 / grain.units)
        radii = [slot for slot in group.values if slot.parameter.name == "radius"]
    outer = -0.5 * group.falloff.double()  # a radius is written where coverage is one half
    found = {slot: of_unit[slot.parameter.unit] for slot in group.values if slot.parameter.unit in of_unit}
    return found | {slot: Steps(outer, 1.0 / grain.units, least=1.0) for slot in radii}


def _has_outline(group: Group) -> bool:
    """Whether what is written are the numbers of a shape, not a contour that is traced."""
    return len(group.structure) == 1 and KINDS[group.structure[0].kind].outline is not None


def _unfold(group: Group, grain: Grain, kept: Kept) -> None:
    """Moves a corner of triangles that have become one upright or level line, of which renderers draw no blur, or
    none with an area, which are not seen without one.
    """
    if len(group.structure) > 1 or group.structure[0].kind not in TRIANGLES:
        return
    a, b, c = (values for slot, values in kept.items() if slot.parameter.unit is POSITION)
    step = 1.0 / grain.units
    corners = torch.stack([a, b, c], 1)
    spread = corners.amax(1) - corners.amin(1)
    ab, ac = b - a, c - a
    flat = (ab[:, 0] * ac[:, 1] - ab[:, 1] * ac[:, 0]).abs() < 0.5 * step * step
    flat &= (group.falloff[:, 0] == 0.0) | (spread.amin(1) < 0.5 * step)
    across = spread.argmin(1)
    c[flat, across[flat]] += step
    point = spread.amax(1) < 0.5 * step
    c[point, 1 - across[point]] += step

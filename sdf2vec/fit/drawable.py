"""A scene as a small drawing can say it: corners on a grid, few softnesses, colours and opacities in steps.

The numbers are put there a few at a time while the others go on descending, so that the rest makes up for what one
loses by it (as in incremental network quantization, Zhou et al. 2017).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache

import numpy as np
import torch

from ..arrays import Float64Array
from ..blend import EDGE_DEVIATION
from ..clusters import clustered
from ..grain import Grain
from ..image import Picture, fitted_size
from ..layer import Slot
from ..render import fused
from ..render.draw import draw
from ..render.tensors import Group, SceneTensors, from_scene, to_scene
from ..scene import Scene
from ..units import COLOR, FALLOFF, OPACITY, POSITION
from .adam import adam_over
from .constraints import project
from .losses import objective
from .presets import L1_MSE, Phase
from .surroundings import View
from .views import scaled

HARDLY = 0.6  # pixels: an edge of a smaller standard deviation is drawn sharp
NARROWEST = (1.1, 1.5)  # pixels: of the narrowest blurs, on which renderers agree more or less
LEAST_FREE = 1.8  # pixels, from which on softnesses are free
LEAST = 2.15  # pixels, of a free one: renderers have nothing between it and the narrowest ones
GROWTH = 1.1  # of a triangle's spread, where its edge moves outwards
LARGEST = 512  # shortest side, in pixels, of the render that is fitted
TINY = 1e-12
PHASES = (
    Phase("drawing", 60, 256, rate=0.2, end_rate=0.12, loss=L1_MSE),
    Phase("drawing", 60, 320, rate=0.12, end_rate=0.05, loss=L1_MSE),
)
LATE, FIRM = 0.3, 0.95  # shares of the steps after which colours begin to settle, and all have


def views_of(picture: Picture) -> Callable[[float], View]:
    """A picture at any resolution."""
    return cache(lambda resolution: View(scaled(picture.premultiplied, resolution), None))


def views_of_render(scene: Scene) -> Callable[[float], View]:
    """What a scene shows, likewise."""
    width, height = fitted_size(scene.width, scene.height, min(LARGEST, scene.width, scene.height))
    image = draw(scene, width, height).numpy().transpose(1, 2, 0)[..., : 3 if scene.opaque else 4]
    return cache(lambda resolution: View(scaled(image, resolution), None))


def rounded(scene: Scene, grain: Grain) -> Scene:
    """The scene with all numbers such that a drawing of this grain can say them."""
    return _settled(scene, grain, lambda tensors, settling: None)


def drawable(scene: Scene, views: Callable[[float], View], grain: Grain) -> Scene:
    """The same, as near to a picture, which is given at any resolution, as it comes by descending meanwhile."""
    pixel = 1.0 / min(scene.width, scene.height)
    return _settled(scene, grain, lambda tensors, settling: _descend(tensors, settling, views, pixel))


def _settled(scene: Scene, grain: Grain, descend: Callable[[SceneTensors, list[_Settling]], None]) -> Scene:
    tensors, pixel = from_scene(scene), 1.0 / min(scene.width, scene.height)
    if not scene.layers:
        return scene
    _soften(tensors, pixel, grain.softnesses)
    settling = [_Settling(group, grain, tensors.size) for group in tensors.groups]
    descend(tensors, settling)
    for group in settling:
        group.settle(1.0)
    return to_scene(tensors, scene.width, scene.height)


def _descend(
    tensors: SceneTensors, settling: list[_Settling], views: Callable[[float], View], pixel: float
) -> None:
    """Goes down the loss while ever more numbers settle."""
    optimizer = adam_over(tensors, frozen=(FALLOFF.name,))
    done, total = 0, sum(phase.steps for phase in PHASES)
    for phase in PHASES:
        view = views(phase.resolution)
        channels, height, width = view.target.shape
        measure = objective(phase.loss, view.target, view.weights)
        for rate in phase.rates():
            for group in settling:
                group.settle(done / total)
            optimizer.zero_grad()
            measure(fused.composite(tensors, width, height, channels)).backward()
            optimizer.step(rate)
            project(tensors, pixel)
            for group in settling:
                group.hold()
            done += 1


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
def _soften(tensors: SceneTensors, pixel: float, count: int) -> None:
    """Gives each layer the falloff of its class, in place; its edge stays where coverage is one half."""
    before = torch.cat([group.falloff for group in tensors.groups])
    deviations = (EDGE_DEVIATION / pixel * before[:, 0]).double().numpy()
    after = torch.from_numpy(softnesses(deviations, count) * (pixel / EDGE_DEVIATION)).float()[:, None]
    sizes = [len(group) for group in tensors.groups]
    for group, old, new in zip(tensors.groups, before.split(sizes), after.split(sizes), strict=True):
        _grow(group, 0.5 * (old - new), pixel)
        group.falloff.copy_(new)


def _grow(group: Group, margin: torch.Tensor, pixel: float) -> None:
    """Moves the sharp edges of a group's shapes outwards by [G, 1], about, in place."""
    kind = group.structure[0].kind
    if kind == "triangle":
        corners = [group.of(name, 0) for name in "abc"]
        for corner, moved in zip(corners, _grown(torch.stack(corners, 1), margin).unbind(1), strict=True):
            corner.copy_(moved)
    elif kind == "circle":
        group.of("radius", 0).add_(margin).clamp_(min=pixel)
    else:
        group.of("half_size", 0).add_(margin).clamp_(min=pixel)
        group.of("corner_radius", 0).add_(margin).clamp_(min=0.0)


def _grown(corners: torch.Tensor, margin: torch.Tensor) -> torch.Tensor:
    """Triangles [G, 3, 2] whose spread along both of their own axes has grown as a strip's of that margin [G, 1]."""
    middle = corners.mean(1, keepdim=True)
    arms = corners - middle
    variances, axes = torch.linalg.eigh(arms.mT @ arms / 12.0)
    spreads = variances.clamp(min=TINY).sqrt()
    scales = (spreads + margin * (GROWTH / math.sqrt(3.0))).clamp(min=0.3 * spreads) / spreads
    grown: torch.Tensor = middle + (arms @ axes * scales[:, None]) @ axes.mT
    return grown


# --- the grid -------------------------------------------------------------------------------------------------


class _Settling:
    """The layers of a group, of which ever more numbers stay where a drawing can say them."""

    def __init__(self, group: Group, grain: Grain, size: tuple[float, float]) -> None:
        self.group, self.grain = group, grain
        self.middle = torch.tensor(size) * 0.5
        order = torch.randperm(len(group), generator=torch.Generator().manual_seed(0))
        self.turns = torch.empty(len(group)).scatter_(0, order, torch.arange(len(group)) / len(group))
        self.kept: dict[Slot, torch.Tensor] = {}

    @torch.no_grad()
    def settle(self, share: float) -> None:
        """Puts what is due after a share of the steps on the grid."""
        for slot, values in self.group.values.items():
            due = self.turns < (share - _first(slot)) / (FIRM - _first(slot))
            kept = self.kept.setdefault(slot, torch.full_like(values, math.nan))
            fresh = due & kept[:, 0].isnan()
            if fresh.any():
                kept[fresh] = self._snapped(slot, values)[fresh]
        if self.group.structure[0].kind == "triangle":
            self._unfold()
        self.hold()

    def _unfold(self) -> None:
        """Moves a corner of triangles that have become one upright or level line, of which renderers draw no blur, or
        none with an area, which are not seen without one."""
        a, b, c = (kept for slot, kept in self.kept.items() if slot.parameter.unit is POSITION)
        step = 1.0 / self.grain.units
        corners = torch.stack([a, b, c], 1)
        spread = corners.amax(1) - corners.amin(1)
        ab, ac = b - a, c - a
        flat = (ab[:, 0] * ac[:, 1] - ab[:, 1] * ac[:, 0]).abs() < 0.5 * step * step
        flat &= (self.group.falloff[:, 0] == 0.0) | (spread.amin(1) < 0.5 * step)
        across = spread.argmin(1)
        c[flat, across[flat]] += step
        point = spread.amax(1) < 0.5 * step
        c[point, 1 - across[point]] += step

    @torch.no_grad()
    def hold(self) -> None:
        """Moves what stays back to where it stays."""
        for slot, kept in self.kept.items():
            values = self.group.values[slot]
            values.copy_(torch.where(kept.isnan(), values, kept))

    def _snapped(self, slot: Slot, values: torch.Tensor) -> torch.Tensor:
        """The nearest numbers that a drawing can say."""
        grain, unit = self.grain, slot.parameter.unit
        if unit is POSITION:
            return ((values + self.middle) * grain.units).round() / grain.units - self.middle
        if unit is COLOR:
            return (values * grain.colors).round() / grain.colors
        if unit is OPACITY:
            return (values * grain.opacities).round().clamp(min=1.0) / grain.opacities
        if slot.parameter.name == "radius":
            outer = 0.5 * self.group.falloff
            return ((values + outer) * grain.units).round().clamp(min=1.0) / grain.units - outer
        return values


def _first(slot: Slot) -> float:
    """The share of the steps after which the first numbers settle."""
    return LATE if slot.parameter.unit in (COLOR, OPACITY) else 0.0

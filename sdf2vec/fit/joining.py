"""Shapes joined to layers by trial: cut out of them, added to them, or intersected with them.

Which join helps is a decision, not a number that could be descended; so every candidate is trained for some steps, and
the best is kept where the error falls. All of it happens at low resolution by the dense renderer, candidates of one
structure at a time in one tensor: kernels would have to be compiled for every structure.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import NamedTuple

import torch

from ..blend import JOINS, UNION
from ..layer import Part, Slot
from ..paints import BASE, FLAT
from ..render.reference import canvas, composite_points, group_coverage, lay
from ..render.tensors import Group, SceneTensors
from ..shapes import KINDS
from ..units import COLOR, SMOOTHNESS, Placed
from .adam import Adam, rate_of
from .constraints import enforce_min_thickness, project
from .initialization import Layers, Places, groups_at, start_of, straight
from .matching_pursuit import find_discs

RESOLUTION = 64  # pixels squared at which candidates are tried
STARTS = 3  # of each kind and join
SCREENED, TRAINED = 15, 60  # steps of every candidate; of the best few after that
FINALISTS = 3
RATE, END_RATE = 3.0, 0.1
LEAST_GAIN = 0.03  # of a layer's share of the error: what a join must take away to be kept
LEAST_ERROR = 2e-5  # mean square: below it nothing is missing
START_SMOOTHNESS = 0.01  # scene units
START_FALLOFF = 0.05
MISSING = 0.1  # share of all that is missing from a layer from which on it is worth adding; so with too much

Tick = Callable[[float], None]  # told of the error after every step; raises to stop


@dataclass(frozen=True)
class Surroundings:
    """All that one layer is seen with, at the points of a small canvas.

    What is above is linear in what is below it: `dark` and `light` are the scene where that is 0 and 1.
    """

    points: tuple[torch.Tensor, torch.Tensor, torch.Tensor]  # x [P], y [P], size of a pixel []
    target: torch.Tensor  # [C, H, W] premultiplied
    weights: torch.Tensor  # [P]
    below: torch.Tensor  # [4, P]
    dark: torch.Tensor  # [4, P]
    light: torch.Tensor  # [4, P]
    scene: SceneTensors

    @classmethod
    def of(
        cls, scene: SceneTensors, order: int, target: torch.Tensor, weights: torch.Tensor | None
    ) -> Surroundings:
        """Those of the layer at this place in the draw order."""
        points = canvas(scene, target.shape[2], target.shape[1])
        below = _some(scene, lambda place: place < order)
        above = _some(scene, lambda place: place > order)
        ends = [composite_points(replace(above, background=torch.full((4,), end)), *points) for end in (0.0, 1.0)]
        own = torch.ones_like(points[0]) if weights is None else weights.flatten()
        return cls(points, target, own, composite_points(below, *points), *ends, scene)

    def images(self, group: Group) -> torch.Tensor:
        """The scene with each of some layers alone in the place of this one, [G, C, P]."""
        cover, color = group_coverage(group, self.scene.compositing, *self.points)
        return self._seen(lay(self.scene.compositing, self.below, color, group.opacity[:, 0], cover))

    def _seen(self, laid: torch.Tensor) -> torch.Tensor:
        return (self.dark + (self.light - self.dark) * laid)[..., : len(self.target), :]

    def errors(self, images: torch.Tensor) -> torch.Tensor:
        """Weighted mean squared errors [G]."""
        missing = (images - self.target.flatten(1)) * self.weights
        return missing.square().mean(dim=(1, 2))

    @property
    def residual(self) -> torch.Tensor:
        """What is missing without the layer, [C, H, W]."""
        with torch.no_grad():
            bare = self._seen(self.below)
        return ((self.target.flatten(1) - bare) * self.weights).reshape(self.target.shape)

    def cover(self, layer: Group) -> torch.Tensor:
        """Coverage of one layer [H, W]."""
        cover, _ = group_coverage(layer, self.scene.compositing, *self.points)
        return cover[0].reshape(self.target.shape[1:])

    def missing(self, layer: Group) -> torch.Tensor:
        """How much more of a layer is wanted at each pixel, −1..1, times how far that is seen; [H, W]."""
        compositing = self.scene.compositing
        cover, color = group_coverage(layer, compositing, *self.points)
        bare, full = (
            self._seen(lay(compositing, self.below, color, layer.opacity[:, 0], torch.full_like(cover, end)))[0]
            for end in (0.0, 1.0)
        )
        change = (full - bare) * self.weights
        wanted = ((self.target.flatten(1) - bare) * self.weights * change).sum(0)
        seen = change.square().sum(0)
        more = (wanted / seen.clamp_min(1e-6)).clamp(0.0, 1.0) - cover[0]
        return (more * seen.sqrt()).reshape(self.target.shape[1:])


def _some(scene: SceneTensors, which: Callable[[torch.Tensor], torch.Tensor]) -> SceneTensors:
    """The layers at some places of the draw order."""
    picked = [(group, which(group.order)) for group in scene.groups]
    groups = [group.each(lambda tensor, rows=rows: tensor[rows]) for group, rows in picked if rows.any()]
    return replace(scene, groups=groups)


class Tried(NamedTuple):
    """One layer after some steps, and its error."""

    layer: Group
    error: float


@dataclass(frozen=True)
class Search:
    """What is tried and how: what new shapes are, the range of falloffs, where randomness comes from."""

    layers: Layers
    falloff: tuple[float, float]
    generator: torch.Generator
    tick: Tick
    size: tuple[float, float]

    def joined(self, layer: Group, around: Surroundings, most: int) -> Tried:
        """A layer, begun anew where that is better, with up to `most` shapes joined to it, while that helps."""
        best = self.best([layer, *self._alone(around)], around)
        for _ in range(most):
            if best.error < LEAST_ERROR:
                break
            tried = self.best(self._candidates(best.layer, around), around)
            share = 1.0 - LEAST_GAIN / around.scene.layer_count
            if tried.error > best.error * share:
                break
            best = tried
        return best

    def best(self, groups: Sequence[Group], around: Surroundings) -> Tried:
        """The best of some layers after training: all a little, then the best few."""
        rows = [row for group in groups for row in self._trained(group, around, SCREENED, END_RATE * 4)]
        finalists = sorted(rows, key=lambda row: row.error)[:FINALISTS]
        trained = [row for tried in finalists for row in self._trained(tried.layer, around, TRAINED)]
        return min(trained, key=lambda row: row.error)

    def _trained(
        self, group: Group, around: Surroundings, steps: int, end_rate: float = END_RATE
    ) -> Iterator[Tried]:
        """Each layer of a group after so many steps."""
        scene = replace(around.scene, groups=[group.each(lambda tensor: tensor.detach().clone())])
        moving = scene.groups[0]
        canvas_side = math.sqrt(scene.size[0] * scene.size[1])
        optimizer = Adam((v, rate_of(slot.parameter.unit, canvas_side, 1.0)) for slot, v in moving.values.items())
        pixel = float(around.points[2])
        for step in range(steps):
            optimizer.zero_grad()
            errors = around.errors(around.images(moving))
            errors.sum().backward()
            optimizer.step(RATE * (end_rate / RATE) ** (step / steps))
            project(scene, pixel, self.falloff)
            self.tick(float(errors.detach().min()))
        enforce_min_thickness(scene, pixel)
        with torch.no_grad():
            errors = around.errors(around.images(moving))
        for row, error in enumerate(errors.tolist()):
            yield Tried(moving.each(lambda tensor, row=row: tensor.detach()[row : row + 1]), error)

    def _alone(self, around: Surroundings) -> list[Group]:
        """Layers of one shape of each kind, where the picture differs most from what is there without the layer."""
        residual = around.residual
        amount = residual.square().sum(0).sqrt()
        placed = self._placed(amount)
        wanted = residual if self.layers.signed else around.target
        color = straight((wanted * amount).sum(dim=(1, 2))[None] / amount.sum().clamp_min(1e-6))
        places = Places(placed.centers, placed.sizes, color.expand(STARTS, 4))
        return [
            groups_at(places, replace(self.layers, kinds=(kind,), union=1), self.generator)[0]
            for kind in self._kinds
        ]

    def _candidates(self, layer: Group, around: Surroundings) -> Iterator[Group]:
        """The layer with one more shape, of each kind, joined in each way where something is wrong."""
        with torch.no_grad():
            missing = around.missing(layer)
            cover = around.cover(layer)
        less, more = (-missing).clamp(min=0.0), missing.clamp(min=0.0)
        rest = float(missing.abs().sum()) * MISSING
        places = {"union": more, "subtraction": less, "intersection": (cover - less).clamp(min=0.0)}
        for join, amount in places.items():
            if (more if JOINS[join].adds else less).sum() > rest:
                placed = self._placed(amount)
                for kind in self._kinds:
                    yield _extended(layer, self._part(kind, join), placed)

    def _part(self, kind: str, join: str) -> Part:
        return Part(kind, self.layers.paint if JOINS[join].adds else FLAT, join)

    @property
    def _kinds(self) -> list[str]:
        """Those that can be joined."""
        return [kind for kind in self.layers.kinds if KINDS[kind].patch is None]

    def _placed(self, amount: torch.Tensor) -> Placed:
        """Where most of an amount [H, W] is: all of it first, then the best discs; turned at random."""
        height, width = amount.shape
        found = find_discs(amount[None], STARTS - 1)
        center, radius = _moments(amount)
        centers, radii = torch.cat([center[None], found.centers]), torch.cat([radius[None], found.radii])
        size = torch.tensor(self.size)
        turns = torch.rand(STARTS, generator=self.generator) * 2 * math.pi
        return Placed((centers / torch.tensor([width, height]) - 0.5) * size, radii * float(size[0]) / width, turns)


def _moments(amount: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
    """The middle [2] of an amount [H, W], and the radius of a disc that is spread as far, in pixels."""
    height, width = amount.shape
    share = amount / amount.sum().clamp_min(1e-9)
    y, x = torch.meshgrid(torch.arange(height) + 0.5, torch.arange(width) + 0.5, indexing="ij")
    middle = torch.stack([(share * x).sum(), (share * y).sum()])
    spread = (share * ((x - middle[0]).square() + (y - middle[1]).square())).sum()
    return middle, (2.0 * spread).sqrt().clamp_min(1.0)


def _extended(layer: Group, part: Part, placed: Placed) -> Group:
    """A layer, once for each place, with one more shape joined to it there."""
    count = len(placed.sizes)
    row = layer.each(lambda tensor: tensor.detach().expand(count, *tensor.shape[1:]).clone())
    smoothness = torch.full((count, 1), START_SMOOTHNESS)
    looks = {SMOOTHNESS.name: smoothness, COLOR.name: row.of(BASE.name, 0)}
    index = len(layer.structure)
    fresh = {Slot(index, parameter): start_of(parameter, placed, looks) for parameter in part.parameters}
    return Group((*layer.structure, part), row.order, row.values | fresh)

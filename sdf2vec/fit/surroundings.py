"""One layer among the others of a scene: how wrong the picture is with what may stand in its place."""

from __future__ import annotations

import operator
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import NamedTuple

import numpy as np
import torch

from ..layer import ROW_OPACITY, Structure
from ..render import fused
from ..render.reference import canvas, lay, rows_coverage
from ..render.tensors import Group, SceneTensors
from .laying import Blocks, Laid, Points, covers
from .levenberg import Dense, Problem

# shapes in a layer, and points: there are too many structures of more shapes to compile kernels for a look at less
MOST_COMPILED, GLANCE = 6, 2500

NEARBY = 5  # pixels across
SEEN = 0.2  # of what is below, at least, where its colour is told from what is shown


class View(NamedTuple):
    """A picture at some size: premultiplied [C, H, W], how much an error matters there [H, W], or None, and how many
    samples across a pixel of a scene its mean is taken of: several are nearer to how drawings are antialiased.
    """

    target: torch.Tensor
    weights: torch.Tensor | None
    samples: int = 1

    @property
    def sampled(self) -> tuple[int, int]:
        """Its height and width in samples."""
        height, width = self.target.shape[1:]
        return self.samples * height, self.samples * width


def points_of(scene: SceneTensors, view: View) -> Points:
    """The pixel centres of a picture on the scene's canvas."""
    x, y, pixel = canvas(scene, view.target.shape[2], view.target.shape[1])
    return x, y, pixel


def covers_of(scene: SceneTensors, view: View) -> torch.Tensor:
    """Coverage [N, P] of the layers of a scene, in draw order, at the pixels of a picture."""
    blocks = Blocks.of(points_of(scene, view))
    found = torch.empty(scene.layer_count, blocks.points)
    for group in scene.groups:
        found[group.order] = covers(group.structure, scene.compositing, group.rows(), blocks)
    return found


def residual_of(scene: SceneTensors, view: View) -> torch.Tensor:
    """How far a scene is from a picture, weighted, [C, H, W]; differentiable."""
    return residual_of_drawn(_sampled(scene, view), view)


def residual_of_drawn(drawn: torch.Tensor, view: View) -> torch.Tensor:
    """The same [..., C, H, W] of what is drawn already, in samples [..., C, H', W']."""
    wrong = _pooled(drawn, view.samples) - view.target
    return wrong if view.weights is None else wrong * view.weights


def _drawn(scene: SceneTensors, view: View) -> torch.Tensor:
    """A scene at the size of a picture and with its channels, [C, H, W]; differentiable."""
    return _pooled(_sampled(scene, view), view.samples)


def _sampled(scene: SceneTensors, view: View) -> torch.Tensor:
    """The same in samples."""
    height, width = view.sampled
    return fused.composite(scene, width, height, len(view.target))


def _pooled(drawn: torch.Tensor, samples: int) -> torch.Tensor:
    """What is drawn by so many samples across a pixel."""
    return drawn if samples == 1 else torch.nn.functional.avg_pool2d(drawn, samples)


@torch.no_grad()
def error_of(scene: SceneTensors, view: View) -> float:
    """The weighted mean squared error of a scene."""
    return float(squared_error(scene, view))


@torch.no_grad()
def local_error(scene: SceneTensors, view: View) -> torch.Tensor:
    """The same around each pixel that is not at the rim, [H - 4, W - 4]; of a smaller picture [1, 1]."""
    wrong = residual_of(scene, view).square().mean(0)[None]
    across = [min(NEARBY, side) for side in wrong.shape[1:]]
    return torch.nn.functional.avg_pool2d(wrong, across, 1)[0]


def squared_error(scene: SceneTensors, view: View) -> torch.Tensor:
    """The same, differentiable."""
    return residual_of(scene, view).square().mean()


def some(scene: SceneTensors, which: Callable[[torch.Tensor], torch.Tensor]) -> SceneTensors:
    """The layers at some places of the draw order."""
    picked = [(group, which(group.order).nonzero()[:, 0]) for group in scene.groups]
    groups = [
        group if len(rows) == len(group) else _taken(group, rows) for group, rows in picked if len(rows)
    ]
    return replace(scene, groups=groups)


def layer_at(scene: SceneTensors, order: int) -> Group:
    """The layer at a place of the draw order."""
    (layer,) = some(scene, partial(operator.eq, order)).groups
    return layer


def _taken(group: Group, rows: torch.Tensor) -> Group:
    return group.each(lambda tensor: tensor.index_select(0, rows))


@dataclass(frozen=True, eq=False)
class Surroundings:
    """All that one layer is seen with, at the points of a small canvas.

    What is above is linear in what is below it: `dark` and `light` are the scene where that is 0 and 1.
    """

    points: Points
    target: torch.Tensor  # [C, H, W] premultiplied
    weights: torch.Tensor  # [P]
    below: torch.Tensor  # [C, P]
    dark: torch.Tensor  # [C, P]
    light: torch.Tensor  # [C, P]
    scene: SceneTensors

    @classmethod
    def of(cls, scene: SceneTensors, order: int, view: View) -> Surroundings:
        """Those of the layer at this place in the draw order."""
        points = points_of(scene, view)
        below, above = (some(scene, partial(side, order)) for side in (operator.gt, operator.lt))
        seen = [below, *(replace(above, background=torch.full((4,), end)) for end in (0.0, 1.0))]
        drawn, dark, light = (_drawn(each, view).flatten(1) for each in seen)
        own = torch.ones_like(points[0]) if view.weights is None else view.weights.flatten()
        return cls(points, view.target, own, drawn, dark, light, scene)

    @property
    def shape(self) -> tuple[int, int]:
        """Height and width in pixels."""
        return self.target.shape[1], self.target.shape[2]

    def plane(self, values: torch.Tensor) -> np.ndarray:
        """Values at the points [P] as an array [H, W]."""
        return values.reshape(self.shape).numpy()

    def places(self, pixels: torch.Tensor) -> torch.Tensor:
        """Points (x, y) [N, 2] in scene units of some in pixels; the middle of the first pixel is 0, 0."""
        x, y, pixel = self.points
        return pixels * pixel + torch.stack([x[0], y[0]])

    def pixels(self, places: torch.Tensor) -> torch.Tensor:
        """Points (x, y) [N, 2] in pixels of some in scene units."""
        x, y, pixel = self.points
        return (places - torch.stack([x[0], y[0]])) / pixel

    def window(self, rows: slice, columns: slice) -> Surroundings:
        """A part of them."""
        height, width = self.shape

        def part(values: torch.Tensor) -> torch.Tensor:
            planes = values.reshape(*values.shape[:-1], height, width)[..., rows, columns]
            return planes.reshape(*values.shape[:-1], -1)

        x, y, pixel = self.points
        points = part(x), part(y), pixel
        weights, below, dark, light = map(part, (self.weights, self.below, self.dark, self.light))
        target = self.target[:, rows, columns]
        return Surroundings(points, target, weights, below, dark, light, self.scene)

    def problem(self, structure: Structure, counts: torch.Tensor | None = None) -> Problem:
        """What is wrong with layers of a structure in the place of this one, weighted; `counts` [G, P]: by how much
        each point counts for each of them.
        """
        if len(structure) > MOST_COMPILED and len(self.weights) < GLANCE:
            matter = 1.0 if counts is None else counts[:, None]
            return Dense(lambda rows: self._wrong_at(structure, rows) * matter, len(self.weights))
        weights = self.weights[None] if counts is None else self.weights * counts
        scale = (self.light - self.dark) * weights[:, None]
        offset = (self.target.flatten(1) - self.dark) * weights[:, None]
        return Laid.of(structure, self.scene.compositing, self.blocks, self.below, scale, offset)

    @cached_property
    def blocks(self) -> Blocks:
        """The points as kernels take them."""
        return Blocks.of(self.points)

    def covers(self, structure: Structure, rows: torch.Tensor) -> torch.Tensor:
        """Coverage [G, P] of layers of a structure with these rows [G, U]."""
        return covers(structure, self.scene.compositing, rows, self.blocks)

    def wrong(self, structure: Structure, rows: torch.Tensor) -> torch.Tensor:
        """What is wrong with layers of these rows [G, U] in the place of this one, weighted, [G, C, P]."""
        return self.problem(structure).residuals(rows)

    def _wrong_at(self, structure: Structure, rows: torch.Tensor) -> torch.Tensor:
        """The same from rows [G, U, P or 1], without kernels."""
        cover, color = rows_coverage(structure, rows, self.scene.compositing, *self.points)
        return self.wrong_with(cover, color, rows[:, ROW_OPACITY - 1])

    def wrong_with(self, cover: torch.Tensor, color: torch.Tensor, opacity: torch.Tensor) -> torch.Tensor:
        """What is wrong with layers, weighted, [G, C, P], from coverage [G, P], colours [G, 3, P or 1] and opacities
        [G, P or 1].
        """
        laid = lay(self.scene.compositing, self.below, color, opacity, cover)
        seen = self.dark + (self.light - self.dark) * laid
        return (seen - self.target.flatten(1)) * self.weights

    def error(self, layer: Group) -> float:
        """The weighted mean squared error with a layer in the place of this one."""
        return float(self.problem(layer.structure).errors(layer.rows())[0])

    def shown(self) -> torch.Tensor:
        """The picture [C, P] as this place should show it: without what lies above, where that lets enough through."""
        target, through = self.target.flatten(1), self.light - self.dark
        below = (target - self.dark) / through.clamp_min(SEEN)
        return torch.where(through > SEEN, below.clamp(0.0, 1.0), target)

    @cached_property
    def residual(self) -> torch.Tensor:
        """What is missing without the layer, weighted, [C, H, W]."""
        seen = self.dark + (self.light - self.dark) * self.below
        return ((self.target.flatten(1) - seen) * self.weights).reshape(self.target.shape)

"""Shapes joined to layers by trial: cut out of them, added to them, or intersected with them.

Which join helps is a decision, not a number that could be descended; so every candidate is trained for some steps, and
the best is kept where the error falls. All of it happens at low resolution by the dense renderer, candidates of one
structure at a time in one tensor: kernels would have to be compiled for every structure.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from typing import NamedTuple

import torch

from ..blend import JOINS
from ..layer import Part, Slot, row_width
from ..paints import BASE, FLAT
from ..render.reference import canvas, composite_points, group_coverage, lay, layers_at
from ..render.tensors import Group, SceneTensors
from ..shapes import KINDS
from ..units import COLOR, SMOOTHNESS, Placed
from .adam import rate_of
from .constraints import project
from .initialization import Layers, Places, groups_at, start_of, straight
from .matching_pursuit import find_discs

RESOLUTION = 40  # pixels squared at which candidates are tried
STARTS = 3  # of each kind and join
SCREENING, TRAINING = 6, 12  # steps of every candidate; of the best few after that
FINALISTS, BEAM = 9, 2  # structures that are trained on; that go on to have more joined
REFINING = 20  # steps at the end
MOST_JOINED = 24  # shapes in one layer
FIRST_DAMPING, LESS, MORE = 0.1, 0.3, 5.0  # of a step; after one that helps, after one that does not
LONGEST_STEP = 20.0  # rates
TINY = 1e-9
SMALL = 2e-4  # change of a number that its derivative is taken from
LEAST_GAIN = 0.03  # of a layer's share of the error: what a join must take away to be kept
LEAST_ERROR = 5e-5  # mean square: below it nothing is missing
START_SMOOTHNESS = 0.01  # scene units
SURPLUS = 0.25  # how much an error matters, at first, where nothing is wanted
MISSING = 0.1  # share of all that is missing from a layer from which on it is worth adding; so with too much

Tick = Callable[[float], None]  # told of the error after every step; raises to stop


class View(NamedTuple):
    """A picture at some size: premultiplied [C, H, W], and how much an error matters there [H, W], or None."""

    target: torch.Tensor
    weights: torch.Tensor | None


@torch.no_grad()
def join(scene: SceneTensors, coarse: View, fine: View, search: Search, most: int) -> Iterator[SceneTensors]:
    """The scene after each of its layers has had shapes joined to it, the worst first; tried `most` times in all.

    Tried at the resolution of one picture, refined at that of the other.
    """
    scene, left = _grounded(scene, coarse), list(range(scene.layer_count))
    while left and most > 0:
        order = max(left, key=_faults(scene, coarse).__getitem__)
        left.remove(order)
        (layer,) = _some(scene, partial(operator.eq, order)).groups
        found, tries = search.joined(layer, Surroundings.of(scene, order, *coarse), most)
        if found.layer is not layer:
            layer = search.refined(found.layer, Surroundings.of(scene, order, *fine))
            scene = _grounded(_replaced(scene, replace(layer, order=torch.tensor([order]))), fine)
        most -= tries
        yield scene


def _faults(scene: SceneTensors, view: View) -> list[float]:
    """For each layer in draw order, how wrong the picture is where it covers."""
    covers, _ = layers_at(scene, *_points(scene, view))
    faults: list[float] = (covers @ _wrong(scene, view)).tolist()
    return faults


def _wrong(scene: SceneTensors, view: View) -> torch.Tensor:
    """Squared errors [P] at the points of a picture, summed over the channels."""
    wrong = composite_points(scene, *_points(scene, view))[: len(view.target)] - view.target.flatten(1)
    return (wrong if view.weights is None else wrong * view.weights.flatten()).square().sum(0)


def _points(scene: SceneTensors, view: View) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
    x, y, pixel = canvas(scene, view.target.shape[2], view.target.shape[1])
    return x, y, pixel


def _grounded(scene: SceneTensors, view: View) -> SceneTensors:
    """The scene on the median colour of the picture where the background is seen, if that is nearer to it."""
    if scene.transparent:
        return scene
    light, dark = (
        composite_points(replace(scene, background=torch.full((4,), end)), *_points(scene, view))
        for end in (1.0, 0.0)
    )
    colors, order = view.target.flatten(1).sort(dim=1)
    shares = (light - dark)[0][order].cumsum(1)
    middle = (shares >= 0.5 * shares[:, -1:]).int().argmax(dim=1, keepdim=True)
    grounded = replace(scene, background=torch.cat([colors.gather(1, middle)[:, 0], torch.ones(1)]))
    return min(scene, grounded, key=lambda tried: float(_wrong(tried, view).sum()))


def _replaced(scene: SceneTensors, layer: Group) -> SceneTensors:
    """The scene with another layer in the place of that with the same draw order."""
    groups = list(_some(scene, lambda place: place != layer.order).groups)
    for index, group in enumerate(groups):
        if group.structure == layer.structure:
            groups[index] = group.joined(layer)
            return replace(scene, groups=groups)
    return replace(scene, groups=[*groups, layer])


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
        x, y, pixel = points = canvas(scene, target.shape[2], target.shape[1])
        below = _some(scene, lambda place: place < order)
        above = _some(scene, lambda place: place > order)
        dark, light = (
            composite_points(replace(above, background=torch.full((4,), end)), *points) for end in (0.0, 1.0)
        )
        own = torch.ones_like(points[0]) if weights is None else weights.flatten()
        return cls((x, y, pixel), target, own, composite_points(below, *points), dark, light, scene)

    def images(self, group: Group) -> torch.Tensor:
        """The scene with each of some layers alone in the place of this one, [G, C, P]."""
        cover, color = group_coverage(group, self.scene.compositing, *self.points)
        return self._seen(lay(self.scene.compositing, self.below, color, group.opacity[:, 0], cover))

    def _seen(self, laid: torch.Tensor) -> torch.Tensor:
        return (self.dark + (self.light - self.dark) * laid)[..., : len(self.target), :]

    def eager(self) -> Surroundings:
        """Such that it matters less where a layer is and should not be: what is too much can be cut out."""
        amount = self.residual.square().sum(0).sqrt().flatten()
        share = SURPLUS + (1.0 - SURPLUS) * amount / amount.max().clamp_min(1e-6)
        return replace(self, weights=self.weights * share)

    def measured(self, layer: Group) -> Tried:
        """A layer and its error."""
        return Tried(layer, float(self.errors(self.images(layer))))

    def errors(self, images: torch.Tensor) -> torch.Tensor:
        """Weighted mean squared errors [G]."""
        missing = (images - self.target.flatten(1)) * self.weights
        return missing.square().mean(dim=(1, 2))

    @property
    def residual(self) -> torch.Tensor:
        """What is missing without the layer, [C, H, W]."""
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
            self._seen(lay(compositing, self.below, color, layer.opacity[:, 0], torch.full_like(cover, end)))[
                0
            ]
            for end in (0.0, 1.0)
        )
        change = (full - bare) * self.weights
        wanted = ((self.target.flatten(1) - bare) * self.weights * change).sum(0)
        seen = change.square().sum(0)
        more = (wanted / seen.clamp_min(1e-6)).clamp(0.0, 1.0) - cover[0]
        return (more * seen.sqrt()).reshape(self.target.shape[1:])


def _some(scene: SceneTensors, which: Callable[[torch.Tensor], torch.Tensor]) -> SceneTensors:
    """The layers at some places of the draw order."""
    picked = [(group, which(group.order).nonzero()[:, 0]) for group in scene.groups]
    groups = [group.each(partial(_take, rows)) for group, rows in picked if len(rows)]
    return replace(scene, groups=groups)


def _take(rows: torch.Tensor, tensor: torch.Tensor) -> torch.Tensor:
    return tensor[rows]


class Tried(NamedTuple):
    """One layer after some steps, and its error."""

    layer: Group
    error: float


def _rank(tried: Tried) -> tuple[float, int]:
    """The less wrong the better; of those where nothing is missing, that of fewer numbers."""
    return max(tried.error, LEAST_ERROR), row_width(tried.layer.structure)


@dataclass(frozen=True)
class Search:
    """What is tried and how: what new shapes are, the range of falloffs, where randomness comes from."""

    layers: Layers
    falloff: tuple[float, float]
    generator: torch.Generator
    tick: Tick
    pixel: float  # scene units: the least length

    def joined(self, layer: Group, around: Surroundings, most: int) -> tuple[Tried, int]:
        """A layer, begun anew where that is better, with shapes joined to it while that helps.

        Tried `most` times; also how often it was tried. What comes back is never worse than the layer.
        """
        before = around.measured(layer)
        is_patch = KINDS[layer.structure[0].kind].patch is not None
        beam = self.best([*([] if is_patch else [layer]), *self._alone(around)], around)[:BEAM]
        if beam[0].error > LEAST_ERROR:
            beam += [
                around.measured(wide.layer) for wide in self.best(self._alone(around), around.eager())[:1]
            ]
        least, tries = 1.0 - LEAST_GAIN / around.scene.layer_count, 0
        while tries < most and beam[0].error > LEAST_ERROR and len(beam[0].layer.structure) <= MOST_JOINED:
            tries += 1
            grown = self.best((g for start in beam for g in self._candidates(start.layer, around)), around)
            if not grown or grown[0].error > beam[0].error * least:
                break
            beam = grown[:BEAM]
        return min(before, beam[0], key=_rank), max(tries, 1)

    def refined(self, layer: Group, around: Surroundings) -> Group:
        """A layer after some more steps."""
        (tried,) = self._trained(layer, around, REFINING)
        return tried.layer

    def best(self, groups: Iterable[Group], around: Surroundings) -> list[Tried]:
        """Some layers after training, the best first: of all the last shape alone, then the best few structures."""
        rows = [row for group in groups for row in self._trained(group, around, SCREENING, last=True)]
        rows.sort(key=lambda row: row.error, reverse=True)
        finalists = list({row.layer.structure: row for row in rows}.values())
        finalists.sort(key=lambda row: row.error)
        trained = [
            row for tried in finalists[:FINALISTS] for row in self._trained(tried.layer, around, TRAINING)
        ]
        return sorted(trained, key=_rank)

    def _trained(self, group: Group, around: Surroundings, steps: int, last: bool = False) -> Iterator[Tried]:
        """Each layer of a group after so many steps down the squared error, or the last shape and the look only.

        Levenberg's and Marquardt's steps, each number's no longer than `LONGEST_STEP` of its rate.
        """
        free, limits = _free(group, around, last)
        damping = torch.full((len(group),), FIRST_DAMPING)
        errors = around.errors(around.images(group))
        for _ in range(steps):
            step = _descent(group, around, free, damping).clamp(-limits, limits)
            rows = group.rows()
            rows[:, free] -= step
            moved = _of_rows(group, rows)
            self._project(moved, around)
            found = around.errors(around.images(moved))
            better = found < errors
            group = _of_rows(group, torch.where(better[:, None], moved.rows(), group.rows()))
            errors = torch.where(better, found, errors)
            damping = (damping * torch.where(better, LESS, MORE)).clamp(1e-7, 1e4)
            self.tick(float(errors.min()))
        for index, error in enumerate(errors.tolist()):
            yield Tried(group.each(partial(_take, torch.tensor([index]))), error)

    def _project(self, group: Group, around: Surroundings) -> None:
        project(replace(around.scene, groups=[group]), self.pixel, self.falloff)

    def _alone(self, around: Surroundings) -> list[Group]:
        """Layers of one shape of each kind, where the picture differs most from what is there without the layer."""
        residual = around.residual
        amount = residual.square().sum(0).sqrt()
        placed = self._placed(amount, around.scene.size)
        wanted = residual if self.layers.signed else around.target
        color = straight((wanted * amount).sum(dim=(1, 2))[None] / amount.sum().clamp_min(1e-6))
        places = Places(placed.centers, placed.sizes, color.expand(STARTS, 4))
        return [
            groups_at(places, replace(self.layers, kinds=(kind,), union=1), self.generator)[0]
            for kind in self._kinds
        ]

    def _candidates(self, layer: Group, around: Surroundings) -> Iterator[Group]:
        """The layer with one more shape, of each kind, joined in each way where something is wrong."""
        missing, cover = around.missing(layer), around.cover(layer)
        less, more = (-missing).clamp(min=0.0), missing.clamp(min=0.0)
        rest = float(missing.abs().sum()) * MISSING
        places = {"union": more, "subtraction": less, "intersection": (cover - less).clamp(min=0.0)}
        for join, amount in places.items():
            if (more if JOINS[join].adds else less).sum() > rest:
                placed = self._placed(amount, around.scene.size)
                for kind in self._kinds:
                    yield _extended(layer, self._part(kind, join), placed)

    def _part(self, kind: str, join: str) -> Part:
        return Part(kind, self.layers.paint if JOINS[join].adds else FLAT, join)

    @property
    def _kinds(self) -> list[str]:
        """Those that can be joined."""
        return [kind for kind in self.layers.kinds if KINDS[kind].patch is None]

    def _placed(self, amount: torch.Tensor, canvas_size: tuple[float, float]) -> Placed:
        """Where most of an amount [H, W] is: all of it first, then the best discs; turned at random."""
        height, width = amount.shape
        found = find_discs(amount[None], STARTS - 1)
        center, radius = _moments(amount)
        centers, radii = torch.cat([center[None], found.centers]), torch.cat([radius[None], found.radii])
        size = torch.tensor(canvas_size)
        turns = torch.rand(STARTS, generator=self.generator) * 2 * math.pi
        return Placed(
            (centers / torch.tensor([width, height]) - 0.5) * size, radii * float(size[0]) / width, turns
        )


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


def _free(group: Group, around: Surroundings, last: bool) -> tuple[torch.Tensor, torch.Tensor]:
    """Which numbers of a row move, and how far in one step."""
    size = around.scene.size
    side = math.sqrt(size[0] * size[1])
    moves, limits = [], []
    for slot in group.values:
        free = not last or slot.part in (None, len(group.structure) - 1) or slot.parameter.unit is COLOR
        moves += [free] * slot.parameter.width
        limits += [rate_of(slot.parameter.unit, side, LONGEST_STEP)] * slot.parameter.width if free else []
    return torch.tensor(moves).nonzero()[:, 0], torch.tensor(limits)


def _descent(layers: Group, around: Surroundings, free: torch.Tensor, damping: torch.Tensor) -> torch.Tensor:
    """The damped Gauss-Newton steps [G, F] of the free numbers of some layers; derivatives are differences."""
    rows, count = layers.rows(), len(free)
    moved = rows[:, None].repeat(1, count + 1, 1)
    moved[:, torch.arange(count), free] += SMALL
    images = around.images(_of_rows(layers, moved.flatten(0, 1))).unflatten(0, (-1, count + 1))
    images = (images - around.target.flatten(1)) * around.weights
    images = images.flatten(2)  # [G, F + 1, C · P]
    wrong = images[:, -1:]
    slopes = (images[:, :-1] - wrong) / SMALL
    normal = slopes @ slopes.mT
    scale = normal.diagonal(dim1=1, dim2=2)
    normal = normal + torch.diag_embed(scale * damping[:, None] + TINY)
    steps: torch.Tensor = torch.linalg.solve(normal, slopes @ wrong.mT)[..., 0]
    return steps


def _of_rows(like: Group, rows: torch.Tensor) -> Group:
    """Layers of a structure from their rows [G, U]."""
    parts = rows.split([slot.parameter.width for slot in like.values], dim=1)
    order = like.order[:1].expand(len(rows))
    return Group(like.structure, order, dict(zip(like.values, parts, strict=True)))

"""Shapes joined to layers by trial: cut out of them, added to them, or intersected with them.

Which join helps is a decision, not a number that could be descended; so candidates are trained for some steps, and
the best is kept where the error falls by more than its numbers are worth. All of it happens at low resolution, and
what is seen around a layer comes from the dense renderer: structures are many, and each is looked at for a moment.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache, partial

import torch

from ..layer import Slot, Structure, row_width, slots
from ..render.reference import composite_points, layers_at
from ..render.tensors import Group, SceneTensors
from ..shapes import KINDS
from ..units import FALLOFF, SMOOTHNESS
from .adam import rate_of
from .candidates import ROUNDED, Opening, Proposer, Tried, alone, openings, reductions
from .constraints import ranges_of, room_of
from .initialization import Layers, straight
from .levenberg import Numbers, Tick
from .surroundings import Surroundings, View, layer_at, points_of, some

RESOLUTIONS = 40, 80  # pixels squared at which candidates are tried; at which the best are refined first
SCREENING, TRAINING = 4, 10  # steps of every finalist; of the best of them after that
FINALISTS, TRAINED, BEAM = (
    4,
    4,
    3,
)  # changes of a layer that are screened; that are trained; that are built on
KINDS_EACH = 2  # finalists of other kinds of shape in the same place
LIKELY = 2  # kinds of shape in an opening, of one change
ALIKE = 0.1  # squared difference of two layers that look the same, in shares of the error
REFINED, REFINING = 3, 20  # layers that are refined at the end; steps at each resolution
MOST_JOINED = 24  # shapes in one layer
LONGEST_STEP = 20.0  # rates
PRICE = 0.03  # of a number: the part of a layer's share of the error that it must take away
FIRST_PRICE = 0.004  # while others may follow
LEAST_GAIN = 0.03  # of the worth of the best layer: with less the search ends
LEAST_ERROR = 1e-9  # mean square: of a picture that needs no layer
LEAST_SHARE = 2e-4  # of what is missing without the layer, squared: below it nothing is missing


@torch.no_grad()
def join(scene: SceneTensors, views: Sequence[View], search: Search, most: int) -> Iterator[SceneTensors]:
    """The scene after each of its layers has had shapes joined to it, the worst first; tried `most` times in all.

    Tried at the resolution of the first picture, refined at those of the others; never worse at the last.
    """
    coarse, *finer = views
    scene, left = _grounded(detached(scene), finer[-1]), list(range(scene.layer_count))
    while left and most > 0:
        order = max(left, key=faults_of(scene, coarse).__getitem__)
        left.remove(order)
        layer = layer_at(scene, order)
        found, tries = search.joined(layer, Surroundings.of(scene, order, coarse), most)
        for view in finer:
            around = Surroundings.of(scene, order, view)
            refined = [search.refined(tried.layer, around) for tried in found]
            found = [best] = [min(refined, key=search.worth(around, PRICE).of)]
        if best.error < around.error(layer):
            scene = _grounded(inserted(scene, best.layer), finer[-1])
        most -= tries
        yield detached(scene)


def detached(scene: SceneTensors) -> SceneTensors:
    """A copy with tensors of its own, that no derivative reaches."""
    groups = [group.each(lambda tensor: tensor.detach().clone()) for group in scene.groups]
    return replace(scene, groups=groups, background=scene.background.detach().clone())


def faults_of(scene: SceneTensors, view: View) -> list[float]:
    """For each layer in draw order, how wrong the picture is where it covers."""
    if not scene.groups:
        return []
    covers, _ = layers_at(scene, *points_of(scene, view))
    faults: list[float] = (covers @ _wrong(scene, view)).tolist()
    return faults


def _wrong(scene: SceneTensors, view: View) -> torch.Tensor:
    """Squared errors [P] at the points of a picture, summed over the channels."""
    wrong = composite_points(scene, *points_of(scene, view))[: len(view.target)] - view.target.flatten(1)
    return (wrong if view.weights is None else wrong * view.weights.flatten()).square().sum(0)


def _grounded(scene: SceneTensors, view: View) -> SceneTensors:
    """The scene on the median colour of the picture where the background is seen, if that is nearer to it."""
    if not scene.opaque:
        return scene
    light, dark = (
        composite_points(replace(scene, background=torch.full((4,), end)), *points_of(scene, view))
        for end in (1.0, 0.0)
    )
    colors, order = view.target.flatten(1).sort(dim=1)
    shares = (light - dark)[0][order].cumsum(1)
    middle = (shares >= 0.5 * shares[:, -1:]).int().argmax(dim=1, keepdim=True)
    grounded = replace(scene, background=torch.cat([colors.gather(1, middle)[:, 0], torch.ones(1)]))
    return min(scene, grounded, key=lambda tried: float(_wrong(tried, view).sum()))


def inserted(scene: SceneTensors, layer: Group) -> SceneTensors:
    """The scene with a layer at its draw order, in the place of any that is there."""
    groups = list(some(scene, lambda place: place != layer.order).groups)
    for index, group in enumerate(groups):
        if group.structure == layer.structure:
            groups[index] = group.joined(layer)
            return replace(scene, groups=groups)
    return replace(scene, groups=[*groups, layer])


def topped(scene: SceneTensors, layers: Iterable[Group]) -> SceneTensors:
    """The scene with layers on top, one above the other."""
    for layer in layers:
        scene = inserted(scene, replace(layer, order=torch.tensor([scene.layer_count])))
    return scene


@dataclass(frozen=True)
class Worth:
    """How good a layer is: its error's logarithm, and a price for each of its numbers; the less the better."""

    layer_count: int  # each has about an equal share of the error
    least: float  # mean square: below it nothing is missing
    price: float
    sharpest: float  # scene units: the least falloff

    def is_sharp(self, layer: Group) -> bool:
        """Whether its edge has no width of its own."""
        return float(layer.falloff.max()) <= self.sharpest

    def of(self, tried: Tried) -> float:
        """Of those where nothing is missing, the one of fewer numbers is better."""
        error = math.log(max(tried.error, self.least))
        return error * self.layer_count + self.price * row_width(tried.layer.structure)

    def best(self, all_tried: Iterable[Tried]) -> list[Tried]:
        """The best of each structure, sharp and soft, the best first."""
        found: dict[tuple[Structure, bool], Tried] = {}
        for tried in sorted(all_tried, key=self.of):
            found.setdefault((tried.layer.structure, self.is_sharp(tried.layer)), tried)
        return list(found.values())

    def beam(self, all_tried: Iterable[Tried], around: Surroundings) -> list[Tried]:
        """Those that are built on, the best first; a soft layer is no rival of sharp ones."""
        best = self.best(all_tried)
        sharp = self.distinct((tried for tried in best if self.is_sharp(tried.layer)), around, BEAM)
        soft = [tried for tried in best if not self.is_sharp(tried.layer)][:1]
        return sorted([*sharp, *soft], key=self.of)

    def distinct(self, all_tried: Iterable[Tried], around: Surroundings, most: int) -> list[Tried]:
        """The best few that don't look alike; of those that do, the one of fewest numbers."""
        found: list[tuple[Tried, torch.Tensor]] = []
        for tried in self.best(all_tried):
            wrong = around.wrong(tried.layer.structure, tried.layer.rows())
            near = ALIKE * max(tried.error, self.least)
            like = [i for i, (_, other) in enumerate(found) if (wrong - other).square().mean() <= near]
            if not like:
                found.append((tried, wrong))
            elif row_width(tried.layer.structure) < row_width(found[like[0]][0].layer.structure):
                found[like[0]] = tried, wrong
        return [tried for tried, _ in found[:most]]


@dataclass(frozen=True)
class Search:
    """What is tried and how: what new shapes are, the range of falloffs, where randomness comes from."""

    layers: Layers
    falloff: tuple[float, float]
    generator: torch.Generator
    tick: Tick
    pixel: float  # scene units: how thick shapes are at least
    shortest: float | None = None  # scene units: of lengths; as thick as shapes are where it is not said

    @property
    def least(self) -> float:
        """Scene units: the least length."""
        return self.pixel if self.shortest is None else self.shortest

    def joined(self, layer: Group, around: Surroundings, most: int) -> tuple[list[Tried], int]:
        """The best few with shapes joined, to a layer or to one begun anew, while that helps.

        Tried `most` times; also how often it was tried.
        """
        worth = self.worth(around, FIRST_PRICE)
        beam, tries = self._started(layer, around, worth), 0
        seen, fresh = list(beam), beam
        while tries < most and fresh and beam[0].error > worth.least:
            tries += 1
            chosen = worth.beam([*beam, *self._grown(fresh, around, worth)], around)
            fresh = [new for new in chosen if all(new is not old for old in beam)]
            gain, beam = worth.of(beam[0]) - worth.of(chosen[0]), chosen
            seen += fresh
            if gain < LEAST_GAIN:
                break
        ranked = replace(worth, price=PRICE).best(seen)
        return ranked[:REFINED], max(tries, 1)

    def worth(self, around: Surroundings, price: float) -> Worth:
        """How good layers are in these surroundings."""
        bare = float(around.residual.square().mean())
        least = max(LEAST_SHARE * bare, LEAST_ERROR)
        return Worth(around.scene.layer_count, least, price, self.falloff[0])

    def refined(self, layer: Group, around: Surroundings) -> Tried:
        """A layer after some more steps down the squared error."""
        return self.trained(layer, around, REFINING, lambda slot: True)

    def trained(self, layer: Group, around: Surroundings, steps: int, moves: Callable[[Slot], bool]) -> Tried:
        """A layer after so many steps of some of its numbers down the squared error."""
        structure = layer.structure
        numbers = self.numbers(around, structure, moves)
        rows, errors = around.problem(structure).descended(layer.rows(), numbers, steps, self.tick)
        return Tried(layer_of(structure, layer.order, rows), float(errors[0]))

    def _searched(self, layer: Group, around: Surroundings, worth: Worth, steps: int) -> Tried:
        """A layer after so many steps; what is sharp stays so, as softness makes up for shapes that are missing."""
        still = (FALLOFF, SMOOTHNESS) if worth.is_sharp(layer) else ()
        return self.trained(layer, around, steps, lambda slot: slot.parameter.unit not in still)

    def _started(self, layer: Group, around: Surroundings, worth: Worth) -> list[Tried]:
        """The layer, and some of one shape that are begun anew: the nearest, and one from which to cut."""
        is_patch = KINDS[layer.structure[0].kind].patch is not None
        old = [] if is_patch else [self._searched(layer, around, worth, TRAINING)]
        places = alone(layer.order, self._color(around), self.falloff[0], around)
        near, wide = (worth.best(found) for found in self.proposer(around).candidates(places, around))
        anew = [self._searched(tried.layer, around, worth, TRAINING) for tried in near]
        whole = [Tried(tried.layer, around.error(tried.layer)) for tried in wide[:1]]
        return sorted([*old, *worth.distinct(anew, around, BEAM), *whole], key=worth.of)

    def _grown(self, beam: list[Tried], around: Surroundings, worth: Worth) -> list[Tried]:
        """The most promising changes of some layers, trained: a shape joined, exchanged, or left out."""
        proposed = (
            tried
            for old in beam
            if len(old.layer.structure) < MOST_JOINED
            for tried in self._proposed(old, around, worth)
        )
        screened = [self._searched(tried.layer, around, worth, SCREENING) for tried in proposed]
        best = worth.distinct(screened, around, TRAINED)
        return [self._searched(tried.layer, around, worth, TRAINING) for tried in best]

    def _proposed(self, tried: Tried, around: Surroundings, worth: Worth) -> list[Tried]:
        """The most promising changes of a layer, and the part that matters least left out."""
        places = list(openings(tried.layer, around))
        found = self.proposer(around).candidates(places, around)
        kinds = (kind for own in found for kind in worth.best(own)[:KINDS_EACH])
        fewer = (Tried(less, around.error(less)) for less in reductions(tried.layer))
        return [*worth.best(kinds)[:FINALISTS], *worth.best(fewer)[:1]]

    def filled(
        self, place: Opening, around: Surroundings, finer: Surroundings, worst: float = math.inf
    ) -> Tried | None:
        """The layer with the best shape in an opening, refined in finer surroundings; None where nothing is wanted, or
        where no shape promises an error below the worst.
        """
        hopeful = (likely for likely in self.likely(place, around) if likely.error < worst)
        tried = (self.refined(likely.layer, finer) for likely in hopeful)
        return min(tried, key=lambda found: found.error, default=None)

    def likely(self, place: Opening, around: Surroundings) -> list[Tried]:
        """The layer with a shape of each of the likeliest kinds in an opening; none where nothing is wanted."""
        (found,) = self.proposer(around).candidates([place], around)
        return sorted(found, key=lambda tried: tried.error)[:LIKELY]

    @property
    def kinds(self) -> tuple[str, ...]:
        """What single shapes may be."""
        return tuple(kind for kind in self.layers.kinds if KINDS[kind].patch is None)

    def outliner(self, around: Surroundings) -> Proposer:
        """What fits single shapes to masks of which the whole outline is known."""
        return Proposer(
            self.kinds, self.layers.paint, self.generator, partial(self.numbers, around), self.tick
        )

    def proposer(self, around: Surroundings) -> Proposer:
        """The same of any: where little is known triangles with round corners are as near as any, but take more."""
        return self.outliner(around).without(ROUNDED)

    def _color(self, around: Surroundings) -> torch.Tensor:
        """The mean colour [1, 3] of what a layer should show."""
        residual = around.residual
        amount = residual.square().sum(0).sqrt()
        wanted = residual if self.layers.signed else around.target
        return straight((wanted * amount).sum(dim=(1, 2))[None] / amount.sum().clamp_min(1e-6))[:, :3]

    def numbers(self, around: Surroundings, structure: Structure, moves: Callable[[Slot], bool]) -> Numbers:
        """Which numbers of a structure's rows move, how far in one step, and what keeps them in their range."""
        scene = around.scene
        every = [moves(slot) for slot in slots(structure) for _ in range(slot.parameter.width)]
        room = room_of(scene, self.least, self.falloff)
        return Numbers.where(every, longest_steps(structure, scene), ranges_of(structure, room))


def longest_steps(structure: Structure, scene: SceneTensors) -> torch.Tensor:
    """How far each number of a structure's rows [U] may move in one step."""
    side = math.sqrt(scene.size[0] * scene.size[1])
    return torch.tensor(
        [
            rate_of(slot.parameter.unit, side, LONGEST_STEP)
            for slot in slots(structure)
            for _ in range(slot.parameter.width)
        ]
    )


def layer_of(structure: Structure, order: torch.Tensor, rows: torch.Tensor) -> Group:
    """Layers of a structure from their rows [G, U]."""
    parts = rows.split(_widths(structure), dim=1)
    return Group(structure, order[:1].expand(len(rows)), dict(zip(slots(structure), parts, strict=True)))


@cache
def _widths(structure: Structure) -> list[int]:
    """How many numbers each slot has."""
    return [slot.parameter.width for slot in slots(structure)]

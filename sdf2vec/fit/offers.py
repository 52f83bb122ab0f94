"""Single shapes that explain what a scene lacks: searched in each missing colour, on top of it and at its bottom.

A shape on top must not cover more than its own region; one at the bottom may lie under all the others, so that a shape
which is partly hidden can be found whole. What explains a region is taken before what gains more but leaves a rest.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import groupby
from typing import Any

import torch
from torch.nn.functional import max_pool2d, one_hot

from ..deferred import deferred
from ..layer import Structure, row_width
from ..render.tensors import Group
from ..scene import Color
from .candidates import Opening, alone, cut_from
from .initialization import straight
from .joining import Search, layer_of
from .surroundings import Surroundings

label: Callable[..., Any] = deferred("skimage.measure", "label")

COLORS = 3  # that are missing most, looked for at once
BINS = 8  # of a channel, when colours are counted
NEAR = 0.02  # squared distance of colours that are one
LEAST = 0.02  # share of all that is missing, of a colour that is looked for
REGION = 0.1  # of the greatest gain: what belongs to a region
PARTS, PART = 5, 0.02  # parts of a region that are looked at alone; share of it that each has at least
EDGE = 0.3  # least part of a pixel that is wanted, at a region's edge
STARTS = 6  # of a kind in an opening
MOST = 12  # shapes that are refined at once
WEAKEST = 0.05  # of the greatest gain
APART, ALIKE = 0.15, 0.4  # overlap below which two shapes are apart; above which they are tries of one
EACH, STEPS = 2, 12  # shapes of a kind that are refined in a place; steps of each
ROUGH, NEARLY_CLEAN, CLEAN = (
    0.3,
    0.12,
    0.06,
)  # what is left of a region, at most, by a shape that may explain it; that does
PRICE = 0.02  # of a number, in logarithms of what is left
CUT = 4  # shapes from which others are cut
LEAST_GAIN = 0.02  # of what is missing, by a shape that is worth its numbers
CUTTABLE = 0.3  # how much harm matters where it may be cut away
HARMLESS, MUCH = (
    0.03,
    0.35,
)  # shares of what a region is worth: harm, at most, by one of its parts; gain, at least
WEAK = 0.2  # of the greatest gain: what is clean and gains less waits
BLAME = 2.0  # for what is left, where clean shapes are rivals
WORTH, HOPELESS = 0.05, 1.5  # least share of all that is missing, most that is left, where shapes are cut

Place = tuple[int, Color, int]


@dataclass(frozen=True, eq=False)
class Region:
    """What a shape may be for: an opening, where its colour is wanted, and which part of that a point is in.

    What helps elsewhere is for shapes of other colours: it does not count.
    """

    opening: Opening  # whose mask asks for nothing where it does not count
    wanted: torch.Tensor  # [P]: by how much the error falls there
    labels: torch.Tensor  # [P], from 1; 0 for none
    counts: torch.Tensor  # [P], 1 or 0

    @classmethod
    def of(cls, opening: Opening, around: Surroundings) -> Region:
        """Where the picture has about the opening's colour; where it nowhere has, wherever the colour helps."""
        height, width = around.shape
        colors = straight(around.shown().T)[:, :3]
        near = (colors - opening.color).square().sum(1) < NEAR
        near = near if bool((opening.mask.gain.clamp_min(0.0) * near).any()) else torch.ones_like(near)
        beside = max_pool2d(near.reshape(1, 1, height, width).float(), 3, 1, 1).flatten() > 0
        edge = beside & (
            opening.mask.amount > EDGE * opening.mask.strength
        )  # of what is thin there is nothing else
        wanted = opening.mask.best_gain * (near | edge)
        inside = (wanted > REGION * wanted.max()).reshape(height, width).numpy()
        counts = (beside | (opening.mask.gain <= 0.0)).float()
        opening = replace(opening, mask=opening.mask.only(counts))
        return cls(opening, wanted, torch.from_numpy(label(inside)).flatten(), counts)

    def split(self) -> Iterator[Region]:
        """Each of its parts alone, where it has several: the others neither count nor are wanted."""
        amounts = torch.bincount(self.labels, weights=self.wanted)
        amounts[0] = 0.0
        numbers = amounts.argsort(descending=True)[:PARTS].tolist()
        numbers = [number for number in numbers if amounts[number] > PART * amounts.sum()]
        for number in numbers if len(numbers) > 1 else ():
            own = self.labels == number
            others = (self.wanted > 0) & ~own
            counts = self.counts * ~others
            opening = replace(self.opening, mask=self.opening.mask.only(counts))
            yield Region(opening, self.wanted * own, self.labels * own, counts)

    def under(self, covers: torch.Tensor) -> torch.Tensor:
        """The number [N] of the part that each of some shapes [N, P] covers most of; 0 where it covers none."""
        inside = covers @ self._parts
        return torch.where(inside.amax(1) > 0, inside.argmax(1), 0)

    @cached_property
    def _parts(self) -> torch.Tensor:
        """1 where a point is in a part, [P, parts + 1]; nothing is in the first, which is none."""
        parts = one_hot(self.labels.long()).float()
        parts[:, 0] = 0.0
        return parts


@dataclass(frozen=True, eq=False)
class Offer:
    """A layer of one shape for a place in the draw order, and what it does.

    `gain`: by how much the mean squared error falls; `potential`: the most that it could fall in the part of the region
    that it is for; `stays`: the share of that which does not; `harm`: what becomes worse elsewhere, in the same shares.
    """

    structure: Structure
    row: torch.Tensor  # [1, U]
    region: Region
    part: int  # of the region
    cover: torch.Tensor  # [P]
    gain: float
    potential: float
    stays: float
    harm: float

    @cached_property
    def layer(self) -> Group:
        """The layer."""
        return layer_of(self.structure, self.region.opening.layer.order, self.row)

    @property
    def left(self) -> float:
        """All that is wrong with it."""
        return self.stays + self.harm

    @property
    def place(self) -> Place:
        """Its place in the draw order, its colour, and the part of its region."""
        return (*self.purpose, self.part)

    @cached_property
    def purpose(self) -> tuple[int, Color]:
        """Its place in the draw order, and the colour that it is for."""
        red, green, blue = self.region.opening.color[0].tolist()
        return self.order, (red, green, blue)

    @property
    def aim(self) -> tuple[int, Color, bool]:
        """Its purpose, and whether it is for all of it."""
        return (*self.purpose, self.is_within)

    @property
    def kind(self) -> str:
        """Of its shape."""
        return self.structure[0].kind

    @property
    def is_within(self) -> bool:
        """Whether it is one shape that covers much of its region and nothing else: one of several that make it up."""
        return not self.is_joined and self.harm < HARMLESS and self.gain > MUCH * self.potential

    @property
    def by_number(self) -> float:
        """Its gain by the numbers that it takes."""
        return self.gain / row_width(self.structure)

    @property
    def is_joined(self) -> bool:
        """Whether its layer has several shapes."""
        return len(self.structure) > 1

    @property
    def order(self) -> int:
        """Its place in the draw order."""
        return int(self.region.opening.layer.order)


def offers(around: Mapping[int, Surroundings], search: Search, floor: float) -> list[Offer]:
    """The best shape for each region that is worth its numbers, the best first.

    `around`: the scene as it is seen from places of the draw order. `floor`: mean squared error that need not be
    explained.
    """
    colors = {order: missing_colors(place) for order, place in around.items()}
    least = LEAST_GAIN * _missing(around)
    best = [offer for offer in _found(around, colors, search, floor) if offer.gain > least]
    return sorted(best, key=lambda offer: offer.gain * (BLAME * offer.left - 1.0))


def choices(best: Sequence[Offer]) -> Iterator[list[Offer]]:
    """What of the best offers may be taken at once: those that explain regions and hardly overlap; the best one.

    What has a hole waits for plain shapes: these may hide what the hole is for.
    """
    most = max((offer.gain for offer in best), default=0.0)
    worthy = [offer for offer in best if offer.gain > WEAK * most]
    clean = _apart([offer for offer in worthy if offer.left < CLEAN])
    plain = [offer for offer in clean if not offer.is_joined]
    dense = [offer for offer in worthy if offer.is_within and offer.by_number >= best[0].by_number]
    chosen = plain or clean or _apart(dense)
    if chosen:
        yield chosen
    if best and chosen != best[:1]:
        yield list(best[:1])


def instead_of(
    order: int, color: torch.Tensor, around: Surroundings, search: Search, floor: float
) -> Group | None:
    """The layer of about a colour [1, 3] that gains most at a place of the draw order."""
    found = _found({order: around}, {order: [color]}, search, floor)
    return max(found, key=lambda offer: offer.gain).layer if found else None


def _found(
    around: Mapping[int, Surroundings],
    colors: Mapping[int, Sequence[torch.Tensor]],
    search: Search,
    floor: float,
) -> list[Offer]:
    """For each region of some colours the best shape, and one with another cut out where that leaves something."""
    every = [
        offer for order, place in around.items() for offer in _searched(place, order, colors[order], search)
    ]
    gaining = sorted(
        (offer for offer in every if offer.gain > 0),
        key=lambda offer: (offer.left > NEARLY_CLEAN, offer.left > ROUGH, not offer.is_within, -offer.gain),
    )
    best = [_best(tries, floor) for tries in _refined(_tries(gaining), around, search) if tries]
    cut = (_cut(base, around, search) for base in _unfit(every, best, around))
    return [*best, *(_best(tries, floor) for tries in cut if tries)]


def _missing(around: Mapping[int, Surroundings]) -> float:
    """The mean squared error of the scene."""
    return max(float(place.residual.square().mean()) for place in around.values())


def _best(tries: Sequence[Offer], floor: float) -> Offer:
    """That which leaves least, where each number has its price."""

    def score(offer: Offer) -> float:
        left = max(offer.left * offer.potential, 0.1 * floor)
        return math.log(left) + PRICE * row_width(offer.structure)

    return min(tries, key=score)


def _searched(
    around: Surroundings, order: int, colors: Sequence[torch.Tensor], search: Search
) -> Iterator[Offer]:
    """All that shapes in some colours come to from many starts."""
    here = torch.tensor([order])
    regions = []
    for color in colors:
        near, eager = (Region.of(o, around) for o in alone(here, color, search.falloff[0], around))
        regions += [near, eager, *near.split()]
    openings = [region.opening for region in regions]
    proposer = search.proposer(around)
    starts = [proposer.placed(region.wanted, around) for region in regions]
    for kind in proposer.kinds if openings else ():
        ends = proposer.optima(kind, openings, starts, around, STARTS)
        if ends:
            rows = torch.cat([layer.rows() for _, layer in ends])
            made = _offers_of(ends[0][1].structure, rows, [regions[index] for index, _ in ends], around)
            yield from (offer for offer in made if offer is not None)


def _offers_of(
    structure: Structure, rows: torch.Tensor, regions: Sequence[Region], around: Surroundings
) -> list[Offer | None]:
    """What layers with these rows [N, U] gain; None for those that cover nothing of their region, of which equal ones
    are one after the other.
    """
    before = around.residual.square().mean(0).flatten()
    covers, after = around.covers(structure, rows), around.wrong(structure, rows).square().mean(1)
    runs = [list(run) for _, run in groupby(range(len(regions)), key=lambda index: id(regions[index]))]
    found = [regions[run[0]].under(covers[run[0] : run[-1] + 1]) for run in runs]
    inside = torch.cat([regions[run[0]].labels == own[:, None] for run, own in zip(runs, found, strict=True)])
    potential, gain = (before * inside).mean(1), (before - after).mean(1)
    stays, harm = (after * inside).mean(1), ((after - before).clamp_min(0.0) * ~inside).mean(1)
    shares = torch.stack([stays, harm]) / potential.clamp_min(1e-12)
    parts = torch.cat(found)
    numbers = zip(*(each.tolist() for each in (parts, gain, potential, *shares)), strict=True)
    return [
        Offer(structure, row[None], region, part, cover, *rest) if part else None
        for row, region, cover, (part, *rest) in zip(rows, regions, covers, numbers, strict=True)
    ]


def _tries(found: Sequence[Offer]) -> list[list[Offer]]:
    """The best offers that are apart, each with those of all kinds that cover about the same."""
    seeds: list[Offer] = []
    for offer in found:
        if len(seeds) == MOST or offer.gain < WEAKEST * found[0].gain:
            break
        rivals = (seed for seed in seeds if seed.aim == offer.aim)
        if all(_overlap(offer.cover, seed.cover) < APART for seed in rivals):
            seeds.append(offer)
    groups = []
    for seed in seeds:
        kinds: dict[str, list[Offer]] = defaultdict(list)
        for offer in found:
            if offer.aim == seed.aim and _likeness(offer.cover, seed.cover) > ALIKE:
                kinds[offer.kind].append(offer)
        groups.append([offer for own in kinds.values() for offer in own[:EACH]])
    return groups


def _refined(
    tries: Sequence[Sequence[Offer]], around: Mapping[int, Surroundings], search: Search
) -> list[list[Offer]]:
    """The same after some steps of all their numbers; all of a kind at once."""
    alike: dict[tuple[int, str], list[tuple[int, Offer]]] = defaultdict(list)
    for index, own in enumerate(tries):
        for offer in own:
            alike[offer.order, offer.kind].append((index, offer))
    made: list[list[Offer]] = [[] for _ in tries]
    for (order, _), members in alike.items():
        layers, regions = [offer.layer for _, offer in members], [offer.region for _, offer in members]
        descended = _descended(layers, regions, around[order], search)
        for (index, _), better in zip(members, descended, strict=True):
            made[index] += [better] if better is not None else []
    return made


def _unfit(every: Sequence[Offer], best: Sequence[Offer], around: Mapping[int, Surroundings]) -> list[Offer]:
    """Where much is missing and nothing is clean, what to cut from: for each part of a region what covers most."""
    least = WORTH * _missing(around)
    done = {offer.place for offer in best if offer.left < CLEAN}
    bases: dict[Place, Offer] = {}
    for offer in sorted(every, key=lambda offer: offer.stays + CUTTABLE * offer.harm):
        if offer.potential >= least and CLEAN < offer.left < HOPELESS and offer.place not in done:
            bases.setdefault(offer.place, offer)
    return sorted(bases.values(), key=lambda offer: -offer.potential)[:CUT]


def _cut(base: Offer, around: Mapping[int, Surroundings], search: Search) -> list[Offer]:
    """A layer with a shape cut out of it, of the likeliest kinds."""
    place, region = around[base.order], base.region
    opening = cut_from(base.layer, place)
    opening = replace(opening, mask=opening.mask.only(region.counts))
    made = [_descended([tried.layer], [region], place, search)[0] for tried in search.likely(opening, place)]
    return [offer for offer in made if offer is not None]


def _descended(
    layers: Sequence[Group], regions: Sequence[Region], around: Surroundings, search: Search
) -> list[Offer | None]:
    """Layers of one structure, each for its region, after some steps of all their numbers; None for what is no gain."""
    structure = layers[0].structure
    numbers = search.numbers(around, structure, lambda slot: True)
    problem = around.problem(structure, torch.stack([region.counts for region in regions]))
    rows = torch.cat([layer.rows() for layer in layers])
    rows, _ = problem.descended(rows, numbers, STEPS, search.tick)
    return _offers_of(structure, rows, regions, around)


def _apart(ranked: Sequence[Offer]) -> list[Offer]:
    """The first of those that overlap."""
    taken: list[Offer] = []
    for offer in ranked:
        if all(_overlap(offer.cover, other.cover) < APART for other in taken):
            taken.append(offer)
    return taken


def _overlap(one: torch.Tensor, other: torch.Tensor) -> float:
    """The share of the smaller one that both cover."""
    return float((one * other).sum() / torch.minimum(one.sum(), other.sum()).clamp_min(1e-6))


def _likeness(one: torch.Tensor, other: torch.Tensor) -> float:
    """Intersection over union."""
    return float(torch.minimum(one, other).sum() / torch.maximum(one, other).sum().clamp_min(1e-6))


# --- colours --------------------------------------------------------------------------------------------------


def missing_colors(around: Surroundings) -> list[torch.Tensor]:
    """The straight colours [1, 3] of the picture where most is missing, the worst first."""
    wrong = around.residual.square().sum(0).flatten()
    colors = straight(around.shown().T)
    if len(around.target) == 4:
        wrong = wrong * (colors[:, 3] > 0.5)
    colors, left, found = colors[:, :3], wrong.clone(), []
    for _ in range(COLORS):
        if left.sum() <= LEAST * wrong.sum() or wrong.max() <= 0:
            break
        color = common_color(colors, left)
        near = (colors - color).square().sum(1) < NEAR
        found.append(color[None])
        left[near] = 0.0
    return found


def common_color(colors: torch.Tensor, weights: torch.Tensor) -> torch.Tensor:
    """The colour [3] that is most common among colours [P, 3] by weight [P]: the median around the fullest bin."""
    bins = (colors * BINS * 0.999).long()
    keys = (bins[:, 0] * BINS + bins[:, 1]) * BINS + bins[:, 2]
    inside = keys == torch.bincount(keys, weights=weights, minlength=BINS**3).argmax()
    middle = (colors * (weights * inside)[:, None]).sum(0) / (weights * inside).sum()
    near = (colors - middle).square().sum(1) < NEAR
    return colors[near].median(0).values if bool(near.any()) else middle

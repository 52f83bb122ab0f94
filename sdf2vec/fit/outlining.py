"""Which shape has the outline of an area, or shapes that are joined: one with another cut out of it, what is left of
circles that the outline runs along, and several that cover the area together.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import torch
from scipy import ndimage
from skimage.morphology import convex_hull_image

from ..blend import INTERSECTION, SUBTRACTION
from ..layer import LOOK, Slot, Structure, row_width
from ..paints import FLAT
from ..render.reference import rows_coverage
from ..render.tensors import Group
from .arcs import Arc, arcs
from .candidates import Mask, Opening, Proposer, joined_sharply, own_cover, reductions
from .covering import TRIANGLE, Covering, parted, with_triangle
from .initialization import straight
from .joining import Search
from .surroundings import Surroundings
from .transparency import Overlay
from .windows import Part

STARTS, BASES = 6, 3  # of a kind of shape; shapes from which others are cut
EXACT = 0.36  # pixels by which an outline is off in the mean, at most
LEAST_OFF, FINELY_OFF = 0.15, 0.08  # below that an outline is no better; in the finest surroundings
TOGETHER = 0.27  # the same of several shapes: what round ones that have the very outline come to
GOOD = 0.25  # share of a layer that its shape may miss, at most
CIRCLE = "circle"
ON_CIRCLES = 2  # of an outline from which others are cut, or which are
BITTEN = 0.05  # share of what is cut out of a shape that is beyond its edge: a bite, no hole
# of a number, in logarithms of what is missed; of shapes that are all good; of what is left of circles
PRICE, DEAR, CHEAP = 0.04, 0.15, 0.01
EAGER = 0.25  # how much it matters what is covered too much, where it may be cut away
# structures whose outlines are sharpened in the end; of what is left of circles, which differ less; steps of each
LIKELY, LIKELY_ROUND, STEPS = 3, 6, 10
HOPEFUL = 3.0  # pixels by which these are off
TINY = 1e-9


@dataclass(frozen=True)
class Outlined:
    """A layer of one shape, or of several that are joined, for an overlay.

    `off`: by how many pixels its outline is off, in the mean; `missed`: the share of the overlay that is wrong;
    `bitten`: whether what is cut out of it goes beyond its edge; `soft`: whether the overlay's edge is.
    """

    layer: Group
    overlay: Overlay
    off: float
    missed: float
    bitten: bool
    soft: bool

    @property
    def score(self) -> float:
        """What is the less the better."""
        return self.priced(LEAST_OFF, PRICE)

    def priced(self, least: float, price: float) -> float:
        """The same where it is no better that an outline is off by less than the least, and each number has a price."""
        return math.log(max(self.off, least)) + price * row_width(self.layer.structure)

    @property
    def is_good(self) -> bool:
        """Whether it has the overlay's outline."""
        return self.off < EXACT and self.missed < GOOD

    @property
    def is_joined(self) -> bool:
        """Whether something is cut out of it."""
        return len(self.layer.structure) > 1

    @property
    def layers(self) -> list[Group]:
        """The same as layers of one shape each, if nothing is cut out of it."""
        return parted(self.layer) if all(part.adds for part in self.layer.structure) else [self.layer]

    @property
    def is_opaque(self) -> bool:
        return self.overlay.opacity == 1.0

    @property
    def rank(self) -> tuple[bool, bool, int, float]:
        """What is the less the likelier: of translucent layers what explains the most regions is."""
        covered = 0 if self.is_opaque else -int(self.overlay.inside.sum())
        return self.bitten, self.is_joined, covered, self.score

    @property
    def is_plain(self) -> bool:
        """Whether it is one opaque shape."""
        return self.is_opaque and not self.is_joined

    def lies_under(self, other: Outlined) -> bool:
        """Whether another one shows what is under it where this one is."""
        return bool((self.overlay.inside & other.overlay.outside).any())


@dataclass(frozen=True)
class Area:
    """Where an overlay is, [P], and where it is known whether it is, [P], in a window of some surroundings."""

    overlay: Overlay
    inside: torch.Tensor
    known: torch.Tensor
    part: Part  # that window of the surroundings
    around: Surroundings
    soft: bool  # its edge

    @property
    def key(self) -> tuple[bytes, ...]:
        """What its outline follows from."""
        x, y, pixel = self.around.points
        ends = torch.stack([x[0], y[0], pixel])
        return tuple(tensor.numpy().tobytes() for tensor in (self.inside, self.known, ends))

    @cached_property
    def edge(self) -> float:
        """The length of its outline in pixels, where it is known."""
        inside, known = (self.around.plane(mask > 0.5) for mask in (self.inside, self.known))
        return float(max((inside & ndimage.binary_dilation(known & ~inside)).sum(), 1))

    def outlined(self, layer: Group) -> Outlined:
        """How well a layer covers it."""
        return self.all_outlined([layer])[0]

    def all_outlined(self, layers: Sequence[Group]) -> list[Outlined]:
        """The same of some layers of one structure."""
        wrong = (self._covers(layers) * self.known - self.inside).abs().sum(1)
        size = max(float(self.inside.sum()), TINY)
        return [
            Outlined(layer, self.overlay, off / self.edge, off / size, self._is_bitten(layer), self.soft)
            for layer, off in zip(layers, wrong.tolist(), strict=True)
        ]

    def gross(self, layer: Group, pixels: int) -> float:
        """The share of it that a layer covers wrongly in squares of so many pixels: elsewhere its edge is off."""
        wrong = self.around.plane((self.cover(layer) * self.known - self.inside).abs() > 0.5)
        squares = ndimage.binary_opening(wrong, np.ones((pixels, pixels)))
        return float(squares.sum()) / max(float(self.inside.sum()), TINY)

    def _is_bitten(self, layer: Group) -> bool:
        """Whether a shape that is cut out of the first goes beyond its edge, or one that leaves a part of it does."""
        joins = [part.join for part in layer.structure]
        if INTERSECTION in joins:
            return True
        base, *cuts = (own_cover(layer, index, self.around) for index in range(len(joins)))
        return any(
            (cut * (1.0 - base)).sum() > BITTEN * cut.sum()
            for cut, join in zip(cuts, joins[1:], strict=True)
            if join == SUBTRACTION
        )

    def cover(self, layer: Group) -> torch.Tensor:
        """Coverage [P] of a layer without its opacity."""
        return self._covers([layer])[0]

    def _covers(self, layers: Sequence[Group]) -> torch.Tensor:
        """The same [G, P] of layers of one structure."""
        rows, compositing = torch.cat([layer.rows() for layer in layers]), self.around.scene.compositing
        return rows_coverage(layers[0].structure, rows[..., None], compositing, *self.around.points)[0]

    def hull(self) -> torch.Tensor:
        """Where it may be if it is convex: others may hide parts of it, [P]."""
        around = convex_hull_image(self.around.plane(self.inside > 0.5))
        return torch.from_numpy(around).flatten() * (1.0 - self.known + self.inside)

    @property
    def color(self) -> torch.Tensor:
        """The straight colour [1, 3] of the overlay."""
        return straight(torch.tensor(self.overlay.color[None], dtype=torch.float32))[:, :3]

    def opening(self, too_much: float = 1.0) -> Opening:
        """A place for its first shape; by how much it matters what that covers too much."""
        opacity, edge = (Slot(None, parameter) for parameter in LOOK)
        alpha = self.overlay.opacity * float(self.overlay.color[3] if len(self.overlay.color) == 4 else 1.0)
        looks = {opacity: torch.tensor([[alpha]]), edge: torch.zeros(1, 1)}
        matters = self.known * torch.where(self.inside > 0, 1.0, too_much)
        mask = Mask(matters, self.inside, 0.0)
        return Opening(Group((), torch.tensor([0]), looks), 0, "", self.color, mask)

    def cut(self, base: Group) -> Opening:
        """A place for a shape that is cut out of one which covers too much."""
        matters = self.known * self.cover(base)
        too_much = (matters - self.inside).clamp_min(0.0)
        return Opening(base, len(base.structure), SUBTRACTION, self.color, Mask(matters, too_much, 0.0))

    def on(self, arc: Arc, place: Opening) -> Group:
        """The layer with a circle that an outline runs along in a place."""
        middle = self.around.places(torch.tensor([[arc.x, arc.y]]))
        circle = {"center": middle, "radius": torch.full((1, 1), arc.radius) * self.around.points[2]}
        return place.filled(place.part(CIRCLE, FLAT), circle)

    def wedges(self, arc: Arc, base: Group, proposer: Proposer) -> list[Group]:
        """A layer of which a triangle from the middle of a circle leaves what is seen, or takes away the rest."""
        found = arc.wedge(self.around.plane(self.inside))
        if found is None or TRIANGLE not in proposer.kinds:
            return []
        is_within, ends = found
        place = self.meeting(base) if is_within else self.cut(base)
        return [with_triangle(place, ends, self.around)]

    def meeting(self, base: Group) -> Opening:
        """A place for a shape of which only what it has in common with one that covers too much is left."""
        matters = self.known * self.cover(base)
        return Opening(base, len(base.structure), INTERSECTION, self.color, Mask(matters, self.inside, 0.0))


def best_outlined(area: Area, fine: Area, search: Search) -> Outlined | None:
    """The best that shapes of all kinds come to, of those that are good what is so in the finest surroundings, too;
    None where there is less than a pixel.
    """
    proposer = search.proposer(area.around)
    plain = _single(area, area.opening(), proposer) if area.inside.max() > 0.5 else []
    if not plain:
        return None
    ranked = _sharpest(plain, area, proposer)
    good = _distinct([each for each in ranked if each.is_good])[:LIKELY]
    if good:
        return _finest(good, area, fine, proposer, lambda each: each.priced(FINELY_OFF, DEAR))
    best = ranked[0]
    wide = sorted(_single(area, area.opening(EAGER), proposer), key=lambda each: _eager(each, area))
    cut = [
        area.outlined(tried.layer)
        for base in _distinct(wide)[:BASES]
        for tried in proposer.candidates([area.cut(base.layer)], area.around)[0]
    ]
    best = _sharpest([best, *cut], area, proposer)[0]
    if area.overlay.opacity < 1.0:
        return best
    # chances of its own: what is tried from here on changes nothing that is found elsewhere
    proposer = replace(proposer, generator=torch.Generator().manual_seed(0))
    round_ones = _on_circles(area, proposer)
    if round_ones and min(each.score for each in round_ones) < best.score:
        return _finest(round_ones, area, fine, proposer, lambda each: each.priced(LEAST_OFF, CHEAP))
    return best if best.off < TOGETHER else _together(area, fine, proposer) or best


def _finest(
    good: Sequence[Outlined],
    area: Area,
    fine: Area,
    proposer: Proposer,
    rank: Callable[[Outlined], float],
) -> Outlined:
    """The best of good ones after some steps of their outlines in the finest surroundings, by what is seen there."""
    mask = fine.opening().mask
    exact = [proposer.sharpened(each.layer, mask, fine.around, STEPS) for each in good]
    return area.outlined(min(exact, key=lambda layer: rank(fine.outlined(layer))))


def _on_circles(area: Area, proposer: Proposer) -> list[Outlined]:
    """What is left of circles that the outline runs along, where others are cut out of them and a shape leaves or takes
    away a part: sectors, bows. None but those that have the very outline.
    """
    if CIRCLE not in proposer.kinds:
        return []
    found = arcs(area.around.plane(area.inside), area.around.plane(area.known))
    outer, inner = ([arc for arc in found if arc.is_outer == side][:ON_CIRCLES] for side in (True, False))
    tried: list[Outlined] = []
    for arc in outer:
        disc = area.on(arc, area.opening())
        for base in (disc, *(area.on(hole, area.cut(disc)) for hole in inner)):
            places = [area.meeting(base), area.cut(base)]
            made = [each.layer for own in proposer.candidates(places, area.around) for each in own]
            made += area.wedges(arc, base, proposer)
            made += [base] if base is not disc else []
            tried += map(area.outlined, map(joined_sharply, made))
    return _distinct(
        [each for each in _sharpest(tried, area, proposer, LIKELY_ROUND) if each.off < TOGETHER]
    )[:LIKELY_ROUND]


def _together(area: Area, fine: Area, proposer: Proposer) -> Outlined | None:
    """Several shapes that have the very outline together, laid out from bars, or also from triangles between corners;
    None if none have: what they miss would take many more.
    """
    barred = _covered(area, proposer, has_corners=False)
    if barred is not None:
        barred = _finest([barred], area, fine, proposer, lambda each: each.score)
        if fine.outlined(barred.layer).off < EXACT:
            return barred
    found = [each for each in (barred, _covered(area, proposer, has_corners=True)) if each is not None]
    return _finest(found, area, fine, proposer, lambda each: each.score) if found else None


def _covered(area: Area, proposer: Proposer, has_corners: bool) -> Outlined | None:
    """The same in one of the two ways."""
    place = area.opening()

    def sharp(layer: Group) -> Outlined:
        moved = proposer.sharpened(layer, place.mask, area.around, STEPS)
        return area.outlined(joined_sharply(moved))

    region = Covering(area.inside, area.known, place.color, place.layer, area.around, proposer, has_corners)
    for layer in region.layers():
        found = [sharp(layer)]
        if found[0].off < EXACT:  # what was laid first may be needless, or keep the others from their places
            found += map(sharp, reductions(found[0].layer))
        good = [each for each in found if each.off < TOGETHER]
        if good:
            return min(good, key=lambda each: (len(each.layer.structure), each.off))
    return None


def _distinct(ranked: Sequence[Outlined]) -> list[Outlined]:
    """The first of each structure."""
    found: dict[Structure, Outlined] = {}
    for each in ranked:
        found.setdefault(each.layer.structure, each)
    return list(found.values())


def _sharpest(
    tried: Sequence[Outlined], area: Area, proposer: Proposer, most: int = LIKELY
) -> list[Outlined]:
    """The best first, the likeliest structures after some steps of their outlines."""
    likely = _distinct(sorted(tried, key=lambda each: each.score))[:most]
    mask = area.opening().mask
    sharp = [
        area.outlined(proposer.sharpened(each.layer, mask, area.around, STEPS))
        for each in likely
        if each.off < HOPEFUL
    ]
    return sorted([*tried, *sharp], key=lambda each: each.score)


def _single(area: Area, opening: Opening, proposer: Proposer) -> list[Outlined]:
    """All that shapes of every kind come to in an opening for an area."""
    starts = [proposer.placed(wanted, area.around) for wanted in (area.inside, area.hull())]
    places = [opening] * len(starts)
    ends = (proposer.optima(kind, places, starts, area.around, STARTS) for kind in proposer.kinds)
    return [each for found in ends if found for each in area.all_outlined([layer for _, layer in found])]


def _eager(tried: Outlined, area: Area) -> float:
    """What is missed where what is covered too much matters less."""
    cover = area.cover(tried.layer)
    return float(((1 - cover) * area.inside + EAGER * cover * (area.known - area.inside)).sum())

"""Which shape has the outline of an area, or shapes that are joined: one with another cut out of it, what is left of
circles that the outline runs along, and several that cover the area together.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import torch

from ..layer import Structure
from ..render.tensors import Group
from .arcs import Arc
from .areas import CIRCLE, EXACT, LEAST_OFF, Area, Outlined
from .candidates import ARC, ROUNDED, Opening, Proposer, joined_sharply, reductions
from .covering import Covering
from .joining import Search
from .stroking import stroked

STARTS, BASES = 6, 3  # of a kind of shape; shapes from which others are cut
# pixels in the finest surroundings: an outline that is off by less is no better; what has it is not made of strokes
FINELY_OFF, FINELY_EXACT = 0.08, 0.22
TOGETHER = 0.27  # the same of several shapes: what round ones that have the very outline come to
ON_CIRCLES = 2  # of an outline from which others are cut, or which are
DEAR, CHEAP = 0.15, 0.01  # price of a number of shapes that are all good; of what is left of circles
EAGER = 0.25  # how much it matters what is covered too much, where it may be cut away
# structures whose outlines are sharpened in the end; of what is left of circles, which differ less; steps of each
LIKELY, LIKELY_ROUND, STEPS = 3, 6, 10
HOPEFUL = 3.0  # pixels by which these are off


def best_outlined(area: Area, fine: Area, search: Search) -> Outlined | None:
    """The best that shapes of all kinds come to, of those that are good what is so in the finest surroundings, too;
    None where there is less than a pixel.
    """
    outliner = search.outliner(area.around).without(ARC)  # of which ends are round: strokes tell, or the rest
    plain = _single(area, area.opening(), outliner) if area.inside.max() > 0.5 else []
    if not plain:
        return None
    proposer = outliner.without(ROUNDED)
    ranked = _sharpest(plain, area, proposer)

    def finely(each: Outlined) -> float:
        return each.priced(FINELY_OFF, DEAR)

    good = _distinct([each for each in ranked if each.is_good])[:LIKELY]
    if good:
        good = [_finest(good, area, fine, proposer, finely)]
        if area.overlay.opacity == 1.0 and fine.outlined(good[0].layer).off > EXACT:
            good += _narrowed(good[0].layer, area, proposer)
        return _finest(good, area, fine, proposer, finely) if len(good) > 1 else good[0]
    best = ranked[0]
    wide = sorted(_single(area, area.opening(EAGER), proposer), key=lambda each: _eager(each, area))
    cut = [
        area.outlined(tried.layer)
        for base in _distinct(wide)[:BASES]
        for tried in outliner.candidates([area.cut(base.layer)], area.around)[0]
    ]
    best = _sharpest([best, *cut], area, proposer)[0]
    if area.overlay.opacity < 1.0:
        return best
    # chances of its own: what is tried from here on changes nothing that is found elsewhere
    proposer = replace(proposer, generator=torch.Generator().manual_seed(0))
    if fine.outlined(best.layer).off >= FINELY_EXACT and (layers := stroked(fine, search.kinds)):
        drawn = area.outlined_together(layers)
        if drawn.off < TOGETHER:
            return drawn
    round_ones = _on_circles(area, fine, proposer)
    if round_ones and min(each.score for each in round_ones) < best.score:
        return _finest(round_ones, area, fine, proposer, lambda each: each.priced(LEAST_OFF, CHEAP))
    return best if best.off < TOGETHER else _together(area, fine, proposer) or best


def _narrowed(base: Group, area: Area, proposer: Proposer) -> list[Outlined]:
    """What another shape leaves of one that nearly has the outline: of a bar with round ends a circle does."""
    (made,) = proposer.candidates([area.meeting(base)], area.around)
    found = _sharpest([area.outlined(joined_sharply(each.layer)) for each in made], area, proposer)
    return _distinct([each for each in found if each.off < TOGETHER])[:LIKELY]


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


def _on_circles(area: Area, fine: Area, proposer: Proposer) -> list[Outlined]:
    """What is left of circles that the outline runs along, where others are cut out of them and a shape leaves or takes
    away a part: sectors, bows. None but those that have the very outline.
    """
    if CIRCLE not in proposer.kinds:
        return []
    found = area.arcs(fine)
    outer, inner = ([arc for arc in found if arc.is_outer == side][:ON_CIRCLES] for side in (True, False))
    tried: list[Outlined] = []
    for arc in outer:
        disc = _with_arc(arc, area, area.opening())
        for base in (disc, *(_with_arc(hole, area, area.cut(disc)) for hole in inner)):
            places = [area.meeting(base), area.cut(base)]
            made = [each.layer for own in proposer.candidates(places, area.around) for each in own]
            made += area.wedges(arc, base, proposer)
            made += [base] if base is not disc else []
            tried += map(area.outlined, map(joined_sharply, made))
    return _distinct(
        [each for each in _sharpest(tried, area, proposer, LIKELY_ROUND) if each.off < TOGETHER]
    )[:LIKELY_ROUND]


def _with_arc(arc: Arc, area: Area, place: Opening) -> Group:
    """The layer with the circle of an arc in a place."""
    return area.with_circle(arc.x, arc.y, arc.radius, place)


def _together(area: Area, fine: Area, proposer: Proposer) -> Outlined | None:
    """Several shapes that have the very outline together, laid out from bars, or also from triangles between corners;
    None if none have: what they miss would take many more.
    """
    barred = _covered(area, fine, proposer, None)
    if barred is not None:
        barred = _finest([barred], area, fine, proposer, lambda each: each.score)
        if fine.outlined(barred.layer).off < EXACT:
            return barred
    found = [barred, *(_covered(area, fine, proposer, each.corners()) for each in _different(area, fine))]
    good = [each for each in found if each is not None]
    return _finest(good, area, fine, proposer, lambda each: each.score) if good else None


def _different(area: Area, fine: Area) -> list[Area]:
    """An area, and the same in finer surroundings if there are any."""
    return [area] if area is fine else [area, fine]


def _covered(area: Area, fine: Area, proposer: Proposer, corners: torch.Tensor | None) -> Outlined | None:
    """The same in one of the two ways; of few shapes those that miss nothing in the finest surroundings, either."""
    place = area.opening()

    def sharp(layer: Group) -> Outlined:
        moved = proposer.sharpened(layer, place.mask, area.around, STEPS)
        return area.outlined(joined_sharply(moved))

    region = Covering(area.inside, area.known, place.color, place.layer, area.around, proposer, corners)
    for layer in region.layers():
        found = [sharp(layer)]
        if found[0].off < EXACT:  # what was laid first may be needless, or keep the others from their places
            found += map(sharp, reductions(found[0].layer))
        good = [each for each in found if each.off < TOGETHER and fine.is_told_as_in(area, [each.layer])]
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
    cover = area.cover([tried.layer])
    return float(((1 - cover) * area.inside + EAGER * cover * (area.known - area.inside)).sum())

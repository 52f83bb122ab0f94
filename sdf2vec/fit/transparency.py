"""Translucent shapes, told by what they make of the colours that they lie on.

Under a layer of opacity a and colour c, what had the colour u shows v = (1 - a) u + a c (Metelli 1974). Where the edge
of a shape crosses another, four regions meet: two neighbours u and u' outside, v and v' inside. From these follow a and
c, and from a and c all other regions that the same layer covers: its outline is known though it has many colours.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from ..arrays import BoolArray, Float64Array
from .region_graph import Regions

EDGE = 3  # pixels of a common edge, at least, of two regions from which a layer is told
CONTRAST = 12.0 / 255  # of two colours under a layer, at least
FAINTEST, STRONGEST = 0.08, 0.92  # opacity
OUTSIDE = 0.03  # how far a channel of a layer's colour may be from its range
SEEDS = 200  # that are looked at, those with the longest edges
TRIED = 8  # layers, those that cover most
TINY = 1e-9


class Overlay(NamedTuple):
    """A layer that may lie on a picture: its opacity and colour [C], the regions [R] under it, and those beside these
    that show what they would be without it.
    """

    opacity: float
    color: Float64Array
    inside: BoolArray
    outside: BoolArray


def bared(regions: Regions, overlay: Overlay) -> Regions:
    """The regions as they would be without a translucent overlay."""
    inside, through = overlay.inside, 1.0 - overlay.opacity
    colors = (regions.colors[inside] - overlay.opacity * overlay.color) / through
    return regions.recolored(inside, colors.clip(0.0, 1.0), regions.doubts[inside] / through)


def overlays(regions: Regions) -> list[Overlay]:
    """Those that may lie on regions, the largest first."""
    found: dict[bytes, Overlay] = {}
    for seed in _seeds(regions):
        overlay = _grown(seed, regions)
        if overlay is not None:
            key = overlay.inside.tobytes()
            if key not in found or overlay.outside.sum() > found[key].outside.sum():
                found[key] = overlay
    return sorted(found.values(), key=lambda each: -int(regions.areas @ each.inside))[:TRIED]


def _seeds(regions: Regions) -> Iterator[Overlay]:
    """What may lie on two neighbours, each of which has another neighbour that it does not lie on; and these touch."""
    outside, inside = np.nonzero(regions.borders >= EDGE)
    one, other = np.triu_indices(len(outside), 1)
    corners = outside[one], outside[other], inside[one], inside[other]
    a, b, c, d = corners
    meet = regions.beside[a, b] & regions.beside[c, d] & (a != d) & (b != c)
    one, other = one[meet], other[meet]
    a, b, c, d = (corner[meet] for corner in corners)
    colors, doubts = regions.colors, regions.doubts
    under, shown = colors[a] - colors[b], colors[c] - colors[d]
    contrast = np.square(under).sum(axis=1)
    through = (under * shown).sum(axis=1) / np.maximum(contrast, TINY)
    wrong = np.abs(shown - through[:, None] * under).max(axis=1, initial=0.0)
    allowed = (doubts[c] + doubts[d] + through * (doubts[a] + doubts[b])) / 2
    own = (colors[c] - through[:, None] * colors[a]) / np.maximum(1.0 - through, TINY)[:, None]
    good = (contrast > CONTRAST**2) & (wrong <= allowed) & _is_color(own)
    good &= (through >= 1.0 - STRONGEST) & (through <= 1.0 - FAINTEST)
    lengths = np.minimum(
        regions.borders[outside[one], inside[one]], regions.borders[outside[other], inside[other]]
    )
    for index in sorted(np.nonzero(good)[0].tolist(), key=lambda index: -lengths[index])[:SEEDS]:
        yield Overlay(
            1.0 - float(through[index]),
            own[index].clip(0.0, 1.0),
            _chosen(len(colors), c[index], d[index]),
            _chosen(len(colors), a[index], b[index]),
        )


def _is_color(colors: Float64Array) -> BoolArray:
    """Which colours [N, C] may be those of a layer: opaque by themselves."""
    away: Float64Array = np.abs(colors - 0.5).max(axis=1, initial=0.0) - 0.5
    thin: Float64Array = 1.0 - colors[:, 3:].min(axis=1, initial=1.0)
    return np.maximum(away, thin) < OUTSIDE


def _chosen(count: int, *numbers: int) -> BoolArray:
    chosen = np.zeros(count, bool)
    chosen[list(numbers)] = True
    return chosen


def _grown(seed: Overlay, regions: Regions) -> Overlay | None:
    """An overlay over all connected regions that it explains by their neighbours; None where there are none."""
    outside, inside = np.nonzero(regions.beside)
    colors, doubts = regions.colors, regions.doubts
    grown = seed
    for _ in range(2):
        through = 1.0 - grown.opacity
        wrong: Float64Array = np.abs(
            colors[inside] - through * colors[outside] - grown.opacity * grown.color
        ).max(axis=1, initial=0.0)
        fits = wrong <= doubts[inside] + through * doubts[outside]
        covered = _spread(seed, outside[fits], inside[fits], regions.beside)
        edges = np.nonzero(np.logical_and(fits, covered[inside] & ~covered[outside]))[0]
        if len(np.unique(outside[edges])) < 2:
            return None
        grown = Overlay(
            *_least_squares(colors[outside[edges]], colors[inside[edges]]),
            covered,
            _chosen(len(colors), *outside[edges]),
        )
    return grown


def _spread(seed: Overlay, outside: np.ndarray, inside: np.ndarray, beside: BoolArray) -> BoolArray:
    """The regions [R] that are reached from those under a seed, each with a neighbour outside that explains it."""
    covered = seed.inside.copy()
    while True:
        near = np.asarray(beside[:, covered].any(axis=1))
        new = _chosen(len(beside), *inside[~covered[outside] & near[inside]]) & ~covered & ~seed.outside
        if not new.any():
            return covered
        covered |= new


def _least_squares(under: Float64Array, shown: Float64Array) -> tuple[float, Float64Array]:
    """The opacity and the colour [C] by which colours [E, C] come nearest to what they look like [E, C]."""
    middles = under.mean(axis=0), shown.mean(axis=0)
    away = under - middles[0]
    through = float((away * (shown - middles[1])).sum() / max(float(np.square(away).sum()), TINY))
    through = min(max(through, 1.0 - STRONGEST), 1.0 - FAINTEST)
    color = (middles[1] - through * middles[0]) / (1.0 - through)
    return 1.0 - through, color.clip(0.0, 1.0)

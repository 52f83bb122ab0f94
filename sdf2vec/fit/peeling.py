"""A drawing taken apart from the top: what lies on all else is whole, so its outline is known; then what it lies on.

A translucent layer is told by the colours of the regions that it covers (`transparency`), an opaque one is a region of
one colour, or all regions of that. If a shape has the same outline, or several that are joined (`outlining`), that is
taken off the picture. What an opaque one hides is not known then: what lies under it may have any outline there.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import torch
from scipy import ndimage

from ..arrays import BoolArray, Float64Array
from ..blend import INTERSECTION
from ..render.tensors import Group, SceneTensors
from .areas import Area, Outlined, cover_at
from .candidates import own_cover
from .hairlines import hairlines
from .joining import Search, topped
from .outlining import best_outlined
from .region_graph import Regions
from .slopes import even
from .surroundings import Surroundings, View
from .transparency import Overlay, bared, overlays
from .windows import Part, Sides, larger, means, smaller, widened

MOST = 256  # layers that are taken off a picture
# regions that are no shapes, before the rest is left; and so many more for each that is one
FAILED, FORGIVEN = 64, 0.5
KNOWN = 0.5  # share of it that is flat regions, for any to be
POINTS = 4000  # at most, at which an outline is looked for
MARGIN = 0.2, 4  # around a region: share of its longer side, and pixels
MOSTLY = 0.5  # share of an edge beyond a shape
SOFT = 0.25  # share of an edge that is so, of what is told to be soft
HIDDEN = 0.5  # share of another region, at most, that a layer on top covers


@torch.no_grad()
def peeled(scene: SceneTensors, views: Sequence[View], search: Search) -> SceneTensors:
    """The scene, which has no layers but a ramp's, with those of a picture that can be told by their outlines.

    What has a soft edge is taken off, too, but it is not kept: of which kind it is, its colours tell better.
    None where little of the picture is flat: what regions a photograph has are no outlines. `views`: the picture at
    the sizes where outlines are looked for, the largest last.
    """
    pixels = views[-1].target.permute(1, 2, 0).numpy().astype(np.float64)
    regions = Regions.of(pixels)
    if np.mean((regions.labels > 0) | even(pixels)) < KNOWN:
        return scene
    outlines = Outlines(scene, [Surroundings.of(scene, scene.layer_count, view) for view in views], search)
    finest = outlines.around[-1]
    if plate := None if scene.layer_count else outlines.plate(regions):
        corners = plate.overlay.outside
        scene = replace(scene, background=_opaque_color(regions.colors[corners][0]))
        # as if the plate went on there: what ends at its round corners is seen to end
        regions = regions.recolored(corners, plate.overlay.color, regions.doubts[corners])
    found, parts = hairlines(regions, finest, search.kinds)
    regions = regions.hidden(parts)
    while len(found) < MOST and not outlines.are_hopeless and (top := outlines.topmost(regions)):
        found += [layer for each in top if not each.soft for layer in each.layers]
        if top[0].is_opaque:
            regions = regions.hidden(np.any([each.overlay.inside for each in top], axis=0))
        else:
            regions = bared(regions, top[0].overlay)
    return topped(scene, [*(plate.layers if plate else ()), *reversed(found)])


@dataclass(frozen=True, eq=False)
class Outlines:
    """What the outlines of overlays were found to be; the surroundings rise in size.

    `before`: what each was the last time it was told, and what was known next to it then.
    """

    scene: SceneTensors
    around: Sequence[Surroundings]
    search: Search
    done: dict[tuple[bytes, ...], Outlined | None] = field(default_factory=dict)
    before: dict[tuple[bytes, ...], tuple[bytes, Outlined]] = field(default_factory=dict)

    def topmost(self, regions: Regions) -> list[Outlined]:
        """The layer that lies on top of some regions, of plain ones all that are no neighbours; none if none is told.

        Another shape where one is bitten is the likelier, or where a hole is not of the form that was cut out: these
        wait until there is nothing else.
        """
        good = self._good(overlays(regions), regions)
        top = [
            each for each in good if not any(each.lies_under(other) for other in good if other is not each)
        ]
        found = top or good
        for whole in (True, False):
            if all(each.is_unlikely for each in found):
                found += self._good(opaque(regions, self.ground, whole), regions)
        if not found:
            found = self._good(holes(regions, self.ground), regions)
        return _apart(sorted(found, key=lambda each: each.rank), regions)

    @property
    def ground(self) -> np.ndarray:
        """Its colour [4]; no number where it is a ramp, which has none that a region may have."""
        return np.full(4, np.nan) if self.scene.layer_count else self.scene.background.numpy()

    def plate(self, regions: Regions) -> Outlined | None:
        """The shape in the ground's colour that covers all of the picture but its four corners, which are of another
        one; None if there is none.
        """
        corners, ground = cornered(regions), self.ground[: regions.colors.shape[1]]
        if not corners.any() or _of_color(regions, ground)[corners].any():
            return None
        told = self.told(Overlay(1.0, ground, ~corners, corners), regions)
        return told if told is not None and told.is_plain and not told.soft else None

    @property
    def are_hopeless(self) -> bool:
        """Whether so many regions are no shapes that the picture is hardly made of shapes: of a photograph reduced to
        few colours, or of the blocks that JPEG makes of a gradient.
        """
        good = sum(each is not None and each.is_good for each in self.done.values())
        return len(self.done) - good > FAILED + FORGIVEN * good

    def _good(self, tried: Iterable[Overlay], regions: Regions) -> list[Outlined]:
        """Those of some overlays that a shape has the outline of."""
        found = []
        for overlay in tried:
            if self.are_hopeless:
                break
            best = self.told(overlay, regions)
            found += [best] if best is not None else []
        return found

    def told(self, overlay: Overlay, regions: Regions) -> Outlined | None:
        """What has the outline of an overlay; looked for in all of the picture where that hides what is not seen around
        its own place.
        """
        height, width = self.around[-1].shape
        for part in (regions.extent(overlay.inside), (slice(0, height), slice(0, width))):
            best = self._within(part, overlay, regions)
            if best is None or not self._hides_more(best, regions):
                return best
        return None

    def _within(self, part: Part, overlay: Overlay, regions: Regions) -> Outlined | None:
        """What has the outline of an overlay, as seen in a part of the picture and around it."""
        area, fine = self._areas(part, overlay, regions)
        best = self._of(area, fine)
        is_ground = _of_color(regions, self.ground)
        if best is None or not best.is_good or not _holds(best, area, fine, regions, is_ground):
            return None
        return replace(best, overlay=overlay)

    def _hides_more(self, best: Outlined, regions: Regions) -> bool:
        """Whether layers cover the greater part of a region that they do not belong to."""
        whole = self.around[-1]
        hidden = regions.count(whole.plane(cover_at(best.all, whole) > 0.5))
        return bool(((hidden > HIDDEN * regions.areas) & ~best.overlay.inside).any())

    def _of(self, area: Area, fine: Area) -> Outlined | None:
        """The shape that comes nearest to an overlay, or a shape with another cut out of it; None for no pixel.

        What it was before, where what is next to it is what it was, too, or where nothing better is found now.
        """
        key = (*area.key, *fine.key)
        if key not in self.done:
            self.done[key] = self._kept_or_found(area, fine)
        return self.done[key]

    def _kept_or_found(self, area: Area, fine: Area) -> Outlined | None:
        name, near = fine.name, fine.near
        then, old = self.before.get(name, (b"", None))
        tried = [replace(area.outlined_together(old.all), bitten=old.bitten)] if old else []
        good = [each for each in tried if each.is_good]
        if then != near or not good:
            found = best_outlined(area, fine, self.search)
            if found and found.is_good:
                good = [replace(found, bitten=any(map(area.is_bitten, found.all))), *good]
            if not good:
                return found
        best = min(good, key=lambda each: each.score)
        self.before[name] = near, best
        return best

    def _areas(self, place: Part, overlay: Overlay, regions: Regions) -> tuple[Area, Area]:
        """Where an overlay is, in a window around a part of the largest surroundings in which that has at most `POINTS`
        points, and in one of the finest.
        """
        sides = regions.sides
        soft = _is_soft(overlay.inside, widened(place, 2, sides), regions)
        windows = [_with_margin(smaller(place, sides, around.shape), around.shape) for around in self.around]
        near = max((i for i, window in enumerate(windows) if _points(window) <= POINTS), default=0)

        def area(index: int) -> Area:
            around, window = self.around[index], windows[index]
            part = larger(window, sides, around.shape)
            own, beyond = (regions.mask(chosen, part) for chosen in (overlay.inside, overlay.outside))
            if overlay.opacity == 1.0:
                beyond |= regions.slopes.beyond(own, part)
            inside, others = (
                torch.from_numpy(means(mask, window, sides, around.shape)).flatten() for mask in (own, beyond)
            )
            return Area(overlay, inside, inside + others, window, around.window(*window), soft)

        fine = area(len(windows) - 1)
        return fine if near == len(windows) - 1 else area(near), fine


def _apart(ranked: Sequence[Outlined], regions: Regions) -> list[Outlined]:
    """The first, and if that is plain, all others that are so and no neighbours of each other."""
    if not ranked or not ranked[0].is_plain:
        return list(ranked[:1])
    taken: list[Outlined] = []
    touched = np.zeros(len(regions.colors), bool)
    for each in ranked:
        inside = each.overlay.inside
        if each.is_plain and not (touched & inside).any():
            taken.append(each)
            touched |= inside | regions.beside[inside].any(axis=0)
    return taken


def _holds(best: Outlined, area: Area, fine: Area, regions: Regions, is_ground: BoolArray) -> bool:
    """Whether layers cover their overlay in the finest surroundings as well as where found, with edges of their own."""
    if not fine.is_told_as_in(area, best.all):
        return False
    return not any(_goes_on(layer, fine, regions, is_ground) for layer in best.all if _is_met(layer))


def _is_met(layer: Group) -> bool:
    """Whether only what shapes have in common is left of it."""
    return INTERSECTION in [part.join for part in layer.structure]


def _goes_on(layer: Group, fine: Area, regions: Regions, is_ground: BoolArray) -> bool:
    """Whether edges that cut a part out of a layer's first shape go on beyond it, between regions: then they are those
    of a shape that lies on it, or under it. Not where all that they cut off is ground [R]: many shapes may end there.
    """
    labels, around = regions.labels[fine.part], fine.around
    ground = regions.place(is_ground)[fine.part]
    base, *others = (
        around.plane(own_cover(layer, index, around) > 0.5) for index in range(len(layer.structure))
    )
    edge = seen = 0
    for other in others:
        if ground[base & ~other].sum() > MOSTLY * (base & ~other).sum():
            continue
        for one, next_one in ((np.s_[1:], np.s_[:-1]), (np.s_[:, 1:], np.s_[:, :-1])):
            beyond = (other[one] != other[next_one]) & ~base[one] & ~base[next_one]
            edge += int(beyond.sum())
            seen += int((labels[one] != labels[next_one])[beyond].sum())
    return seen > MOSTLY * edge


def opaque(regions: Regions, ground: np.ndarray, whole: bool) -> Iterator[Overlay]:
    """What may be opaque on top: the regions of each colour but the ground's, each alone, or all of one shape together:
    of one colour, and connected but for what is not known.
    """
    colors, doubts = regions.colors, regions.doubts
    count, is_ground = len(colors), _of_color(regions, ground)
    apart = np.abs(colors[:, None] - colors[None]).max(axis=2, initial=0.0)
    alike = (apart <= doubts[:, None] + doubts[None]) & ~is_ground
    done = is_ground.copy()
    for number in range(count):
        if not done[number]:
            inside = _linked(number, alike[number], regions) if whole else np.arange(count) == number
            done |= inside
            yield Overlay(1.0, colors[number], inside, ~inside)


def cornered(regions: Regions) -> BoolArray:
    """Which regions [R] are in the corners of the picture; none where these are not all of one colour."""
    labels, chosen = regions.labels, np.zeros(len(regions.colors), bool)
    numbers = labels[[0, 0, -1, -1], [0, -1, 0, -1]]
    if numbers.all() and _of_color(regions, regions.colors[numbers[0] - 1])[numbers - 1].all():
        chosen[numbers - 1] = True
    return chosen


def holes(regions: Regions, ground: np.ndarray) -> Iterator[Overlay]:
    """The regions of the ground's colour within others, as what may lie on top of these in that colour."""
    is_ground, labels = _of_color(regions, ground), regions.labels
    at_edge = np.concatenate([labels[0], labels[-1], labels[:, 0], labels[:, -1]])
    inner = ~np.isin(np.arange(1, len(is_ground) + 1), at_edge)
    within = is_ground & inner & regions.beside[:, ~is_ground].any(axis=1)
    for number in np.flatnonzero(within):
        inside = np.arange(len(within)) == number
        yield Overlay(1.0, regions.colors[number], inside, ~inside)


def _of_color(regions: Regions, color: np.ndarray) -> BoolArray:
    """Which regions [R] have about a colour [C]."""
    apart = np.abs(regions.colors - color[: regions.colors.shape[1]])
    return np.asarray((apart <= 2 * regions.doubts[:, None]).all(axis=1))


def _opaque_color(color: Float64Array) -> torch.Tensor:
    """A colour [C] as RGBA."""
    return torch.from_numpy(np.concatenate([color, np.ones(4 - len(color))])).float()


def _linked(number: int, alike: BoolArray, regions: Regions) -> BoolArray:
    """Which of some regions [R] one is connected with, by themselves and by what is not known."""
    numbers = np.concatenate([[True], alike])[regions.labels]
    parts, _ = ndimage.label(numbers)
    own = np.unique(parts[regions.labels == number + 1])
    reached = np.unique(regions.labels[np.isin(parts, own)])
    linked = np.zeros(len(alike), bool)
    linked[reached[reached > 0] - 1] = True
    return linked


def _with_margin(part: Part, sides: Sides) -> Part:
    """What is around a part, too."""
    share, pixels = MARGIN
    return widened(part, round(share * max(each.stop - each.start for each in part)) + pixels, sides)


def _is_soft(chosen: BoolArray, part: Part, regions: Regions) -> bool:
    """Whether much of the edge of some regions [R], around which a part goes, goes over into others by colours that no
    region has, without a jump.
    """
    inside, slopes = regions.mask(chosen, part), regions.slopes
    edge = inside & ~ndimage.binary_erosion(inside, border_value=1)
    unsure = ndimage.binary_dilation(~(regions.sure | slopes.ends)[part]) & ~slopes.jumps[part]
    return bool((edge & unsure).sum() > SOFT * edge.sum())


def _points(window: Part) -> int:
    rows, columns = window
    return int((rows.stop - rows.start) * (columns.stop - columns.start))

"""The flat regions of a picture, which colours they have, and which of them are neighbours."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations, product

import numpy as np
from scipy import ndimage
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from ..arrays import BoolArray, Float64Array, IntArray
from .slopes import Slopes, steps
from .windows import NOWHERE, Part, Sides, extent, moved

# how far neighbours of a flat region differ at most; and any two of most of its pixels
STEADY, EVEN = 1.5 / 255, 4.0 / 255
MOSTLY = 0.95  # of them; near its edges others ring
LEAST = 6  # pixels of a region
MOST = 320  # regions, the largest
REACH, SURELY = (
    4.0,
    2.0,
)  # pixels from a region that are shared out among those around, at most: edges; that surely are
EXACT = 1.0 / 255  # how far the colour of a region may be off
NEAR = 5  # pixels across, in which another region is near
BESIDE = 2  # pixels of a common edge that make neighbours


@dataclass(frozen=True, eq=False)
class Regions:
    """Regions by number from 1, 0 for none, [H, W], and where that is sure; the slopes between them; the colour
    [R, C] of each, and how far that may be off [R].
    """

    labels: IntArray
    sure: BoolArray
    slopes: Slopes
    colors: Float64Array
    doubts: Float64Array

    @classmethod
    def of(cls, pixels: Float64Array) -> Regions:
        """Those of a picture [H, W, C]; what lies between them is of the nearest."""
        parts = connected(
            _calm(pixels), lambda one, other: np.abs(pixels[one] - pixels[other]).max(axis=2) <= STEADY
        )
        flat = [inside for inside in largest(parts, LEAST) if _is_flat(pixels[inside])]
        cores = np.zeros_like(parts)
        for number, inside in enumerate(flat, 1):
            cores[inside] = number
        is_step = steps(pixels, cores)
        flat = [inside for inside, step in zip(flat, is_step, strict=True) if not step]
        cores = _left(cores, is_step)
        colors = np.array([np.median(pixels[inside], axis=0) for inside in flat]).reshape(-1, pixels.shape[2])
        labels, sure, slopes = _shared_out(pixels, cores, colors)
        return cls(labels, sure, slopes, colors, np.full(len(colors), EXACT)).merged()

    @cached_property
    def borders(self) -> IntArray:
        """How many pixels of each region lie beside one of each other, [R, R]."""
        found = np.zeros((len(self.colors) + 1,) * 2, np.int64)
        for one, other in (
            (self.labels[:, 1:], self.labels[:, :-1]),
            (self.labels[1:], self.labels[:-1]),
        ):
            np.add.at(found, (one, other), 1)
            np.add.at(found, (other, one), 1)
        np.fill_diagonal(found, 0)
        return found[1:, 1:]

    @cached_property
    def beside(self) -> BoolArray:
        """Which regions are neighbours, [R, R]."""
        return self.borders >= BESIDE

    @cached_property
    def areas(self) -> IntArray:
        """Pixels of each, [R]."""
        return self.count(np.ones(self.labels.shape, bool))

    def count(self, where: BoolArray) -> IntArray:
        """Pixels of each somewhere [H, W], [R]."""
        return np.bincount(self.labels[where], minlength=len(self.colors) + 1)[1:]

    @property
    def sides(self) -> Sides:
        """Of the picture."""
        height, width = self.labels.shape
        return height, width

    @cached_property
    def boxes(self) -> list[Part]:
        """The part of the picture that each is in."""
        return [box or NOWHERE for box in ndimage.find_objects(self.labels, len(self.colors))]

    def mask(self, chosen: BoolArray, part: Part) -> BoolArray:
        """Where some of them [R] surely are, in a part of the picture."""
        return self.place(chosen)[part] & self.sure[part]

    def place(self, chosen: BoolArray) -> BoolArray:
        """Where some of them [R] are or may be, [H, W]."""
        return np.asarray(np.concatenate([[False], chosen])[self.labels])

    def extent(self, chosen: BoolArray) -> Part:
        """The part of the picture that some of them [R] surely are in."""
        boxes = [self.boxes[index] for index in np.flatnonzero(chosen)] or [NOWHERE]
        rows, columns = (
            slice(min(box[axis].start for box in boxes), max(box[axis].stop for box in boxes))
            for axis in (0, 1)
        )
        return moved(extent(self.mask(chosen, (rows, columns))), (rows, columns))

    def recolored(self, chosen: BoolArray, colors: Float64Array, doubts: Float64Array) -> Regions:
        """The same where some [R] have other colours; neighbours that have come to be alike are one."""
        recolored, doubted = self.colors.copy(), self.doubts.copy()
        recolored[chosen], doubted[chosen] = colors, doubts
        return replace(self, colors=recolored, doubts=doubted).merged()

    def hidden(self, chosen: BoolArray) -> Regions:
        """The same where some [R] are no longer seen: it is not known what is there."""
        labels = _left(self.labels, chosen)
        return replace(self, labels=labels, colors=self.colors[~chosen], doubts=self.doubts[~chosen])

    def merged(self) -> Regions:
        """The same with neighbours of one colour made one, the likest first."""
        regions = self
        while (pair := regions._likest()) is not None:
            regions = regions._joined(*pair)
        return regions

    def _likest(self) -> tuple[int, int] | None:
        """The two neighbours that differ least, where they may be of one colour."""
        one, other = np.nonzero(np.triu(self.beside))
        apart = np.abs(self.colors[one] - self.colors[other]).max(axis=1, initial=0.0)
        excess = apart - self.doubts[one] - self.doubts[other]
        if not (excess <= 0).any():
            return None
        best = int(np.where(excess <= 0, apart, np.inf).argmin())
        return int(one[best]), int(other[best])

    def _joined(self, one: int, other: int) -> Regions:
        """The same with the second region part of the first, which comes before it."""
        pair = [one, other]
        colors, doubts = self.colors.copy(), self.doubts.copy()
        colors[one] = np.average(self.colors[pair], axis=0, weights=self.doubts[pair] ** -2)
        doubts[one] = self.doubts[pair].min()
        labels = np.where(self.labels == other + 1, one + 1, self.labels)
        labels = labels - (labels > other + 1)
        return replace(
            self,
            labels=labels,
            colors=np.delete(colors, other, axis=0),
            doubts=np.delete(doubts, other),
        )


def _calm(pixels: Float64Array) -> BoolArray:
    """Where a picture [H, W, C] has one colour in four pixels that make a square."""
    squares = np.ones((pixels.shape[0] - 1, pixels.shape[1] - 1), bool)
    for one, other in combinations((pixels[:-1, :-1], pixels[:-1, 1:], pixels[1:, :-1], pixels[1:, 1:]), 2):
        squares &= np.abs(one - other).max(axis=2) <= STEADY
    calm = np.zeros(pixels.shape[:2], bool)
    for rows, columns in product((slice(None, -1), slice(1, None)), repeat=2):
        calm[rows, columns] |= squares
    return calm


def _is_flat(colors: Float64Array) -> bool:
    """Whether most colours [P, C] are one."""
    away = np.abs(colors - np.median(colors, axis=0)).max(axis=1)
    return float(np.mean(away <= EVEN / 2)) >= MOSTLY


def _left(labels: IntArray, gone: BoolArray) -> IntArray:
    """Numbers from 1 [H, W] without some [R], the rest in their order."""
    return np.asarray(np.concatenate([[0], np.where(gone, 0, np.cumsum(~gone))])[labels])


def connected(chosen: BoolArray, alike: Callable[[Part, Part], BoolArray]) -> IntArray:
    """Numbers from 1 of what is connected, by neighbours that are alike, where something is chosen [H, W]; else 0.

    `alike`: whether the pixels of a part of the picture are like those of another, one by one.
    """
    numbers = np.arange(chosen.size).reshape(chosen.shape)
    pairs = []
    for one, other in ((np.s_[:, 1:], np.s_[:, :-1]), (np.s_[1:, :], np.s_[:-1, :])):
        joined = alike(one, other) & chosen[one] & chosen[other]
        pairs.append(np.stack([numbers[one][joined], numbers[other][joined]]))
    ends = np.concatenate(pairs, axis=1)
    graph = coo_matrix((np.ones(ends.shape[1], bool), ends), shape=(chosen.size, chosen.size))
    _, found = connected_components(graph, directed=False)
    return np.where(chosen, found.reshape(chosen.shape).astype(np.int64) + 1, 0)


def largest(parts: IntArray, least: int) -> Iterator[BoolArray]:
    """Masks [H, W] of numbered parts, the largest first: of at least so many pixels each, no more than `MOST`."""
    sizes = np.bincount(parts.ravel())
    sizes[0] = 0
    for number in np.argsort(-sizes, kind="stable")[:MOST]:
        if sizes[number] >= least:
            yield parts == number


def _shared_out(
    pixels: Float64Array, cores: IntArray, colors: Float64Array
) -> tuple[IntArray, BoolArray, Slopes]:
    """Of a picture [H, W, C] what is in no region as well, each of that which is likest nearby, else of the nearest;
    where that is sure; and its slopes: what is beyond an edge is in no region.
    """
    slopes = Slopes.of(pixels, cores)
    if not len(colors):
        return cores, cores > 0, slopes
    cores = np.where(slopes.ends, len(colors) + 1, cores)
    shown = np.where(slopes.ends[..., None], pixels, colors[np.minimum(cores, len(colors)) - 1])
    away, nearest = ndimage.distance_transform_edt(cores == 0, return_indices=True)
    labels = np.where(away <= REACH, cores[tuple(nearest)], 0)
    own = shown[tuple(nearest)]
    padded, around = np.pad(cores, 2), np.pad(shown, ((2, 2), (2, 2), (0, 0)))
    least = np.where(cores > 0, 0.0, np.inf)
    height, width = cores.shape
    for down, right in product(range(5), repeat=2):
        beside, color = (each[down:, right:][:height, :width] for each in (padded, around))
        apart = np.where(beside > 0, np.abs(pixels - color).max(axis=2), np.inf)
        nearer = apart < least
        labels, own = np.where(nearer, beside, labels), np.where(nearer[..., None], color, own)
        least = np.minimum(apart, least)
    sure = (away <= SURELY) & ~_foreign(pixels, labels, own)
    is_region = labels <= len(colors)
    return labels * is_region, sure & is_region, replace(slopes, ends=sure & ~is_region)


def _foreign(pixels: Float64Array, labels: IntArray, own: Float64Array) -> BoolArray:
    """Where a picture [H, W, C] has another colour than that of the region there though no other is near: what is
    thin.
    """
    alone: BoolArray = ndimage.maximum_filter(labels, NEAR) == ndimage.minimum_filter(labels, NEAR)
    apart: Float64Array = np.abs(pixels - own).max(axis=2)
    return alone & (apart > EVEN) & (labels > 0)

"""Gradients of a picture, taken out of it: shapes that run from one colour to another are searched in one colour.

Where a region of the picture is a plane in its colours, or these change with the distance from a point alone, all of
it gets one of these, and what lies beside it or on it stays: the picture is flat then. `repainting` puts the gradients
into the shapes that were found.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy import ndimage

from ..arrays import BoolArray, Float32Array, IntArray
from ..image import Picture, unpremultiply
from .region_graph import connected, largest
from .rings import RadialShade, rings_of
from .slopes import BENT, even
from .views import scaled
from .windows import Part, Sides, extent, larger, widened

WHITE = 255  # levels
LOOKED = 320  # pixels squared, at which regions are looked for
PLANE, NEARLY = 2.2 / 255, 0.98  # how far a region is from a plane at most; share of it that is as near
BENDS = 0.06  # how far it may be, too, by what its colour changes: as where there is a third one in between
SMALLEST = 3  # pixels of a side, for anything to be even
LEAST, LEAST_SHADED = 9, 60  # pixels of a region; of one that is no single colour
CHANGES = 6.0 / 255  # of a colour across a region, at least, of a gradient
ALIKE = 3.0 / 255  # how far two regions of one plane are from it, at most
REACH = 3  # pixels beyond a region that its edge may show in
AROUND = 5  # pixels squared where an edge goes from one colour to the other
# length of the difference of two colours that are one, in a region at its edge, and where it may be no plane
NOISE, BENT_AWAY = 3.0 / 255, 16.0 / 255
UNLIKE = 6.0 / 255  # from the region's colour, of an edge's other one
CLEAR = 0.7  # share of the difference of two regions that is left without gradients, at least, if it can be
SHARP = 0.7  # share of what lies beyond a region's edge that is another region, at least

EVERYWHERE: Part = slice(None), slice(None)


class Shade(NamedTuple):
    """A premultiplied colour [C] at a place (x, y) and its slopes along both axes [2, C], by shares of the sides."""

    place: Float32Array
    color: Float32Array
    slopes: Float32Array

    @property
    def is_flat(self) -> bool:
        """Whether it is one colour."""
        return not self.slopes.any()

    @property
    def axis(self) -> Float32Array:
        """The direction [C] in which its colours lie."""
        found: Float32Array = np.linalg.svd(self.slopes, full_matrices=False)[2][0]
        return found

    def at(self, x: Float32Array, y: Float32Array) -> Float32Array:
        """The colour there [..., C]."""
        found: Float32Array = (
            self.color
            + (x - self.place[0])[..., None] * self.slopes[0]
            + (y - self.place[1])[..., None] * self.slopes[1]
        )
        return found


Gradient = Shade | RadialShade


@dataclass(frozen=True, eq=False)
class Shading:
    """The regions of premultiplied pixels, by number from 1, 0 for none [H, W], where these are scaled down; what they
    are painted with; and where these pixels are even [H, W].

    Parts of one colour or gradient are one region, wherever they are.
    """

    pixels: Float32Array
    labels: IntArray
    shades: tuple[Gradient, ...]
    calm: BoolArray

    @classmethod
    def of(cls, pixels: Float32Array) -> Shading | None:
        """That of pixels [H, W, C]; None where no region of them is a gradient with sharp edges."""
        small = scaled(pixels, LOOKED).permute(1, 2, 0).numpy()
        calm = even(small)
        labels, shades = _regions(small, calm)
        found = cls(pixels, labels, tuple(shades), calm)
        return found if found.graded else None

    @cached_property
    def graded(self) -> list[int]:
        """The numbers of the regions that are gradients with sharp edges."""
        numbers = (number for number, shade in enumerate(self.shades, 1) if not shade.is_flat)
        return [number for number in numbers if _is_sharp(self.labels, number, self.calm)]

    @cached_property
    def nearest(self) -> IntArray:
        """The number of the region that each pixel is in or next to, [H, W]."""
        _, (rows, columns) = ndimage.distance_transform_edt(self.labels == 0, return_indices=True)
        found: IntArray = self.labels[rows, columns]
        return found

    @cached_property
    def flats(self) -> Float32Array:
        """The colours [R, C] of the shades, of 8 bits; of a gradient one that it has, so that its region is as far from
        those beside it as it was.
        """
        colors: Float32Array = np.rint(np.array([shade.color for shade in self.shades]) * WHITE) / WHITE
        for number in self.graded:
            beside = list(self._beside(number))
            others, far = [index for index, _ in beside], np.array([far for _, far in beside])
            choices = self._choices(number)
            apart = np.linalg.norm(choices[:, None] - colors[others], axis=2)
            left = np.minimum(apart / far, CLEAR).min(axis=1, initial=CLEAR)
            colors[number - 1] = choices[left.argmax()]
        return colors

    def _choices(self, number: int) -> Float32Array:
        """Colours [5, C] of 8 bits that a gradient has: in its middle, and towards and at both ends."""
        x, y = np.broadcast_arrays(*_places(self.labels.shape))
        shade, inside = self.shades[number - 1], self.labels == number
        away = shade.at(x[inside], y[inside]) - shade.color
        along = away @ shade.axis
        ends = (away[along.argsort()[round(share * (len(along) - 1))]] for share in (0.25, 0.75, 0.0, 1.0))
        choices = np.array([shade.color, *(shade.color + end for end in ends)])
        found: Float32Array = np.rint(choices.clip(0.0, 1.0) * WHITE) / WHITE
        return found

    def _beside(self, number: int) -> Iterator[tuple[int, float]]:
        """The places among all of the regions that begin where one ends, and how far the colours are apart there."""
        x, y = np.broadcast_arrays(*_places(self.labels.shape))
        inside = self.nearest == number
        for other in np.unique(self.nearest[ndimage.binary_dilation(inside) & ~inside]).tolist():
            edge = inside & ndimage.binary_dilation(self.nearest == other)
            one, two = (self.shades[index - 1].at(x[edge], y[edge]) for index in (number, other))
            far = float(np.linalg.norm(one - two, axis=1).mean())
            if far > UNLIKE:
                yield other - 1, far

    @cached_property
    def flattened(self) -> Picture:
        """The picture without its gradients: each is of a colour that it has."""
        before = self.pixels
        flat = before.copy()
        for number in self.graded:
            self._flatten(number, before, flat)
        flat = flat.clip(0.0, 1.0)
        return Picture(unpremultiply(flat) if flat.shape[2] == 4 else flat)

    def _flatten(self, number: int, before: Float32Array, flat: Float32Array) -> None:
        """Puts a colour in the place of a gradient of a picture [H, W, C], `flat`."""
        sides, small = before.shape[:2], self.labels.shape
        own = self.labels == number
        around = ndimage.binary_dilation(own, iterations=REACH)
        part = larger(widened(extent(around), 1, small), sides, small)
        own, around = (mask[_resized(small, sides, part)] for mask in (own, around))
        shown, color = self.shades[number - 1].at(*_places(sides, part)), self.flats[number - 1]
        apart = np.linalg.norm(before[part] - shown, axis=2)
        near = ndimage.maximum_filter(around & (apart <= UNLIKE), 2 * REACH + 1)
        flat[part] += _share(apart, near)[..., None] * (color - shown)
        flat[part][near & (apart <= np.where(own, BENT_AWAY, NOISE))] = color


def _places(sides: Sides, part: Part = EVERYWHERE) -> tuple[Float32Array, Float32Array]:
    """Where the pixels of a part of a picture are, x [1, w] and y [h, 1], by shares of its sides."""
    y, x = (
        ((np.arange(side)[seen] + 0.5) / side).astype(np.float32)
        for side, seen in zip(sides, part, strict=True)
    )
    return x[None], y[:, None]


def _resized(sides: Sides, wanted: Sides, part: Part = EVERYWHERE) -> tuple[IntArray, IntArray]:
    """Which rows [h, 1] and columns [1, w] of a picture are seen in a part of one of other sides."""
    rows, columns = (
        np.arange(new)[seen] * own // new for own, new, seen in zip(sides, wanted, part, strict=True)
    )
    return rows[:, None], columns[None]


def _share(apart: Float32Array, near: BoolArray) -> Float32Array:
    """How much of each pixel [H, W] a region has: all where its colour is shown, none where what is nearby is shown
    that is least like it.
    """
    most = ndimage.maximum_filter(apart, AROUND)
    share = np.where(most <= UNLIKE, 1.0, 1.0 - apart / np.maximum(most, UNLIKE))
    found: Float32Array = (near * share.clip(0.0, 1.0)).astype(np.float32)
    return found


def _is_sharp(labels: IntArray, number: int, calm: BoolArray) -> bool:
    """Whether other regions begin where a region ends, or it goes on; or, beyond an edge, what is calm [H, W]."""
    inside, square = labels == number, np.ones((3, 3))
    within = ndimage.binary_dilation(inside, square, iterations=REACH)
    beyond = ndimage.binary_dilation(within, square) & ~within
    if not beyond.any():
        return True
    edge = ndimage.binary_dilation(inside, square) & ~inside
    has_edge = calm[edge].mean() <= 1.0 - SHARP
    return float(((labels > 0) | (calm & has_edge))[beyond].mean()) >= SHARP


# --- regions --------------------------------------------------------------------------------------------------


def _regions(pixels: Float32Array, calm: BoolArray) -> tuple[IntArray, list[Gradient]]:
    """The regions of a picture [H, W, C] that are gradients or one colour, by number from 1, and what these are, the
    largest first; `calm`: where it is even [H, W].
    """
    labels, shades = np.zeros(pixels.shape[:2], np.int64), list[Gradient]()
    x, y = np.broadcast_arrays(*_places(pixels.shape[:2]))
    for inside in _smooth(pixels, calm):
        shade = _gradient(inside, x[inside], y[inside], pixels)
        if shade is None:
            continue
        same = (
            number
            for number, other in enumerate(shades, 1)
            if other.is_flat == shade.is_flat
            and np.abs(other.at(x[inside], y[inside]) - pixels[inside]).max(axis=1).mean() < ALIKE
        )
        number = next(same, len(shades) + 1)
        if number > len(shades):
            shades.append(shade)
        labels[inside] = number
    return labels, shades


def _smooth(pixels: Float32Array, calm: BoolArray) -> Iterator[BoolArray]:
    """Masks [H, W] of connected pixels of a picture where colours hardly bend, and change the same way; the largest
    first.
    """
    if min(pixels.shape[:2]) < SMALLEST:
        return
    slopes = np.concatenate([np.gradient(pixels, axis=axis) for axis in (0, 1)], axis=2)
    parts = connected(calm, lambda one, other: np.abs(slopes[one] - slopes[other]).max(axis=2) <= BENT)
    yield from largest(parts, LEAST)


def _gradient(inside: BoolArray, x: Float32Array, y: Float32Array, pixels: Float32Array) -> Gradient | None:
    """What is inside [H, W] of a picture, at places [P] of that: one colour, a plane, or else rings, where it is near
    to one, and no paler here than there; rings before a plane that bends.
    """
    colors = pixels[inside]
    plane = _plane(x, y, colors)
    shown = plane.at(x, y)
    if _is_told(shown, colors, 0.0) and np.ptp(shown, axis=0).max() < CHANGES:
        return Shade(plane.place, np.median(colors, axis=0), np.zeros_like(plane.slopes))
    if len(colors) < LEAST_SHADED or (colors.shape[1] == 4 and np.ptp(colors[:, 3]) > CHANGES):
        return None
    if _is_told(shown, colors, 0.0):
        return plane
    rings = rings_of(inside, pixels)
    around = None if rings is None else rings.at(x, y)
    if around is not None and _is_told(around, colors, 0.0):
        return rings
    if _is_told(shown, colors, BENDS):
        return plane
    return rings if around is not None and _is_told(around, colors, BENDS) else None


def _is_told(shown: Float32Array, colors: Float32Array, bends: float) -> bool:
    """Whether colours [P, C] are near to others, or as near as they may be of gradients that bend."""
    allowed = max(PLANE, bends * float(np.ptp(shown, axis=0).max()))
    return bool(np.mean(np.abs(shown - colors).max(axis=1) <= allowed) >= NEARLY)


def _plane(x: Float32Array, y: Float32Array, colors: Float32Array) -> Shade:
    """The plane through colours [P, C] that changes along one direction."""
    places = np.stack([x, y], axis=1)
    middle, mean = places.mean(axis=0), colors.mean(axis=0)
    return Shade(middle, mean, _along_one(np.linalg.lstsq(places - middle, colors - mean)[0]))


def _along_one(slopes: Float32Array) -> Float32Array:
    """Slopes [2, C] as near to these as change along one direction."""
    left, strengths, right = np.linalg.svd(slopes, full_matrices=False)
    found: Float32Array = left[:, :1] * strengths[0] @ right[:1]
    return found

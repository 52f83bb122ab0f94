"""Gradients of a picture, taken out of it: shapes that run from one colour to another are searched in one colour.

Where colours change along one direction of a region of the picture, or with the distance from a point alone, all of it
gets one of these, and what lies beside it or on it stays: the picture is flat then. `repainting` puts the gradients
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
from .gradient_regions import UNLIKE, WHITE, regions_of
from .shades import Gradient, places_in
from .slopes import even
from .views import scaled
from .windows import Part, Sides, extent, larger, widened

LOOKED = 320  # pixels squared, at which regions are looked for
REACH = 3  # pixels beyond a region that its edge may show in
BEYOND = 5  # pixels from it where there is another one, if its edge is sharp: it may have a thin rim
AROUND = 5  # pixels squared where an edge goes from one colour to the other
# length of the difference of two colours that are one, in a region at its edge, and where it may be no plane
NOISE, BENT_AWAY = 3.0 / 255, 16.0 / 255
CLEAR = 0.7  # share of the difference of two regions that is left without gradients, at least, if it can be
SHARP = 0.7  # share of what lies beyond a region's edge that is another region, at least


class Seen(NamedTuple):
    """What is seen of a gradient in a part of a picture [h, w]: which share of each pixel, by how much its colour [C]
    without the gradient differs from that with it [h, w, C]; where nothing else is seen.
    """

    part: Part
    share: Float32Array
    change: Float32Array
    is_all: BoolArray
    color: Float32Array


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
    def of(cls, pixels: Float32Array, least: float = 0.0) -> Shading | None:
        """That of pixels [H, W, C]; None where no region of them is a gradient with sharp edges, or regions are less
        than a share of the picture.
        """
        small = scaled(pixels, LOOKED).permute(1, 2, 0).numpy()
        calm = even(small)
        labels, shades = regions_of(small, calm, least)
        found = cls(pixels, labels, tuple(shades), calm)
        return found if found.graded else None

    @cached_property
    def graded(self) -> list[int]:
        """The numbers of the regions that are gradients with sharp edges."""
        numbers = (number for number, shade in enumerate(self.shades, 1) if not shade.is_flat)
        return [number for number in numbers if _is_sharp(self.labels, number, self.calm)]

    @cached_property
    def flat(self) -> BoolArray:
        """Where regions are of one colour [H, W]."""
        is_flat = np.array([False, *(shade.is_flat for shade in self.shades)])
        return np.asarray(is_flat[self.labels])

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
        shade = self.shades[number - 1]
        away = shade.at(*places_in(self.labels == number)) - shade.color
        along = away @ shade.axis
        ends = (away[along.argsort()[round(share * (len(along) - 1))]] for share in (0.25, 0.75, 0.0, 1.0))
        choices = np.array([shade.color, *(shade.color + end for end in ends)])
        found: Float32Array = np.rint(choices.clip(0.0, 1.0) * WHITE) / WHITE
        return found

    def _beside(self, number: int) -> Iterator[tuple[int, float]]:
        """The places among all of the regions that begin where one ends, and how far the colours are apart there."""
        inside = self.nearest == number
        for other in np.unique(self.nearest[ndimage.binary_dilation(inside) & ~inside]).tolist():
            edge = inside & ndimage.binary_dilation(self.nearest == other)
            one, two = (self.shades[index - 1].at(*places_in(edge)) for index in (number, other))
            far = float(np.linalg.norm(one - two, axis=1).mean())
            if far > UNLIKE:
                yield other - 1, far

    @cached_property
    def flattened(self) -> Picture:
        """The picture without its gradients: each is of a colour that it has."""
        before = self.pixels
        flat, taken = before.copy(), np.zeros(before.shape[:2], np.float32)
        seen = [self._seen(number) for number in self.graded]
        for each in seen:
            taken[each.part] += each.share
        for each in seen:
            flat[each.part] += (each.share / taken[each.part].clip(min=1.0))[..., None] * each.change
        for each in seen:
            flat[each.part][each.is_all] = each.color
        flat = flat.clip(0.0, 1.0)
        return Picture(unpremultiply(flat))

    def _seen(self, number: int) -> Seen:
        """How much is seen of a gradient, and where."""
        sides, small = self.pixels.shape[:2], self.labels.shape
        own = self.labels == number
        free = ~self.flat  # what is of no other colour
        around = ndimage.binary_dilation(own, iterations=REACH) & free
        part = larger(widened(extent(around), 1, small), sides, small)
        own, around, free = (mask[_resized(small, sides, part)] for mask in (own, around, free))
        shown, color = self.shades[number - 1].at(*_places(sides, part)), self.flats[number - 1]
        apart = np.linalg.norm(self.pixels[part] - shown, axis=2)
        near = ndimage.maximum_filter(around & (apart <= UNLIKE), 2 * REACH + 1) & free
        is_all = near & (apart <= np.where(own, BENT_AWAY, NOISE))
        return Seen(part, _share(apart, near), color - shown, is_all, color)


def _places(sides: Sides, part: Part) -> tuple[Float32Array, Float32Array]:
    """Where the pixels of a part of a picture are, x [1, w] and y [h, 1], by shares of its sides."""
    y, x = (
        ((np.arange(side)[seen] + 0.5) / side).astype(np.float32)
        for side, seen in zip(sides, part, strict=True)
    )
    return x[None], y[:, None]


def _resized(sides: Sides, wanted: Sides, part: Part) -> tuple[IntArray, IntArray]:
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
    within = ndimage.binary_dilation(inside, square, iterations=BEYOND)
    beyond = ndimage.binary_dilation(within, square) & ~within
    if not beyond.any():
        return True
    edge = ndimage.binary_dilation(inside, square) & ~inside
    has_edge = calm[edge].mean() <= 1.0 - SHARP
    return float(((labels > 0) | (calm & has_edge))[beyond].mean()) >= SHARP

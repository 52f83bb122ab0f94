"""Where the colours of a picture go over into each other: in gradients, shadows and glows."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from ..arrays import BoolArray, Float32Array, Float64Array, IntArray
from .windows import Part

BENT, STEEP = 2.2 / 255, 16.0 / 255  # second differences of what is even, at most; first ones
CURVED = 4.5 / 255  # the same of a slope: that of a shadow bends more than a gradient
GOES_OVER = 8.0 / 255  # how far a colour is at most from that of a region that it goes over into
CLOSE, REACH = 2, 8  # pixels from a region, where that is seen; from there, where it may still be so
NEAR = 6.0  # pixels from a region, at most, of what is told to lie beyond its edge
BROAD, SUDDEN = 5, 0.85  # pixels; share of what changes within these that changes at once, of a sharp edge
BANDS = 0.35  # share of a region, at least, that goes over into others, of what is a step of a gradient


def even(pixels: Float32Array | Float64Array, bends: float = BENT) -> BoolArray:
    """Where a picture [H, W, C] hardly bends, and is not steep, from a pixel to all of those around it."""
    found = np.zeros(pixels.shape[:2], bool)
    middle = pixels[1:-1, 1:-1]
    bent = np.zeros_like(middle[..., 0])
    steep = bent
    for one, other in (
        (pixels[1:-1, :-2], pixels[1:-1, 2:]),
        (pixels[:-2, 1:-1], pixels[2:, 1:-1]),
        (pixels[:-2, :-2], pixels[2:, 2:]),
        (pixels[:-2, 2:], pixels[2:, :-2]),
    ):
        bent = np.maximum(bent, np.abs(one + other - 2 * middle).max(axis=2))
        steep = np.maximum(steep, np.abs(one - other).max(axis=2) / 2)
    found[1:-1, 1:-1] = (bent <= bends) & (steep <= STEEP)
    return found


@dataclass(frozen=True, eq=False)
class Slopes:
    """Where slopes end at the sharp edge of a region, where they go over into one, where edges are sharp: [H, W]."""

    ends: BoolArray
    go_over: BoolArray
    jumps: BoolArray

    @classmethod
    def of(cls, pixels: Float64Array, cores: IntArray) -> Slopes:
        """Those of a picture [H, W, C] with regions by number from 1, 0 for none [H, W]."""
        slope = even(pixels, CURVED) & (cores == 0)
        away, nearest = _nearest(cores > 0)
        apart = np.abs(pixels - pixels[nearest]).max(axis=2)
        go_over = slope & (away <= CLOSE) & (apart <= GOES_OVER)
        far, there = _nearest(go_over)
        beside = cores[nearest]
        ends = slope & (away <= NEAR) & ((far > REACH) | (beside[there] != beside))
        return cls(np.asarray(ends), np.asarray(go_over), _jumps(pixels))

    def beyond(self, inside: BoolArray, part: Part) -> BoolArray:
        """Where they end at the edge of what is inside [h, w], in a part of the picture."""
        contact = self.go_over[part] & ndimage.binary_dilation(inside, np.ones((3, 3)), iterations=CLOSE)
        far, _ = _nearest(contact)
        return self.ends[part] & (far > REACH)


def _nearest(chosen: BoolArray) -> tuple[Float64Array, tuple[IntArray, IntArray]]:
    """How far pixels are from the next that is chosen, and where that is."""
    if not chosen.any():
        nowhere = np.zeros(chosen.shape, np.int64)
        return np.full(chosen.shape, np.inf), (nowhere, nowhere)
    far, (rows, columns) = ndimage.distance_transform_edt(~chosen, return_indices=True)
    return far, (rows, columns)


def _jumps(pixels: Float64Array) -> BoolArray:
    """Where most of what a colour changes nearby it does within the next pixels: at sharp edges, at no soft ones."""
    changes = []
    for reach in (CLOSE, BROAD):
        size = (2 * reach + 1, 2 * reach + 1, 1)
        high, low = ndimage.maximum_filter(pixels, size), ndimage.minimum_filter(pixels, size)
        changes.append(np.maximum(high - pixels, pixels - low).max(axis=2))
    return np.asarray(changes[0] >= SUDDEN * changes[1])


def steps(pixels: Float64Array, cores: IntArray) -> BoolArray:
    """Which regions [R] are steps of a slope: in eight bits it has some."""
    calm = even(pixels)
    go_over = np.zeros(cores.shape, bool)
    for one, other in ((np.s_[CLOSE:], np.s_[:-CLOSE]), (np.s_[:, CLOSE:], np.s_[:, :-CLOSE])):
        apart = np.abs(pixels[one] - pixels[other]).max(axis=2)
        meets = (cores[one] != cores[other]) & calm[one] & calm[other] & (apart <= GOES_OVER)
        go_over[one] |= meets
        go_over[other] |= meets
    counts, areas = (np.bincount(each.ravel(), minlength=cores.max() + 1) for each in (cores[go_over], cores))
    return np.asarray(counts >= BANDS * areas)[1:]

"""Parts of a picture as rows and columns, at its own size and at smaller ones, where a pixel is the mean of a block."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from ..arrays import BoolArray, Float32Array

Part = tuple[slice, slice]  # rows, columns
Sides = tuple[int, int]  # height, width
NOWHERE: Part = slice(0, 1), slice(0, 1)


def extent(mask: BoolArray) -> Part:
    """The rows and columns [H, W] that something is in; one pixel where nothing is."""
    places = [np.flatnonzero(mask.any(axis=axis)) for axis in (1, 0)]
    if not len(places[0]):
        return NOWHERE
    rows, columns = (slice(int(where[0]), int(where[-1]) + 1) for where in places)
    return rows, columns


def moved(part: Part, by: Part) -> Part:
    """A part of a part, in the picture."""
    rows, columns = (
        slice(own.start + whole.start, own.stop + whole.start) for own, whole in zip(part, by, strict=True)
    )
    return rows, columns


def widened(part: Part, margin: int, sides: Sides) -> Part:
    """With so many pixels around it, as far as the picture goes."""
    rows, columns = (
        slice(max(own.start - margin, 0), min(own.stop + margin, side))
        for own, side in zip(part, sides, strict=True)
    )
    return rows, columns


def smaller(part: Part, sides: Sides, small: Sides) -> Part:
    """Which pixels of a smaller picture a part is seen in."""
    rows, columns = (
        slice(own.start * few // side, -(-own.stop * few // side))
        for own, side, few in zip(part, sides, small, strict=True)
    )
    return rows, columns


def larger(part: Part, sides: Sides, small: Sides) -> Part:
    """The pixels of the picture that a part of a smaller one is made of."""
    rows, columns = (
        slice(own.start * side // few, -(-own.stop * side // few))
        for own, side, few in zip(part, sides, small, strict=True)
    )
    return rows, columns


def means(values: BoolArray, part: Part, sides: Sides, small: Sides) -> Float32Array:
    """What each pixel of a part of a smaller picture is the mean of; `values` are those of `larger` alone."""
    if small == sides:
        return values.astype(np.float32)
    down, across = (
        _blocks(own.start, own.stop, side, few) for own, side, few in zip(part, sides, small, strict=True)
    )
    found: Float32Array = down @ values.astype(np.float32) @ across.T
    return found


@lru_cache(maxsize=512)
def _blocks(start: int, stop: int, side: int, few: int) -> Float32Array:
    """Weights of pixels in the means of some along one side, [stop − start, pixels]."""
    blocks = np.arange(start, stop)[:, None] * (side / few)
    pixels = np.arange(start * side // few, -(-stop * side // few))
    inside = np.minimum(pixels + 1, blocks + side / few) - np.maximum(pixels, blocks)
    found: Float32Array = (inside.clip(min=0.0) * (few / side)).astype(np.float32)
    return found

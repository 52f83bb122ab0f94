"""What lossy compression made of a drawing, taken back: colours that ran over edges, and ringing beside them, so that
what is found is what was drawn and not the noise.

Such files keep colour at half the resolution of lightness, and of both leave out fine waves. In a drawing two colours
meet at an edge, so that there colour is a linear function of lightness, by which it becomes as sharp again (guided
filter: He, Sun, Tang 2010). Ringing is small beside the edge that it comes from: pixels become the mean of those
around that differ by less (sigma filter: Lee 1983).
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy.ndimage import convolve1d, maximum_filter, minimum_filter, uniform_filter

from ..arrays import Float32Array, Float64Array
from .jagged import alike

SEEN, SMALL = 1.5 / 255, 20 / 255  # what differs from one pixel to the next; up to which it may be ringing
RINGING = 0.06  # of the differences, from which share on they go up and down, of what has been compressed
GUIDED = 7  # pixels, the side of a window in which colour follows lightness
STEADY = (1 / 255) ** 2  # variance of lightness, in a window, from which on it does
EXACT = 1e-6  # variance of colour about a line that is none
HALVED = np.array([1, 4, 6, 4, 1]) / 16  # pairs' means, three quarters of the own and one of the next
AROUND = 2  # pixels, to all sides, of which a mean is taken
REACH = 9  # pixels, the side of a window whose edges ring in its middle
SHARE = 0.1  # of the greatest difference there, which is no edge of its own
PASSES = 2
YCBCR = np.array([[0.299, 0.587, 0.114], [-0.168736, -0.331264, 0.5], [0.5, -0.418688, -0.081312]])  # JFIF's


def has_ringing(pixels: Float32Array) -> bool:
    """Whether small differences of a picture [H, W, C] go up and down from pixel to pixel, as they do beside the edges
    of what has been compressed, and in photographs; those of drawings only go up, or only down.
    """
    waves = differences = 0
    for axis in (0, 1):
        along = np.moveaxis(np.diff(pixels, axis=axis), axis, 0)
        before, after = along[:-1], along[1:]
        one, other = np.abs(before), np.abs(after)
        turns = (before * after < 0) & (np.minimum(one, other) > SEEN) & (np.maximum(one, other) < SMALL)
        waves += int(turns.any(axis=2).sum())
        differences += int((np.abs(along) > SEEN).any(axis=2).sum())
    return waves > RINGING * differences


def restored(pixels: Float32Array) -> Float32Array:
    """A picture [H, W, C] without either; alpha, which is kept whole, as it is."""
    made = _evened(_sharpened(pixels[..., :3]))
    return np.concatenate([made, pixels[..., 3:]], axis=2)


def _sharpened(colors: Float32Array) -> Float32Array:
    """Colours [H, W, 3] as sharp as their lightness."""
    seen = colors.astype(np.float64) @ YCBCR.T
    guide = seen[..., 0]
    seen[..., 1:] = np.stack([_guided(guide, seen[..., channel]) for channel in (1, 2)], axis=2)
    sharp: Float32Array = (seen @ np.linalg.inv(YCBCR).T).clip(0.0, 1.0).astype(np.float32)
    return sharp


def _guided(guide: Float64Array, values: Float64Array) -> Float64Array:
    """Values [H, W] as linear functions of a guide [H, W], each fitted to a window: as sharp as the guide, or as one
    that is kept at half the resolution. Where windows overlap their mean, in which those count by how well they fit.
    """
    slopes, offsets, weights = np.zeros((3, *guide.shape))
    mean = _mean(values)
    for kept in (guide, _halved(guide)):
        middle = _mean(kept)
        shared = _mean(kept * values) - middle * mean
        slope = shared / (_mean(kept**2) - middle**2 + STEADY)
        left = np.maximum(_mean(values**2) - mean**2 - slope * shared, 0.0)
        weight = 1.0 / (left + EXACT) ** 2
        slopes += weight * slope
        offsets += weight * (mean - slope * middle)
        weights += weight
    guided: Float64Array = (_mean(slopes) * guide + _mean(offsets)) / _mean(weights)
    return guided


def _halved(values: Float64Array) -> Float64Array:
    """Values at half the resolution and back, in the mean of where its pixels may begin."""
    across = convolve1d(values, HALVED, axis=1, mode="nearest")
    found: Float64Array = convolve1d(across, HALVED, axis=0, mode="nearest")
    return found


def _mean(values: Float64Array) -> Float64Array:
    """Of the window around each value."""
    mean: Float64Array = uniform_filter(values, GUIDED, mode="nearest")
    return mean


def _evened(colors: Float32Array) -> Float32Array:
    """Colours [H, W, 3] without small differences."""
    window = (REACH, REACH, 1)
    span = maximum_filter(colors, window, mode="nearest") - minimum_filter(colors, window, mode="nearest")
    limit = SHARE * span.max(axis=2)
    for _ in range(PASSES):
        total, count = np.zeros_like(colors), np.zeros((*limit.shape, 1), np.float32)
        for beside in _around(colors):
            near = alike(beside, colors, limit)[..., None]
            total += near * beside
            count += near
        colors = (total / count).astype(np.float32)
    return colors


def _around(colors: Float32Array) -> Iterator[Float32Array]:
    """The picture moved so that each pixel has one of those around it in its place, or itself."""
    height, width = colors.shape[:2]
    padded = np.pad(colors, ((AROUND, AROUND), (AROUND, AROUND), (0, 0)), mode="edge")
    for down in range(2 * AROUND + 1):
        for across in range(2 * AROUND + 1):
            yield padded[down : down + height, across : across + width]

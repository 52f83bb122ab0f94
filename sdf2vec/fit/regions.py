"""Where shapes could begin: the connected regions of what is wanted, and pairs of them, as turned ellipses."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import combinations

import numpy as np
from scipy import ndimage
from skimage import measure

LEAST = 0.2  # of the greatest gain: what belongs to a region
MOST_REGIONS, MOST_PAIRS = 5, 4  # regions; of which pairs are made
MOST_BRANCHED, MOST_STROKES = 2, 5  # regions whose strokes are looked for; strokes of each
LEAST_STROKE, MOST_STROKE = 0.05, 0.9  # share of the region
SLENDER = 1.3  # a stroke's length, at least, by the greatest thickness
SMALLEST = 0.02  # share of all gain that a region has at least
THINNEST = 0.5  # pixels: half an ellipse's shorter axis

Ellipse = tuple[
    float, float, float, float, float
]  # middle x, y, half axes in pixels; turn of the longer, radians


def ellipses(gain: np.ndarray) -> list[Ellipse]:
    """Of the regions of a gain [H, W] that have most of it: all together, each, their strokes, pairs; no longer."""
    return [_ellipse(region) for region in _regions(gain)]


def _regions(gain: np.ndarray) -> Iterator[np.ndarray]:
    """Masks [H, W]."""
    most = float(gain.max())
    if most <= 0:
        return
    labels = measure.label(gain > LEAST * most)
    amounts = np.bincount(labels.ravel(), weights=gain.ravel())[1:]
    found = [
        labels == index + 1
        for index in np.argsort(-amounts, kind="stable")[:MOST_REGIONS]
        if amounts[index] > SMALLEST * amounts.sum()
    ]
    if len(found) > 2:
        yield labels > 0
    yield from found
    for region in found[:MOST_BRANCHED]:
        yield from strokes(region)
    yield from (one | other for one, other in combinations(found[:MOST_PAIRS], 2))


def strokes(region: np.ndarray) -> list[np.ndarray]:
    """The straight strokes of a region [H, W] that is longer than thick, as masks, the largest first; none of others.

    They are what a line `SLENDER` times as long as the region is thick fits into, in one of four directions.
    """
    reach = math.ceil(SLENDER * ndimage.distance_transform_edt(np.pad(region, 1)).max())
    size = 2 * reach + 1
    if size > max(region.shape):
        return []
    found = []
    for opened in _openings(region, size):
        labels = measure.label(opened)
        found += [labels == number for number in range(1, labels.max() + 1)]
    least = LEAST_STROKE * region.sum()
    found = [stroke for stroke in found if least < stroke.sum() < MOST_STROKE * region.sum()]
    return sorted(found, key=lambda stroke: -stroke.sum())[:MOST_STROKES]


def _openings(region: np.ndarray, size: int) -> Iterator[np.ndarray]:
    """Where lines of so many pixels fit into a region: level, upright, falling and rising ones."""
    yield _opened(region.T, size).T
    yield _opened(region, size)
    width = region.shape[1]
    yield _straight(_opened(_skewed(region[:, ::-1]), size), width)[:, ::-1]
    yield _straight(_opened(_skewed(region), size), width)


def _opened(region: np.ndarray, size: int) -> np.ndarray:
    """Where upright lines fit into a region."""
    eroded = ndimage.minimum_filter1d(region, size, axis=0, mode="constant")
    opened: np.ndarray = ndimage.maximum_filter1d(eroded, size, axis=0, mode="constant")
    return opened


def _skewed(region: np.ndarray) -> np.ndarray:
    """Each row moved to the right by its number: what rises in [H, W] is upright in [H, W + H − 1]."""
    height, width = region.shape
    return np.pad(region, ((0, 0), (0, height))).ravel()[:-height].reshape(height, width + height - 1)


def _straight(skewed: np.ndarray, width: int) -> np.ndarray:
    """The rows moved back."""
    height = len(skewed)
    return np.pad(skewed.ravel(), (0, height)).reshape(height, -1)[:, :width]


def _ellipse(region: np.ndarray) -> Ellipse:
    """That with a region's moments, cut down to the region's extent: between two parts of it there may be anything."""
    points = np.argwhere(region)[:, ::-1] + 0.5  # [M, 2] x, y
    middle = points.mean(axis=0)
    away = points - middle
    spread, axes = np.linalg.eigh(away.T @ away / len(points))
    farthest = np.abs(away @ axes).max(axis=0) + 0.5
    short, long = np.maximum(np.minimum(2.0 * np.sqrt(np.maximum(spread, 0.0)), farthest), THINNEST).tolist()
    return float(middle[0]), float(middle[1]), long, short, math.atan2(axes[1, 1], axes[0, 1])

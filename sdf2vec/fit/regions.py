"""Where shapes could begin: the connected regions of what is wanted, and pairs of them, as turned ellipses."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import combinations

import numpy as np
from skimage import measure

LEAST = 0.2  # of the greatest gain: what belongs to a region
MOST_REGIONS, MOST_PAIRS = 5, 4  # regions; of which pairs are made
SMALLEST = 0.02  # share of all gain that a region has at least
THINNEST = 0.5  # pixels: half an ellipse's shorter axis

Ellipse = tuple[
    float, float, float, float, float
]  # middle x, y, half axes in pixels; turn of the longer, radians


def ellipses(gain: np.ndarray) -> list[Ellipse]:
    """Of the regions of a gain [H, W] that have most of it: all together, each, and pairs; no longer than they are."""
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
    yield from (one | other for one, other in combinations(found[:MOST_PAIRS], 2))


def _ellipse(region: np.ndarray) -> Ellipse:
    """That with a region's moments, cut down to the region's extent: between two parts of it there may be anything."""
    points = np.argwhere(region)[:, ::-1] + 0.5  # [M, 2] x, y
    middle = points.mean(axis=0)
    away = points - middle
    spread, axes = np.linalg.eigh(away.T @ away / len(points))
    farthest = np.abs(away @ axes).max(axis=0) + 0.5
    short, long = np.maximum(np.minimum(2.0 * np.sqrt(np.maximum(spread, 0.0)), farthest), THINNEST).tolist()
    return float(middle[0]), float(middle[1]), long, short, math.atan2(axes[1, 1], axes[0, 1])

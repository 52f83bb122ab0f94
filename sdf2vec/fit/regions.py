"""Where shapes could begin: the connected regions of what is wanted, and pairs of them, as turned ellipses."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import combinations

import numpy as np
from skimage import measure

LEAST = 0.2  # of the greatest gain: what belongs to a region
MOST_REGIONS, MOST_PAIRS = 5, 4  # of which pairs are made
SMALLEST = 0.02  # share of all gain that a region has at least
THINNEST = 1.0  # pixels: of a region's ellipse the shorter diameter

Ellipse = tuple[
    float, float, float, float, float
]  # middle x, y, half axes in pixels; turn of the longer, radians


def ellipses(gain: np.ndarray) -> list[Ellipse]:
    """Of the regions of a gain [H, W] that have most of it: all together, each, and pairs; with the same moments."""
    return [_ellipse(region) for region in _regions(gain)]


def _regions(gain: np.ndarray) -> Iterator[np.ndarray]:
    """Masks [H, W]."""
    most = float(gain.max())
    if most <= 0:
        return
    labels = measure.label(gain > LEAST * most)
    amounts = np.bincount(labels.ravel(), weights=gain.ravel())[1:]
    order = [
        index for index in np.argsort(-amounts, kind="stable") if amounts[index] > SMALLEST * amounts.sum()
    ]
    found = [labels == index + 1 for index in order[:MOST_REGIONS]]
    if len(found) > 2:
        yield labels > 0
    yield from found
    yield from (one | other for one, other in combinations(found[:MOST_PAIRS], 2))


def _ellipse(region: np.ndarray) -> Ellipse:
    (found,) = measure.regionprops(region.astype(np.uint8))
    y, x = found.centroid
    long, short = max(found.axis_major_length, THINNEST), max(found.axis_minor_length, THINNEST)
    return x + 0.5, y + 0.5, long / 2, short / 2, math.pi / 2 - found.orientation

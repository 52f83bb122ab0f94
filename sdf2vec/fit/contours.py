"""The outlines of a region, where they are known: what arcs and corners are found on."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from scipy import ndimage
from skimage import measure

from ..arrays import Float64Array

SMOOTHED = 0.7  # pixels: standard deviation of what takes the steps of pixels off an outline
SHORTEST = 9  # points of a part of an outline


class Polyline(NamedTuple):
    """Points (x, y) [N, 2] about a pixel apart, the middle of the first pixel at 0, 0; the last is the first again
    where it is closed.
    """

    points: Float64Array
    is_closed: bool


def known_outlines(inside: Float64Array, known: Float64Array) -> Iterator[Polyline]:
    """Those of a region's coverage [H, W], and the parts of those, where it is known (0..1, [H, W])."""
    known_here = np.pad(known, 1) > 0.5
    smooth = ndimage.gaussian_filter(np.pad(inside, 1).astype(np.float64), SMOOTHED)
    for outline in measure.find_contours(smooth, 0.5):
        low, high = (rounded(outline).astype(int).T for rounded in (np.floor, np.ceil))
        is_known = known_here[low[0], low[1]] & known_here[high[0], high[1]]
        points = outline[:, ::-1] - 1.0
        if is_known.all():
            yield Polyline(points, True)
            continue
        breaks = np.flatnonzero(np.diff(is_known.astype(int))) + 1
        for part, own in zip(np.split(points, breaks), np.split(is_known, breaks), strict=True):
            if own[0] and len(part) >= SHORTEST:
                yield Polyline(part, False)

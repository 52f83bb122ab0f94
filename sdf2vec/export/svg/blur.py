"""One blurred element for a soft shape: small, but only near, most of all at corners.

The outline where coverage is one half, blurred by a Gaussian of the falloff's spread. A blur rounds corners off, so
the outline's own corners are made sharper; how much, and how wide the blur, is found by trying.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...scene import Layer
from ...shapes import KINDS, Outline
from .field import Array, Grid, covers, extent, grid_over
from .outlines import core, distance_to, sharpened

GAUSSIAN = math.pi / math.sqrt(3.0) / 10.0  # standard deviation of the edge's logistic profile, in falloffs
SHARES = (1.0, 0.7, 0.45, 0.2)  # of the corner radius that an offset outline has
WIDTHS = (0.9, 1.0, 1.1)  # of the Gaussian
LADDER = 1.12  # ratio of neighbouring standard deviations, so that shapes share filters
CELLS = 44  # of the grid along the longest side
LEAST = 2.0  # user units: librsvg blurs much too little below it


class Blurred(NamedTuple):
    """An outline, the standard deviation of its blur in scene units, and what is wrong with it.

    `error` is the integral of the squared difference of coverage, in squared scene units.
    """

    outline: Outline
    deviation: float
    error: float


def quantised(deviation: float) -> float:
    """The nearest standard deviation, in user units, that filters are made for."""
    return LADDER ** round(math.log(deviation, LADDER))


@lru_cache(maxsize=8192)
def best_blur(layer: Layer, size: tuple[int, int, float]) -> Blurred | None:
    """The blurred outline nearest to a layer's coverage, if its kind has an outline made of a polygon.

    `size`: width, height and scene unit of the canvas, in user units.
    """
    outline_of = KINDS[layer.kind].outline
    if outline_of is None or len(layer.shapes) > 1:
        return None
    outline = outline_of(0.5 * layer.falloff, *layer.shapes[0].named().values())
    if core(outline) is None:
        return None
    trial = trial_of(layer, size)
    rounded = min((trial.blurred(sharpened(outline, share), 1.0) for share in SHARES), key=_error)
    widths = (trial.blurred(rounded.outline, width) for width in WIDTHS)
    return min(rounded, *widths, key=_error)


def _error(tried: Blurred) -> float:
    return tried.error


@dataclass(frozen=True)
class Trial:
    """A layer's coverage on a grid, to compare blurs with; only what lies on the canvas counts."""

    falloff: float
    grid: Grid
    wanted: Array  # [Y, X]
    seen: NDArray[np.bool_]  # [Y, X]
    unit: float

    def blurred(self, outline: Outline, width: float) -> Blurred:
        """The error of an outline whose blur is so many times as wide as the falloff asks for.

        The worse of two: some renderers (librsvg) cut the shape off at the canvas' edge before they blur it.
        """
        deviation = quantised(max(width * GAUSSIAN * self.falloff * self.unit, LEAST)) / self.unit
        sharp = np.clip(0.5 - distance_to(outline, self.grid) / self.grid.step, 0.0, 1.0)
        whole = [sharp] if self.seen.all() else [sharp, sharp * self.seen]
        errors = [np.sum(np.square(self._smooth(s, deviation) - self.wanted)[self.seen]) for s in whole]
        return Blurred(outline, deviation, float(max(errors)) * self.grid.step**2)

    def _smooth(self, sharp: Array, deviation: float) -> Array:
        from scipy.ndimage import gaussian_filter

        return np.asarray(gaussian_filter(sharp, deviation / self.grid.step, mode="constant", truncate=3.5))


def trial_of(layer: Layer, size: tuple[int, int, float]) -> Trial:
    """What blurs of a layer are compared with; `size` as in `best_blur`."""
    width, height, unit = size
    box = extent(layer)
    grid = grid_over(box, max(box.right - box.left, box.bottom - box.top) / CELLS)
    across, down = np.abs(grid.x) < width / unit / 2, np.abs(grid.y) < height / unit / 2
    seen = down[:, None] & across[None, :]
    return Trial(layer.falloff, grid, covers(layer, grid, 1.0 / unit), seen, unit)

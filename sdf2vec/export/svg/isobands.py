"""Traced contours: of anything that has a field, one for a sharp edge, several on each other for a soft one.

Each contour of a soft edge adds the coverage that is missing up to the next. They lie in a group of their own, so
that opacity is applied once; few strong layers, for 8 bits lose a little at every layer.
"""

from __future__ import annotations

import math

import numpy as np

from ...blend import REACH
from ...scene import Layer
from .canvas import Canvas, Points
from .gradient_stops import SOFT
from .sampling import Array, Box, Grid, distances, extent, grid_over

TRACE = 768  # grid cells along the canvas' shortest side
SOFTLY = 12  # grid cells in a falloff are enough
FEWEST = 96  # grid cells along the longest side of a small shape
MAX_CELLS = 2048  # grid cells along any side
FEWEST_BANDS, MOST_BANDS = 3, 24
BANDS_A_PIXEL = 1.4


def seen(layer: Layer, canvas: Canvas) -> Box:
    """The part of a layer's extent that can be seen, with a margin of some pixels."""
    margin = 3.0 / canvas.unit
    right, bottom = canvas.width / canvas.unit / 2 + margin, canvas.height / canvas.unit / 2 + margin
    return extent(layer).grown(1.0 / canvas.unit).clipped(Box(-right, -bottom, right, bottom))


def trace_grid(box: Box, falloff: float) -> Grid:
    """A grid fine enough to trace contours on; larger by a cell than the box, for contours are closed within one."""
    longest = max(box.right - box.left, box.bottom - box.top)
    step = max(min(max(1.0 / TRACE, falloff / SOFTLY), longest / FEWEST), longest / MAX_CELLS)
    return grid_over(box.grown(step), step)


def contours(field: Array, level: float, grid: Grid) -> list[Points]:
    """Closed contours [M, 2] of a field in scene units; what the grid cuts off is closed along its edge."""
    from skimage.measure import find_contours

    padded = np.pad(field, 1, constant_values=max(float(field.max()), level) + grid.step)
    corner = (grid.x[0] - grid.step, grid.y[0] - grid.step)
    found = find_contours(padded, level)
    return [contour[:, ::-1] * grid.step + corner for contour in found if len(contour) > 3]


def band_levels(count: int) -> list[tuple[float, float]]:
    """Where each of `count` bands and the core begin, in falloffs, and the coverage there; outermost first.

    Coverage changes by the same amount from each to the next, and from nothing to the first.
    """
    edges = (np.arange(count + 1) + 0.5) / (count + 1)
    return [(_distance_at(edge), (i + 1) / (count + 1)) for i, edge in enumerate(edges.tolist())]


def band_count(contrast: float, levels: float, width: float = math.inf) -> int:
    """How many bands keep the error of their steps below so many 8-bit levels (root mean square).

    `contrast` is the mean squared change of the picture where coverage goes from 0 to 1. `width`: the falloff in
    pixels; of a narrow edge more bands than BANDS_A_PIXEL only overlap, and are rounded down once each.
    """
    wanted = 255.0 * contrast**0.5 / (math.sqrt(12.0) * levels) - 1.0
    return int(min(max(math.ceil(min(wanted, BANDS_A_PIXEL * width)), FEWEST_BANDS), MOST_BANDS))


def _distance_at(cover: float) -> float:
    """Distance in falloffs at which coverage has a value."""
    from .gradient_stops import edge_profile

    x = np.linspace(0.5 - REACH, SOFT, 4001)
    return float(np.interp(-cover, -edge_profile(x), x))


def layer_contours(layer: Layer, levels: list[float], canvas: Canvas) -> list[list[Points]]:
    """For each distance in scene units the contours of a layer, in user units."""
    box = seen(layer, canvas)
    if box.empty:
        return [[] for _ in levels]
    grid = trace_grid(box, layer.falloff)
    field = distances(layer, grid)
    return [[canvas.places(c) for c in contours(field, level, grid)] for level in levels]

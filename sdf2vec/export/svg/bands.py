"""Traced contours: of anything that has a field, one for a sharp edge, bands between several for a soft one.

Bands do not overlap and are drawn without antialiasing, each with the coverage in its middle: every pixel is
painted once, where a stack of translucent contours would be rounded to 8 bits at every layer.
"""

from __future__ import annotations

import math

import numpy as np

from ...blend import REACH
from ...scene import Layer
from .canvas import Canvas, Points
from .field import Array, Box, Grid, distances, extent, grid_over
from .stops import SOFT

TRACE = 768  # grid cells along the canvas' shortest side
FEWEST = 96  # grid cells along the longest side of a small shape
MAX_CELLS = 2048  # grid cells along any side


def seen(layer: Layer, canvas: Canvas) -> Box:
    """The part of a layer's extent that can be seen, with a margin as wide as a blur reaches."""
    margin = layer.falloff + 2.0 / canvas.unit
    right, bottom = canvas.width / canvas.unit / 2 + margin, canvas.height / canvas.unit / 2 + margin
    return extent(layer).grown(1.0 / canvas.unit).clipped(Box(-right, -bottom, right, bottom))


def trace_grid(box: Box) -> Grid:
    """A grid fine enough to trace contours on."""
    longest = max(box.right - box.left, box.bottom - box.top)
    return grid_over(box, max(min(1.0 / TRACE, longest / FEWEST), longest / MAX_CELLS))


def contours(field: Array, level: float, grid: Grid) -> list[Points]:
    """Closed contours [M, 2] of a field in scene units; what the grid cuts off is closed along its edge."""
    from skimage.measure import find_contours

    padded = np.pad(field, 1, constant_values=max(float(field.max()), level) + grid.step)
    corner = (grid.x[0] - grid.step, grid.y[0] - grid.step)
    found = find_contours(padded, level)
    return [contour[:, ::-1] * grid.step + corner for contour in found if len(contour) > 3]


def band_levels(count: int) -> list[tuple[float, float, float]]:
    """(outer, inner, coverage): bands of equal difference in coverage, distances in falloffs, outermost first.

    The innermost has no inner end: −∞.
    """
    low, high = 0.5 / (count + 1), 1 - 0.5 / (count + 1)
    edges = np.linspace(low, high, count + 1)
    ends = [_distance_at(edge) for edge in edges[:-1]] + [_distance_at(edges[-1])]
    middles = (edges[:-1] + edges[1:]) / 2
    bands = [(ends[i], ends[i + 1], float(middles[i])) for i in range(count)]
    return [*bands, (ends[-1], -math.inf, 1.0)]


def _distance_at(cover: float) -> float:
    """Distance in falloffs at which coverage has a value."""
    from .stops import edge_profile

    x = np.linspace(0.5 - REACH, SOFT, 4001)
    return float(np.interp(-cover, -edge_profile(x), x))


def layer_contours(layer: Layer, levels: list[float], canvas: Canvas) -> list[list[Points]]:
    """For each distance in scene units the contours of a layer, in user units."""
    box = seen(layer, canvas)
    if box.empty:
        return [[] for _ in levels]
    grid = trace_grid(box)
    field = distances(layer, grid)
    return [[canvas.places(c) for c in contours(field, level, grid)] for level in levels]

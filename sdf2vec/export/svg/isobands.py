"""Traced contours: of anything that has a field, one for a sharp edge, several on each other for a soft one."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

import numpy as np

from ...arrays import Float64Array
from ...deferred import deferred
from ...scene import Layer
from .canvas import Canvas, Points
from .sampling import Box, SampleGrid, distances, edge_profile, edge_range, extent, grid_over

TRACE = 768  # grid cells along the canvas' shortest side
SOFTLY = 12  # grid cells in a falloff are enough
FEWEST = 96  # grid cells along the longest side of a small shape
MAX_CELLS = 2048  # grid cells along any side
WORK = 1 << 23  # grid cells × shapes: coarser for large unions
FEWEST_BANDS, MOST_BANDS = 3, 24
BANDS_A_PIXEL = 1.2

find_contours: Callable[[Float64Array, float], list[Points]] = deferred("skimage.measure", "find_contours")


class Band(NamedTuple):
    """The coverage within some contours [M, 2] in user units."""

    cover: float
    contours: list[Points]


def seen(layer: Layer, canvas: Canvas) -> Box:
    """The part of a layer's extent that can be seen, with a margin of some pixels."""
    margin = 3.0 / canvas.unit
    right, bottom = canvas.width / canvas.unit / 2 + margin, canvas.height / canvas.unit / 2 + margin
    return extent(layer).grown(1.0 / canvas.unit).clipped(Box(-right, -bottom, right, bottom))


def trace_grid(layer: Layer, canvas: Canvas) -> SampleGrid | None:
    """A grid fine enough to trace what is seen of a layer; None where nothing is.

    It is larger by a cell, for contours are closed within one.
    """
    box = seen(layer, canvas)
    if box.empty:
        return None
    fine = min(max(1.0 / TRACE, layer.falloff / SOFTLY), box.longest / FEWEST)
    area = (box.right - box.left) * (box.bottom - box.top)
    step = max(fine, box.longest / MAX_CELLS, math.sqrt(area * len(layer.shapes) / WORK))
    return grid_over(box.grown(step), step)


def contours(field: Float64Array, level: float, grid: SampleGrid) -> list[Points]:
    """Closed contours [M, 2] of a field in scene units; what the grid cuts off is closed along its edge."""
    padded = np.pad(field, 1, constant_values=max(float(field.max()), level) + grid.step)
    corner = (grid.x[0] - grid.step, grid.y[0] - grid.step)
    found = find_contours(padded, level)
    return [contour[:, ::-1] * grid.step + corner for contour in found if len(contour) > 3]


def isobands(field: Float64Array, levels: Sequence[float], grid: SampleGrid, canvas: Canvas) -> list[Band]:
    """A band for each level of a field [Y, X], outermost first; from each to the next coverage grows alike."""
    traced = ([canvas.places(c) for c in contours(field, level, grid)] for level in levels)
    return [Band((i + 1) / len(levels), found) for i, found in enumerate(traced)]


def cover_bands(cover: Float64Array, count: int, grid: SampleGrid, canvas: Canvas) -> list[Band]:
    """The bands of a field of coverage [Y, X], so many and a core."""
    return isobands(-cover, [-edge for edge in band_edges(count)], grid, canvas)


def layer_contours(layer: Layer, falloffs: Sequence[float], canvas: Canvas) -> list[Band]:
    """The bands between contours of a layer, so many falloffs outside."""
    grid = trace_grid(layer, canvas)
    levels = [distance * layer.falloff for distance in falloffs]
    return [] if grid is None else isobands(distances(layer, grid), levels, grid, canvas)


def stacked(bands: Sequence[Band], apart: bool) -> Iterator[tuple[list[Points], float]]:
    """The contours and the opacity of what is painted for each band.

    `apart`: rings, each from its contour to the next. Drawn without antialiasing every pixel belongs to one:
    nothing adds up, so nothing is lost to rounding. Not for cairo, which fills holes that are a single pixel wide.
    Else each covers all the further ones and adds the coverage that is missing: few strong layers, for 8 bits lose a
    little at every one.
    """
    below = 0.0
    for (cover, outer), (_, inner) in zip(bands, [*bands, Band(1.0, [])][1:], strict=True):
        if outer:
            yield (outer + inner, cover) if apart else (outer, (cover - below) / (1.0 - below))
        below = cover


def band_edges(count: int) -> list[float]:
    """The coverage at which each of `count` bands and the core begin, outermost first."""
    return [(i + 0.5) / (count + 1) for i in range(count + 1)]


def edge_distance(cover: float) -> float:
    """The distance in falloffs at which coverage has a value."""
    x = np.linspace(*edge_range(), 4001)
    return float(np.interp(-cover, -edge_profile(x), x))


def band_count(contrast: float, levels: float, width: float = math.inf) -> int:
    """How many bands keep the error of their steps below so many 8-bit levels (root mean square).

    `contrast` is the mean squared change of the picture where coverage goes from 0 to 1. `width`: the falloff in
    pixels; of a narrow edge more bands than BANDS_A_PIXEL only overlap, and are rounded down once each.
    """
    wanted = 255.0 * contrast**0.5 / (math.sqrt(12.0) * levels) - 1.0
    return int(min(max(math.ceil(min(wanted, BANDS_A_PIXEL * width)), FEWEST_BANDS), MOST_BANDS))

"""One blurred element for a soft shape: small, but only near, most of all at corners.

The outline where coverage is one half, blurred by a Gaussian of the falloff's spread. A blur rounds corners off, so
the outline's own corners are made sharper; how much, and how wide the blur, is found by trying. What has no outline
of its own is traced, and its contour moved until the blurred one lies where coverage is one half.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ...arrays import BoolArray, Float64Array
from ...blend import EDGE_DEVIATION
from ...deferred import deferred
from ...outlines import EllipseOutline, Outline
from ...scene import Layer
from .canvas import Canvas
from .isobands import contours
from .outlines import Traced, core, distance_to, edge_of, sharpened
from .refit_appearance import Difference
from .sampling import SampleGrid, covers, distances, extent, grid_over

SHARES = (1.0, 0.7, 0.45, 0.2)  # of the corner radius that an offset outline has; all of it first
WIDTHS = (0.9, 1.0, 1.1)  # of the Gaussian
# Standard deviations in user units, few so that shapes can share filters. At these the three boxes of the standard
# (librsvg, browsers on the CPU) and resvg's five are near to a Gaussian (browsers on a GPU), at twice the size as well.
STEPS = (2.15, 2.45, 3.2, 3.65, 4.3, 4.7, 5.15, 5.75, 6.3, 7.35)
LADDER = 1.12  # ratio of neighbouring ones beyond the last
CELLS = 44, 96  # of the grid along the longest side, at least and at most
TRACED_CELLS = 96, 256  # of a traced shape's
ACROSS = 1.5  # of them in a standard deviation
MOVES = 4  # of a traced contour to where its blur is one half
LEAST = STEPS[0]  # librsvg blurs much too little below 2

gaussian_filter: Callable[..., Float64Array] = deferred("scipy.ndimage", "gaussian_filter")


class Blurred(NamedTuple):
    """An outline, the standard deviation of its blur in scene units (0: none), and what is wrong with it.

    `error` is the integral of the squared difference of coverage, in squared scene units; `error_cut` the same where
    a renderer (librsvg) cuts the shape off at the canvas' edge before it blurs.
    """

    outline: Outline | Traced
    deviation: float
    error: float
    error_cut: float
    difference: Difference


def quantised(deviation: float) -> float:
    """The nearest standard deviation, in user units, that filters are made for."""
    if deviation > STEPS[-1]:
        return STEPS[-1] * LADDER ** round(math.log(deviation / STEPS[-1], LADDER))
    return min(STEPS, key=lambda step: abs(math.log(step / deviation)))


def best_blur(layer: Layer, canvas: Canvas) -> Blurred | None:
    """The blurred outline nearest to a layer's coverage; None where gradients say it exactly, or nothing is seen."""
    outline = edge_of(layer, 0.5)
    if outline is None:
        return best_traced(layer, canvas)
    if isinstance(outline, EllipseOutline):
        return None
    trial = trial_of(layer, canvas)
    edges = _edges(outline, layer, trial.grid)
    usual = trial.deviation(1.0)
    blurs = [trial.judged(*tried, usual) for tried in edges]
    best, edge = min(zip(blurs, edges, strict=True), key=lambda pair: pair[0].error)
    others = sorted({trial.deviation(width) for width in WIDTHS} - {usual})
    plain = trial.judged(outline, edges[0][1], 0.0)
    return nearest([plain, best, *(trial.judged(*edge, other) for other in others)])


def _edges(outline: Outline, layer: Layer, grid: SampleGrid) -> list[tuple[Outline, Float64Array]]:
    """An outline with corners ever sharper, if it has any, and the distances [Y, X] to them."""
    made = [outline] if core(outline) is None else [sharpened(outline, share) for share in SHARES]
    return [(sharp, distances_from(sharp, layer, grid)) for sharp in made]


def distances_from(outline: Outline, layer: Layer, grid: SampleGrid) -> Float64Array:
    """Signed distances [Y, X] to an outline; if it is of no polygon, the layer's own, to where coverage is one half."""
    if core(outline) is None:
        return distances(layer, grid) - 0.5 * layer.falloff
    return distance_to(outline, grid)


def best_traced(layer: Layer, canvas: Canvas, deviation: float | None = None) -> Blurred | None:
    """The nearest blur of a contour of a layer that has no outline of its own; None where nothing is seen.

    `deviation`: what it is blurred by, in scene units; without, by about what the falloff asks for, or not at all.
    """
    trial = trial_of(layer, canvas, *TRACED_CELLS)
    field = distances(layer, trial.grid) - 0.5 * layer.falloff
    edge = trial.wanted * (1.0 - trial.wanted) * trial.seen
    if edge.sum() < 1e-3:
        return None
    # 1 for a true distance
    steep = max(float(np.sum(edge * steepness(field, trial.grid.step)) / edge.sum()), 0.1)
    if deviation is not None:
        return nearest(list(trial.moved(field / steep, deviation)))
    widths = (trial.deviation(width / steep) for width in WIDTHS)
    tried = [found for width in widths for found in trial.moved(field / steep, width)]
    plain = Traced(tuple(contours(field, 0.0, trial.grid)))
    return nearest([*tried, trial.judged(plain, field / steep, 0.0)])


def steepness(field: Float64Array, step: float) -> Float64Array:
    """How much a field [Y, X] changes by a unit of length; along an axis with a single row nothing does."""
    changes = (np.gradient(field, step, axis=axis) for axis in (0, 1) if field.shape[axis] > 1)
    return np.asarray(sum((np.square(change) for change in changes), np.zeros_like(field)) ** 0.5)


def nearest(tried: Sequence[Blurred]) -> Blurred:
    """The one with the smallest error, its difference in few numbers."""
    best = min(tried, key=lambda blurred: blurred.error)
    return best._replace(difference=best.difference.coarse())


@dataclass(frozen=True, eq=False)
class Trial:
    """A layer's coverage on a grid, to compare blurs with; only what lies on the canvas counts."""

    falloff: float
    grid: SampleGrid
    wanted: Float64Array  # [Y, X]
    seen: BoolArray  # [Y, X]
    unit: float

    def moved(self, field: Float64Array, deviation: float) -> Iterator[Blurred]:
        """Contours of a field [Y, X] where it is 0, each nearer to where coverage is one half once it is blurred."""
        for _ in range(MOVES):
            found = self.judged(Traced(tuple(contours(field, 0.0, self.grid))), field, deviation)
            yield found
            field = field + found.difference.off * deviation * math.sqrt(math.tau)

    def deviation(self, width: float) -> float:
        """Of a blur so many times as wide as the falloff asks for."""
        wanted = width * EDGE_DEVIATION * self.falloff * self.unit
        return quantised(max(wanted, LEAST)) / self.unit

    def judged(self, outline: Outline | Traced, distance: Float64Array, deviation: float) -> Blurred:
        """An outline, drawn at these distances [Y, X] from its edge, and its errors."""
        sharp = np.clip(0.5 - distance / self.grid.step, 0.0, 1.0)
        off = self._smooth(sharp, deviation) - self.wanted
        cut = off if self.seen.all() else self._smooth(sharp * self.seen, deviation) - self.wanted
        error, error_cut = (float(np.sum(np.square(o)[self.seen])) * self.grid.step**2 for o in (off, cut))
        return Blurred(outline, deviation, error, error_cut, Difference(self.grid, off))

    def _smooth(self, sharp: Float64Array, deviation: float) -> Float64Array:
        if not deviation:
            return sharp
        return gaussian_filter(sharp, deviation / self.grid.step, mode="constant", truncate=3.5)


def trial_of(layer: Layer, canvas: Canvas, fewest: int = CELLS[0], most: int = CELLS[1]) -> Trial:
    """What blurs of a layer are compared with, on a grid with so many cells along its longest side."""
    unit, box = canvas.unit, extent(layer)
    fine = max(EDGE_DEVIATION * layer.falloff, 0.5 / unit) / ACROSS
    grid = grid_over(box, box.longest / min(max(box.longest / fine, fewest), most))
    across = np.abs(grid.x) < canvas.width / unit / 2
    down = np.abs(grid.y) < canvas.height / unit / 2
    return Trial(layer.falloff, grid, covers(layer, grid, 1.0 / unit), down[:, None] & across[None, :], unit)

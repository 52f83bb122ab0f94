"""A smooth union of several colours: a part for each shape, laid on each other so that they mix to the union.

What shape i has to show is coverage · wᵢ, its share of the colour. Laid over those before it, it needs the alpha
aᵢ = coverage·wᵢ / (1 − Σ coverage·wⱼ), the sum over the shapes above. Each aᵢ is drawn as bands, like any soft edge.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...arrays import Float64Array
from ...scene import Layer, Shape
from .canvas import Canvas
from .isobands import Band, cover_bands, trace_grid
from .sampling import SampleGrid, colors, covers

LEAST = 1e-6


def part_bands(layer: Layer, count: int, canvas: Canvas) -> list[list[Band]]:
    """The bands of each seen shape's part, lowest first."""
    grid = trace_grid(layer, canvas)
    if grid is None:
        return [[] for _ in layer.seen]
    return [cover_bands(alpha, count, grid, canvas) for alpha in alphas(layer, grid, 1.0 / canvas.unit)]


def alphas(layer: Layer, grid: SampleGrid, pixel: float) -> list[Float64Array]:
    """The alpha [Y, X] of each seen shape's part, lowest first."""
    cover = covers(layer, grid, pixel)
    found, above = [], np.zeros_like(cover)
    for share in reversed(shares(layer, grid)):
        shown = cover * share
        found.append(np.clip(shown / np.maximum(1.0 - above, LEAST), 0.0, 1.0))
        above += shown
    return found[::-1]


def shares(layer: Layer, grid: SampleGrid) -> list[Float64Array]:
    """How much of each seen shape's colour the layer has at each point [Y, X]; they add up to 1."""
    found: list[Float64Array] = []
    places = [index for index, part in enumerate(layer.structure) if part.adds]
    for first in range(0, len(places), 3):  # three at a time, as red, green and blue
        marked = list(layer.shapes)
        for i, place in enumerate(places):
            mark = (float(i == first), float(i == first + 1), float(i == first + 2))
            marked[place] = Shape(marked[place].kind, marked[place].parameters, mark)
        found += list(colors(replace(layer, shapes=tuple(marked)), grid))[: len(places) - first]
    return found

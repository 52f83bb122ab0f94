"""A smooth union of several colours: a piece for each shape, laid on each other so that they mix to the union.

What shape i has to show is coverage · wᵢ, its share of the colour. Laid over those before it, it needs the alpha
aᵢ = coverage·wᵢ / (1 − Σ coverage·wⱼ), the sum over the shapes above. Each aᵢ is drawn as bands, like any soft edge.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...scene import Layer
from .canvas import Canvas, Points
from .isobands import contours, seen, trace_grid
from .sampling import Array, Grid, colors, covers

LEAST = 1e-6


def piece_contours(layer: Layer, count: int, canvas: Canvas) -> list[list[tuple[float, list[Points]]]]:
    """For each shape, lowest first: alpha and the contours, in user units, of `count` bands and the core."""
    box = seen(layer, canvas)
    if box.empty:
        return [[] for _ in layer.shapes]
    grid = trace_grid(box, layer.falloff)
    edges = ((np.arange(count + 1) + 0.5) / (count + 1)).tolist()
    return [
        [
            ((i + 1) / (count + 1), [canvas.places(c) for c in contours(-alpha, -edge, grid)])
            for i, edge in enumerate(edges)
        ]
        for alpha in alphas(layer, grid, 1.0 / canvas.unit)
    ]


def alphas(layer: Layer, grid: Grid, pixel: float) -> list[Array]:
    """The alpha [Y, X] of each shape's piece, lowest first."""
    cover = covers(layer, grid, pixel)
    found, above = [], np.zeros_like(cover)
    for share in reversed(shares(layer, grid)):
        shown = cover * share
        found.append(np.clip(shown / np.maximum(1.0 - above, LEAST), 0.0, 1.0))
        above += shown
    return found[::-1]


def shares(layer: Layer, grid: Grid) -> list[Array]:
    """How much of each shape's colour the union has at each point [Y, X]; they add up to 1."""
    found: list[Array] = []
    for first in range(0, len(layer.shapes), 3):  # three at a time, as red, green and blue
        marked = [
            replace(shape, color=(float(i == first), float(i == first + 1), float(i == first + 2)))
            for i, shape in enumerate(layer.shapes)
        ]
        found += list(colors(replace(layer, shapes=tuple(marked)), grid))[: len(layer.shapes) - first]
    return found

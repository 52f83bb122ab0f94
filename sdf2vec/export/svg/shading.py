"""The colour of a smooth union of shapes with different colours, as a linear gradient."""

from __future__ import annotations

import numpy as np

from ...scene import Layer
from .bands import seen
from .canvas import Document, mean_color, number, tag, url
from .field import Array, colors, covers, grid_over

STOPS = 7
CELLS = 48  # of the grid along the longest side
SAME = 0.5 / 255.0


def fill_of(layer: Layer, document: Document) -> str:
    """A colour, or a gradient along the direction in which the union's colour changes most."""
    own = np.array([shape.color for shape in layer.shapes])
    if np.ptp(own, axis=0).max() <= SAME:
        return document.color(mean_color([shape.color for shape in layer.shapes]))
    box = seen(layer, document.canvas)
    grid = grid_over(box, max(box.right - box.left, box.bottom - box.top) / CELLS)
    weight = covers(layer, grid, 1.0 / document.canvas.unit).ravel() * layer_weight(layer)
    if weight.max() < 1e-3:
        return document.color(mean_color([shape.color for shape in layer.shapes]))
    places = np.stack([v.ravel() for v in np.meshgrid(grid.x, grid.y)], axis=1)
    return url(_gradient(places, colors(layer, grid).reshape(3, -1).T, weight, document))


def layer_weight(layer: Layer) -> float:
    """Opacity, never quite 0."""
    return max(abs(layer.opacity), 1e-3)


def _gradient(places: Array, wanted: Array, weight: Array, document: Document) -> str:
    """The gradient's id; least squares for its direction first, then for its stops."""
    canvas = document.canvas
    root = np.sqrt(weight)[:, None]
    middle = np.average(places, axis=0, weights=weight)
    flat = np.concatenate([places - middle, np.ones((len(places), 1))], axis=1)
    slope, *_ = np.linalg.lstsq(flat * root, wanted * root, rcond=None)
    direction = np.linalg.svd(slope[:2].T)[2][0]
    along = (places - middle) @ direction
    kept = along[weight > 1e-3]
    knots = np.linspace(kept.min(), kept.max(), STOPS)
    hats = np.stack([np.interp(along, knots, row) for row in np.eye(STOPS)], axis=1)
    ridge = 1e-3 * np.sqrt(weight.sum()) * np.eye(STOPS)
    stacked = np.concatenate([hats * root, ridge])
    mean = np.average(wanted, axis=0, weights=weight)
    values, *_ = np.linalg.lstsq(
        stacked, np.concatenate([wanted * root, ridge @ np.tile(mean, (STOPS, 1))]), rcond=None
    )
    stops = [
        tag("stop", offset=number(i / (STOPS - 1), 3), stop_color=document.color(value))
        for i, value in enumerate(values.tolist())
    ]
    (x1, y1), (x2, y2) = canvas.places(middle + np.outer(knots[[0, -1]], direction)).tolist()
    ends = {name: canvas.number(v) for name, v in (("x1", x1), ("y1", y1), ("x2", x2), ("y2", y2))}
    return document.define("shade", "linearGradient", *stops, gradientUnits="userSpaceOnUse", **ends)

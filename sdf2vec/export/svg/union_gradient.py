"""The colour of a smooth union of shapes with different colours, as a linear gradient."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from ...scene import Layer
from .canvas import Canvas, Document, color_text, mean_color, number, tag, url
from .isobands import seen
from .sampling import Array, colors, covers, grid_over

STOPS = 7
CELLS = 48  # of the grid along the longest side
SAME = 0.5 / 255.0


class Shade(NamedTuple):
    """A gradient: the places of its stops [S, 2] in scene units, their colours [S, 3], and how far it is off."""

    places: Array
    colors: Array
    error: float


def fill_of(layer: Layer, document: Document, lift: float = 0.0) -> str:
    """A colour, or a gradient along the direction in which the union's colour changes most; `lift` in 8-bit levels."""
    shade = shade_of(layer, document.canvas)
    if shade is None:
        return color_text(mean_color([shape.color for shape in layer.shapes]), lift)
    return url(_gradient(shade, document))


def is_mixed(layer: Layer, canvas: Canvas, levels: float) -> bool:
    """Whether a layer has colours that no gradient shows with an error below so many 8-bit levels."""
    shade = shade_of(layer, canvas) if len(layer.shapes) > 1 else None
    return shade is not None and 255.0 * shade.error * layer_weight(layer) > levels


@lru_cache(maxsize=1024)
def shade_of(layer: Layer, canvas: Canvas) -> Shade | None:
    """The gradient nearest to a union's colours; None where there is but one, or nothing to see."""
    own = np.array([shape.color for shape in layer.shapes])
    box = seen(layer, canvas)
    if np.ptp(own, axis=0).max() <= SAME or box.empty:
        return None
    grid = grid_over(box, max(box.right - box.left, box.bottom - box.top) / CELLS)
    weight = covers(layer, grid, 1.0 / canvas.unit).ravel() * layer_weight(layer)
    if weight.max() < 1e-3:
        return None
    places = np.stack([v.ravel() for v in np.meshgrid(grid.x, grid.y)], axis=1)
    return _nearest(places, colors(layer, grid).reshape(3, -1).T, weight)


def layer_weight(layer: Layer) -> float:
    """Opacity, never quite 0."""
    return max(abs(layer.opacity), 1e-3)


def _nearest(places: Array, wanted: Array, weight: Array) -> Shade:
    """Least squares for the direction first, then for the stops."""
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
    off = np.average(np.square(hats @ values - wanted).mean(axis=1), weights=weight)
    return Shade(middle + np.outer(knots, direction), values, float(np.sqrt(off)))


def _gradient(shade: Shade, document: Document) -> str:
    """The gradient's id."""
    canvas = document.canvas
    stops = [
        tag("stop", offset=number(i / (STOPS - 1), 3), stop_color=color_text(value))
        for i, value in enumerate(shade.colors.tolist())
    ]
    (x1, y1), (x2, y2) = canvas.places(shade.places[[0, -1]]).tolist()
    ends = {name: canvas.number(v) for name, v in (("x1", x1), ("y1", y1), ("x2", x2), ("y2", y2))}
    return document.define("shade", "linearGradient", *stops, gradientUnits="userSpaceOnUse", **ends)

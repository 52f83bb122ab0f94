"""The fill of a layer: a colour, or the colours of a smooth union as a linear gradient."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...arrays import Float64Array
from ...paints import PAINTS
from ...scene import Color, Layer, Shape
from .canvas import Canvas, pairs
from .display import LinearGradient, Stop, moved
from .isobands import seen
from .sampling import colors, covers, frame_of, grid_over

STOPS = 7
CELLS = 48  # of the grid along the longest side
SAME = 0.5 / 255.0
FLAT = 1e-9


class LayerFill(NamedTuple):
    """A fill, and by how many 8-bit levels the layer's own colours differ from it."""

    fill: Color | LinearGradient
    error: float = 0.0


def fill_of(layer: Layer, canvas: Canvas, lift: float = 0.0) -> LayerFill:
    """One colour, the gradient of a paint, or for several shapes one along the direction in which they change most.

    `lift`: 8-bit levels that colours are raised by.
    """
    own = np.array(layer.colors)
    flat = LayerFill(moved(own.mean(axis=0).tolist(), lift))
    if np.ptp(own, axis=0).max() <= SAME:
        return flat
    if len(layer.seen) == 1 and (ramp := ramp_of(layer.seen[0], canvas, lift)) is not None:
        return LayerFill(ramp)
    box = seen(layer, canvas)
    if box.empty:
        return flat
    grid = grid_over(box, box.longest / CELLS)
    weight = covers(layer, grid, 1.0 / canvas.unit).ravel() * max(layer.opacity, 1e-3)
    if weight.max() < 1e-3:
        return flat
    places = np.stack([v.ravel() for v in np.meshgrid(grid.x, grid.y)], axis=1)
    knots, values, off = nearest_gradient(places, colors(layer, grid).reshape(3, -1).T, weight)
    start, end = pairs(canvas.places(knots[[0, -1]]))
    stops = tuple(Stop(i / (STOPS - 1), moved(value, lift)) for i, value in enumerate(values.tolist()))
    return LayerFill(LinearGradient(start, end, stops), 255.0 * off * max(layer.opacity, 1e-3))


def ramp_of(shape: Shape, canvas: Canvas, lift: float = 0.0) -> LinearGradient | Color | None:
    """A paint that is a linear gradient as one, or as a colour where it is next to none; None for any other."""
    ramp_from, frame = PAINTS[shape.paint].ramp, frame_of(shape)
    if ramp_from is None:
        return None
    ramp = ramp_from(*shape.painted().values())
    (cosine, sine), (across, down) = frame.axis, np.array(ramp.slope) / np.maximum(frame.half, FLAT)
    slope = np.array(
        [across * cosine - down * sine, across * sine + down * cosine]
    )  # along x and y of the scene
    steepness = float(slope @ slope)
    if steepness < FLAT:
        ends = zip(ramp.first, ramp.last, strict=True)
        return moved([float(np.interp(ramp.middle, (0.0, 1.0), pair)) for pair in ends], lift)
    places = frame.origin + np.outer((-ramp.middle, 1.0 - ramp.middle), slope / steepness)
    start, end = pairs(canvas.places(places))
    return LinearGradient(start, end, (Stop(0.0, moved(ramp.first, lift)), Stop(1.0, moved(ramp.last, lift))))


def mean_color(shape: Shape) -> Color:
    """The mean of a shape's colours."""
    red, green, blue = np.mean(shape.colors, axis=0).tolist()
    return red, green, blue


def nearest_gradient(
    places: Float64Array, wanted: Float64Array, weight: Float64Array
) -> tuple[Float64Array, Float64Array, float]:
    """Places [S, 2] and colours [S, 3] of the stops nearest to colours [P, 3] at places [P, 2], and their error.

    Least squares, weighted by [P], for the direction first, then for the stops.
    """
    root = np.sqrt(weight)[:, None]
    middle = np.average(places, axis=0, weights=weight)
    flat = np.concatenate([places - middle, np.ones((len(places), 1))], axis=1)
    slope, *_ = np.linalg.lstsq(flat * root, wanted * root, rcond=None)
    direction = np.linalg.svd(slope[:2].T)[2][0]
    along = (places - middle) @ direction
    kept = along[weight > min(1e-3, weight.max() / 2)]
    knots = np.linspace(kept.min(), kept.max(), STOPS)
    hats = np.stack([np.interp(along, knots, row) for row in np.eye(STOPS)], axis=1)
    ridge = 1e-3 * np.sqrt(weight.sum()) * np.eye(STOPS)
    mean = np.average(wanted, axis=0, weights=weight)
    right = np.concatenate([wanted * root, ridge @ np.tile(mean, (STOPS, 1))])
    values, *_ = np.linalg.lstsq(np.concatenate([hats * root, ridge]), right, rcond=None)
    off = np.average(np.square(hats @ values - wanted).mean(axis=1), weights=weight)
    return middle + np.outer(knots, direction), values, float(np.sqrt(off))

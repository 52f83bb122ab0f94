"""The fill of a layer: a colour, the gradient of a paint, or the colours of a smooth union as a linear gradient."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ...arrays import Float64Array
from ...paints import PAINTS, Ramp, Rings, Stops
from ...scene import Color, Layer, Shape
from .canvas import Canvas, pairs
from .display import Fill, LinearGradient, RadialGradient, Stop, moved
from .isobands import seen
from .sampling import ShapeFrame, colors, covers, frame_of, grid_over

STOPS = 7
CELLS = 48  # of the grid along the longest side
SAME = 0.5 / 255.0
FLAT = 1e-9
FARTHEST = 1e4  # user units: a radius of a gradient, at most


class LayerFill(NamedTuple):
    """A fill, and by how many 8-bit levels the layer's own colours differ from it."""

    fill: Fill
    error: float = 0.0


def fill_of(layer: Layer, canvas: Canvas, lift: float = 0.0) -> LayerFill:
    """One colour, the gradient of a paint, or for several shapes one along the direction in which they change most.

    `lift`: 8-bit levels that colours are raised by.
    """
    own = np.array(layer.colors)
    flat = LayerFill(moved(own.mean(axis=0).tolist(), lift))
    if np.ptp(own, axis=0).max() <= SAME:
        return flat
    if len(layer.seen) == 1 and (own_fill := gradient_of(layer.seen[0], canvas, lift)) is not None:
        return LayerFill(own_fill)
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


def gradient_of(shape: Shape, canvas: Canvas, lift: float = 0.0) -> Fill | None:
    """A paint that is a gradient as one, or as a colour where it is next to none; None for any other."""
    gradient_from, frame = PAINTS[shape.paint].gradient, frame_of(shape)
    if gradient_from is None:
        return None
    gradient = gradient_from(*shape.painted().values())
    if isinstance(gradient, Ramp):
        return _linear(gradient, frame, canvas, lift)
    return _radial(gradient, frame, canvas, lift)


def _linear(ramp: Ramp, frame: ShapeFrame, canvas: Canvas, lift: float) -> Fill:
    slope = _turned(np.array(ramp.slope) / np.maximum(frame.half, FLAT), frame)
    steepness = float(slope @ slope)
    if steepness < FLAT:
        return _color_at(ramp.middle, ramp.stops, lift)
    places = frame.origin + np.outer((-ramp.middle, 1.0 - ramp.middle), slope / steepness)
    start, end = pairs(canvas.places(places))
    return LinearGradient(start, end, tuple(Stop(share, moved(color, lift)) for share, color in ramp.stops))


def _radial(rings: Rings, frame: ShapeFrame, canvas: Canvas, lift: float) -> Fill:
    """With a rim where the last colour begins, as far as a colour begins there."""
    lowest, stops = rings.lowest, rings.stops
    rise = 1.0 - lowest
    slopes = np.array(rings.slope) / np.maximum(frame.half, FLAT)
    if rise <= 0.0 or slopes.max() * FARTHEST < rise * canvas.unit:
        return _color_at(lowest, stops, lift)
    radii = np.minimum(rise * canvas.unit / np.maximum(slopes, FLAT), FARTHEST)
    (center,) = pairs(canvas.places(frame.origin + _turned(np.array(rings.focus) * frame.half, frame)))
    first = max(lowest, 0.0)
    seen = ((first, _color_at(first, stops)), *(stop for stop in stops if stop[0] > first))
    shown = tuple(Stop((share - lowest) / rise, moved(color, lift)) for share, color in seen)
    return RadialGradient(
        center, (float(radii[0]), float(radii[1])), shown, math.atan2(frame.axis[1], frame.axis[0])
    )


def _turned(vector: Float64Array, frame: ShapeFrame) -> Float64Array:
    """A vector along the axes of a frame, along x and y of the scene."""
    (across, down), (cosine, sine) = vector, frame.axis
    return np.array([across * cosine - down * sine, across * sine + down * cosine])


def _color_at(share: float, stops: Stops, lift: float = 0.0) -> Color:
    """The colour of a gradient at a share of the way."""
    shares, colors = zip(*stops, strict=True)
    return moved([float(np.interp(share, shares, channel)) for channel in zip(*colors, strict=True)], lift)


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

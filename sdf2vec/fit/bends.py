"""Linear gradients of several colours that parts of a picture are: along a direction one runs into the next."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy import ndimage

from ..arrays import BoolArray, Float32Array, Float64Array
from .color_stops import ColorStops, nearest_stops
from .rings import LEAST, LOOKED, MOSTLY, SMOOTH, smooth_slopes

SCALES = (0.1,)  # of the search: radians


class BentShade(NamedTuple):
    """Premultiplied colours by how far a place is along a direction [2], by shares of the sides."""

    direction: Float64Array
    stops: ColorStops

    @property
    def is_flat(self) -> bool:
        """Never: it is no single colour."""
        return False

    @property
    def color(self) -> Float32Array:
        """One that it has [C]."""
        return self.stops.middle

    @property
    def axis(self) -> Float32Array:
        """The direction [C] in which its colours lie."""
        return self.stops.axis

    def at(self, x: Float32Array, y: Float32Array) -> Float32Array:
        """The colour there [..., C]."""
        return self.stops.at(x * self.direction[0] + y * self.direction[1])


def bend_of(inside: BoolArray, pixels: Float32Array, count: int = 3) -> BentShade | None:
    """The linear gradient of so many colours that is nearest to what is inside [H, W] of a picture [H, W, C]; None for
    too few pixels, or where most are of one colour.
    """
    if inside.sum() < LEAST:
        return None
    height, width = inside.shape
    unit = min(height, width)
    rows, columns = np.nonzero(inside)
    x, y, colors = columns / unit, rows / unit, pixels[inside]
    some = np.linspace(0, len(x) - 1, min(len(x), LOOKED)).astype(int)
    (angle,), stops = nearest_stops(
        lambda numbers: x[some] * np.cos(numbers[0]) + y[some] * np.sin(numbers[0]),
        _steepest(inside, colors),
        SCALES,
        colors[some],
        count,
    )
    along = x * np.cos(angle) + y * np.sin(angle)
    stops = stops.within(float(along.min()), float(along.max()))
    if stops.changing(along) < MOSTLY:
        return None
    direction = np.array((np.cos(angle) * width, np.sin(angle) * height)) / unit
    return BentShade(
        direction, ColorStops(stops.values + direction @ (0.5 / width, 0.5 / height), stops.colors)
    )


def _steepest(inside: BoolArray, colors: Float32Array) -> Float64Array:
    """The angle [1] of the direction in which colours [P, C] inside [H, W] change most: by the structure tensor."""
    core = ndimage.binary_erosion(inside, np.ones((3, 3)), iterations=round(SMOOTH))
    core = core if core.any() else inside
    slopes = [
        np.stack(smooth_slopes(inside, channel))[:, core] for channel in (colors - colors.mean(axis=0)).T
    ]
    tensor = sum(own @ own.T for own in slopes)
    across, down = np.linalg.eigh(tensor)[1][:, 1]
    return np.array([np.arctan2(down, across)])

"""Radial gradients that parts of a picture are: colours that change with the distance from a point alone."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import ndimage

from ..arrays import BoolArray, Float32Array, Float64Array
from .color_stops import NO_MIDDLE, Samples, StoppedShade, main_axis, nearest_stops

LEAST = 200  # pixels of a region: fewer are like a gradient of some kind by chance
SMOOTH = 2.0  # pixels, of the standard deviation of a blur that takes away the steps of eight bits
STEEP = 0.3  # share of the largest slopes, of those that point to the middle
ROUND = 8.0  # times the one axis of an ellipse, that the other may be
FARTHEST = 3.0  # shorter sides of the picture, from a region's middle to that of its rings
MOSTLY = 0.5  # of the pixels lie where colours change, at least: else it is one colour that ends softly
TIP = 5.0  # pixels: what is too near to the middle of rings to be smooth
SCALES, TINY = (0.1, 0.1, 0.3), 1e-3  # of the search: of its numbers; of weights


@dataclass(frozen=True, eq=False)
class RadialShade(StoppedShade):
    """Colours by the distance from a place (x, y), by shares of the sides: in shares of the shorter side, of which that
    along y counts `squeeze` times. `sides`: width and height, in the same unit.
    """

    place: Float32Array
    squeeze: float
    sides: tuple[float, float]

    def at(self, x: Float32Array, y: Float32Array) -> Float32Array:
        """The colour there [..., C]."""
        away = np.hypot(
            (x - self.place[0]) * self.sides[0], (y - self.place[1]) * self.sides[1] * self.squeeze
        )
        return self.stops.at(away)


@dataclass(frozen=True, eq=False)
class Around:
    """Samples whose colours may hang on their distance from a point."""

    samples: Samples

    def rings(self, middles: Sequence[tuple[float, ...]] = NO_MIDDLE) -> RadialShade | None:
        """The nearest radial gradient; None for too few pixels, where most are of one colour, or where its middle is
        far away. `middles`: where colours between its ends may start, shares of the way.
        """
        seen = self.samples
        if len(seen.x) < LEAST:
            return None
        x, y, colors = seen.x[seen.some], seen.y[seen.some], seen.colors[seen.some]
        numbers, stops = nearest_stops(
            lambda numbers: _distances(x, y, numbers), self._middle, SCALES, colors, middles
        )
        far = np.abs(numbers[:2] - [seen.x.mean(), seen.y.mean()]).max()
        if far > FARTHEST or abs(numbers[2]) > np.log(ROUND):
            return None
        away = _distances(seen.x, seen.y, numbers)
        stops = stops.within(float(away.min()), float(away.max()))
        if away.min() * seen.unit < TIP and stops.values[0] * seen.unit < TIP:
            stops = stops.begun(0.0)
        if stops.changing(away) < MOSTLY:
            return None
        place = np.array(numbers[:2] / seen.sides, np.float32)
        return RadialShade(stops, place, float(np.exp(numbers[2])), seen.sides)

    @cached_property
    def _middle(self) -> Float64Array:
        """Where slopes point to, x and y, and the logarithm of how many times that along y counts: by least squares.

        Along a slope (u, v) from the middle (a, b) of ellipses k² (y − b) u = (x − a) v.
        """
        inside, colors, unit = self.samples.inside, self.samples.colors, self.samples.unit
        across, down = smooth_slopes(inside, (colors - colors.mean(axis=0)) @ main_axis(colors))
        core = ndimage.binary_erosion(inside, np.ones((3, 3)), iterations=round(SMOOTH))
        steep = np.hypot(across, down)
        core &= steep > STEEP * np.quantile(steep[core], 0.95) if core.any() else core
        rows, columns = np.nonzero(core if core.sum() >= LEAST // 2 else inside)
        u, v = across[rows, columns], down[rows, columns]
        x, y = (columns + 0.5) / unit, (rows + 0.5) / unit
        terms = np.stack([u * y, -u, v], axis=1)
        squared, moved, a = np.linalg.lstsq(terms, v * x)[0]
        if not ROUND**-2 < squared < ROUND**2:  # of circles, which hang on fewer numbers
            a, b = np.linalg.lstsq(np.stack([v, -u], axis=1), v * x - u * y)[0]
            return np.array([a, b, 0.0])
        return np.array([a, moved / squared, np.log(squared) / 2])


def smooth_slopes(inside: BoolArray, values: Float64Array) -> tuple[Float64Array, Float64Array]:
    """The slopes of values [P] at what is inside [H, W] along x and y, [H, W], without the steps of eight bits."""
    plane = np.zeros(inside.shape)
    plane[inside] = values
    weight = ndimage.gaussian_filter(inside.astype(float), SMOOTH)
    smooth = ndimage.gaussian_filter(plane, SMOOTH) / np.maximum(weight, TINY)
    down, across = np.gradient(smooth)
    return across, down


def _distances(x: Float64Array, y: Float64Array, numbers: Float64Array) -> Float64Array:
    """How far places [P] are from a middle; the third of the numbers is the logarithm of what along y counts."""
    found: Float64Array = np.hypot(x - numbers[0], (y - numbers[1]) * np.exp(numbers[2]))
    return found

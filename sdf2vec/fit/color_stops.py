"""Colours that run into each other while a number rises: those of a gradient, told from pixels."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares

from ..arrays import BoolArray, Float32Array, Float64Array, IntArray

MOST_STEPS, NEARER = 60, 1e-4  # of the search; shares by which the error falls in one, at least
LOOKED = 3000  # pixels that are looked at
NEAREST = 0.05  # shares of the way, of two stops
FIRST = 0.02, 0.98  # where the stops at the ends start, shares of the pixels
# where one between them may start, shares of the way; where there is none
MIDDLES: Sequence[tuple[float, ...]] = (0.3,), (0.5,), (0.7,)
NO_MIDDLE: Sequence[tuple[float, ...]] = ((),)
SCALE = 0.1  # of the way, of the search
TINY = 1e-6
SAME = 2.0 / 255  # how far two colours are from each other at most that are one
PLANE, NEARLY = 2.2 / 255, 0.98  # how far a region is from a gradient at most; share of it that is as near
CHANGES = 6.0 / 255  # of a colour from one stop to the next, at least, where there is a gradient

Measure = Callable[[Float64Array], Float64Array]


class ColorStops(NamedTuple):
    """Colours [S, C] at values [S] of a number, which rise; between them they run into each other."""

    values: Float64Array
    colors: Float32Array

    @property
    def middle(self) -> Float32Array:
        """The colour [C] half way."""
        return self.at(np.array((self.values[0] + self.values[-1]) / 2))

    @property
    def axis(self) -> Float32Array:
        """The direction [C] in which they differ most."""
        return main_axis(self.colors)

    def at(self, value: Float32Array | Float64Array) -> Float32Array:
        """The colour there [..., C]."""
        channels = [np.interp(value, self.values, channel) for channel in self.colors.T]
        return np.stack(channels, axis=-1).astype(np.float32)

    def changing(self, values: Float64Array) -> float:
        """The share of values [P] that lie between stops of two colours, not of one."""
        changes = np.abs(np.diff(self.colors, axis=0)).max(axis=1) >= CHANGES
        return float(np.concatenate([[False], changes, [False]])[np.searchsorted(self.values, values)].mean())

    def some(self, chosen: slice) -> ColorStops:
        """Some of the stops alone."""
        return ColorStops(self.values[chosen], self.colors[chosen])

    def within(self, low: float, high: float) -> ColorStops:
        """The same between two values, beyond which nothing is known, without what is of one colour before and after
        all others.
        """
        values = self.values.clip(low, high)
        colors = self.at(values)
        changes = np.flatnonzero(np.abs(np.diff(colors, axis=0)).max(axis=1) >= SAME)
        first, last = (changes[0], changes[-1] + 2) if len(changes) else (0, 2)
        return ColorStops(values, colors).some(slice(first, last))

    def begun(self, value: float) -> ColorStops:
        """The same from another value on."""
        first, second = self.values[:2]
        color = self.colors[0] + (value - first) / (second - first) * (self.colors[1] - self.colors[0])
        return ColorStops(
            np.array([value, *self.values[1:]]), np.array([color, *self.colors[1:]], np.float32)
        )


@dataclass(frozen=True, eq=False)
class StoppedShade:
    """A gradient of a picture that hangs on one number at each place: by premultiplied colours at stops."""

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


@dataclass(frozen=True, eq=False)
class Samples:
    """Places x, y [P] in shorter sides of a picture, the colours [P, C] there, which of them are looked at, and where
    they are inside [H, W].
    """

    x: Float64Array
    y: Float64Array
    colors: Float32Array
    some: IntArray
    inside: BoolArray

    @classmethod
    def of(cls, inside: BoolArray, pixels: Float32Array) -> Samples:
        """What is inside [H, W] of a picture [H, W, C]."""
        rows, columns = np.nonzero(inside)
        unit = min(inside.shape)
        some = np.linspace(0, len(rows) - 1, min(len(rows), LOOKED)).astype(int)
        return cls((columns + 0.5) / unit, (rows + 0.5) / unit, pixels[inside], some, inside)

    @property
    def unit(self) -> int:
        """The shorter side of the picture in pixels."""
        height, width = self.inside.shape
        return int(min(height, width))

    @property
    def sides(self) -> tuple[float, float]:
        """Its width and height in shorter sides."""
        height, width = self.inside.shape
        return width / self.unit, height / self.unit


def main_axis(colors: Float32Array) -> Float32Array:
    """The direction [C] in which colours [P, C] differ most."""
    away = (colors - colors.mean(axis=0)).astype(np.float64)
    found: Float32Array = np.linalg.svd(away.T @ away)[0][:, 0].astype(np.float32)
    return found


def nearest_stops(
    measure: Measure,
    start: Float64Array,
    scales: tuple[float, ...],
    colors: Float32Array,
    middles: Sequence[tuple[float, ...]],
) -> tuple[Float64Array, ColorStops]:
    """What a number at each pixel hangs on, and the stops by which it tells colours [P, C], from `start` on: by least
    squares.

    `scales`: of each of the numbers that it hangs on. `middles`: where the stops between the ends may start, shares of
    the way; from those that are nearest the search begins. The colours are those that are best for a number: they are
    solved for at each step.
    """
    wanted, count = colors.astype(np.float64), len(middles[0]) + 2

    def off(numbers: Float64Array) -> Float64Array:
        shares = _shares(measure(numbers[:-count]), _rising(numbers[-count:]))
        left: Float64Array = (shares @ _solved(shares, wanted) - wanted).ravel()
        return left

    low, high = np.quantile(measure(start), FIRST)
    begins = [
        np.concatenate([start, low + np.array((0.0, *middle, 1.0)) * (high - low)]) for middle in middles
    ]
    begin = min(begins, key=lambda numbers: float(np.square(off(numbers)).sum()))
    step = max(float(high - low), TINY) * SCALE
    found = least_squares(off, begin, x_scale=(*scales, *(step,) * count), ftol=NEARER, max_nfev=MOST_STEPS).x
    values = _rising(found[-count:])
    shares = _shares(measure(found[:-count]), values)
    return found[:-count], ColorStops(values, _solved(shares, wanted).astype(np.float32))


def _rising(values: Float64Array) -> Float64Array:
    """Stops that are apart: those between the ends are no nearer to these than they may be."""
    low, high = values[0], max(values[-1], values[0] + TINY)
    room = NEAREST * (high - low)
    between = np.sort(values[1:-1].clip(low + room, high - room))
    return np.array([low, *between, high])


def _shares(values: Float64Array, stops: Float64Array) -> Float64Array:
    """How much of each stop's colour [S] there is at values [P], [P, S]."""
    return np.stack([np.interp(values, stops, own) for own in np.eye(len(stops))], axis=1)


def _solved(shares: Float64Array, colors: Float64Array) -> Float64Array:
    """The colours [S, C] with which shares [P, S] are nearest to colours [P, C]; the mean where there is no share."""
    mean, own = colors.mean(axis=0), shares.T @ shares + TINY * np.eye(shares.shape[1])
    found: Float64Array = mean + np.linalg.solve(own, shares.T @ (colors - mean))
    return found

"""Linear gradients of several colours that parts of a picture are: along a direction one runs into the next."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy import ndimage
from scipy.optimize import minimize_scalar

from ..arrays import BoolArray, Float32Array, Float64Array
from .color_stops import MIDDLES, Samples, StoppedShade, nearest_stops
from .rings import LEAST, SMOOTH, smooth_slopes

SCALES = (0.1,)  # of the search: radians
MOSTLY = 0.3  # of the pixels lie where colours change, at least: else it is one colour that ends softly
MANY, MOST = 800, 8  # pixels of a region of many colours, at least; so many colours
TURN = 0.1  # radians: how far a direction may be from where colours change most
FINE = 1e-4  # radians: how exact it is
BINS = 64  # places along a direction
PLANE, NEARLY = 2.2 / 255, 0.98  # how far a region is from a gradient at most; share of it that is as near


@dataclass(frozen=True, eq=False)
class BentShade(StoppedShade):
    """Colours by how far a place is along a direction [2], by shares of the sides."""

    direction: Float64Array

    def at(self, x: Float32Array, y: Float32Array) -> Float32Array:
        """The colour there [..., C]."""
        return self.stops.at(self.along(x, y))

    def along(self, x: Float32Array, y: Float32Array) -> Float32Array:
        """How far a place is along the direction [...]."""
        found: Float32Array = x * self.direction[0] + y * self.direction[1]
        return found


def bend_of(inside: BoolArray, pixels: Float32Array) -> BentShade | None:
    """The linear gradient of three colours that is nearest to what is inside [H, W] of a picture [H, W, C]; None for
    too few pixels, or where most are of one colour.
    """
    if inside.sum() < LEAST:
        return None
    line = Line.of(inside, pixels)
    return line.nearest(_steepest(inside, line.colors), MIDDLES)


def long_bends_of(inside: BoolArray, pixels: Float32Array) -> Iterator[BentShade]:
    """The same of ever more colours; none where colours do not hang on how far they are along a line."""
    if inside.sum() < MANY:
        return
    line = Line.of(inside, pixels)
    angle = line.evenest(float(_steepest(inside, line.colors)[0]))
    middles = line.bends(angle)
    for count in range(2, len(middles) + 1):
        bend = line.nearest(np.array([angle]), (tuple(sorted(middles[:count])),))
        if bend is not None:
            yield bend


class Line(Samples):
    """What colours hang on how far they are along a line."""

    def along(self, angle: float) -> Float64Array:
        """How far those that are looked at are along a direction."""
        found: Float64Array = self.x[self.some] * np.cos(angle) + self.y[self.some] * np.sin(angle)
        return found

    def nearest(self, start: Float64Array, middles: Sequence[tuple[float, ...]]) -> BentShade | None:
        """The nearest gradient, from an angle [1] and shares of the way on."""
        (angle,), stops = nearest_stops(
            lambda numbers: self.along(numbers[0]), start, SCALES, self.colors[self.some], middles
        )
        along = self.x * np.cos(angle) + self.y * np.sin(angle)
        stops = stops.within(float(along.min()), float(along.max()))
        if stops.changing(along) < MOSTLY:
            return None
        return BentShade(stops, np.array((np.cos(angle), np.sin(angle))) * self.sides)

    def evenest(self, angle: float) -> float:
        """The angle near to one, across which colours differ least."""
        return float(
            minimize_scalar(
                lambda turned: float(np.square(self._uneven(turned)[0]).mean()),
                bounds=(angle - TURN, angle + TURN),
                method="bounded",
                options={"xatol": FINE},
            ).x
        )

    def _uneven(self, angle: float) -> tuple[Float64Array, Float64Array, Float64Array]:
        """How far colours [P, C] are from the mean at the same place along a direction; these means [B, C] and places
        [B], shares of the way.
        """
        along = self.along(angle)
        share = (along - along.min()) / max(np.ptp(along), 1e-9)
        bins = np.minimum((share * BINS).astype(int), BINS - 1)
        counts = np.bincount(bins, minlength=BINS)
        sums = [np.bincount(bins, channel, BINS) for channel in self.colors[self.some].T]
        means = np.stack(sums, axis=1) / np.maximum(counts, 1)[:, None]
        there = counts > 0
        return self.colors[self.some] - means[bins], means[there], (np.flatnonzero(there) + 0.5) / BINS

    def bends(self, angle: float) -> list[float]:
        """Where colours bend along a direction, shares of the way, the farthest from a line first; none if they do not
        hang on that.
        """
        off, means, places = self._uneven(angle)
        steps = np.abs(np.diff(means, axis=0)).max()
        if np.quantile(np.abs(off).max(axis=1), NEARLY) > PLANE + steps:
            return []
        chosen = [0, len(places) - 1]
        while len(chosen) < MOST:
            known = sorted(chosen)
            left = [np.interp(places, places[known], channel[known]) for channel in means.T] - means.T
            worst = np.abs(left).max(axis=0)
            if worst.max() <= PLANE:
                break
            chosen.append(int(worst.argmax()))
        return [float(places[index]) for index in chosen[2:]]


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

"""Linear gradients of several colours that parts of a picture are: along a direction one runs into the next."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import ndimage
from scipy.optimize import minimize_scalar

from ..arrays import Float32Array, Float64Array
from .color_stops import MIDDLES, NEARLY, PLANE, Samples, StoppedShade, nearest_stops
from .rings import LEAST, SMOOTH, smooth_slopes

SCALES = (0.1,)  # of the search: radians
MOSTLY = 0.3  # of the pixels lie where colours change, at least: else it is one colour that ends softly
MANY, MOST = 800, 8  # pixels of a region of many colours, at least; so many colours
TURN = 0.1  # radians: how far a direction may be from where colours change most
FINE = 1e-4  # radians: how exact it is
BINS = 64  # places along a direction
TINY = 1e-9


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


@dataclass(frozen=True, eq=False)
class Line:
    """Samples whose colours may hang on how far they are along a line."""

    samples: Samples

    def bend(self) -> BentShade | None:
        """The nearest linear gradient of three colours; None for too few pixels, or where most are of one colour."""
        return self._nearest(self._steepest, MIDDLES) if len(self.samples.x) >= LEAST else None

    def long_bends(self) -> Iterator[BentShade]:
        """The same of ever more colours; none where these do not hang on how far they are along a line."""
        if len(self.samples.x) < MANY:
            return
        angle = self.evenest(self._steepest)
        middles = self._bends(angle)
        for count in range(2, len(middles) + 1):
            bend = self._nearest(angle, (tuple(sorted(middles[:count])),))
            if bend is not None:
                yield bend

    @cached_property
    def _steepest(self) -> float:
        """The angle of the direction in which colours change most: by the structure tensor."""
        inside, colors = self.samples.inside, self.samples.colors
        core = ndimage.binary_erosion(inside, np.ones((3, 3)), iterations=round(SMOOTH))
        core = core if core.any() else inside
        channels = (colors - colors.mean(axis=0)).T
        slopes = [np.stack(smooth_slopes(inside, channel))[:, core] for channel in channels]
        across, down = np.linalg.eigh(sum(own @ own.T for own in slopes))[1][:, 1]
        return float(np.arctan2(down, across))

    @cached_property
    def _colors(self) -> Float32Array:
        """Those that are looked at [P, C]."""
        return self.samples.colors[self.samples.some]

    def _along(self, angle: float) -> Float64Array:
        """How far those that are looked at are along a direction."""
        x, y = self.samples.x[self.samples.some], self.samples.y[self.samples.some]
        found: Float64Array = x * np.cos(angle) + y * np.sin(angle)
        return found

    def _nearest(self, start: float, middles: Sequence[tuple[float, ...]]) -> BentShade | None:
        """The nearest gradient, from an angle and shares of the way on."""
        (angle,), stops = nearest_stops(
            lambda numbers: self._along(numbers[0]), np.array([start]), SCALES, self._colors, middles
        )
        along = self.samples.x * np.cos(angle) + self.samples.y * np.sin(angle)
        stops = stops.within(float(along.min()), float(along.max()))
        if stops.changing(along) < MOSTLY:
            return None
        return BentShade(stops, np.array((np.cos(angle), np.sin(angle))) * self.samples.sides)

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
        along = self._along(angle)
        share = (along - along.min()) / max(np.ptp(along), TINY)
        bins = np.minimum((share * BINS).astype(int), BINS - 1)
        counts = np.bincount(bins, minlength=BINS)
        sums = [np.bincount(bins, channel, BINS) for channel in self._colors.T]
        means = np.stack(sums, axis=1) / np.maximum(counts, 1)[:, None]
        there = counts > 0
        return self._colors - means[bins], means[there], (np.flatnonzero(there) + 0.5) / BINS

    def _bends(self, angle: float) -> list[float]:
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

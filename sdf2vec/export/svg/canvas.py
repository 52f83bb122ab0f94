"""From scene units to user units, which are pixels of the fitted picture, or coarser."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ...arrays import Float64Array
from ...grain import is_few_and_sharp
from ...outlines import Point
from ...scene import Scene

Points = Float64Array  # [N, 2]


@dataclass(frozen=True)
class Canvas:
    """A canvas of `width` × `height` user units, `unit` of them in a scene unit, `pixels` of the fitted picture in one.

    Coordinates get `digits` decimals: a twentieth of a pixel for a picture of 512, more for a smaller one and for few
    sharp layers, because a drawing is shown at any size.
    """

    width: float
    height: float
    unit: float
    digits: int
    pixels: float = 1.0

    @classmethod
    def of(cls, scene: Scene, coarser: int = 0) -> Canvas:
        """The canvas of a scene in pixels, with some decimals fewer than usual; of few sharp layers, with one more."""
        unit = float(min(scene.width, scene.height))
        finer = 1 if scene.layers and is_few_and_sharp(scene) else 0
        digits = max(0, math.ceil(3.4 - math.log10(unit)), 1) + finer - coarser
        return cls(scene.width, scene.height, unit, max(0, digits))

    @classmethod
    def whole(cls, scene: Scene, units: int) -> Canvas:
        """The canvas of a scene whose coordinates are whole numbers, so many units along the shortest side."""
        pixels = min(scene.width, scene.height) / units
        return cls(scene.width / pixels, scene.height / pixels, float(units), 0, pixels)

    def places(self, points: object) -> Points:
        """Scene points [N, 2] in user units, unrounded."""
        middle = np.array([self.width, self.height]) / 2
        return np.asarray(points, np.float64).reshape(-1, 2) * self.unit + middle

    def place(self, point: Point) -> Point:
        """A scene point in user units, unrounded."""
        (placed,) = pairs(self.places(point))
        return placed

    def from_places(self, places: Points) -> Points:
        """Points in user units [N, 2] in scene units."""
        return (places - np.array([self.width, self.height]) / 2) / self.unit

    def rounded(self, points: Points) -> Points:
        """Points as they will be written."""
        return np.round(points, self.digits)


def pairs(points: Points) -> tuple[Point, ...]:
    """Points [N, 2] as tuples."""
    return tuple((x, y) for x, y in points.tolist())


def growing(radius: float, digits: int) -> float:
    """A radius of half a circle that renderers make larger until it reaches from end to end, for one that is too large,
    as these are rounded towards each other, flattens it.
    """
    return max(radius - 10.0**-digits, 0.5 * radius)

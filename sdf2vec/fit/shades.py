"""What a region of a picture is painted with: one colour, or a gradient of two or three."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import chain
from typing import NamedTuple

import numpy as np

from ..arrays import BoolArray, Float32Array
from .bends import BentShade, Line
from .color_stops import CHANGES, MIDDLES, NEARLY, PLANE, Samples
from .rings import Around, RadialShade

BENDS = (
    0.06  # how far a region may be from one, too, by what its colour changes: as where there are more colours
)
LEAST_SHADED = 60  # pixels of a region that is no single colour


class Shade(NamedTuple):
    """A premultiplied colour [C] at a place (x, y) and its slopes along both axes [2, C], by shares of the sides."""

    place: Float32Array
    color: Float32Array
    slopes: Float32Array

    @property
    def is_flat(self) -> bool:
        """Whether it is one colour."""
        return not self.slopes.any()

    @property
    def axis(self) -> Float32Array:
        """The direction [C] in which its colours lie."""
        found: Float32Array = np.linalg.svd(self.slopes, full_matrices=False)[2][0]
        return found

    def at(self, x: Float32Array, y: Float32Array) -> Float32Array:
        """The colour there [..., C]."""
        found: Float32Array = (
            self.color
            + (x - self.place[0])[..., None] * self.slopes[0]
            + (y - self.place[1])[..., None] * self.slopes[1]
        )
        return found


Gradient = Shade | RadialShade | BentShade


def gradient_of(inside: BoolArray, pixels: Float32Array) -> Gradient | None:
    """What is inside [H, W] of a picture [H, W, C]: one colour, a plane, rings, either of three colours, a line of
    more, the first that is near to it, if it is no paler here than there; at last what is less near.
    """
    colors, (x, y) = pixels[inside], places_in(inside)
    plane = _plane(x, y, colors)
    shown = plane.at(x, y)
    is_plane = _is_told(shown, colors)
    if is_plane and np.ptp(shown, axis=0).max() < CHANGES:
        return Shade(plane.place, np.median(colors, axis=0), np.zeros_like(plane.slopes))
    if len(colors) < LEAST_SHADED or (colors.shape[1] == 4 and np.ptp(colors[:, 3]) > CHANGES):
        return None
    if is_plane:
        return plane
    tried: list[tuple[Gradient, Float32Array]] = [(plane, shown)]
    samples = Samples.of(inside, pixels)
    around = Around(samples)
    rings = around.rings()
    for told in chain([] if rings is None else [rings], _bent(samples, around)):
        shown = told.at(x, y)
        if _is_told(shown, colors):
            return told
        tried.append((told, shown))
    return next((told for told, shown in tried if _is_told(shown, colors, BENDS)), None)


def bent_gradient(inside: BoolArray, pixels: Float32Array) -> Gradient | None:
    """The gradient of three colours or more that is near to what is inside; None where none is."""
    places, samples = places_in(inside), Samples.of(inside, pixels)
    found = _bent(samples, Around(samples))
    return next((told for told in found if _is_told(told.at(*places), samples.colors)), None)


def _bent(samples: Samples, around: Around) -> Iterator[Gradient]:
    """Along a line over a third colour, around a point, along a line over ever more."""
    line = Line(samples)
    for told in (line.bend, lambda: around.rings(MIDDLES)):
        if (gradient := told()) is not None:
            yield gradient
    yield from line.long_bends()


def places_in(inside: BoolArray) -> tuple[Float32Array, Float32Array]:
    """Where pixels inside [H, W] are, x and y [P], by shares of the sides."""
    height, width = inside.shape
    rows, columns = np.nonzero(inside)
    x, y = (columns + 0.5) / width, (rows + 0.5) / height
    return x.astype(np.float32), y.astype(np.float32)


def _is_told(shown: Float32Array, colors: Float32Array, bends: float = 0.0) -> bool:
    """Whether colours [P, C] are near to others, or as near as they may be of gradients that bend."""
    allowed = max(PLANE, bends * float(np.ptp(shown, axis=0).max()))
    return bool(np.mean(np.abs(shown - colors).max(axis=1) <= allowed) >= NEARLY)


def _plane(x: Float32Array, y: Float32Array, colors: Float32Array) -> Shade:
    """The plane through colours [P, C] that changes along one direction."""
    places = np.stack([x, y], axis=1)
    middle, mean = places.mean(axis=0), colors.mean(axis=0)
    return Shade(middle, mean, _along_one(np.linalg.lstsq(places - middle, colors - mean)[0]))


def _along_one(slopes: Float32Array) -> Float32Array:
    """Slopes [2, C] as near to these as change along one direction."""
    left, strengths, right = np.linalg.svd(slopes, full_matrices=False)
    found: Float32Array = left[:, :1] * strengths[0] @ right[:1]
    return found

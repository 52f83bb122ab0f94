"""Radial gradients that parts of a picture are: colours that change with the distance from a point alone."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy import ndimage
from scipy.optimize import least_squares

from ..arrays import BoolArray, Float32Array, Float64Array

LEAST = 200  # pixels of a region: fewer are like rings of some gradient by chance
LOOKED = 3000  # pixels that are looked at
SMOOTH = 2.0  # pixels, of the standard deviation of a blur that takes away the steps of eight bits
STEEP = 0.3  # share of the largest slopes, of those that point to the middle
ROUND = 8.0  # times the one axis of an ellipse, that the other may be
FARTHEST = 3.0  # shorter sides of the picture, from a region's middle to that of its rings
MOSTLY = 0.5  # of the pixels lie where colours change, at least: else it is one colour that ends softly
TIP = 0.015  # the same, of what is too near to the middle of rings to be smooth
SCALES, MOST_STEPS, TINY = (0.1, 0.1, 0.3, 0.1, 0.1), 60, 1e-3  # of the search: of its numbers; in it


class RadialShade(NamedTuple):
    """Premultiplied colours [C] at a place (x, y), by shares of the sides, and how much they change for each unit of
    the distance from there: in shares of the shorter side, of which that along y counts `squeeze` times. They change
    between two distances, `span`, alone. `sides`: width and height, in the same unit.
    """

    place: Float32Array
    color: Float32Array
    change: Float32Array
    squeeze: float
    span: tuple[float, float]
    sides: tuple[float, float]

    @property
    def is_flat(self) -> bool:
        """Never: it is no single colour."""
        return False

    @property
    def axis(self) -> Float32Array:
        """The direction [C] in which its colours lie."""
        found: Float32Array = self.change / np.linalg.norm(self.change)
        return found

    def at(self, x: Float32Array, y: Float32Array) -> Float32Array:
        """The colour there [..., C]."""
        away = np.hypot(
            (x - self.place[0]) * self.sides[0], (y - self.place[1]) * self.sides[1] * self.squeeze
        )
        found: Float32Array = (self.color + away.clip(*self.span)[..., None] * self.change).astype(np.float32)
        return found


def rings_of(inside: BoolArray, pixels: Float32Array) -> RadialShade | None:
    """The radial gradient that is nearest to what is inside [H, W] of a picture [H, W, C]; None for too few pixels,
    or where most are of one colour.
    """
    if inside.sum() < LEAST:
        return None
    height, width = inside.shape
    sides = width / min(height, width), height / min(height, width)
    rows, columns = np.nonzero(inside)
    share = _along_one(pixels[inside])
    x, y = (columns + 0.5) / min(height, width), (rows + 0.5) / min(height, width)
    start = _middle(inside, share, min(height, width))
    some = np.linspace(0, len(x) - 1, min(len(x), LOOKED)).astype(int)
    found = _fitted(x[some], y[some], share[some], start)
    if found is None:
        return None
    middle, squeeze, span = found
    away = np.hypot(x - middle[0], (y - middle[1]) * squeeze)
    if np.mean((away > span[0]) & (away < span[1])) < MOSTLY:
        return None
    away = away.clip(*span)
    terms = np.stack([np.ones_like(away), away], axis=1)
    color, change = np.linalg.lstsq(terms, pixels[inside].astype(np.float64))[0].astype(np.float32)
    return RadialShade(np.array(middle / sides, np.float32), color, change, squeeze, span, sides)


def _along_one(colors: Float32Array) -> Float64Array:
    """Colours [P, C] as one number each, along the direction in which they differ most."""
    away = (colors - colors.mean(axis=0)).astype(np.float64)
    found: Float64Array = away @ np.linalg.svd(away.T @ away)[0][:, 0]
    return found


def _middle(inside: BoolArray, share: Float64Array, unit: int) -> Float64Array:
    """Where slopes point to, x and y, and how many times that along y counts: by least squares.

    Along a slope (u, v) from the middle (a, b) of ellipses k² (y − b) u = (x − a) v.
    """
    plane = np.zeros(inside.shape)
    plane[inside] = share
    weight = ndimage.gaussian_filter(inside.astype(float), SMOOTH)
    smooth = ndimage.gaussian_filter(plane, SMOOTH) / np.maximum(weight, TINY)
    core = ndimage.binary_erosion(inside, np.ones((3, 3)), iterations=round(SMOOTH))
    down, across = np.gradient(smooth)
    steep = np.hypot(across, down)
    core &= steep > STEEP * np.quantile(steep[core], 0.95) if core.any() else core
    rows, columns = np.nonzero(core if core.sum() >= LEAST // 2 else inside)
    u, v = across[rows, columns], down[rows, columns]
    x, y = (columns + 0.5) / unit, (rows + 0.5) / unit
    terms = np.stack([u * y, -u, v], axis=1)
    squared, moved, a = np.linalg.lstsq(terms, v * x)[0]
    if not ROUND**-2 < squared < ROUND**2:  # of circles, which hang on fewer numbers
        a, b = np.linalg.lstsq(np.stack([v, -u], axis=1), v * x - u * y)[0]
        return np.array([a, b, 1.0])
    return np.array([a, moved / squared, np.sqrt(squared)])


def _fitted(
    x: Float64Array, y: Float64Array, share: Float64Array, start: Float64Array
) -> tuple[Float64Array, float, tuple[float, float]] | None:
    """The middle, what along y counts, and between which distances numbers [P] at places [P] change; None where the
    middle is far away.
    """

    def off(numbers: Float64Array) -> Float64Array:
        away = _distances(x, y, numbers).clip(numbers[3], max(numbers[4], numbers[3] + TINY))
        away -= away.mean()
        left: Float64Array = share - share.mean() - (away @ share) / max(away @ away, TINY**2) * away
        return left

    begin = np.array([start[0], start[1], np.log(start[2]), 0.0, 0.0])
    begin[3:] = np.quantile(_distances(x, y, begin), (0.02, 0.98))
    solved = least_squares(off, begin, x_scale=SCALES, max_nfev=MOST_STEPS).x
    if np.abs(solved[:2] - [x.mean(), y.mean()]).max() > FARTHEST or abs(solved[2]) > np.log(ROUND):
        return None
    away = _distances(x, y, solved)
    least = 0.0 if away.min() < TIP else float(away.min())
    low, high = max(float(solved[3]), least), min(float(solved[4]), float(away.max()))
    return (solved[:2], float(np.exp(solved[2])), (low, high)) if high > low else None


def _distances(x: Float64Array, y: Float64Array, numbers: Float64Array) -> Float64Array:
    """How far places [P] are from a middle; the third of the numbers is the logarithm of what along y counts."""
    found: Float64Array = np.hypot(x - numbers[0], (y - numbers[1]) * np.exp(numbers[2]))
    return found

"""Patches: shapes with coverage of their own."""

from __future__ import annotations

import math

from ..blend import CUTOFF
from ..expr import Expr, cos, dot, exp, maximum, sqrt, vec2
from ..function import function, let
from ..kind import SMALLEST, Kind, Patch, rotate
from ..operation import FLOAT, VEC2
from ..units import ANGLE, FREQUENCY, Parameter
from .common import angle_named, direction, position, size, smaller_component, turned_frame
from .ellipse import ellipse_distance, ellipse_extent, ellipse_thickness

REACH = math.sqrt(2.0 * math.log(1.0 / CUTOFF))  # standard deviations from which on a Gaussian counts as 0
PIXEL_VARIANCE = 1.0 / 12.0  # of a box of one pixel


def _widened(radii: Expr, pixel: Expr) -> Expr:
    """Standard deviations of a Gaussian that a pixel's box has blurred."""
    squared = radii * radii + pixel * pixel * PIXEL_VARIANCE
    return vec2(sqrt(squared.x), sqrt(squared.y))


@function("gaussianCover", q=VEC2, radii=VEC2, pixel=FLOAT)
def gaussian_cover(q: Expr, radii: Expr, pixel: Expr) -> Expr:
    """A Gaussian of these standard deviations, 1 in its middle and 0 far away, as a box of one pixel blurs it."""
    wide = let("wide", _widened(radii, pixel))
    r = let("r", q / wide)
    height = radii.x * radii.y / (wide.x * wide.y)
    return height * maximum(exp(-0.5 * dot(r, r)) - CUTOFF, 0.0) * (1.0 / (1.0 - CUTOFF))


@function("gaborCover", q=VEC2, radii=VEC2, frequency=FLOAT, phase=FLOAT, pixel=FLOAT)
def gabor_cover(q: Expr, radii: Expr, frequency: Expr, phase: Expr, pixel: Expr) -> Expr:
    """A cosine along x within a Gaussian (Gabor 1946), faint where its waves are finer than pixels."""
    step = let("step", frequency * pixel)
    seen = exp(-0.5 * PIXEL_VARIANCE * step * step)
    return gaussian_cover(q, radii, pixel) * seen * cos(frequency * q.x + phase)


def _gaussian_cover(p: Expr, pixel: Expr, center: Expr, radii: Expr, angle: Expr) -> Expr:
    return gaussian_cover(rotate(p - center, direction(angle)), radii, pixel)


def _gabor_cover(
    p: Expr, pixel: Expr, center: Expr, radii: Expr, angle: Expr, frequency: Expr, phase: Expr
) -> Expr:
    return gabor_cover(rotate(p - center, direction(angle)), radii, frequency, phase, pixel)


def _patch_reach(pixel: Expr, center: Expr, radii: Expr, *rest: Expr) -> Expr:
    shortest = maximum(smaller_component(radii), SMALLEST)
    return REACH * sqrt(shortest * shortest + pixel * pixel * PIXEL_VARIANCE) - shortest


def _patch_distance(p: Expr, center: Expr, radii: Expr, angle: Expr, *wave: Expr) -> Expr:
    return ellipse_distance(p, center, radii, angle)


def _patch_extent(margin: Expr, center: Expr, radii: Expr, angle: Expr, *wave: Expr) -> Expr:
    return ellipse_extent(margin, center, radii, angle)


def _patch_area(center: Expr, radii: Expr, *rest: Expr) -> Expr:
    return math.tau * radii.x * radii.y


GAUSSIAN = Kind(
    "gaussian",
    (position("center"), size("radii", 0.8, 0.5), angle_named("angle")),
    _patch_distance,
    _patch_extent,
    _patch_area,
    ellipse_thickness,
    exact=False,
    own_frame=turned_frame,
    patch=Patch(_gaussian_cover, _patch_reach, radial=True),
)

GABOR = Kind(
    "gabor",
    (
        position("center"),
        size("radii", 0.8, 0.8),
        angle_named("angle"),
        Parameter("frequency", FREQUENCY, (2.0,)),
        Parameter("phase", ANGLE),
    ),
    _patch_distance,
    _patch_extent,
    _patch_area,
    ellipse_thickness,
    exact=False,
    own_frame=turned_frame,
    patch=Patch(_gabor_cover, _patch_reach, signed=True),
)

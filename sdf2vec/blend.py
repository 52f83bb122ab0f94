"""From distances to colours: falloff, smooth union, compositing. And from a pixel to a point of the scene.

Colours are sRGB-coded and blended as such. All formulas are expressions; nothing here computes.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from .expr import (
    FLOAT,
    VEC2,
    VEC3,
    VEC4,
    Expr,
    clamp,
    const,
    exp,
    function,
    let,
    log,
    maximum,
    minimum,
    mix,
    sigmoid,
    sin,
    vec4,
)

# --- falloff ------------------------------------------------------------------------------------------------

STEEPNESS = 10.0  # the thesis' normalised sigmoid: 5 − 10·d/falloff
CUTOFF = 1.0 / 512.0  # coverage below it counts as 0, above 1 − it as 1: half a level of 8 bits
MIN_FALLOFF_PIXELS = 1.6  # a logistic edge of this falloff has the variance of a one-pixel box filter
REACH = math.log(1.0 / CUTOFF - 1.0) / STEEPNESS  # half the width of the soft edge, in falloffs


def saturation(falloff: Expr, pixel: Expr) -> Expr:
    """The distance up to which `coverage` is exactly 1."""
    return 0.5 * falloff - REACH * _softness(falloff, pixel)


def _softness(falloff: Expr, pixel: Expr) -> Expr:
    return maximum(falloff, MIN_FALLOFF_PIXELS * pixel)


@function("coverage", d=FLOAT, falloff=FLOAT, pixel=FLOAT)
def coverage(d: Expr, falloff: Expr, pixel: Expr) -> Expr:
    """Coverage 0..1 at distance d: a sigmoid that is 1/2 at falloff/2 and never sharper than the pixels."""
    softness = let("softness", _softness(falloff, pixel))
    z = let("z", STEEPNESS * (0.5 * falloff - d) / softness)
    return clamp((sigmoid(z) - CUTOFF) * (1.0 / (1.0 - 2.0 * CUTOFF)), 0.0, 1.0)


def reach(falloff: Expr, pixel: Expr) -> Expr:
    """The distance from which on `coverage` is exactly 0."""
    return 0.5 * falloff + REACH * _softness(falloff, pixel)


# --- smooth union -------------------------------------------------------------------------------------------


@function("unionWeight", d=FLOAT, nearest=FLOAT, smoothness=FLOAT)
def union_weight(d: Expr, nearest: Expr, smoothness: Expr) -> Expr:
    """Weight of one shape in a smooth union, 1 for the nearest."""
    return exp((nearest - d) / smoothness)


@function("unionDistance", nearest=FLOAT, total=FLOAT, smoothness=FLOAT)
def union_distance(nearest: Expr, total: Expr, smoothness: Expr) -> Expr:
    """Exponential smooth minimum from the sum of the weights."""
    return nearest - smoothness * log(total)


def smooth_union(distances: Sequence[Expr], colors: Sequence[Expr], smoothness: Expr) -> tuple[Expr, Expr]:
    """Distance and colour of shapes joined by the exponential smooth minimum (the thesis' 4.2 to 4.4).

    −k·log Σ exp(−dᵢ/k), shifted by the nearest distance so that nothing overflows; the colour is the mean of
    the shapes' colours by the same weights. One shape is itself.
    """
    if len(distances) == 1:
        return distances[0], colors[0]
    named = [let(f"d{i}", d) for i, d in enumerate(distances, 1)]
    nearest = named[0]
    for d in named[1:]:
        nearest = minimum(nearest, d)
    nearest = let("nearest", nearest)
    weights = [let(f"w{i}", union_weight(d, nearest, smoothness)) for i, d in enumerate(named, 1)]
    total, color = weights[0], colors[0] * weights[0]
    for weight, other in zip(weights[1:], colors[1:], strict=True):
        total, color = total + weight, color + other * weight
    total = let("total", total)
    return union_distance(nearest, total, smoothness), color / total


def union_reach(count: int, smoothness: Expr) -> Expr:
    """How much farther than its nearest shape a smooth union of `count` shapes can reach."""
    return smoothness * math.log(count) if count > 1 else const(0.0)


# --- compositing --------------------------------------------------------------------------------------------


@function("over", below=VEC4, color=VEC3, opacity=FLOAT, cover=FLOAT)
def over(below: Expr, color: Expr, opacity: Expr, cover: Expr) -> Expr:
    """Lays a colour over what is below (premultiplied)."""
    return mix(below, vec4(color, 1.0), opacity * cover)


@function("add", below=VEC4, color=VEC3, opacity=FLOAT, cover=FLOAT)
def additive(below: Expr, color: Expr, opacity: Expr, cover: Expr) -> Expr:
    """Adds a signed colour to what is below (premultiplied); opacity is what it adds to alpha."""
    return below + vec4(color, opacity) * cover


COMPOSITING = {"over": over, "additive": additive}


@function("display", color=VEC4)
def display(color: Expr) -> Expr:
    """What a screen can show of a premultiplied colour."""
    alpha = let("alpha", clamp(color.w, 0.0, 1.0))
    return vec4(*(clamp(c, 0.0, alpha) for c in (color.x, color.y, color.z)), alpha)


# --- the canvas ---------------------------------------------------------------------------------------------


def _units(resolution: Expr, size: Expr) -> Expr:
    return let("units", size / resolution)


@function("pixelSize", resolution=VEC2, size=VEC2)
def pixel_size(resolution: Expr, size: Expr) -> Expr:
    """Scene units per pixel such that a scene of this size fits into the canvas."""
    units = _units(resolution, size)
    return maximum(units.x, units.y)


@function("scenePoint", pixel=VEC2, resolution=VEC2, size=VEC2)
def scene_point(pixel: Expr, resolution: Expr, size: Expr) -> Expr:
    """The scene's point at a pixel position (y down, centres at half-integers); the origin is the middle."""
    return (pixel - 0.5 * resolution) * pixel_size(resolution, size)


@function("pixelSize", resolution=VEC2, size=VEC2)
def covering_pixel_size(resolution: Expr, size: Expr) -> Expr:
    """Scene units per pixel such that a scene of this size covers the canvas."""
    units = _units(resolution, size)
    return minimum(units.x, units.y)


@function("scenePoint", pixel=VEC2, resolution=VEC2, size=VEC2)
def covering_scene_point(pixel: Expr, resolution: Expr, size: Expr) -> Expr:
    """The scene's point at a pixel position (y down, centres at half-integers); the origin is the middle."""
    return (pixel - 0.5 * resolution) * covering_pixel_size(resolution, size)


# How a scene meets a canvas of another shape: the point and the size of a pixel.
FRAMINGS = {"fit": (scene_point, pixel_size), "cover": (covering_scene_point, covering_pixel_size)}


@function("surfacePoint", uv=VEC2, size=VEC2)
def surface_point(uv: Expr, size: Expr) -> Expr:
    """The scene's point at a place 0..1 of a surface (y down) that it fills."""
    return (uv - 0.5) * size


@function("gridPoint", p=VEC2, low=VEC2, cells=VEC2)
def grid_point(p: Expr, low: Expr, cells: Expr) -> Expr:
    """p in a grid that begins at low and has so many cells a unit."""
    return (p - low) * cells


# --- motion -------------------------------------------------------------------------------------------------

BREATH = 0.004  # scene units


@function("breath", time=FLOAT, index=FLOAT)
def breath(time: Expr, index: Expr) -> Expr:
    """How far a shape has drawn in its edge at a time in seconds, each at its own pace."""
    return BREATH * sin(time * (1.0 + 0.3 * sin(index)) + index)

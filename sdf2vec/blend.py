"""From distances to colours: falloff, joins, compositing. And from a pixel to a point of the scene.

Colours are sRGB-coded and blended as such. All formulas are expressions; nothing here computes.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from .expr import Expr, absolute, clamp, const, exp, log, maximum, minimum, mix, select, sigmoid, vec4
from .function import Function, function, let
from .operation import FLOAT, VEC2, VEC3, VEC4

# --- falloff ------------------------------------------------------------------------------------------------

STEEPNESS = 10.0  # the thesis' normalised sigmoid: 5 − 10·d/falloff
CUTOFF = 1.0 / 512.0  # coverage below it counts as 0, above 1 − it as 1: half a level of 8 bits
EDGE_DEVIATION = math.pi / math.sqrt(3.0) / STEEPNESS  # standard deviation of the edge's slope, in falloffs
MIN_FALLOFF_PIXELS = 1.6  # a logistic edge of this falloff has the variance of a one-pixel box filter
SHARPEST = 1e-6  # scene units: joins of no smoothness have this one
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


# --- joins --------------------------------------------------------------------------------------------------
# Of what has been joined so far, `a`, and the next shape, `b`: each a colour and a signed distance, (r, g, b, d).


def _blur(difference: Expr, smoothness: Expr) -> tuple[Expr, Expr]:
    """The weight of the farther one of two, that of the nearer being 1; and how far a smooth join is from a sharp one.

    The logarithm of a sum of exponentials, shifted by the larger so that nothing overflows.
    """
    k = let("k", maximum(smoothness, SHARPEST))
    weight = let("weight", exp(-absolute(difference) / k))
    return weight, k * log(1.0 + weight)


@function("smoothUnion", a=VEC4, b=VEC4, smoothness=FLOAT)
def smooth_union(a: Expr, b: Expr, smoothness: Expr) -> Expr:
    """Exponential smooth minimum −k·log(e^(−a/k) + e^(−b/k)); colours are mixed by the same weights."""
    weight, blur = _blur(a.w - b.w, smoothness)
    share = select(b.w < a.w, 1.0, weight) / (1.0 + weight)
    mixed = let("mixed", mix(a, b, share))
    return vec4(mixed.x, mixed.y, mixed.z, minimum(a.w, b.w) - blur)


@function("smoothSubtraction", a=VEC4, b=VEC4, smoothness=FLOAT)
def smooth_subtraction(a: Expr, b: Expr, smoothness: Expr) -> Expr:
    """What is in a and not in b, in the colour of a."""
    _, blur = _blur(a.w + b.w, smoothness)
    return vec4(a.x, a.y, a.z, maximum(a.w, -b.w) + blur)


@function("smoothIntersection", a=VEC4, b=VEC4, smoothness=FLOAT)
def smooth_intersection(a: Expr, b: Expr, smoothness: Expr) -> Expr:
    """What is in both, in the colour of a."""
    _, blur = _blur(a.w - b.w, smoothness)
    return vec4(a.x, a.y, a.z, maximum(a.w, b.w) + blur)


@dataclass(frozen=True)
class Join:
    """How a shape is joined to those before it. `adds`: it may make the layer larger, and its colour is seen."""

    name: str
    symbol: str
    formula: Function
    adds: bool = False


JOINS: dict[str, Join] = {
    join.name: join
    for join in (
        Join("union", "|", smooth_union, adds=True),
        Join("subtraction", "-", smooth_subtraction),
        Join("intersection", "&", smooth_intersection),
    )
}
UNION, SUBTRACTION, INTERSECTION = "union", "subtraction", "intersection"


def union_reach(count: int, smoothness: Expr) -> Expr:
    """How much farther than its nearest shape a union of `count` shapes, none smoother than that, can reach."""
    return maximum(smoothness, SHARPEST) * math.log(count) if count > 1 else const(0.0)


# --- compositing --------------------------------------------------------------------------------------------


@function("over", below=VEC4, color=VEC3, opacity=FLOAT, cover=FLOAT)
def over(below: Expr, color: Expr, opacity: Expr, cover: Expr) -> Expr:
    """Lays a colour over what is below (premultiplied)."""
    return mix(below, vec4(color, 1.0), opacity * cover)


@function("add", below=VEC4, color=VEC3, opacity=FLOAT, cover=FLOAT)
def additive(below: Expr, color: Expr, opacity: Expr, cover: Expr) -> Expr:
    """Adds a signed colour to what is below (premultiplied); opacity is what either sign of a wave adds to alpha."""
    return below + vec4(color * cover, opacity * absolute(cover))


@dataclass(frozen=True)
class Compositing:
    """How layers come together: `draw(below, color, opacity, cover)` is what a layer makes of what is below it.

    `signed`: colours, opacities and coverage go from −1 to 1, not from 0; coverage below 0 counts as none otherwise.
    `hides`: an opaque layer hides what is below it, and the order of layers matters. `linear_in`: names of the numbers
    in which the picture is linear, such that a layer adds nothing where they are all 0.
    """

    name: str
    draw: Function
    signed: bool
    hides: bool
    linear_in: tuple[str, ...]

    @property
    def lowest(self) -> float:
        """The least that a colour, an opacity or a coverage can be."""
        return -1.0 if self.signed else 0.0


COMPOSITING: dict[str, Compositing] = {
    compositing.name: compositing
    for compositing in (
        Compositing("over", over, signed=False, hides=True, linear_in=("opacity",)),
        Compositing("additive", additive, signed=True, hides=False, linear_in=("color", "opacity")),
    )
}
OVER = "over"


@function("display", color=VEC4)
def display(color: Expr) -> Expr:
    """What a screen can show of a premultiplied colour."""
    alpha = let("alpha", clamp(color.w, 0.0, 1.0))
    return vec4(*(clamp(c, 0.0, alpha) for c in (color.x, color.y, color.z)), alpha)


# --- the canvas ---------------------------------------------------------------------------------------------


def _framing(pick: Callable[[Expr, Expr], Expr], does: str) -> tuple[Function, Function]:
    """The scene's point at a pixel, and the size of a pixel."""

    def size_of_pixel(resolution: Expr, size: Expr) -> Expr:
        units = let("units", size / resolution)
        return pick(units.x, units.y)

    size_of_pixel.__doc__ = f"Scene units per pixel such that a scene of this size {does} the canvas."
    pixel_size = function("pixelSize", resolution=VEC2, size=VEC2)(size_of_pixel)

    @function("scenePoint", pixel=VEC2, resolution=VEC2, size=VEC2)
    def scene_point(pixel: Expr, resolution: Expr, size: Expr) -> Expr:
        """The scene's point at a pixel position (y down, centres at half-integers); the origin is the middle."""
        return (pixel - 0.5 * resolution) * pixel_size(resolution, size)

    return scene_point, pixel_size


# How a scene meets a canvas of another shape: the point and the size of a pixel.
CROP = "crop"  # fits, with the ground around it
FRAMINGS = {"fit": _framing(maximum, "fits into"), "cover": _framing(minimum, "covers")}
FRAMINGS[CROP] = FRAMINGS["fit"]
scene_point, pixel_size = FRAMINGS["fit"]


def cropped(color: Expr, p: Expr, size: Expr, ground: Expr) -> Expr:
    """The colour at p within a scene of this size, the ground outside."""
    return select(within(p, size), color, ground)


def within(p: Expr, size: Expr) -> Expr:
    """Whether p is in a scene of this size."""
    beyond = [absolute(at) - 0.5 * side for at, side in ((p.x, size.x), (p.y, size.y))]
    return maximum(*beyond) < 0.0


@function("surfacePoint", uv=VEC2, size=VEC2)
def surface_point(uv: Expr, size: Expr) -> Expr:
    """The scene's point at a place 0..1 of a surface (y down) that it fills."""
    return (uv - 0.5) * size


@function("gridPoint", p=VEC2, low=VEC2, cells=VEC2)
def grid_point(p: Expr, low: Expr, cells: Expr) -> Expr:
    """p in a grid that begins at low and has so many cells a unit."""
    return (p - low) * cells

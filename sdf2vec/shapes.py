"""Every shape: its signed distance, its parameters, its extent, its outline.

To add a shape, write its distance as an expression and add one entry to `KINDS`; the renderers, the gradients
and all exports follow. A point `p` and all lengths are in scene units (the picture's shortest side), y points
down, angles are in radians and turn clockwise on the screen.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

from .expr import (
    FLOAT,
    VEC2,
    Expr,
    Type,
    absolute,
    clamp,
    components_of,
    const,
    cos,
    dot,
    fixed,
    function,
    length,
    let,
    maximum,
    minimum,
    select,
    sin,
    sqrt,
    var,
    vec2,
    vec4,
)

Point = tuple[float, float]
Unit = Literal["position", "length", "angle", "frequency"]

SMALLEST = 1e-6  # scene units; keeps divisors away from 0 at zero size
TINY = 1e-20  # the same for squared lengths
LARGEST = 65536.0  # scene units: the longest canvas there can be; anything larger is a mistake


# --- outlines: what a vector format draws for the contour `distance = offset` -------------------------------


@dataclass(frozen=True)
class EllipseOutline:
    """An ellipse about `center` with its own axes turned by `angle`."""

    center: Point
    radii: Point
    angle: float = 0.0


@dataclass(frozen=True)
class RectangleOutline:
    """A rectangle of `half_size` about `center`, turned by `angle`, with rounded corners."""

    center: Point
    half_size: Point
    angle: float
    corner_radius: float


@dataclass(frozen=True)
class PolygonOutline:
    """A polygon grown by `rounding` on all sides, which rounds its corners."""

    points: tuple[Point, ...]
    rounding: float


Outline = EllipseOutline | RectangleOutline | PolygonOutline


# --- declarations -------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Parameter:
    """One parameter of a shape.

    `unit`: position and length are in scene units, angle in radians, frequency in radians per scene unit.
    `minimum` is excluded when `positive`. `start` is the value for a shape of size 1 at the origin: a
    position or length is multiplied by the size where the shape is placed, a frequency divided by it.
    """

    name: str
    unit: Unit
    start: tuple[float, ...]
    minimum: float = -LARGEST
    maximum: float = LARGEST
    positive: bool = False

    @property
    def type(self) -> Type:
        return VEC2 if len(self.start) == 2 else FLOAT


@dataclass(frozen=True)
class Kind:
    """A kind of shape.

    `distance(p, *parameters)` is the signed distance, negative inside. `exact` says whether it is the true
    Euclidean distance everywhere. `slope(*parameters)` bounds how fast it changes, which is 1 for a distance.
    `extent(margin, *parameters)` is a box (low x, low y, high x, high y)
    that holds every point with distance ≤ margin, for margin ≥ 0. `outline(offset, *parameters)` is the
    contour at `distance = offset`, where it has a simple form. `area(*parameters)` is what it covers when sharp,
    and `thickness(*parameters)` its least width; both may be those of a simpler shape near it.
    """

    name: str
    parameters: tuple[Parameter, ...]
    distance: Callable[..., Expr]
    extent: Callable[..., Expr]
    area: Callable[..., Expr]
    thickness: Callable[..., Expr]
    exact: bool
    outline: Callable[..., Outline] | None = None
    slope: Callable[..., Expr] = lambda *parameters: const(1.0)

    def variables(self, suffix: str = "") -> tuple[Expr, ...]:
        """One variable for each parameter."""
        return tuple(var(parameter.name + suffix, parameter.type) for parameter in self.parameters)

    def scalars(self, suffix: str = "") -> tuple[Expr, ...]:
        """The float variables behind `variables`, in the order of a flat parameter row."""
        return tuple(scalar for variable in self.variables(suffix) for scalar in components_of(variable))


def _position(name: str, start: Point = (0.0, 0.0)) -> Parameter:
    return Parameter(name, "position", start)


def _size(name: str, *start: float) -> Parameter:
    return Parameter(name, "length", start, minimum=0.0, positive=True)


def _angle(name: str) -> Parameter:
    return Parameter(name, "angle", (0.0,), minimum=-1000.0, maximum=1000.0)


# --- helpers ------------------------------------------------------------------------------------------------


@function("rotate", p=VEC2, axis=VEC2)
def rotate(p: Expr, axis: Expr) -> Expr:
    """p in the frame whose x axis points along axis (cosine, sine)."""
    return vec2(p.x * axis.x + p.y * axis.y, p.y * axis.x - p.x * axis.y)


def _axis(angle: Expr) -> Expr:
    return vec2(cos(angle), sin(angle))


def _cross(a: Expr, b: Expr) -> Expr:
    return a.x * b.y - a.y * b.x


def _smaller_component(v: Expr) -> Expr:
    return minimum(v.x, v.y)


def _box_around(center: Expr, half: Expr) -> Expr:
    return vec4(center - half, center + half)


# --- circle -------------------------------------------------------------------------------------------------


@function("sdCircle", p=VEC2, radius=FLOAT)
def sd_circle(p: Expr, radius: Expr) -> Expr:
    """Exact distance to a circle."""
    return length(p) - radius


def _circle_distance(p: Expr, center: Expr, radius: Expr) -> Expr:
    return sd_circle(p - center, radius)


def _circle_extent(margin: Expr, center: Expr, radius: Expr) -> Expr:
    return _box_around(center, vec2(radius + margin))


def _circle_area(center: Expr, radius: Expr) -> Expr:
    return math.pi * radius * radius


def _circle_thickness(center: Expr, radius: Expr) -> Expr:
    return 2.0 * radius


def _circle_outline(offset: float, center: Point, radius: float) -> Outline:
    return EllipseOutline(center, (radius + offset, radius + offset))


# --- ellipse ------------------------------------------------------------------------------------------------


@function("sdEllipse", p=VEC2, radii=VEC2)
def sd_ellipse(p: Expr, radii: Expr) -> Expr:
    """Field of a scaled circle: 0 on the ellipse, exact along the shorter axis, too small elsewhere."""
    r = let("r", maximum(radii, SMALLEST))
    return (length(p / r) - 1.0) * _smaller_component(r)


def _ellipse_distance(p: Expr, center: Expr, radii: Expr, angle: Expr) -> Expr:
    return sd_ellipse(rotate(p - center, _axis(angle)), radii)


def _ellipse_extent(margin: Expr, center: Expr, radii: Expr, angle: Expr) -> Expr:
    r = maximum(radii, SMALLEST)
    grown = r + r * (margin / _smaller_component(r))
    along, across = _axis(angle) * grown.x, _axis(angle) * grown.y
    half = vec2(length(vec2(along.x, across.y)), length(vec2(along.y, across.x)))
    return _box_around(center, half)


def _ellipse_area(center: Expr, radii: Expr, angle: Expr) -> Expr:
    return math.pi * radii.x * radii.y


def _ellipse_thickness(center: Expr, radii: Expr, angle: Expr) -> Expr:
    return 2.0 * _smaller_component(radii)


def _ellipse_outline(offset: float, center: Point, radii: Point, angle: float) -> Outline:
    grown = 1.0 + offset / min(radii)
    return EllipseOutline(center, (radii[0] * grown, radii[1] * grown), angle)


# --- box ----------------------------------------------------------------------------------------------------


@function("sdBox", p=VEC2, half_size=VEC2, corner_radius=FLOAT)
def sd_box(p: Expr, half_size: Expr, corner_radius: Expr) -> Expr:
    """Exact distance to a box whose corners are rounded within half_size."""
    r = let("r", minimum(corner_radius, _smaller_component(half_size)))
    q = let("q", absolute(p) - half_size + r)
    return length(maximum(q, 0.0)) + minimum(maximum(q.x, q.y), 0.0) - r


def _box_distance(p: Expr, center: Expr, half_size: Expr, angle: Expr, corner_radius: Expr) -> Expr:
    return sd_box(rotate(p - center, _axis(angle)), half_size, corner_radius)


def _box_extent(margin: Expr, center: Expr, half_size: Expr, angle: Expr, corner_radius: Expr) -> Expr:
    r = minimum(corner_radius, _smaller_component(half_size))
    core = half_size - r
    turned = absolute(_axis(angle))
    half = vec2(turned.x * core.x + turned.y * core.y, turned.y * core.x + turned.x * core.y)
    return _box_around(center, half + (r + margin))


def _box_area(center: Expr, half_size: Expr, angle: Expr, corner_radius: Expr) -> Expr:
    r = minimum(corner_radius, _smaller_component(half_size))
    return 4.0 * half_size.x * half_size.y - (4.0 - math.pi) * r * r


def _box_thickness(center: Expr, half_size: Expr, angle: Expr, corner_radius: Expr) -> Expr:
    return 2.0 * _smaller_component(half_size)


def _box_outline(
    offset: float, center: Point, half_size: Point, angle: float, corner_radius: float
) -> Outline:
    radius = max(min(corner_radius, *half_size) + offset, 0.0)
    return RectangleOutline(center, (half_size[0] + offset, half_size[1] + offset), angle, radius)


# --- triangle -----------------------------------------------------------------------------------------------


def _side(start: Expr, edge: Expr, turn: Expr) -> Expr:
    """Squared distance to an edge, and a number that is positive on the inner side of its line."""
    # moving along the edge does not change the smallest distance, so `along` counts as constant
    along = fixed(clamp(dot(start, edge) / maximum(dot(edge, edge), TINY), 0.0, 1.0))
    q = start - edge * along
    return vec2(dot(q, q), turn * _cross(start, edge))


@function("sdTriangle", p=VEC2, a=VEC2, b=VEC2, c=VEC2)
def sd_triangle(p: Expr, a: Expr, b: Expr, c: Expr) -> Expr:
    """Exact distance to a triangle (after Inigo Quilez, "2D distance functions")."""
    ab, bc, ca = let("ab", b - a), let("bc", c - b), let("ca", a - c)
    ap, bp, cp = let("ap", p - a), let("bp", p - b), let("cp", p - c)
    turn = let("turn", select(_cross(ab, ca) < 0.0, -1.0, 1.0))
    sides = [let(f"side_{i}", _side(*ends, turn)) for i, ends in enumerate(((ap, ab), (bp, bc), (cp, ca)), 1)]
    nearest = let("nearest", minimum(minimum(sides[0], sides[1]), sides[2]))
    return sqrt(nearest.x) * select(nearest.y > 0.0, -1.0, 1.0)


def _triangle_extent(margin: Expr, a: Expr, b: Expr, c: Expr) -> Expr:
    low, high = minimum(minimum(a, b), c), maximum(maximum(a, b), c)
    return vec4(low - vec2(margin), high + vec2(margin))


def _triangle_area(a: Expr, b: Expr, c: Expr) -> Expr:
    return 0.5 * absolute(_cross(b - a, c - a))


def _triangle_thickness(a: Expr, b: Expr, c: Expr) -> Expr:
    """The smallest height."""
    longest = maximum(maximum(length(b - a), length(c - b)), length(a - c))
    return 2.0 * _triangle_area(a, b, c) / maximum(longest, SMALLEST)


def _triangle_outline(offset: float, a: Point, b: Point, c: Point) -> Outline:
    return PolygonOutline((a, b, c), offset)


# --- displaced circle ---------------------------------------------------------------------------------------


@function("sdDisplacedCircle", p=VEC2, radius=FLOAT, amplitude=FLOAT, frequency=VEC2)
def sd_displaced_circle(p: Expr, radius: Expr, amplitude: Expr, frequency: Expr) -> Expr:
    """Circle with its radius displaced by two sine waves; the slope is up to 1 + amplitude·frequency."""
    wave = sin(frequency.x * p.x) * sin(frequency.y * p.y)
    return length(p) - radius - amplitude * wave


def _displaced_distance(p: Expr, center: Expr, radius: Expr, amplitude: Expr, frequency: Expr) -> Expr:
    return sd_displaced_circle(p - center, radius, amplitude, frequency)


def _displaced_extent(margin: Expr, center: Expr, radius: Expr, amplitude: Expr, frequency: Expr) -> Expr:
    return _box_around(center, vec2(radius + absolute(amplitude) + margin))


def _displaced_area(center: Expr, radius: Expr, amplitude: Expr, frequency: Expr) -> Expr:
    return _circle_area(center, radius)


def _displaced_thickness(center: Expr, radius: Expr, amplitude: Expr, frequency: Expr) -> Expr:
    return _circle_thickness(center, radius)


def _displaced_slope(center: Expr, radius: Expr, amplitude: Expr, frequency: Expr) -> Expr:
    return 1.0 + absolute(amplitude) * length(frequency)


# --- the shapes ---------------------------------------------------------------------------------------------

KINDS: dict[str, Kind] = {
    kind.name: kind
    for kind in (
        Kind(
            "circle",
            (_position("center"), _size("radius", 1.0)),
            _circle_distance,
            _circle_extent,
            _circle_area,
            _circle_thickness,
            exact=True,
            outline=_circle_outline,
        ),
        Kind(
            "ellipse",
            (_position("center"), _size("radii", 1.25, 0.8), _angle("angle")),
            _ellipse_distance,
            _ellipse_extent,
            _ellipse_area,
            _ellipse_thickness,
            exact=False,
            outline=_ellipse_outline,
        ),
        Kind(
            "box",
            (
                _position("center"),
                _size("half_size", 1.0, 0.75),
                _angle("angle"),
                Parameter("corner_radius", "length", (0.1,), minimum=0.0),
            ),
            _box_distance,
            _box_extent,
            _box_area,
            _box_thickness,
            exact=True,
            outline=_box_outline,
        ),
        Kind(
            "triangle",
            (_position("a", (0.0, -1.4)), _position("b", (1.2, 0.7)), _position("c", (-1.2, 0.7))),
            sd_triangle,
            _triangle_extent,
            _triangle_area,
            _triangle_thickness,
            exact=True,
            outline=_triangle_outline,
        ),
        Kind(
            "displaced",
            (
                _position("center"),
                _size("radius", 1.0),
                Parameter("amplitude", "length", (0.2,), minimum=0.0),
                Parameter("frequency", "frequency", (1.5, 1.5), minimum=-1000.0, maximum=1000.0),
            ),
            _displaced_distance,
            _displaced_extent,
            _displaced_area,
            _displaced_thickness,
            exact=False,
            slope=_displaced_slope,
        ),
    )
}

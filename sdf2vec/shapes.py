"""Every shape: its signed distance, its parameters, its extent, its outline.

To add a shape, write its distance as an expression and add one entry to `KINDS`; the renderers, the gradients
and all exports follow. A point `p` and all lengths are in scene units (the picture's shortest side), y points
down, angles are in radians and turn clockwise on the screen.
"""

from __future__ import annotations

import math

from .blend import CUTOFF
from .expr import (
    Expr,
    absolute,
    clamp,
    cos,
    dot,
    exp,
    fixed,
    length,
    maximum,
    minimum,
    select,
    sin,
    sqrt,
    vec2,
    vec4,
)
from .function import function, let
from .kind import SMALLEST, Frame, Kind, Patch, rotate
from .operation import FLOAT, VEC2
from .outlines import ArcOutline, EllipseOutline, Outline, Point, PolygonOutline, RectangleOutline
from .units import ANGLE, FREQUENCY, LENGTH, OFFSET, POSITION, Parameter

PATCH_REACH = math.sqrt(
    2.0 * math.log(1.0 / CUTOFF)
)  # standard deviations from which on a Gaussian counts as 0
PIXEL_VARIANCE = 1.0 / 12.0  # of a box of one pixel
TINY = 1e-20  # the same for squared lengths


def _position(name: str, start: Point = (0.0, 0.0)) -> Parameter:
    return Parameter(name, POSITION, start)


def _size(name: str, *start: float) -> Parameter:
    return Parameter(name, LENGTH, start, positive=True)


def _angle(name: str) -> Parameter:
    return Parameter(name, ANGLE)


# --- helpers ------------------------------------------------------------------------------------------------


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


def _turned_frame(center: Expr, half: Expr, angle: Expr, *rest: Expr) -> Frame:
    return Frame(center, _axis(angle), half)


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


@function("sdSide", start=VEC2, edge=VEC2, turn=FLOAT)
def sd_side(start: Expr, edge: Expr, turn: Expr) -> Expr:
    """Squared distance to an edge, and a number that is positive on the inner side of its line."""
    # moving along the edge does not change the smallest distance, so `along` counts as constant
    along = fixed(clamp(dot(start, edge) / maximum(dot(edge, edge), TINY), 0.0, 1.0))
    q = let("q", start - edge * along)
    return vec2(dot(q, q), turn * _cross(start, edge))


@function("sdTriangle", p=VEC2, a=VEC2, b=VEC2, c=VEC2)
def sd_triangle(p: Expr, a: Expr, b: Expr, c: Expr) -> Expr:
    """Exact distance to a triangle (after Inigo Quilez, "2D distance functions")."""
    ab, bc, ca = let("ab", b - a), c - b, let("ca", a - c)
    turn = let("turn", select(_cross(ab, ca) < 0.0, -1.0, 1.0))
    sides = [sd_side(p - start, edge, turn) for start, edge in ((a, ab), (b, bc), (c, ca))]
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


# --- arc ----------------------------------------------------------------------------------------------------


def _along(chord: Expr, across: Expr) -> Expr:
    """The direction of a chord of some length; to the right where it has none."""
    return select(across < SMALLEST, vec2(1.0, 0.0), chord / maximum(across, SMALLEST))


@function("sdArc", p=VEC2, a=VEC2, b=VEC2, sagitta=FLOAT, half_width=FLOAT)
def sd_arc(p: Expr, a: Expr, b: Expr, sagitta: Expr, half_width: Expr) -> Expr:
    """Exact distance to a round pen's arc of a circle from a to b; a line without sagitta (after Inigo Quilez)."""
    # the distance to the circle (Inigo Quilez, "2D distance functions") times that to its middle plus its radius, over
    # the same: nothing is infinite where it is flat
    chord = let("chord", b - a)
    across = let("across", length(chord))
    q = let("q", rotate(p - (a + b) * 0.5, _along(chord, across)))
    c = let("c", 0.5 * across)
    squares = let("squares", c * c + sagitta * sagitta)
    bend = let("bend", 2.0 * sagitta / maximum(squares, TINY))
    top = let("top", vec2(q.x, q.y - sagitta))
    to_circle = (bend * dot(top, top) + 2.0 * top.y) / (1.0 + length(vec2(bend * top.x, bend * top.y + 1.0)))
    end = let("end", vec2(absolute(q.x) - c, q.y))
    beyond = end.x * (c * c - sagitta * sagitta) - end.y * (2.0 * c * sagitta)
    # where both ends are one, all of the circle is there; where that is none, too, the ends alone
    return select(beyond < SMALLEST * squares, absolute(to_circle), length(end)) - half_width


def _arc_top(a: Expr, b: Expr, sagitta: Expr) -> tuple[Expr, Expr]:
    """The middle of an arc, and the direction from its circle's middle to it."""
    along = _along(b - a, length(b - a))
    out = vec2(-along.y, along.x)
    return (a + b) * 0.5 + out * sagitta, out * select(sagitta < 0.0, -1.0, 1.0)


def _arc_extent(margin: Expr, a: Expr, b: Expr, sagitta: Expr, half_width: Expr) -> Expr:
    """Around both ends, and where the circle reaches farthest up, down or to a side, if that is within the arc."""
    top, out = _arc_top(a, b, sagitta)
    c, rise = 0.5 * length(b - a), absolute(sagitta)
    squares = c * c + rise * rise
    radius = squares / maximum(2.0 * rise, TINY)

    def reach(first: Expr, last: Expr, middle: Expr, out: Expr) -> Expr:
        farthest = middle + minimum(radius * (1.0 - out), rise)
        ends = maximum(first, last)
        return select(out * squares < c * c - rise * rise, ends, maximum(ends, farthest))

    grown = half_width + margin
    right, left = reach(a.x, b.x, top.x, out.x), -reach(-a.x, -b.x, -top.x, -out.x)
    below, above = reach(a.y, b.y, top.y, out.y), -reach(-a.y, -b.y, -top.y, -out.y)
    return vec4(left - grown, above - grown, right + grown, below + grown)


def _arc_area(a: Expr, b: Expr, sagitta: Expr, half_width: Expr) -> Expr:
    """That of a pen along a parabola of so many lengths (Huygens), about: of a whole circle 0.74 times as many."""
    chord = b - a
    along = sqrt(dot(chord, chord) + (16.0 / 3.0) * sagitta * sagitta)
    return half_width * (2.0 * along + math.pi * half_width)


def _arc_thickness(a: Expr, b: Expr, sagitta: Expr, half_width: Expr) -> Expr:
    return 2.0 * half_width


def _arc_frame(a: Expr, b: Expr, sagitta: Expr, half_width: Expr) -> Frame:
    """Along the chord, around the arc unless it is more than half a circle."""
    across = length(b - a)
    along = _along(b - a, across)
    top, _ = _arc_top(a, b, sagitta)
    return Frame((top + (a + b) * 0.5) * 0.5, along, vec2(0.5 * across, 0.5 * absolute(sagitta)) + half_width)


def _arc_outline(offset: float, a: Point, b: Point, sagitta: float, half_width: float) -> Outline:
    return ArcOutline(a, b, sagitta, half_width + offset)


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


# --- patches: coverage of their own ---------------------------------------------------------------------------


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
    return gaussian_cover(rotate(p - center, _axis(angle)), radii, pixel)


def _gabor_cover(
    p: Expr, pixel: Expr, center: Expr, radii: Expr, angle: Expr, frequency: Expr, phase: Expr
) -> Expr:
    return gabor_cover(rotate(p - center, _axis(angle)), radii, frequency, phase, pixel)


def _patch_reach(pixel: Expr, center: Expr, radii: Expr, *rest: Expr) -> Expr:
    shortest = maximum(_smaller_component(radii), SMALLEST)
    return PATCH_REACH * sqrt(shortest * shortest + pixel * pixel * PIXEL_VARIANCE) - shortest


def _patch_distance(p: Expr, center: Expr, radii: Expr, angle: Expr, *wave: Expr) -> Expr:
    return _ellipse_distance(p, center, radii, angle)


def _patch_extent(margin: Expr, center: Expr, radii: Expr, angle: Expr, *wave: Expr) -> Expr:
    return _ellipse_extent(margin, center, radii, angle)


def _patch_area(center: Expr, radii: Expr, *rest: Expr) -> Expr:
    return math.tau * radii.x * radii.y


def _patch_thickness(center: Expr, radii: Expr, *rest: Expr) -> Expr:
    return 2.0 * _smaller_component(radii)


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
            own_frame=_turned_frame,
        ),
        Kind(
            "box",
            (
                _position("center"),
                _size("half_size", 1.0, 0.75),
                _angle("angle"),
                Parameter("corner_radius", LENGTH, (0.1,)),
            ),
            _box_distance,
            _box_extent,
            _box_area,
            _box_thickness,
            exact=True,
            outline=_box_outline,
            at_most=(("corner_radius", "half_size"),),
            own_frame=_turned_frame,
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
            "arc",
            (
                _position("a", (-1.2, 0.4)),
                _position("b", (1.2, 0.4)),
                Parameter("sagitta", OFFSET, (-0.8,)),
                _size("half_width", 0.3),
            ),
            sd_arc,
            _arc_extent,
            _arc_area,
            _arc_thickness,
            exact=True,
            outline=_arc_outline,
            own_frame=_arc_frame,
        ),
        Kind(
            "displaced",
            (
                _position("center"),
                _size("radius", 1.0),
                Parameter("amplitude", LENGTH, (0.2,)),
                Parameter("frequency", FREQUENCY, (1.5, 1.5)),
            ),
            _displaced_distance,
            _displaced_extent,
            _displaced_area,
            _displaced_thickness,
            exact=False,
            slope=_displaced_slope,
        ),
        Kind(
            "gaussian",
            (_position("center"), _size("radii", 0.8, 0.5), _angle("angle")),
            _patch_distance,
            _patch_extent,
            _patch_area,
            _patch_thickness,
            exact=False,
            own_frame=_turned_frame,
            patch=Patch(_gaussian_cover, _patch_reach, radial=True),
        ),
        Kind(
            "gabor",
            (
                _position("center"),
                _size("radii", 0.8, 0.8),
                _angle("angle"),
                Parameter("frequency", FREQUENCY, (2.0,)),
                Parameter("phase", ANGLE),
            ),
            _patch_distance,
            _patch_extent,
            _patch_area,
            _patch_thickness,
            exact=False,
            own_frame=_turned_frame,
            patch=Patch(_gabor_cover, _patch_reach, signed=True),
        ),
    )
}

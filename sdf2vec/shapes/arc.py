"""Lines and arcs of circles that a round pen draws."""

from __future__ import annotations

import math

from ..expr import Expr, absolute, dot, length, maximum, minimum, select, sqrt, vec2, vec4
from ..function import function, let
from ..kind import SMALLEST, Frame, Kind, rotate
from ..operation import FLOAT, VEC2
from ..outlines import ArcOutline, Outline, Point
from ..units import OFFSET, Parameter
from .common import TINY, position, size


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


ARC = Kind(
    "arc",
    (
        position("a", (-1.2, 0.4)),
        position("b", (1.2, 0.4)),
        Parameter("sagitta", OFFSET, (-0.8,)),
        size("half_width", 0.3),
    ),
    sd_arc,
    _arc_extent,
    _arc_area,
    _arc_thickness,
    exact=True,
    outline=_arc_outline,
    own_frame=_arc_frame,
)

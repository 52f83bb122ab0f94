"""Coverage said exactly by gradients: ellipses by one, polygons by slices that do not overlap.

A slice beyond a side is painted by a linear gradient across it, one beyond a corner by a radial gradient about
it: just how the distance grows. Slices meet at shared points and are drawn without antialiasing, so that every
pixel belongs to exactly one of them: no seams, and no need for masks where they are translucent.

Opacity is given to each slice: as a group's, browsers would round half a level down at every layer, as the paint's,
resvg half a level up. Each gradient has stops of its own: CairoSVG takes quadratic time to follow references from one
gradient to another.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ...blend import REACH
from ...scene import Color
from ...shapes import EllipseOutline
from .canvas import Canvas, Document, Points, color_text, number, opacity_text, tag, url
from .gradient_stops import SOFT, edge_stops, stop_elements
from .outlines import convex, sides, turn

LIFT = -0.3  # 8-bit levels: resvg and Firefox gain half a level at a gradient, the others nothing
WIDEST = math.radians(60.0)  # of a circular sector drawn as a triangle


@dataclass(frozen=True)
class Paint:
    """What an element is painted with: colour, opacity, a falloff in user units."""

    color: Color
    opacity: float
    falloff: float
    stops: int = 12


def ellipse(outline: EllipseOutline, paint: Paint, document: Document, name: str | None) -> str:
    """An ellipse as large as its coverage reaches; `outline` is where the distance is 0."""
    canvas = document.canvas
    shortest = min(outline.radii) * canvas.unit / paint.falloff  # in falloffs
    grown = 1.0 + SOFT / shortest
    ((x, y),) = canvas.places(outline.center).tolist()
    rx, ry = (radius * canvas.unit * grown for radius in outline.radii)
    start = max(-shortest, 0.5 - REACH)
    offsets = [((1.0 + d / shortest) / grown, c) for d, c in edge_stops(start, paint.stops)]
    stops = stop_elements(offsets, color_text(paint.color, LIFT))
    look = {"opacity": opacity_text(paint.opacity)}
    place = {"cx": canvas.number(x), "cy": canvas.number(y)}
    if canvas.number(rx) == canvas.number(ry):
        gradient = document.define("soft", "radialGradient", *stops)
        return tag("circle", id=name, **place, r=canvas.number(rx), fill=url(gradient), **look)
    # In user units, for librsvg mistakes gradients that are stretched with a turned element's box.
    squeeze = f"translate({place['cx']} {place['cy']})scale(1 {number(ry / rx, 5)})"
    own = {"gradientUnits": "userSpaceOnUse", "cx": "0", "cy": "0", "gradientTransform": squeeze}
    gradient = document.define("soft", "radialGradient", *stops, r=canvas.number(rx), **own)
    radii = {"rx": canvas.number(rx), "ry": canvas.number(ry)}
    turned = turn(outline.angle, x, y, canvas)
    return tag("ellipse", id=name, **place, **radii, transform=turned, fill=url(gradient), **look)


def sliced(points: Points, rounding: float, paint: Paint, document: Document, name: str | None) -> str:
    """A group of slices for a convex polygon [N, 2], rounded by `rounding`; all in user units."""
    canvas = document.canvas
    corners = canvas.rounded(convex(points))
    corners = convex(corners)
    reach = rounding + SOFT * paint.falloff
    stops = stop_elements(_offsets(rounding, reach, paint), color_text(paint.color, LIFT))
    opacity = opacity_text(paint.opacity)
    parts = []
    outer = [canvas.rounded(np.stack([a, b]) + normal * reach) for a, b, normal in sides(corners)]
    for index, (a, b, normal) in enumerate(sides(corners)):
        inner = np.roll(corners, -index - 1, axis=0) if index == 0 else np.stack([b, a])
        slope = _linear(a, b, normal * reach, stops, document)
        parts.append(_slice(np.concatenate([outer[index], inner]), slope, opacity, canvas))
    radial = [_radial(corner, reach, stops, document) for corner in corners]
    for index, corner in enumerate(corners):
        if len(corners) > 1:
            start, end = outer[index - 1][1], outer[index][0]
        else:
            start = end = corner + np.array([reach, 0.0])
        parts += [
            _slice(p, radial[index], opacity, canvas) for p in _sectors(corner, start, end, reach, canvas)
        ]
    return tag("g", *parts, id=name, shape_rendering="crispEdges")


def _offsets(rounding: float, reach: float, paint: Paint) -> list[tuple[float, float]]:
    """Offset and coverage of stops from the polygon's side to where coverage ends."""
    start = max(-rounding / paint.falloff, 0.5 - REACH) if rounding > 0 else 0.0
    pairs = edge_stops(start, paint.stops)
    return [((d * paint.falloff + rounding) / reach, c) for d, c in pairs]


def _slice(points: Points, gradient: str, opacity: str | None, canvas: Canvas) -> str:
    return tag("path", d=canvas.polygon_path(points), fill=url(gradient), opacity=opacity)


def _linear(a: Points, b: Points, across: Points, stops: list[str], document: Document) -> str:
    """A gradient across a side; it starts near the middle, where an error of its direction matters least."""
    canvas = document.canvas
    x1, y1 = ((a + b) / 2).tolist()
    x2, y2 = ((a + b) / 2 + across).tolist()
    ends = {name: canvas.fine(v) for name, v in (("x1", x1), ("y1", y1), ("x2", x2), ("y2", y2))}
    return document.define("side", "linearGradient", *stops, gradientUnits="userSpaceOnUse", **ends)


def _radial(center: Points, radius: float, stops: list[str], document: Document) -> str:
    canvas = document.canvas
    x, y = center.tolist()
    place = {"cx": canvas.number(x), "cy": canvas.number(y), "r": canvas.number(radius)}
    return document.define("corner", "radialGradient", *stops, gradientUnits="userSpaceOnUse", **place)


def _sectors(center: Points, start: Points, end: Points, reach: float, canvas: Canvas) -> list[Points]:
    """A polygon [M, 2] that holds the circular sector from `start` clockwise on the screen to `end`."""
    first = math.atan2(start[1] - center[1], start[0] - center[0])
    last = math.atan2(end[1] - center[1], end[0] - center[0])
    sweep = (last - first) % math.tau or (math.tau if np.array_equal(start, end) else 0.0)
    if sweep > math.radians(359.5) and not np.array_equal(start, end):
        return []  # rounding turned a sector without width inside out
    count = max(1, math.ceil(sweep / WIDEST))
    half = sweep / count / 2
    angles = first + half * (2 * np.arange(count) + 1)
    tips = center + reach / math.cos(half) * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    return [np.concatenate([center[None], start[None], canvas.rounded(tips), end[None]])]

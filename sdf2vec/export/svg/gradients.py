"""Coverage said exactly by gradients: ellipses by one, polygons by slices that do not overlap.

A slice beyond a side is painted by a linear gradient across it, one beyond a corner by a radial gradient about
it: just how the distance grows. Slices meet at shared points and are drawn without antialiasing, so that every
pixel belongs to exactly one of them: no seams, and no need for masks where they are translucent.

Opacity is given to each slice: as a group's, browsers would round half a level down at every layer.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ...outlines import EllipseOutline, PolygonOutline
from ...scene import Color, Layer
from .canvas import Canvas, Points, pairs
from .display import Figure, Fill, Group, LinearGradient, RadialGradient, Stop, moved
from .gradient_stops import edge_stops
from .outlines import convex, sides
from .sampling import cover_at, edge_range, extent, frame_of

LIFT = -0.3  # 8-bit levels: resvg and Firefox gain half a level at a gradient, the others nothing
RADIAL_STOPS = 24  # of a patch
WIDEST = math.radians(60.0)  # of a circular sector drawn as a triangle


@dataclass(frozen=True)
class SoftEdge:
    """What a soft shape is painted with: colour, opacity, the falloff in user units, how many stops."""

    color: Color
    opacity: float
    falloff: float
    count: int = 12

    def stops(self, inner: float, size: float) -> tuple[Stop, ...]:
        """Stops from `inner` falloffs from the edge, at an offset of its share of `size` falloffs, to the end."""
        curve = edge_stops(max(-inner, edge_range()[0]), self.count)
        color = moved(self.color, LIFT)
        return tuple(Stop((inner + distance) / size, color, cover) for distance, cover in curve)


def ellipse(outline: EllipseOutline, edge: SoftEdge, canvas: Canvas) -> Figure:
    """An ellipse as large as its coverage reaches; `outline`, in scene units, is where the distance is 0."""
    across, down = (radius * canvas.unit for radius in outline.radii)
    shortest = min(across, down) / edge.falloff  # in falloffs
    grown = 1.0 + edge_range()[1] / shortest
    center, radii = canvas.place(outline.center), (across * grown, down * grown)
    stops = edge.stops(shortest, shortest + edge_range()[1])
    gradient = RadialGradient(center, radii, stops, outline.angle)
    return Figure(EllipseOutline(center, radii, outline.angle), gradient, edge.opacity)


def radial(layer: Layer, color: Color, canvas: Canvas) -> Figure:
    """A patch whose coverage falls with the distance from the middle of its frame, as far as it reaches."""
    frame, box = frame_of(layer.shapes[0]), extent(layer)
    half = np.maximum(frame.half, 1.0 / canvas.unit)
    reach = max(box.right - box.left, box.bottom - box.top) / 2 / float(half.max())
    offsets = np.linspace(0.0, 1.0, RADIAL_STOPS)
    places = frame.origin + np.outer(offsets * reach * half[0], frame.axis)
    found = cover_at(layer, places, 1.0 / canvas.unit)
    stops = tuple(
        Stop(o, moved(color, LIFT), c) for o, c in zip(offsets.tolist(), found.tolist(), strict=True)
    )
    angle = math.atan2(frame.axis[1], frame.axis[0])
    (center,) = pairs(canvas.places(frame.origin))
    across, down = (half * reach * canvas.unit).tolist()
    return Figure(
        EllipseOutline(center, (across, down), angle),
        RadialGradient(center, (across, down), stops, angle),
        layer.opacity,
    )


def sliced(points: Points, rounding: float, edge: SoftEdge, canvas: Canvas) -> Group:
    """A group of slices for a convex polygon [N, 2], rounded by `rounding`; all in user units."""
    corners = convex(canvas.rounded(convex(points)))
    reach = rounding + edge_range()[1] * edge.falloff
    stops = edge.stops(rounding / edge.falloff, reach / edge.falloff)
    parts = []
    outer = [canvas.rounded(np.stack([a, b]) + normal * reach) for a, b, normal in sides(corners)]
    for index, (a, b, normal) in enumerate(sides(corners)):
        inner = np.roll(corners, -index - 1, axis=0) if index == 0 else np.stack([b, a])
        # The gradient starts near the middle, where an error of its direction matters least.
        start, end = pairs(np.stack([(a + b) / 2, (a + b) / 2 + normal * reach]))
        parts.append(_slice(np.concatenate([outer[index], inner]), LinearGradient(start, end, stops), edge))
    for index, corner in enumerate(corners):
        if len(corners) > 1:
            first, last = outer[index - 1][1], outer[index][0]
        else:
            first = last = corner + np.array([reach, 0.0])
        radial = RadialGradient(pairs(corner[None])[0], (reach, reach), stops)
        sector = _sector(corner, first, last, reach, canvas)
        parts += [_slice(sector, radial, edge)] if len(sector) else []
    return Group(tuple(parts))


def _slice(points: Points, fill: Fill, edge: SoftEdge) -> Figure:
    return Figure(PolygonOutline(pairs(points), 0.0), fill, edge.opacity, antialiased=False)


def _sector(center: Points, start: Points, end: Points, reach: float, canvas: Canvas) -> Points:
    """A polygon [M, 2] that holds the circular sector from `start` clockwise on the screen to `end`."""
    first = math.atan2(start[1] - center[1], start[0] - center[0])
    last = math.atan2(end[1] - center[1], end[0] - center[0])
    sweep = (last - first) % math.tau or (math.tau if np.array_equal(start, end) else 0.0)
    if sweep > math.radians(359.5) and not np.array_equal(start, end):
        return np.zeros((0, 2))  # rounding turned a sector without width inside out
    count = max(1, math.ceil(sweep / WIDEST))
    half = sweep / count / 2
    angles = first + half * (2 * np.arange(count) + 1)
    tips = center + reach / math.cos(half) * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    return np.concatenate([center[None], start[None], canvas.rounded(tips), end[None]])

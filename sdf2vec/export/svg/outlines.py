"""Outlines as SVG elements, as polygons, and as distance fields."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import singledispatch

import numpy as np

from ...shapes import EllipseOutline, Outline, PolygonOutline, RectangleOutline
from .bezier_fit import path_data
from .canvas import Canvas, Points, tag
from .sampling import Array, Grid

FLAT = 1e-9  # scene units: a side shorter than this is none
LONGEST_MITRE = 4.0  # in lengths that the sides are moved by
TOLERANCE = 0.05  # user units that a traced contour may be off


@dataclass(frozen=True, eq=False)
class Traced:
    """Closed contours [M, 2] in scene units, holes among them; `tolerance` in user units."""

    contours: tuple[Points, ...]
    tolerance: float = TOLERANCE


# --- elements ----------------------------------------------------------------------------------------------


@singledispatch
def element(outline: Outline | Traced, canvas: Canvas, **paint: str | None) -> str:
    """The outline as one element."""
    raise NotImplementedError(type(outline))


@element.register
def _(outline: EllipseOutline, canvas: Canvas, **paint: str | None) -> str:
    ((x, y),) = canvas.places(outline.center).tolist()
    rx, ry = (canvas.number(r * canvas.unit) for r in outline.radii)
    center = {"cx": canvas.number(x), "cy": canvas.number(y)}
    if rx == ry:
        return tag("circle", **center, r=rx, **paint)
    return tag("ellipse", **center, rx=rx, ry=ry, transform=turn(outline.angle, x, y, canvas), **paint)


@element.register
def _(outline: RectangleOutline, canvas: Canvas, **paint: str | None) -> str:
    ((x, y),) = canvas.places(outline.center).tolist()
    half = np.array(outline.half_size) * canvas.unit
    radius = canvas.number(outline.corner_radius * canvas.unit)
    place = {
        "x": canvas.number(x - half[0]),
        "y": canvas.number(y - half[1]),
        "width": canvas.number(2 * half[0]),
        "height": canvas.number(2 * half[1]),
        "rx": None if radius == "0" else radius,
    }
    return tag("rect", **place, transform=turn(outline.angle, x, y, canvas), **paint)


@element.register
def _(outline: PolygonOutline, canvas: Canvas, **paint: str | None) -> str:
    points = canvas.places(outline.points)
    if outline.rounding * canvas.unit < 0.05:
        return tag("polygon", points=canvas.joined(points), **paint)
    return tag("path", d=_rounded_path(points, outline.rounding * canvas.unit, canvas), **paint)


@element.register
def _(outline: Traced, canvas: Canvas, **paint: str | None) -> str:
    contours = [canvas.places(contour) for contour in outline.contours]
    return tag("path", d=path_data(contours, outline.tolerance, canvas), fill_rule="evenodd", **paint)


def turn(angle: float, x: float, y: float, canvas: Canvas) -> str | None:
    """A rotation about a point, None for none."""
    degrees = canvas.fine(math.degrees(angle) % 180.0)
    return None if degrees == "0" else f"rotate({degrees} {canvas.number(x)} {canvas.number(y)})"


def upright(outline: Outline | Traced) -> Outline | Traced:
    """The same without a turned element: librsvg blurs what is turned by other widths."""
    if isinstance(outline, RectangleOutline) and outline.angle:
        points, rounding = core(outline) or (np.zeros((1, 2)), 0.0)
        return PolygonOutline(tuple((x, y) for x, y in points.tolist()), rounding)
    return outline


def _rounded_path(points: Points, rounding: float, canvas: Canvas) -> str:
    """Straight edges moved outwards, joined by arcs."""
    corners = convex(points)
    moved = [(a + n * rounding, b + n * rounding) for a, b, n in sides(corners)] or [(points[0],) * 2]
    # Half a circle must not be flattened because its ends were rounded towards each other; too small a radius grows.
    radius = canvas.number(
        rounding if len(corners) > 2 else max(rounding - 10.0**-canvas.digits, 0.5 * rounding)
    )
    arc = f"A{radius} {radius} 0 0 1 "
    edges = [f"{canvas.joined(a[None])}L{canvas.joined(b[None])}" for a, b in moved]
    first = canvas.joined(moved[0][0][None])
    return "M" + arc.join(edges) + arc + first + "Z"


# --- convex polygons ---------------------------------------------------------------------------------------


def convex(points: Points) -> Points:
    """The corners in the order in which the outward normal is (dy, −dx); the two ends of what has no area."""
    corners = np.array(list(dict.fromkeys(map(tuple, points.tolist()))))
    if len(corners) < 3:
        return corners
    nxt = np.roll(corners, -1, axis=0)
    area = 0.5 * float(np.sum(corners[:, 0] * nxt[:, 1] - nxt[:, 0] * corners[:, 1]))
    longest = float(np.linalg.norm(nxt - corners, axis=1).max())
    if abs(area) > 1e-3 * longest * min(longest, 1.0):
        return corners[::-1] if area < 0 else corners
    along = corners @ (corners[np.argmax(np.linalg.norm(corners - corners[0], axis=1))] - corners[0])
    return corners[[int(np.argmin(along)), int(np.argmax(along))]]


def sides(corners: Points) -> list[tuple[Points, Points, Points]]:
    """Start, end and outward normal of each side; none for a single point."""
    if len(corners) < 2:
        return []
    ends = np.roll(corners, -1, axis=0)
    edges = ends - corners
    lengths = np.maximum(np.linalg.norm(edges, axis=1, keepdims=True), FLAT)
    normals = np.stack([edges[:, 1], -edges[:, 0]], axis=1) / lengths
    return list(zip(corners, ends, normals, strict=True))


@singledispatch
def core(outline: Outline) -> tuple[Points, float] | None:
    """The convex polygon [N, 2] and the rounding around it that an outline is made of, if it is; scene units."""
    return None


@core.register
def _(outline: PolygonOutline) -> tuple[Points, float]:
    return np.array(outline.points, np.float64), outline.rounding


@core.register
def _(outline: RectangleOutline) -> tuple[Points, float]:
    half = np.maximum(np.array(outline.half_size) - outline.corner_radius, 0.0)
    corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * half
    cosine, sine = math.cos(outline.angle), math.sin(outline.angle)
    turned = corners @ np.array([[cosine, sine], [-sine, cosine]])
    return turned + np.array(outline.center), outline.corner_radius


# --- corners less round ------------------------------------------------------------------------------------


@singledispatch
def sharpened(outline: Outline, share: float) -> Outline:
    """The same sides, with corners of that share of the radius."""
    raise NotImplementedError(type(outline))


@sharpened.register
def _(outline: RectangleOutline, share: float) -> Outline:
    return replace(outline, corner_radius=outline.corner_radius * share)


@sharpened.register
def _(outline: PolygonOutline, share: float) -> Outline:
    moved = outline.rounding * (1.0 - share)
    corners = convex(np.array(outline.points, np.float64))
    if len(corners) < 3:
        return outline
    normals = np.array([normal for *_, normal in sides(corners)])
    before = np.roll(normals, 1, axis=0)
    mitres = (normals + before) / np.maximum(1.0 + np.sum(normals * before, axis=1, keepdims=True), 1e-6)
    lengths = np.linalg.norm(mitres, axis=1, keepdims=True)
    mitres *= np.minimum(1.0, LONGEST_MITRE / np.maximum(lengths, FLAT))
    points = (corners + moved * mitres).tolist()
    return PolygonOutline(tuple((x, y) for x, y in points), outline.rounding * share)


def distance_to(outline: Outline | Traced, grid: Grid) -> Array:
    """Signed distances [Y, X] to an outline made of a convex polygon."""
    made = None if isinstance(outline, Traced) else core(outline)
    assert made is not None
    points, rounding = made
    x, y = grid.x[None, :], grid.y[:, None]
    corners = convex(points)
    if len(corners) == 1:
        return np.asarray(np.hypot(x - corners[0, 0], y - corners[0, 1])) - rounding
    nearest = np.full((len(grid.y), len(grid.x)), np.inf)
    inside = np.full(nearest.shape, len(corners) > 2)
    for a, b, normal in sides(corners):
        px, py = x - a[0], y - a[1]
        edge = b - a
        along = np.clip((px * edge[0] + py * edge[1]) / max(float(edge @ edge), FLAT**2), 0.0, 1.0)
        nearest = np.minimum(nearest, np.hypot(px - along * edge[0], py - along * edge[1]))
        inside &= px * normal[0] + py * normal[1] <= 0.0
    return np.asarray(np.where(inside, -nearest, nearest)) - rounding

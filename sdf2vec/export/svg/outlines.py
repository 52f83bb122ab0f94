"""Outlines in user units, as convex polygons with round corners, and as distances."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import singledispatch

import numpy as np

from ...arrays import Float64Array
from ...outlines import ArcOutline, EllipseOutline, Outline, PolygonOutline, RectangleOutline
from ...scene import Layer
from ...shapes import KINDS
from .bezier_fit import smooth_path
from .canvas import Canvas, Points, pairs
from .display import Geometry
from .sampling import SampleGrid

FLAT = 1e-9  # scene units: a side shorter than this is none
LONGEST_MITRE = 4.0  # in lengths that the sides are moved by
TOLERANCE = 0.05  # user units that a traced contour may be off


@dataclass(frozen=True, eq=False)
class Traced:
    """Closed contours [M, 2] in scene units, holes among them; `tolerance` in user units."""

    contours: tuple[Points, ...]
    tolerance: float = TOLERANCE


def edge_of(layer: Layer, falloffs: float) -> Outline | None:
    """The analytic contour of a single shape, so many falloffs outside; the one place that asks a kind for it."""
    outline_of = KINDS[layer.shapes[0].kind].outline
    if outline_of is None or len(layer.shapes) > 1:
        return None
    return outline_of(falloffs * layer.falloff, *layer.shapes[0].named().values())


@singledispatch
def placed(outline: Outline | Traced, canvas: Canvas) -> Geometry:
    """The outline in user units."""
    raise NotImplementedError(type(outline))


@placed.register
def _(outline: EllipseOutline, canvas: Canvas) -> Geometry:
    across, down = outline.radii
    return EllipseOutline(
        canvas.place(outline.center), (across * canvas.unit, down * canvas.unit), outline.angle
    )


@placed.register
def _(outline: RectangleOutline, canvas: Canvas) -> Geometry:
    across, down = outline.half_size
    half = (across * canvas.unit, down * canvas.unit)
    return RectangleOutline(
        canvas.place(outline.center), half, outline.angle, outline.corner_radius * canvas.unit
    )


@placed.register
def _(outline: PolygonOutline, canvas: Canvas) -> Geometry:
    return PolygonOutline(pairs(canvas.places(outline.points)), outline.rounding * canvas.unit)


@placed.register
def _(outline: ArcOutline, canvas: Canvas) -> Geometry:
    start, end = canvas.place(outline.start), canvas.place(outline.end)
    sagitta = outline.sagitta * canvas.unit
    is_line = abs(sagitta) < 0.5 * 10.0**-canvas.digits
    return ArcOutline(start, end, 0.0 if is_line else sagitta, outline.half_width * canvas.unit)


@placed.register
def _(outline: Traced, canvas: Canvas) -> Geometry:
    return smooth_path([canvas.places(contour) for contour in outline.contours], outline.tolerance, canvas)


def upright(outline: Outline | Traced) -> Outline | Traced:
    """The same without a turned element: librsvg blurs what is turned by other widths."""
    if isinstance(outline, RectangleOutline) and outline.angle:
        points, rounding = core(outline) or (np.zeros((1, 2)), 0.0)
        return PolygonOutline(pairs(points), rounding)
    return outline


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


@core.register
def _(outline: ArcOutline) -> tuple[Points, float] | None:
    return None if outline.sagitta else (np.array([outline.start, outline.end]), outline.half_width)


# --- corners less round ------------------------------------------------------------------------------------


@singledispatch
def sharpened(outline: Outline, share: float) -> Outline:
    """The same sides, with corners of that share of the radius."""
    raise NotImplementedError(type(outline))


@sharpened.register
def _(outline: RectangleOutline, share: float) -> Outline:
    return replace(outline, corner_radius=outline.corner_radius * share)


@sharpened.register
def _(outline: ArcOutline, share: float) -> Outline:
    return outline


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
    return PolygonOutline(pairs(corners + moved * mitres), outline.rounding * share)


def distance_to(outline: Outline | Traced, grid: SampleGrid) -> Float64Array:
    """Signed distances [Y, X] to an outline made of a convex polygon."""
    assert not isinstance(outline, Traced)
    return distance_at(outline, grid.x[None, :], grid.y[:, None])


def distance_at(outline: Outline, x: Float64Array, y: Float64Array) -> Float64Array:
    """The same at places x and y, which are broadcast against each other."""
    made = core(outline)
    assert made is not None
    points, rounding = made
    corners = convex(points)
    if len(corners) == 1:
        return np.asarray(np.hypot(x - corners[0, 0], y - corners[0, 1])) - rounding
    squared = np.full(np.broadcast_shapes(x.shape, y.shape), np.inf)
    inside = np.full(squared.shape, len(corners) > 2)
    for a, b, normal in sides(corners):
        px, py = x - a[0], y - a[1]
        edge = b - a
        along = np.clip((px * edge[0] + py * edge[1]) / max(float(edge @ edge), FLAT**2), 0.0, 1.0)
        to_side = np.square(px - along * edge[0]) + np.square(py - along * edge[1])
        squared = np.minimum(squared, to_side, out=squared)
        inside &= px * normal[0] + py * normal[1] <= 0.0
    nearest = np.sqrt(squared, out=squared)
    return np.asarray(np.where(inside, -nearest, nearest)) - rounding

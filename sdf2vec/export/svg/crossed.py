"""The outline of joined shapes: parts of their own outlines, as lines and arcs.

Each shape's outline is cut where another's crosses it. A part is kept where what lies beside it changes with the shape.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from functools import cache
from itertools import pairwise
from typing import cast

import numpy as np

from ...arrays import BoolArray, Float64Array
from ...blend import JOINS, SHARPEST
from ...expr import const, var, vec3, vec4
from ...lower.numpy import compile_numpy
from ...outlines import ArcOutline, EllipseOutline, Outline
from ...scene import Layer, Shape
from .canvas import Canvas, Points
from .display import Path
from .isobands import seen
from .outlines import convex, core, distance_at, edge_of, placed, sides
from .pieces import Piece, arc, contour, middle_line, radius_of
from .sampling import distance_of

MOST = 16  # shapes
SAMPLES = 96  # of a line or an arc, between which another outline crosses it once at most
HALVINGS = 40  # of what a crossing lies in
MEETS = 1e-3  # user units between two ends that are one
SHORTEST = 0.02  # user units of a part
FARTHEST = 3.0  # times as far off as in the mean may a point be: joins of little smoothness round corners off
TESTED = 24  # points of a line or an arc
LOOKED_AT, SURELY = 40, 0.5  # points along the sides of what is seen; user units from an edge where they tell


def crossed(layer: Layer, canvas: Canvas, off: float) -> Path | None:
    """The outline of a layer of several shapes, if it is made of theirs to within so many user units, in the mean of
    squares.
    """
    outlines = _outlines_of(layer) if 1 < len(layer.shapes) <= MOST else None
    if outlines is None:
        return None
    joins = [part.join for part in layer.structure]
    geometries = [cast("Outline", placed(outline, canvas)) for outline in outlines]
    kept = [piece for index in range(len(joins)) for piece in _kept(index, geometries, joins)]
    loops = _loops(kept)
    if not loops or not _is_outline(loops, layer, canvas, off):
        return None
    return Path(tuple(contour(loop, canvas.digits) for loop in loops))


def _outlines_of(layer: Layer) -> list[Outline] | None:
    """Those of its shapes where its coverage is one half: of what is cut out so much within its edge as that of others
    is outside. None where one has none.
    """
    found = []
    for shape, part in zip(layer.shapes, layer.structure, strict=True):
        alone = Layer((shape,), layer.falloff, layer.opacity)
        outline = edge_of(alone, -0.5 if _is_cut_out(part.join) else 0.5)
        if outline is None or not _has_area(outline):
            return None
        found.append(outline)
    return found


def _has_area(outline: Outline) -> bool:
    """Whether something is left of an outline that may have been moved inwards."""
    if isinstance(outline, EllipseOutline):
        return min(outline.radii) > 0
    made = core(outline)
    if made is None:
        return isinstance(outline, ArcOutline) and 0 < outline.half_width < radius_of(outline)
    return made[1] >= 0 and len(convex(made[0])) + (made[1] > 0) > 2


def _pieces(outline: Outline) -> list[Piece]:
    """An outline, clockwise on the screen."""
    made = core(outline)
    if made is None:
        if isinstance(outline, ArcOutline):
            return _around(outline)
        assert isinstance(outline, EllipseOutline)
        (across, down), angle = outline.radii, outline.angle
        if across < down:  # where it begins, its ends are farthest apart
            across, down, angle = down, across, angle + math.pi / 2
        return [arc(outline.center, (across, down), angle, 0.0, math.tau)]
    points, rounding = made
    corners = convex(points)
    found = []
    around = sides(corners)
    for (a, b, normal), (*_, following) in zip(around, [*around[1:], around[0]], strict=True):
        found.append(Piece(a + normal * rounding, b - a))
        first, last = (math.atan2(n[1], n[0]) for n in (normal, following))
        if rounding > 0:
            found.append(arc(b, (rounding, rounding), 0.0, first, (last - first) % math.tau))
    return found


def _around(outline: ArcOutline) -> list[Piece]:
    """The outline of what a pen draws along an arc, clockwise on the screen."""
    half, radius, line = outline.half_width, radius_of(outline), middle_line(outline)
    along = line if line.span > 0 else line.part(1.0, 0.0)
    first, last = along.first, along.first + along.span
    outer, inner = radius + half, radius - half
    return [
        arc(along.start, (outer, outer), 0.0, first, along.span),
        arc(along.end, (half, half), 0.0, last, math.pi),
        arc(along.start, (inner, inner), 0.0, last, -along.span),
        arc(along.begin, (half, half), 0.0, first + math.pi, math.pi),
    ]


def _depths(outline: Outline, points: Points) -> Float64Array:
    """Less than 0 within an outline, [N] for points [N, 2]."""
    if core(outline) is not None:
        return distance_at(outline, *points.T)
    if isinstance(outline, ArcOutline):
        numbers = (*outline.start, *outline.end, outline.sagitta, outline.half_width)
        return distance_of(Layer((Shape("arc", numbers),)), points)
    assert isinstance(outline, EllipseOutline)
    cosine, sine = math.cos(outline.angle), math.sin(outline.angle)
    turned = (points - outline.center) @ np.array([[cosine, -sine], [sine, cosine]]) / outline.radii
    return np.asarray(np.linalg.norm(turned, axis=1) - 1.0)


def _joined(joins: Sequence[str], inside: Sequence[BoolArray]) -> BoolArray:
    """Whether points lie within the layer, by whether they do in its shapes."""
    found = inside[0]
    for join, own in zip(joins[1:], inside[1:], strict=True):
        found = _table(join)[found.astype(int), own.astype(int)]
    return found


@cache
def _table(join: str) -> BoolArray:
    """Whether a point lies within two that are joined, by whether it does in the first and in the second, [2, 2]."""
    ends = var("a"), var("b")
    first, second = (vec4(vec3(0.0), distance) for distance in ends)
    joined = compile_numpy([JOINS[join].formula(first, second, const(SHARPEST)).w], ends)
    away = np.array([1.0, -1.0])
    return np.asarray(joined(away[:, None], away)[0] < 0)


def _is_cut_out(join: str) -> bool:
    """Whether what lies within the second is not within both."""
    return bool(join) and not _table(join)[1, 1]


def _kept(index: int, outlines: Sequence[Outline], joins: Sequence[str]) -> Iterator[Piece]:
    """The parts of a shape's outline that are the layer's, such that this is on their right."""
    others = [other for other in range(len(outlines)) if other != index]
    for piece in _pieces(outlines[index]):
        ends = np.array([0.0, *sorted(_crossings(piece, [outlines[i] for i in others])), 1.0])
        middles = piece.at((ends[1:] + ends[:-1]) / 2.0)
        inside = [_depths(outline, middles) < 0 for outline in outlines]
        within, beyond = (
            _joined(joins, [own if i != index else np.full_like(own, side) for i, own in enumerate(inside)])
            for side in (True, False)
        )
        for (begin, end), is_within, is_beyond in zip(pairwise(ends), within, beyond, strict=True):
            if is_within != is_beyond:
                part = piece.part(begin, end) if is_within else piece.part(end, begin)
                if part.length > SHORTEST:
                    yield part


def _crossings(piece: Piece, outlines: Sequence[Outline]) -> Iterator[float]:
    """At which shares of a piece it crosses some outlines."""
    shares = np.linspace(0.0, 1.0, SAMPLES + 1)
    for outline in outlines:
        depths = _depths(outline, piece.at(shares))
        changes = np.flatnonzero((depths[1:] < 0) != (depths[:-1] < 0))
        low, high, side = shares[changes], shares[changes + 1], depths[changes] < 0
        for _ in range(HALVINGS):
            middle = (low + high) / 2.0
            before = (_depths(outline, piece.at(middle)) < 0) == side
            low, high = np.where(before, middle, low), np.where(before, high, middle)
        yield from ((low + high) / 2.0).tolist()


def _loops(pieces: Sequence[Piece]) -> list[list[Piece]]:
    """The pieces, each behind the one that ends where it begins; none at all if one has no next."""
    left, loops = list(pieces), []
    while left:
        loop = [left.pop(0)]
        while np.linalg.norm(loop[-1].end - loop[0].begin) > MEETS:
            apart = [np.linalg.norm(loop[-1].end - each.begin) for each in left]
            if not apart or min(apart) > MEETS:
                return []
            loop.append(left.pop(int(np.argmin(apart))))
        loops.append(_fewer(loop))
    return loops


def _fewer(loop: list[Piece]) -> list[Piece]:
    """A loop in which arcs that go on in each other are one."""
    found = [loop[0]]
    for piece in loop[1:]:
        both = found[-1].goes_on_in(piece)
        found = [*found[:-1], both] if both else [*found, piece]
    both = found[-1].goes_on_in(found[0]) if len(found) > 1 else None
    return [both, *found[1:-1]] if both else found


def _is_outline(loops: Sequence[Sequence[Piece]], layer: Layer, canvas: Canvas, off: float) -> bool:
    """Whether loops lie where a layer's coverage is one half, and what of it is seen is what lies within them."""
    shares = np.linspace(0.0, 1.0, TESTED, endpoint=False)
    around = [np.concatenate([piece.at(shares) for piece in loop]) for loop in loops]
    wrong = _away(layer, np.concatenate(around), canvas)
    if np.sqrt(np.mean(wrong**2)) > off or np.abs(wrong).max() > FARTHEST * off:
        return False
    left, top, right, bottom = seen(layer, canvas)
    grid = np.meshgrid(np.linspace(left, right, LOOKED_AT), np.linspace(top, bottom, LOOKED_AT))
    places = canvas.places(np.stack(grid, axis=-1))
    away = _away(layer, places, canvas)
    is_sure = np.abs(away) > max(SURELY, FARTHEST * off)
    return bool((_is_within(places, around) == (away < 0))[is_sure].all())


def _away(layer: Layer, places: Points, canvas: Canvas) -> Float64Array:
    """How far points [N, 2] in user units are from where a layer's coverage is one half; negative within."""
    return np.asarray((distance_of(layer, canvas.from_places(places)) - 0.5 * layer.falloff) * canvas.unit)


def _is_within(places: Points, polygons: Sequence[Points]) -> BoolArray:
    """Whether points [N, 2] lie within an odd number of polygons."""
    is_odd = np.zeros(len(places), bool)
    for polygon in polygons:
        for a, b in zip(polygon, np.roll(polygon, -1, axis=0), strict=True):
            passes = (a[1] > places[:, 1]) != (b[1] > places[:, 1])
            with np.errstate(divide="ignore", invalid="ignore"):
                crossing = a[0] + (places[:, 1] - a[1]) * (b[0] - a[0]) / (b[1] - a[1])
            is_odd ^= passes & (places[:, 0] < crossing)
    return is_odd

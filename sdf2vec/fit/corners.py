"""The corners of a region whose outline is straight between them, and the triangles that they make within it."""

from __future__ import annotations

from itertools import combinations, pairwise

import numpy as np
from skimage import measure

from ..arrays import BoolArray, Float64Array
from .contours import Polyline, known_outlines

OFF = 0.8  # pixels that an outline may be off the sides between its corners
ENDS = 2.0  # pixels at the ends of a side, where corners are rounded off by pixels
STUB = 4.0  # pixels of a side that is none
MOVED = 6.0  # pixels from a corner of an outline to where its sides meet, at most
MOST = 14  # corners: of a region with more most are no corners
LEAST_TURN = 0.2  # sine of the angle between sides that don't go on in each other


def corners(inside: Float64Array, known: Float64Array) -> Float64Array:
    """Where straight sides of a region's coverage [H, W] meet, (x, y) [N, 2] in pixels; none where there are too many.

    An outline is only followed where it is known (0..1, [H, W]).
    """
    found = [corner for outline in known_outlines(inside, known) for corner in _of(outline)]
    return np.array(found if len(found) <= MOST else [], np.float64).reshape(-1, 2)


def _of(outline: Polyline) -> list[Float64Array]:
    """Those of one outline, and its ends if it is not closed."""
    points = outline.points
    if outline.is_closed:  # from a corner on, which the farthest point from the middle is
        first = int(np.linalg.norm(points - points.mean(axis=0), axis=1).argmax())
        points = np.concatenate([points[first:], points[1 : first + 1]])
    rough = _without_stubs(measure.approximate_polygon(points, OFF))
    sides = [_side(points, a, b) for a, b in pairwise(rough)]
    if not outline.is_closed:
        inner = [_meeting(corner, a, b) for corner, (a, b) in zip(rough[1:-1], pairwise(sides), strict=True)]
        return [rough[0], *inner, rough[-1]]
    around = [sides[-1], *sides]
    return [_meeting(corner, a, b) for corner, (a, b) in zip(rough[:-1], pairwise(around), strict=True)]


def _without_stubs(rough: Float64Array) -> Float64Array:
    """An outline's corners where those at both ends of a short side are one: what is left of an acute corner."""
    kept = [rough[0]]
    for corner in rough[1:-1]:
        if np.linalg.norm(corner - kept[-1]) > STUB:
            kept.append(corner)
    while len(kept) > 1 and np.linalg.norm(kept[-1] - rough[-1]) <= STUB:
        kept.pop()
    return np.array([*kept, rough[-1]])


Side = tuple[Float64Array, Float64Array]  # a point on a line, and its direction


def _side(points: Float64Array, start: Float64Array, end: Float64Array) -> Side:
    """The line nearest to the points of an outline between two of them."""
    first, last = (int(np.linalg.norm(points - corner, axis=1).argmin()) for corner in (start, end))
    if last <= first:
        last = len(points) - 1
    own = points[first : last + 1]
    away = [np.linalg.norm(own - corner, axis=1) > ENDS for corner in (start, end)]
    inner = own[away[0] & away[1]]
    if len(inner) < 3:
        return start, (end - start) / max(float(np.linalg.norm(end - start)), 1e-9)
    middle = inner.mean(axis=0)
    _, axes = np.linalg.eigh((inner - middle).T @ (inner - middle))
    return middle, axes[:, 1]


def _meeting(corner: Float64Array, before: Side, after: Side) -> Float64Array:
    """Where two sides meet, if that is near a corner of the outline; else that."""
    (p, along), (q, onward) = before, after
    turn = _cross(along, onward)
    if abs(turn) < LEAST_TURN:  # a side without length has no direction, and turns nowhere
        return corner
    met = p + _cross(q - p, onward) / turn * along
    return met if np.linalg.norm(met - corner) < MOVED else corner


def _cross(a: Float64Array, b: Float64Array) -> float:
    return float(a[0] * b[1] - a[1] * b[0])


def triangles(
    points: Float64Array, wanted: Float64Array, too_much: Float64Array, most: int
) -> list[Float64Array]:
    """The triangles [3, 2] of some points that cover most of what is wanted [H, W], and least of what is too much; few,
    the best first.
    """
    every = np.array(list(combinations(range(len(points)), 3)), np.int64).reshape(-1, 3)
    if not len(every):
        return []
    rows, columns = np.nonzero((wanted > 0) | (too_much > 0))
    gains = (wanted - too_much)[rows, columns]
    places = np.stack([columns, rows], axis=1).astype(np.float64)
    covered = _within(points[every], places) @ gains
    best = np.argsort(-covered, kind="stable")[:most]
    return [points[every[index]] for index in best if covered[index] > 0]


def _within(every: Float64Array, places: Float64Array) -> BoolArray:
    """Whether triangles [T, 3, 2] hold places [P, 2], [T, P]."""
    sides = []
    for one, other in ((0, 1), (1, 2), (2, 0)):
        a, b = every[:, one, None], every[:, other, None]
        along, away = b - a, places[None] - a
        sides.append(along[..., 0] * away[..., 1] - along[..., 1] * away[..., 0])
    turns = np.stack(sides)
    return np.asarray((turns >= 0).all(axis=0) | (turns <= 0).all(axis=0))

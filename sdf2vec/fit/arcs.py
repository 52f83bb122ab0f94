"""Circles that the outline of a region runs along: those that it lies in, and those that are cut out of it."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from ..arrays import BoolArray, Float64Array
from .contours import SHORTEST, Polyline, known_outlines

SHORTER = 0.8  # from one length that is looked for to the next
ROUND = 0.2  # pixels by which the points of an arc are off its circle, in the mean of squares, at most
LEAST_TURN = 0.7  # radians of an arc
LEAST_RISE = 1.5  # pixels between an arc and its chord, at least
SAME = 1.5  # pixels by which the centres and radii of two arcs of one circle differ, at most
MOST, FEWEST = 8, 0.15  # arcs of an outline; points of one, in shares of those of the longest
NARROWEST, WIDEST = 0.1, 2.4  # radians of a wedge
BEYOND = 1.1  # radii that a wedge reaches in its middle


class Arc(NamedTuple):
    """A circle in pixels (x, y; the middle of the first pixel is 0, 0); whether the region lies in it; how many points
    of the outline run along it.
    """

    x: float
    y: float
    radius: float
    is_outer: bool
    points: int

    def wedge(self, inside: Float64Array) -> tuple[bool, Float64Array] | None:
        """A triangle [3, 2] from the middle that goes along both ends of a region of the disc, [H, W], as seen from
        there: whether the region is within it, or what is not. None where both are about half, or one is nothing.
        """
        rows, columns = np.nonzero(inside > 0.5)
        turns = np.sort(np.arctan2(rows - self.y, columns - self.x))
        if not len(turns):
            return None
        gaps = np.diff(turns, append=turns[0] + math.tau)
        widest = int(gaps.argmax())
        gap, end = float(gaps[widest]), float(turns[widest])
        span, is_within = (math.tau - gap, True) if gap > math.pi else (gap, False)
        if not NARROWEST < span < WIDEST:
            return None
        middle = np.array([self.x, self.y])
        return is_within, wedge(middle, self.radius, end - span if is_within else end, span)


def wedge(middle: Float64Array, radius: float, first: float, span: float) -> Float64Array:
    """A triangle [3, 2] from the middle of a circle that holds the part of its disc from an angle on, by so many
    radians, `WIDEST` at most.
    """
    ways = np.array([[math.cos(turn), math.sin(turn)] for turn in (first, first + span)])
    return np.stack([middle, *(middle + BEYOND * radius / math.cos(span / 2) * ways)])


def arcs(inside: Float64Array, known: Float64Array) -> list[Arc]:
    """Those of a region's coverage [H, W] where the outline is known (0..1, [H, W]), the longest first."""
    found = [each for outline in known_outlines(inside, known) for each in _along(_line(outline))]
    circles: list[list[tuple[Sums, Arc]]] = []
    for sums, arc in sorted(found, key=lambda each: -each[1].points):
        same = next((own for own in circles if _are_one(own[0][1], arc)), None)
        if same is None:
            circles.append([(sums, arc)])
        else:
            same.append((sums, arc))
    joined = sorted((_joined(own) for own in circles), key=lambda arc: -arc.points)[:MOST]
    return [arc for arc in joined if arc.points >= FEWEST * joined[0].points]


def _line(outline: Polyline) -> Float64Array:
    """The points of an outline; of a closed one twice, for an arc may go on behind the first."""
    points = outline.points
    return np.concatenate([points, points[1:]]) if outline.is_closed else points


Sums = Float64Array  # of products of (x, y, 1, x² + y²), [4, 4]


def sums_of(line: Float64Array) -> Sums:
    """Those of the first 0, 1, 2, … points of a line [N, 2], [N + 1, 4, 4]."""
    powers = np.concatenate([line, np.ones((len(line), 1)), (line**2).sum(1, keepdims=True)], axis=1)
    sums = np.zeros((len(line) + 1, 4, 4))
    np.cumsum(powers[:, :, None] * powers[:, None], axis=0, out=sums[1:])
    return sums


def _along(line: Float64Array) -> Iterator[tuple[Sums, Arc]]:
    """Arcs of a line, the longest first, that share no points."""
    sums = sums_of(line)
    free: BoolArray = np.ones(len(line), bool)
    length = len(line)
    while length >= SHORTEST:
        starts = np.arange(len(line) - length + 1)
        taken = np.concatenate([[0], np.cumsum(~free)])
        starts = starts[taken[starts + length] == taken[starts]]
        while len(starts):
            own = sums[starts + length] - sums[starts]
            circles, off = circles_of(own)
            chords = np.hypot(*(line[starts + length - 1] - line[starts]).T)
            good = np.flatnonzero((off < ROUND) & _is_bent(circles[:, 2], chords, length))
            if not len(good):
                break
            best = int(good[off[good].argmin()])
            first = int(starts[best])
            yield own[best], _arc(circles[best], line[first : first + length])
            free[first : first + length] = False
            starts = starts[(starts + length <= first) | (starts >= first + length)]
        length = min(int(length * SHORTER), length - 1)


def _is_bent(radii: Float64Array, chords: Float64Array, length: int) -> BoolArray:
    """Whether arcs turn enough; by their chords, and by about how long they are."""
    turns = length / radii
    half = np.minimum(chords / (2.0 * radii), 1.0)
    rise = np.where(turns > np.pi, radii, radii * (1.0 - np.sqrt(1.0 - half**2)))
    bent: BoolArray = (turns > LEAST_TURN) & (rise > LEAST_RISE)
    return bent


def circles_of(sums: Sums) -> tuple[Float64Array, Float64Array]:
    """Circles (x, y, radius) [N, 3] by least squares of x² + y² (Kåsa 1976), and by how many pixels points are off."""
    means, sums = _centred(sums)
    matrix, right = sums[:, :3, :3], sums[:, :3, 3]
    eye = np.eye(3) * 1e-9 * np.trace(matrix, axis1=1, axis2=2)[:, None, None]
    solved = np.linalg.solve(matrix + eye, right[..., None])[..., 0]
    centers = solved[:, :2] / 2.0
    radii = np.sqrt(np.maximum(solved[:, 2] + (centers**2).sum(1), 1e-9))
    squares = sums[:, 3, 3] - (solved * right).sum(1)
    off = np.sqrt(np.maximum(squares, 0.0) / matrix[:, 2, 2]) / (2.0 * radii)
    return np.concatenate([centers + means, radii[:, None]], axis=1), off


def _centred(sums: Sums) -> tuple[Float64Array, Sums]:
    """The means (x, y) [N, 2] of points, and the sums as they are where these are at 0, 0."""
    means = sums[:, :2, 2] / sums[:, 2, 2, None]
    moved = np.broadcast_to(np.eye(4), sums.shape).copy()
    moved[:, :2, 2] = -means
    moved[:, 3, :2], moved[:, 3, 2] = -2.0 * means, (means**2).sum(1)
    return means, moved @ sums @ moved.transpose(0, 2, 1)


def _arc(circle: Float64Array, points: Float64Array) -> Arc:
    x, y, radius = circle.tolist()
    away = points - (x, y)
    turn = (away[:-1, 0] * away[1:, 1] - away[:-1, 1] * away[1:, 0]).sum()
    return Arc(x, y, radius, bool(turn > 0), len(points))


def _are_one(a: Arc, b: Arc) -> bool:
    """Whether two arcs are of one circle."""
    apart = np.hypot(a.x - b.x, a.y - b.y)
    return a.is_outer == b.is_outer and max(apart, abs(a.radius - b.radius)) < SAME


def _joined(own: list[tuple[Sums, Arc]]) -> Arc:
    """The circle of several arcs."""
    circles, _ = circles_of(np.sum([sums for sums, _ in own], axis=0)[None])
    x, y, radius = circles[0].tolist()
    return Arc(x, y, radius, own[0][1].is_outer, sum(arc.points for _, arc in own))

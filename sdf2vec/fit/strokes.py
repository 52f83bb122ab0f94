"""The strokes that a region is made of: lines and bows of one width, along its middle line."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from ..arrays import BoolArray, Float64Array
from .arcs import circles_of, sums_of
from .bones import CLEAR, LEAST, depth_of, middle_lines, pixels_of, seen

# points between those at which a line may become a bow, at least; most of these: pairs of them are looked at
STRIDE, MOST = 2, 1000
CLOSED = 1.5  # pixels between the ends of a path around
ROUGH = 0.5  # pixels that points are off where they are of one piece, many of them together
LINE, BOW = 30.0, 36.0  # what a piece costs beside squared distances, in units of that
# radians that a bow turns, at least; share of that where it is clear of what joins it
STRAIGHT, NEARLY = 0.3, 0.5
TIGHTEST = 1.25  # half widths of a bow's radius, at least: else it is a corner
TOUCHES, ALONG = 1.0, 0.95  # pixels between two that touch; cosine of the angle between two that go on
FINE = 0.25  # pixels: steps in which a stroke gets longer
# quantile of how deep a stroke lies in a region; pixels by which its ends lie less deep, at most
USUAL, FITS = 0.1, 0.5
NEEDED, SQUARE = 0.15, 0.3  # of half the width, squared: what a stroke covers alone; what square ends do
BLUNT = 0.3  # pixels beyond its edge that count as covered


@dataclass(frozen=True, eq=False)
class Line:
    """From one point to another [2] in pixels, with half discs at its ends or, `square`, half squares."""

    start: Float64Array
    end: Float64Array
    half: float
    square: bool = False

    @property
    def length(self) -> float:
        return float(np.linalg.norm(self.end - self.start))

    @property
    def ends(self) -> Float64Array:
        """[2, 2]"""
        return np.stack([self.start, self.end])

    @property
    def is_corner(self) -> bool:
        return False

    def direction(self, point: Float64Array) -> Float64Array:
        """[2]"""
        return np.asarray((self.end - self.start) / max(self.length, 1e-9))

    def ending_at(self, point: Float64Array) -> Line:
        """With the end that is nearer to a point there."""
        is_start = np.linalg.norm(self.start - point) < np.linalg.norm(self.end - point)
        return replace(self, start=point) if is_start else replace(self, end=point)

    def points(self) -> Float64Array:
        """Some along it [N, 2]."""
        return np.linspace(self.start, self.end, max(2, round(self.length)))

    def covers(self, points: Float64Array) -> BoolArray:
        """Which points [N, 2] it covers."""
        along = (self.end - self.start) / max(self.length, 1e-9)
        away, half = points - self.start, self.half + BLUNT
        reach = away @ along
        beyond = np.maximum(np.maximum(-reach, reach - self.length), 0.0)
        across = np.abs(away @ np.array([-along[1], along[0]]))
        within = np.maximum(beyond, across) if self.square else np.hypot(beyond, across)
        return np.asarray(within <= half)


@dataclass(frozen=True, eq=False)
class Bow:
    """A part of a ring around a middle [2], from an angle on by so many radians, more than 0; a whole turn at most.

    With half discs at its ends or, `square`, so much longer instead.
    """

    middle: Float64Array
    radius: float
    first: float
    span: float
    half: float
    square: bool = False

    @property
    def length(self) -> float:
        return self.radius * self.span

    def at(self, angles: Float64Array) -> Float64Array:
        """Its points at some angles [N, 2]."""
        ways = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
        return np.asarray(self.middle + self.radius * ways)

    def points(self) -> Float64Array:
        """Some along it [N, 2]."""
        return self.at(self.first + np.linspace(0.0, self.span, max(3, round(self.length))))

    @property
    def ends(self) -> Float64Array:
        """[2, 2]; none of a whole ring."""
        return self.at(np.array([self.first, self.first + self.span]))[: 0 if self.is_closed else 2]

    @property
    def is_corner(self) -> bool:
        """Whether its inner edge is none: what the middle line does where lines meet."""
        return self.radius < TIGHTEST * self.half

    def direction(self, point: Float64Array) -> Float64Array:
        """Of its tangent near a point [2]."""
        x, y = point - self.middle
        return np.array([-y, x]) / max(math.hypot(x, y), 1e-9)

    def ending_at(self, point: Float64Array) -> Bow:
        """With the end that is nearer to a point as far round as that."""
        turn = math.atan2(*(point - self.middle)[::-1].tolist())
        first, last = self.first, self.first + self.span
        if np.linalg.norm(self.ends[0] - point) < np.linalg.norm(self.ends[1] - point):
            first += math.remainder(turn - first, math.tau)
        else:
            last += math.remainder(turn - last, math.tau)
        return replace(self, first=first, span=last - first)

    @property
    def is_closed(self) -> bool:
        return self.span >= math.tau

    @property
    def sector(self) -> tuple[float, float]:
        """The first angle, and how many radians further it goes, with square ends."""
        more = self.half / self.radius if self.square else 0.0
        return self.first - more, self.span + 2.0 * more

    def covers(self, points: Float64Array) -> BoolArray:
        """Which points [N, 2] it covers."""
        away, (first, span) = points - self.middle, self.sector
        turn = np.mod(np.arctan2(away[:, 1], away[:, 0]) - first, math.tau)
        off = np.abs(np.linalg.norm(away, axis=1) - self.radius)
        off = np.where(turn <= span, off, np.inf)
        for end in () if self.square else self.ends:
            off = np.minimum(off, np.linalg.norm(points - end, axis=1))
        return np.asarray(off <= self.half + BLUNT)


Stroke = Line | Bow


def strokes(coverage: Float64Array) -> list[Stroke]:
    """Those of a region's coverage [H, W], the longest first; none where it is not of one width."""
    inside = coverage > 0.5
    depth = depth_of(inside)
    pieces = [piece for line in middle_lines(coverage) for piece in _pieces(line.points, line.half)]
    grown = [_grown(piece, depth) for piece in pieces]
    return _needed(sorted(grown, key=lambda stroke: -stroke.length), inside)


# --- pieces of a branch ---------------------------------------------------------------------------------------


class Piece(NamedTuple):
    """A stroke, and whether another goes on from where it starts, and from where it ends, in the same direction."""

    stroke: Stroke
    goes_on: tuple[bool, bool] = (False, False)

    def meeting(self, point: Float64Array) -> Piece:
        """With the end that is nearer to a point there, from where another goes on."""
        first, last = np.linalg.norm(self.stroke.ends - point, axis=1)
        start, end = self.goes_on
        goes_on = (True, end) if first < last else (start, True)
        return Piece(self.stroke.ending_at(point), goes_on)


def _pieces(path: Float64Array, half: float) -> list[Piece]:
    """Lines and bows that go along a path; the least squares with the fewest pieces (Bellman 1961)."""
    cuts, is_bow = _cuts(path)
    is_closed = bool(np.linalg.norm(path[0] - path[-1]) < CLOSED)
    if is_closed:  # it may begin within a piece: begin it where one ends
        path = np.concatenate([path[cuts[1] :], path[1 : cuts[1] + 1]])
        cuts, is_bow = _cuts(path)
    found = []
    for (a, b), bent in zip(pairwise(cuts), is_bow, strict=True):
        points = _clear(path[a : b + 1], half)
        arc = _bow(points, half) if bent else None
        found.append(Piece(arc if arc and arc.span > NEARLY * STRAIGHT else _line(points, half)))
    count = len(found)
    for index in range(count if is_closed and count > 1 else count - 1):
        after = (index + 1) % count
        point = _passage(found[index].stroke, found[after].stroke, path[cuts[index + 1]])
        if point is not None:
            found[index], found[after] = found[index].meeting(point), found[after].meeting(point)
    return [piece for piece in found if not piece.stroke.is_corner]


def _passage(one: Stroke, other: Stroke, near: Float64Array) -> Float64Array | None:
    """Where two strokes go over into each other; None if they meet in a corner near a point."""
    if one.is_corner or other.is_corner or abs(float(one.direction(near) @ other.direction(near))) < ALONG:
        return None
    found = _tangent(one, other) if isinstance(one, Bow) else _tangent(other, one)
    return found if found is not None and np.linalg.norm(found - near) < one.half else near


def _cuts(path: Float64Array) -> tuple[list[int], list[bool]]:
    """The points at which its pieces begin and end, and which pieces are bows."""
    stride = max(STRIDE, math.ceil(len(path) / MOST))
    nodes = np.unique(np.append(np.arange(0, len(path), stride), len(path) - 1))
    sums = sums_of(path)
    first, last = np.triu_indices(len(nodes), 1)
    own = sums[nodes[last] + 1] - sums[nodes[first]]
    lines = _off_line(own) / ROUGH**2 + LINE
    circles, off = circles_of(own)
    bows = off**2 * own[:, 2, 2] / ROUGH**2 + BOW
    bows[_turns(path, nodes[first], nodes[last], circles) < STRAIGHT] = np.inf
    costs = np.full((len(nodes), len(nodes)), np.inf)
    costs[first, last] = np.minimum(lines, bows)
    is_bow = np.zeros_like(costs, bool)
    is_bow[first, last] = bows < lines
    ends = _cheapest(costs)
    return nodes[ends].tolist(), is_bow[ends[:-1], ends[1:]].tolist()


def _cheapest(costs: Float64Array) -> list[int]:
    """The nodes between which the pieces go."""
    best, before = np.full(len(costs), np.inf), np.zeros(len(costs), int)
    best[0] = 0.0
    for node in range(1, len(costs)):
        tried = best[:node] + costs[:node, node]
        before[node] = tried.argmin()
        best[node] = tried[before[node]]
    ends = [len(costs) - 1]
    while ends[-1] > 0:
        ends.append(int(before[ends[-1]]))
    return ends[::-1]


def _off_line(sums: Float64Array) -> Float64Array:
    """The squared distances, summed, of points from the line nearest to them [N]."""
    count = sums[:, 2, 2]
    xx = sums[:, 0, 0] - sums[:, 0, 2] ** 2 / count
    yy = sums[:, 1, 1] - sums[:, 1, 2] ** 2 / count
    xy = sums[:, 0, 1] - sums[:, 0, 2] * sums[:, 1, 2] / count
    return np.asarray(np.maximum((xx + yy) / 2.0 - np.hypot((xx - yy) / 2.0, xy), 0.0))


def _turns(
    path: Float64Array, first: Float64Array, last: Float64Array, circles: Float64Array
) -> Float64Array:
    """By about how many radians each circle turns between two points of a path."""
    steps = np.linalg.norm(np.diff(path, axis=0), axis=1)
    along = np.concatenate([[0.0], np.cumsum(steps)])
    return np.asarray((along[last] - along[first]) / np.maximum(circles[:, 2], 1e-9))


def _clear(points: Float64Array, half: float) -> Float64Array:
    """Points without those near the ends, unless too few are left."""
    away = [np.linalg.norm(points - end, axis=1) > CLEAR * half for end in (points[0], points[-1])]
    inner = points[away[0] & away[1]]
    return inner if len(inner) >= LEAST else points


def _line(points: Float64Array, half: float) -> Line:
    middle = points.mean(axis=0)
    _, axes = np.linalg.eigh((points - middle).T @ (points - middle))
    along = axes[:, 1]
    reach = (points - middle) @ along
    return Line(middle + reach.min() * along, middle + reach.max() * along, half)


def _bow(points: Float64Array, half: float) -> Bow:
    circles, _ = circles_of(sums_of(points)[-1:])
    x, y, radius = circles[0].tolist()
    angles = np.unwrap(np.arctan2(points[:, 1] - y, points[:, 0] - x))
    first, last = sorted((float(angles[0]), float(angles[-1])))
    return Bow(np.array([x, y]), radius, first, last - first, half)


def _tangent(bow: Stroke, stroke: Stroke) -> Float64Array | None:
    """Where a bow's circle touches a line or another bow's; None where it doesn't, and for two lines."""
    if isinstance(bow, Line):
        return None
    if isinstance(stroke, Line):
        along = (stroke.end - stroke.start) / max(stroke.length, 1e-9)
        foot = stroke.start + ((bow.middle - stroke.start) @ along) * along
        off = abs(float(np.linalg.norm(foot - bow.middle)) - bow.radius)
        return foot if off < TOUCHES else None
    apart = stroke.middle - bow.middle
    distance = float(np.linalg.norm(apart))
    outside = abs(distance - bow.radius - stroke.radius) < TOUCHES
    if (not outside and abs(distance - abs(bow.radius - stroke.radius)) >= TOUCHES) or distance < TOUCHES:
        return None
    towards = 1.0 if outside or bow.radius > stroke.radius else -1.0
    return bow.middle + towards * bow.radius * apart / distance


# --- whole strokes -------------------------------------------------------------------------------------------


def _grown(piece: Piece, depth: Float64Array) -> Stroke:
    """A stroke that goes on as far as a disc of its width fits into the region, but where another goes on."""
    stroke, goes_on = piece
    least = float(np.quantile(seen(stroke.points(), depth), USUAL)) - FITS
    if isinstance(stroke, Line):
        return _grown_line(stroke, goes_on, depth, least)
    return _grown_bow(stroke, goes_on, depth, least)


def _grown_line(line: Line, goes_on: tuple[bool, bool], depth: Float64Array, least: float) -> Line:
    along = (line.end - line.start) / max(line.length, 1e-9)
    steps = np.arange(0.0, math.hypot(*depth.shape), FINE)
    start, end = (
        place if stays else place + way * _way(steps, place + steps[:, None] * way, depth, least)
        for place, way, stays in ((line.start, -along, goes_on[0]), (line.end, along, goes_on[1]))
    )
    return replace(line, start=start, end=end)


def _grown_bow(bow: Bow, goes_on: tuple[bool, bool], depth: Float64Array, least: float) -> Bow:
    steps = np.arange(0.0, math.tau * bow.radius, FINE)
    behind, ahead = (
        0.0 if stays else _way(steps, bow.at(end + sign * steps / bow.radius), depth, least) / bow.radius
        for end, sign, stays in ((bow.first, -1.0, goes_on[0]), (bow.first + bow.span, 1.0, goes_on[1]))
    )
    if bow.span + ahead + behind >= math.tau - 2.0 * (FINE + FITS) / bow.radius:
        return replace(bow, first=0.0, span=math.tau)
    return replace(bow, first=bow.first - behind, span=bow.span + ahead + behind)


def _way(steps: Float64Array, points: Float64Array, depth: Float64Array, least: float) -> float:
    """How far it is, of so many steps, to the last of the points [N, 2] from the first on that a disc fits at."""
    fits = seen(points, depth) >= least
    far = len(fits) if fits.all() else int(fits.argmin())
    return max(0.0, float(steps[far - 1]) - FITS) if far else 0.0


def _needed(ranked: list[Stroke], inside: BoolArray) -> list[Stroke]:
    """Those without which some of the region would not be covered; with square ends where more is covered so."""
    points = pixels_of(inside)
    covers = [stroke.covers(points) for stroke in ranked]
    least = [NEEDED * stroke.half**2 for stroke in ranked]
    kept: list[int] = []
    count = np.zeros(len(points), int)
    for index, cover in enumerate(covers):
        if (cover & (count == 0)).sum() > least[index]:
            kept.append(index)
            count += cover
    for index in reversed(kept):
        if (covers[index] & (count == 1)).sum() <= least[index]:
            kept.remove(index)
            count -= covers[index]
    return [_ended(ranked[index], points, count == 0) for index in kept]


def _ended(stroke: Stroke, points: Float64Array, left: BoolArray) -> Stroke:
    """A stroke with square ends, if they cover what all leave with round ones."""
    squared = replace(stroke, square=True)
    return squared if (squared.covers(points) & left).sum() > SQUARE * stroke.half**2 else stroke

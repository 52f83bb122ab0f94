"""Closed contours as lines and cubic Bézier curves: knots at corners, least squares in between."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from itertools import count, pairwise

import numpy as np

from ...deferred import deferred
from .canvas import Canvas, Points, pairs
from .display import Contour, Path, Segment

# User units: no corner is the middle of a pixel, where renderers differ about whose that pixel is.
ASIDE = 0.0137
SPECK = 8  # points of a contour that is too small for curves: there may be thousands
ROUNDS = 3  # of fitting a curve and moving its parameters to the nearest places
# times the tolerance, that a polygon may be away which tells where corners are: where it turns by so much, in radians
ROUGHLY, SHARPLY = 12.0, 0.8
SHORT, SAMPLES = 4, 64  # points that a line follows; of those along a curve, which are looked at
# to find how many points a curve follows, about to a sixteenth of them: an error grows about by this power of their
# number, by which that is told to change so much at least and at most; after so many tries, halfway
FINELY, ORDER, LEAST, MOST, TRIES = 4, 5, 2.0**-10, 2.0**5, 3
TINY = 1e-12

approximate_polygon: Callable[[Points, float], Points] = deferred("skimage.measure", "approximate_polygon")


def smooth_path(contours: Sequence[Points], tolerance: float, canvas: Canvas) -> Path:
    """Closed contours [M, 2] in user units as curves, at most about `tolerance` away from them; no points."""
    curves = (_smooth(contour, tolerance, canvas) for contour in contours)
    return Path(tuple(curve for curve in curves if curve.segments))


def straight_path(contours: Sequence[Points], tolerance: float, canvas: Canvas) -> Path:
    """The same with straight lines: unlike curves', their pixels are the same in every path they are part of."""
    corners = [approximate_polygon(contour, tolerance)[:-1] for contour in contours]
    return Path(tuple(Contour.straight(pairs(canvas.rounded(points - ASIDE) + ASIDE)) for points in corners))


def _smooth(contour: Points, tolerance: float, canvas: Canvas) -> Contour:
    points = contour[:-1] if np.array_equal(contour[0], contour[-1]) else contour
    if SPECK >= len(points) > 2:
        return Contour.straight(pairs(canvas.rounded(points)))
    points = np.concatenate([points, points[:1]])
    rough = approximate_polygon(points, ROUGHLY * tolerance)
    if len(rough) < 4:
        return Contour.straight(pairs(canvas.rounded(approximate_polygon(points, tolerance)[:-1])))
    points, knots = _from_a_knot(points, _knots(points, rough))
    curves = [
        curve for start, end in pairwise(knots) for curve in _curves(points[start : end + 1], tolerance)
    ]
    segments: tuple[Segment, ...] = tuple(pairs(canvas.rounded(curve)) for curve in curves)
    return Contour(segments[-1][-1], segments)


def _knots(points: Points, rough: Points) -> list[int]:
    """Which points of a closed contour are its corners: those of a polygon near it where that turns sharply."""
    lookup = {tuple(p): i for i, p in reversed(list(enumerate(points.tolist())))}
    sides = np.diff(rough, axis=0)
    ways = np.arctan2(sides[:, 1], sides[:, 0])
    turns = np.abs((ways - np.roll(ways, 1) + np.pi) % (2.0 * np.pi) - np.pi)
    return sorted(lookup[tuple(corner)] for corner in rough[:-1][turns > SHARPLY].tolist())


def _from_a_knot(points: Points, knots: list[int]) -> tuple[Points, list[int]]:
    """A closed contour that begins at a knot, if there are any, and its knots, the first at its end, too."""
    first, *rest = knots or [0]
    turned = np.roll(points[:-1], -first, axis=0)
    return np.concatenate([turned, turned[:1]]), [0, *(knot - first for knot in rest), len(turned)]


def _curves(span: Points, tolerance: float) -> Iterator[Points]:
    """Lines and curves along a part of a contour, each about as long as can be: the points after its start."""
    guess = len(span) - 1
    while len(span) > 1:
        guess, curve = _longest(span, tolerance, min(guess, len(span) - 1))
        yield curve
        span = span[guess:]


def _longest(span: Points, tolerance: float, guess: int) -> tuple[int, Points]:
    """About how many points one line or curve follows, by a guess of it, and that."""
    low, found, high = 0, span[1:2], len(span)
    tried = guess
    for tries in count():
        curve, error = _curve(span[: tried + 1], tolerance)
        if error <= tolerance:
            low, found = tried, curve
        else:
            high = tried
        if high - low <= max(1, low >> FINELY):
            break
        likely = tried * min(max(tolerance / max(error, TINY), LEAST), MOST) ** (1.0 / ORDER)
        tried = min(max(int(likely), low + 1), high - 1) if tries < TRIES else (low + high) // 2
    return low, found


def _curve(span: Points, tolerance: float) -> tuple[Points, float]:
    """The line or curve that is nearest to points, without its start, and how far it is from them at most."""
    if len(span) <= SHORT or _is_straight(span, 0.5 * tolerance):
        return span[-1:], 0.0
    span = span[np.linspace(0, len(span) - 1, min(len(span), SAMPLES)).round().astype(int)]
    handles, worst = _fit(span)
    return np.stack([*handles, span[-1]]), worst


def _is_straight(span: Points, tolerance: float) -> bool:
    """Whether all points are near the line between the first and the last, in their order."""
    way = span[-1] - span[0]
    length = float(np.hypot(*way))
    if length < tolerance:
        return False
    along, aside = ((span - span[0]) @ np.stack([way, [-way[1], way[0]]]).T / length).T
    return bool(np.abs(aside).max() <= tolerance and (np.diff(along) >= -tolerance).all())


def _fit(span: Points) -> tuple[Points, float]:
    """The two inner control points of the nearest cubic, and its largest error.

    Both are free; neighbouring curves meet smoothly because both follow the same smooth contour.
    """
    points = span[:, 0] + 1j * span[:, 1]
    start, end = points[0], points[-1]
    chord = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(points)))])
    t = chord / max(float(chord[-1]), TINY)
    for _ in range(ROUNDS):
        s = 1.0 - t
        one, two = 3.0 * t * s * s, 3.0 * t * t * s
        rest = points - s**3 * start - t**3 * end
        a, b, c = one @ one, one @ two, two @ two
        first, last, scale = one @ rest, two @ rest, a * c - b * b + TINY
        near, far = (c * first - b * last) / scale, (a * last - b * first) / scale
        off = one * near + two * far - rest
        speed = 3.0 * (s * s * (near - start) + 2.0 * s * t * (far - near) + t * t * (end - far))
        t = np.clip(t - (off * speed.conj()).real / np.maximum(np.abs(speed) ** 2, TINY), 0.0, 1.0)
    handles = np.array([[near.real, near.imag], [far.real, far.imag]])
    return handles, float(np.abs(off).max())

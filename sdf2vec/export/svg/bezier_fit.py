"""Closed contours as cubic Bézier curves: knots where the contour bends most, least squares in between."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise

import numpy as np

from ...deferred import deferred
from .canvas import Canvas, Points, pairs
from .display import Contour, Path, Segment

# User units: no corner is the middle of a pixel, where renderers differ about whose that pixel is.
ASIDE = 0.0137
SPECK = 8  # points of a contour that is too small for curves: there may be thousands
ROUNDS = 3  # of fitting a curve and moving its parameters to the nearest places

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
    rough = approximate_polygon(points, 12 * tolerance)
    if len(rough) < 4:
        return Contour.straight(pairs(canvas.rounded(approximate_polygon(points, tolerance)[:-1])))
    curves: list[Points] = []
    for start, end in pairwise(_knots(points, rough)):
        curves += _spans(points, start, end, tolerance)
    segments: tuple[Segment, ...] = tuple(pairs(canvas.rounded(curve)) for curve in curves)
    return Contour(segments[-1][-1], segments)


def _knots(points: Points, knots: Points) -> list[int]:
    """Indices of the knots, which are points of the contour in its order."""
    lookup = {tuple(p): i for i, p in reversed(list(enumerate(points.tolist())))}
    inner = [lookup[tuple(knot)] for knot in knots[1:-1].tolist()]
    return [0, *inner, len(points) - 1]


def _spans(points: Points, start: int, end: int, tolerance: float) -> list[Points]:
    """Lines and curves from one point of a contour to another; split where one curve does not follow it."""
    span = points[start : end + 1]
    if end - start < 4:
        return [span[-1:]]
    handles, worst, where = _fit(span)
    if worst <= tolerance or end - start < 8:
        return [np.stack([*handles, span[-1]])]
    middle = start + min(max(where, 3), end - start - 3)
    return [*_spans(points, start, middle, tolerance), *_spans(points, middle, end, tolerance)]


def _fit(span: Points) -> tuple[Points, float, int]:
    """The two inner control points of the nearest cubic, its largest error, and where that is.

    Both are free; neighbouring curves meet smoothly because both follow the same smooth contour.
    """
    chord = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(span, axis=0), axis=1))])
    t = chord / chord[-1]
    for _ in range(ROUNDS):
        basis = np.stack([(1 - t) ** 3, 3 * t * (1 - t) ** 2, 3 * t**2 * (1 - t), t**3], axis=1)
        rest = span - basis[:, [0, 3]] @ span[[0, -1]]
        handles, *_ = np.linalg.lstsq(basis[:, 1:3], rest, rcond=None)
        control = np.stack([span[0], *handles, span[-1]])
        curve = basis @ control
        first = 3 * (np.diff(control, axis=0).T @ np.stack([(1 - t) ** 2, 2 * t * (1 - t), t**2])).T
        speed = np.maximum(np.sum(first * first, axis=1), 1e-12)
        t = np.clip(t - np.sum((curve - span) * first, axis=1) / speed, 0.0, 1.0)
        t[0], t[-1] = 0.0, 1.0
    errors = np.linalg.norm(curve - span, axis=1)
    return handles, float(errors.max()), int(errors.argmax())

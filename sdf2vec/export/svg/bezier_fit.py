"""Closed contours as cubic Bézier curves: knots where the contour bends most, least squares in between."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from .canvas import Canvas, Points

ASIDE = (
    0.0137  # user units: no corner is the middle of a pixel, where renderers differ about whose that pixel is
)
ROUNDS = 3  # of fitting a curve and moving its parameters to the nearest places


def path_data(contours: list[Points], tolerance: float, canvas: Canvas) -> str:
    """Path data of closed contours [M, 2] in user units, at most about `tolerance` away from them."""
    return "".join(_closed(contour, tolerance, canvas) for contour in contours)


def polygon_data(contours: list[Points], tolerance: float, canvas: Canvas) -> str:
    """The same with straight lines: unlike curves', their pixels are the same in every path they are part of."""
    from skimage.measure import approximate_polygon

    return "".join(
        relative_polygon(approximate_polygon(contour, tolerance)[:-1], canvas, ASIDE) for contour in contours
    )


def relative_polygon(points: Points, canvas: Canvas, aside: float = 0.0) -> str:
    """Path data of a closed polygon by how far each corner is from the last, all corners `aside` of round numbers."""
    rounded = canvas.rounded(points - aside)
    start = " ".join(canvas.fine(v) for v in (rounded[0] + aside).tolist())
    rest = " ".join(canvas.number(v) for v in np.diff(rounded, axis=0).ravel().tolist())
    return f"M{start}l{rest}z".replace(" -", "-")


def _closed(contour: Points, tolerance: float, canvas: Canvas) -> str:
    from skimage.measure import approximate_polygon

    points = contour[:-1] if np.array_equal(contour[0], contour[-1]) else contour
    points = np.concatenate([points, points[:1]])
    rough = approximate_polygon(points, 12 * tolerance)
    if len(rough) < 4:
        return canvas.polygon_path(approximate_polygon(points, tolerance)[:-1])
    places = _places(points, rough)
    commands: list[tuple[str, Points]] = []
    for start, end in pairwise(places):
        commands += _spans(points, start, end, tolerance)
    return f"M{canvas.joined(points[:1])}{_relative(points[0], commands, canvas)}Z"


def _relative(start: Points, commands: list[tuple[str, Points]], canvas: Canvas) -> str:
    """Commands in coordinates relative to where each begins; rounding does not add up."""
    here = canvas.rounded(start)
    parts, last = [], ""
    for command, points in commands:
        written = canvas.rounded(points)
        parts.append((command if command != last else " ") + canvas.joined(written - here))
        here, last = written[-1], command
    return "".join(parts)


def _places(points: Points, knots: Points) -> list[int]:
    """Indices of the knots, which are points of the contour in its order."""
    lookup = {tuple(p): i for i, p in reversed(list(enumerate(points.tolist())))}
    inner = [lookup[tuple(knot)] for knot in knots[1:-1].tolist()]
    return [0, *inner, len(points) - 1]


def _spans(points: Points, start: int, end: int, tolerance: float) -> list[tuple[str, Points]]:
    """Curve commands from one point of a contour to another; split where one curve does not follow it."""
    span = points[start : end + 1]
    if end - start < 4:
        return [("l", span[-1:])]
    handles, worst, where = _fit(span)
    if worst <= tolerance or end - start < 8:
        return [("c", np.stack([*handles, span[-1]]))]
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

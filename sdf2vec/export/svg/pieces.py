"""Lines and parts of ellipses in user units, from which outlines and strokes are put together."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from ...arrays import Float64Array
from ...outlines import ArcOutline, Point
from .canvas import Points, growing
from .display import Arc, Contour, Segment

ROUND = math.tau - 1e-6  # a whole turn: two halves, as they are drawn whatever their rounded radius is
# spans of an arc that are safe from the rounding of its radius; others are drawn as several
WIDEST, AROUND = math.radians(150.0), (math.radians(210.0), math.radians(300.0))


@dataclass(frozen=True, eq=False)
class Piece:
    """A line from `start` by `step`, or an arc: from `first` on by `span` radians of an ellipse's own angle."""

    start: Points
    step: Points
    radii: Points | None = None
    angle: float = 0.0
    first: float = 0.0
    span: float = 0.0

    def at(self, shares: Float64Array) -> Points:
        """Points [N, 2] at shares 0..1 of it."""
        if self.radii is None:
            return np.asarray(self.start + shares[:, None] * self.step)
        t = self.first + shares * self.span
        x, y = self.radii[0] * np.cos(t), self.radii[1] * np.sin(t)
        cosine, sine = math.cos(self.angle), math.sin(self.angle)
        return np.stack([x * cosine - y * sine, x * sine + y * cosine], axis=1) + self.start

    def part(self, begin: float, end: float) -> Piece:
        """From one share to another, which may be the lesser."""
        share = end - begin
        if self.radii is None:
            return Piece(self.start + begin * self.step, share * self.step)
        first = self.first + begin * self.span
        return Piece(self.start, self.step, self.radii, self.angle, first, share * self.span)

    @property
    def begin(self) -> Points:
        return np.asarray(self.at(np.zeros(1))[0])

    @property
    def end(self) -> Points:
        return np.asarray(self.at(np.ones(1))[0])

    @property
    def length(self) -> float:
        """About."""
        return float(np.linalg.norm(np.diff(self.at(np.linspace(0, 1, 9)), axis=0), axis=1).sum())

    def goes_on_in(self, other: Piece) -> Piece | None:
        """This and another one in one, if both are of one ellipse."""
        if self.radii is None or other.radii is None or other.span * self.span < 0:
            return None
        is_same = np.array_equal(self.start, other.start) and np.array_equal(self.radii, other.radii)
        if not is_same or abs(self.span + other.span) > math.tau + 1e-9:
            return None
        return Piece(self.start, self.step, self.radii, self.angle, self.first, self.span + other.span)

    def segments(self, digits: int) -> Iterator[Segment]:
        """What is drawn of it."""
        if self.radii is None:
            yield (_point(self.end, digits),)
            return
        span, radii = abs(self.span), self.radii
        count = 1 if span <= WIDEST or AROUND[0] <= span <= AROUND[1] else math.ceil(span / WIDEST)
        if span > ROUND:
            count, radii = 2, np.array([growing(radius, digits) for radius in radii.tolist()])
        for end in np.arange(1, count + 1) / count:
            to = _point(self.at(np.array([end]))[0], digits)
            yield Arc(
                (float(radii[0]), float(radii[1])), self.angle, span / count > math.pi, self.span > 0, to
            )


def arc(center: Points | Point, radii: Point, angle: float, first: float, span: float) -> Piece:
    """A part of an ellipse whose own axes are turned by an angle."""
    nowhere = np.zeros(2)
    return Piece(np.array(center, np.float64), nowhere, np.array(radii, np.float64), angle, first, span)


def radius_of(outline: ArcOutline) -> float:
    """Of the circle that an arc is a part of; none of a line."""
    (x, y), (end_x, end_y) = outline.start, outline.end
    squares = (end_x - x) ** 2 + (end_y - y) ** 2 + 4.0 * outline.sagitta**2
    return squares / (8.0 * abs(outline.sagitta)) if outline.sagitta else math.inf


def middle_line(outline: ArcOutline) -> Piece:
    """What a pen draws along, of an outline in user units."""
    start, end, sagitta = np.array(outline.start), np.array(outline.end), outline.sagitta
    chord = end - start
    if not sagitta:
        return Piece(start, chord)
    across = float(np.linalg.norm(chord))
    along = chord / across if across else np.array([1.0, 0.0])
    out = np.array([-along[1], along[0]])
    radius = radius_of(outline)
    center = (start + end) / 2.0 + out * (sagitta - math.copysign(radius, sagitta))
    x, y = start - center
    span = -4.0 * math.atan2(sagitta, across / 2.0)
    return arc(center, (radius, radius), 0.0, math.atan2(y, x), span)


def contour(pieces: Sequence[Piece], digits: int) -> Contour:
    """Pieces, each from where the one before ends, as they are drawn."""
    segments = tuple(segment for piece in pieces for segment in piece.segments(digits))
    return Contour(_point(pieces[0].begin, digits), segments)


def _point(place: Points, digits: int) -> Point:
    x, y = np.round(place, digits).tolist()
    return x, y

"""What a vector format draws for the contour `distance = offset` of a shape."""

from __future__ import annotations

from dataclasses import dataclass

Point = tuple[float, float]


@dataclass(frozen=True)
class EllipseOutline:
    """An ellipse about `center` with its own axes turned by `angle`."""

    center: Point
    radii: Point
    angle: float = 0.0


@dataclass(frozen=True)
class RectangleOutline:
    """A rectangle of `half_size` about `center`, turned by `angle`, with rounded corners."""

    center: Point
    half_size: Point
    angle: float
    corner_radius: float


@dataclass(frozen=True)
class PolygonOutline:
    """A polygon grown by `rounding` on all sides, which rounds its corners."""

    points: tuple[Point, ...]
    rounding: float


@dataclass(frozen=True)
class ArcOutline:
    """What a round pen draws along an arc of a circle. `sagitta`: how far it is from the chord, to the right of who
    goes from start to end on the screen.
    """

    start: Point
    end: Point
    sagitta: float
    half_width: float


Outline = EllipseOutline | RectangleOutline | PolygonOutline | ArcOutline

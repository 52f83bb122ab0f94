"""A drawing as data: a display list, from which any vector format can be written.

Lengths and points (x, y) are in user units, y down; angles in radians, clockwise on the screen; colours sRGB-coded,
0..1. Later items lie on earlier ones.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

from ...outlines import Outline, Point
from ...scene import Color, Ground


class Arc(NamedTuple):
    """A part of an ellipse whose own axes are turned by `angle`, to a point: the larger part, or clockwise on the
    screen.
    """

    radii: Point
    angle: float
    is_large: bool
    is_clockwise: bool
    end: Point


# without its start; of points a Bézier curve: one is a line, three are a cubic
Segment = tuple[Point, ...] | Arc


def points_of(segment: Segment) -> tuple[Point, ...]:
    """Those that tell a segment: of an arc its end."""
    return (segment.end,) if isinstance(segment, Arc) else segment


class Contour(NamedTuple):
    """A line, closed where it is filled."""

    start: Point
    segments: tuple[Segment, ...]

    @classmethod
    def straight(cls, corners: Sequence[Point]) -> Contour:
        """Straight lines from corner to corner."""
        first, *rest = corners
        return cls(first, tuple((corner,) for corner in rest))

    @property
    def begins_straight(self) -> bool:
        """Whether its first segment is a line."""
        return bool(self.segments) and len(self.segments[0]) == 1

    @property
    def is_curved(self) -> bool:
        """Whether it has Bézier curves."""
        return any(len(segment) > 1 for segment in self.segments if not isinstance(segment, Arc))

    @property
    def points(self) -> list[Point]:
        """Those that its segments tell, but the start."""
        return [point for segment in self.segments for point in points_of(segment)]


@dataclass(frozen=True)
class Path:
    """What lies within an odd number of contours."""

    contours: tuple[Contour, ...]


Geometry = Outline | Path


class Stop(NamedTuple):
    """A colour and its opacity at an offset 0..1 of a gradient."""

    offset: float
    color: Color
    opacity: float = 1.0


@dataclass(frozen=True)
class LinearGradient:
    """From one point to another."""

    start: Point
    end: Point
    stops: tuple[Stop, ...]


@dataclass(frozen=True)
class RadialGradient:
    """From the centre of an ellipse to its rim; its own axes are turned by `angle`."""

    center: Point
    radii: Point
    stops: tuple[Stop, ...]
    angle: float = 0.0


Fill = Color | LinearGradient | RadialGradient


@dataclass(frozen=True)
class Figure:
    """A filled geometry, blurred by a Gaussian of the standard deviation `blur`.

    Where it is not antialiased, a pixel belongs to it whose centre does.
    """

    geometry: Geometry
    fill: Fill
    opacity: float = 1.0
    blur: float = 0.0
    antialiased: bool = True
    name: str = ""


@dataclass(frozen=True)
class Group:
    """Items composited by themselves, blurred by a Gaussian of the standard deviation `blur`, then laid on what is
    below as one.
    """

    items: tuple[Figure, ...]
    opacity: float = 1.0
    name: str = ""
    blur: float = 0.0


Item = Figure | Group


@dataclass(frozen=True)
class Drawing:
    """A canvas of `width` × `height`, shown `scale` pixels a user unit, on a ground or none.

    Coordinates tell to so many decimal `digits`.
    """

    width: float
    height: float
    scale: float
    digits: int
    ground: Ground
    items: tuple[Item, ...]

    @property
    def figures(self) -> list[Figure]:
        """All of them, also those of groups."""
        return [f for item in self.items for f in (item.items if isinstance(item, Group) else (item,))]


def moved(color: Sequence[float], levels: float) -> Color:
    """A colour with so many 8-bit levels more in all channels."""
    red, green, blue = (channel + levels / 255.0 for channel in color)
    return red, green, blue

"""The layers that draw a region's strokes: arcs; where their ends are square, boxes and what wedges leave of rings; and
boxes out of which others are cut.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Sequence

import numpy as np
import torch

from ..arrays import Float64Array
from ..blend import INTERSECTION, SUBTRACTION
from ..paints import FLAT
from ..render.tensors import Group
from .arcs import WIDEST, wedge
from .areas import CIRCLE, Area
from .candidates import ARC, Opening, joined_sharply
from .covering import BOX, TRIANGLE, with_triangle
from .frames import Frame, framed
from .strokes import Bow, Line, Stroke, strokes

KINDS_OF_STROKES = frozenset((BOX, CIRCLE, TRIANGLE, ARC))


def stroked(area: Area, kinds: Collection[str]) -> list[Group]:
    """Those of an area that is made of strokes; else none, nor where there may be no shapes of their kinds."""
    if not KINDS_OF_STROKES.issubset(kinds):
        return []
    return layers_of(framed(strokes(area.coverage), area.coverage > 0.5), area)


def layers_of(found: Sequence[Stroke | Frame], area: Area) -> list[Group]:
    """Those that draw some strokes, in the pixels of an area, in its colour."""
    return [_layer(stroke, area) for stroke in found]


def _layer(stroke: Stroke | Frame, area: Area) -> Group:
    if isinstance(stroke, Frame):
        return _frame(stroke, area)
    if isinstance(stroke, Line):
        return _bar(stroke, area) if stroke.square else _arc(stroke, (stroke.start + stroke.end) / 2.0, area)
    if stroke.square or stroke.is_closed:
        return _ring(stroke, area)
    (middle,) = stroke.at(np.array([stroke.first + stroke.span / 2.0]))
    return _arc(stroke, middle, area)


def _bar(line: Line, area: Area) -> Group:
    """A layer of a box."""
    along, sides = line.end - line.start, (line.length / 2.0 + line.half, line.half)
    middle = (line.start + line.end) / 2.0
    return _with_box(middle, sides, math.atan2(along[1], along[0]), 0.0, area, area.opening())


def _frame(frame: Frame, area: Area) -> Group:
    """A layer of a box out of which another is cut."""
    outer = _grown_box(frame, frame.half, area, area.opening())
    return joined_sharply(_grown_box(frame, -frame.half, area, area.cut(outer)))


def _grown_box(frame: Frame, more: float, area: Area, place: Opening) -> Group:
    """The layer with the box of a frame's middle line in a place, so many pixels larger on all sides."""
    across, down = (side + more for side in frame.sides)
    return _with_box(frame.middle, (across, down), frame.angle, max(frame.radius + more, 0.0), area, place)


def _with_box(
    middle: Float64Array, sides: tuple[float, float], angle: float, radius: float, area: Area, place: Opening
) -> Group:
    """The layer with a box in a place, whose sides in pixels are twice as long."""
    pixel = area.around.points[2]
    box = {
        "center": area.around.places(torch.from_numpy(middle)[None]).float(),
        "half_size": torch.tensor([sides]) * pixel,
        "angle": torch.tensor([[angle]]),
        "corner_radius": torch.tensor([[radius]]) * pixel,
    }
    return place.filled(place.part(BOX, FLAT), box)


def _arc(stroke: Stroke, middle: Float64Array, area: Area) -> Group:
    """A layer of an arc from end to end through a middle [2]."""
    pixel, place = area.around.points[2], area.opening()
    start, end = stroke.ends
    x, y = (end - start) / max(float(np.linalg.norm(end - start)), 1e-9)
    sagitta = float((middle - (start + end) / 2.0) @ np.array([-y, x]))
    a, b = area.around.places(torch.from_numpy(stroke.ends)).float()[:, None]
    lengths = {"sagitta": sagitta, "half_width": stroke.half}
    arc = {"a": a, "b": b} | {name: torch.tensor([[v * pixel]]) for name, v in lengths.items()}
    return place.filled(place.part(ARC, FLAT), arc)


def _ring(bow: Bow, area: Area) -> Group:
    """A layer of a ring, of which wedges leave or take away a part."""
    x, y = bow.middle.tolist()
    layer = area.with_circle(x, y, bow.radius + bow.half, area.opening())
    if bow.radius > bow.half:
        layer = area.with_circle(x, y, bow.radius - bow.half, area.cut(layer))
    for join, triangle in () if bow.is_closed else _wedges(bow):
        place = area.cut(layer) if join == SUBTRACTION else area.meeting(layer)
        layer = with_triangle(place, triangle, area.around)
    return joined_sharply(layer)


def _wedges(bow: Bow) -> Iterator[tuple[str, Float64Array]]:
    """How triangles are joined to a bow's ring, and which."""
    (first, span), radius = bow.sector, bow.radius + bow.half
    if span <= WIDEST:
        yield INTERSECTION, wedge(bow.middle, radius, first, span)
        return
    gap = math.tau - span
    count = math.ceil(gap / WIDEST)
    for index in range(count):
        yield SUBTRACTION, wedge(bow.middle, radius, first + span + index * gap / count, gap / count)

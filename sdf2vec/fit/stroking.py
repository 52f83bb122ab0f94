"""The layers that draw a region's strokes: boxes with round corners, what is left of boxes out of which others are cut,
and what wedges leave of rings.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np
import torch

from ..arrays import Float64Array
from ..blend import INTERSECTION, SUBTRACTION
from ..paints import FLAT
from ..render.tensors import Group
from .arcs import WIDEST, wedge
from .areas import CIRCLE, Area
from .candidates import Opening, Proposer, joined_sharply
from .covering import BOX, TRIANGLE, with_triangle
from .frames import Frame, framed
from .strokes import Bow, Line, Stroke, strokes

KINDS_OF_STROKES = frozenset((BOX, CIRCLE, TRIANGLE))
SEEN = 16  # points of the edge of a disc at an end of a bow
WITHIN = 0.9  # of its radius: where they are


def stroked(area: Area, proposer: Proposer) -> list[Group]:
    """Those of an area that is made of strokes; else none, nor where there may be no shapes of their kinds."""
    if not set(proposer.kinds) >= KINDS_OF_STROKES:
        return []
    return layers_of(framed(strokes(area.coverage), area.coverage > 0.5), area)


def layers_of(found: Sequence[Stroke | Frame], area: Area) -> list[Group]:
    """Those that draw some strokes, in the pixels of an area, in its colour."""
    return [_layer(stroke, found, area) for stroke in found]


def _layer(stroke: Stroke | Frame, every: Sequence[Stroke | Frame], area: Area) -> Group:
    if isinstance(stroke, Line):
        return _line(stroke, area)
    return (
        _frame(stroke, area) if isinstance(stroke, Frame) else _bow(stroke, _bare_ends(stroke, every), area)
    )


def _line(line: Line, area: Area) -> Group:
    """A layer of a box."""
    along, sides = line.end - line.start, (line.length / 2.0 + line.half, line.half)
    radius = 0.0 if line.square else line.half
    middle = (line.start + line.end) / 2.0
    return _with_box(middle, sides, math.atan2(along[1], along[0]), radius, area, area.opening())


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


def _bow(bow: Bow, ends: Sequence[Float64Array], area: Area) -> Group:
    """A layer of a ring, of which wedges leave or take away a part, and of discs at some ends."""
    x, y = bow.middle.tolist()
    layer = area.with_circle(x, y, bow.radius + bow.half, area.opening())
    if bow.radius > bow.half:
        layer = area.with_circle(x, y, bow.radius - bow.half, area.cut(layer))
    for join, triangle in () if bow.is_closed else _wedges(bow):
        place = area.cut(layer) if join == SUBTRACTION else area.meeting(layer)
        layer = with_triangle(place, triangle, area.around)
    for end in ends:
        layer = area.with_circle(float(end[0]), float(end[1]), bow.half, area.joining(layer))
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


def _bare_ends(bow: Bow, every: Sequence[Stroke | Frame]) -> list[Float64Array]:
    """The round ends of a bow that no other stroke covers."""
    if bow.square:
        return []
    turns = np.linspace(0.0, math.tau, SEEN, endpoint=False)
    edge = WITHIN * bow.half * np.stack([np.cos(turns), np.sin(turns)], axis=1)
    own = [bow.without_ends, *(stroke for stroke in every if stroke is not bow)]
    return [
        end for end in bow.ends if not np.any([stroke.covers(end + edge) for stroke in own], axis=0).all()
    ]

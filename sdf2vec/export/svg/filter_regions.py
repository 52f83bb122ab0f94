"""The regions of blur filters: few of them, in which renderers blur few pixels in vain."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ...outlines import ArcOutline, EllipseOutline, PolygonOutline, RectangleOutline
from .canvas import Points
from .display import Drawing, Figure, Geometry, Group, Path
from .pieces import middle_line

REACH = 3.0  # standard deviations that a blur reaches
USUAL_MARGIN = 0.1  # of a box, that a filter's region has by itself
LARGER = 3.0  # times as large a region is as good
SMALLEST = 0.1  # user units: no box is taken for smaller
ALONG = 33  # points of an arc
THIN = 1.0  # user units: a side that may be written as none, and nothing is blurred in shares of that
MOST = 128  # different margins of figures of one blur; of more, those are told apart that are of other steps
MARGINS = (0.1, 0.2, 0.3, 0.45, 0.6, 0.8, 1.1, 1.5, 2, 3, 4.5, 7, 10, 20, 50, 100, 200, 500, 1000)


class Region(NamedTuple):
    """Where a filter works: in shares of the element's box, or in user units."""

    left: float
    top: float
    width: float
    height: float
    in_user_units: bool = False

    @property
    def area(self) -> float:
        """In squares of the units that it is in."""
        return self.width * self.height

    @classmethod
    def around(cls, across: float, down: float) -> Region:
        """An element's box with such margins, in its sides."""
        return cls(-across, -down, 1.0 + 2.0 * across, 1.0 + 2.0 * down)

    @classmethod
    def of_canvas(cls, drawing: Drawing, blur: float) -> Region:
        """All that a blur can bring into the canvas."""
        reach = math.ceil(REACH * blur)
        return cls(-reach, -reach, drawing.width + 2 * reach, drawing.height + 2 * reach, True)


def region_of_group(group: Group, drawing: Drawing) -> Region | None:
    """What a group's blur needs of a drawing; none where the region that a filter has by itself holds that and is not
    much larger: the box of what it is put on, and a tenth more on each side.
    """
    needed = Region.of_canvas(drawing, group.blur)
    geometries = [figure.geometry for figure in group.items]
    plain = [each for each in geometries if isinstance(each, PolygonOutline) and not each.rounding]
    if len(plain) < len(geometries):
        return needed
    points = np.concatenate([np.array(each.points) for each in plain])
    low, high = points.min(axis=0), points.max(axis=0)
    margin, reach = USUAL_MARGIN * (high - low), REACH * group.blur
    start = np.array([needed.left, needed.top])
    end = start + np.array([needed.width, needed.height])
    holds = (low - margin <= np.maximum(low - reach, start)) & (
        high + margin >= np.minimum(high + reach, end)
    )
    area = float(np.prod(high - low + 2.0 * margin))
    return None if holds.all() and area < LARGER * needed.area else needed


def region_of(figure: Figure) -> Region:
    """The box of a figure and what its blur reaches, each side for itself; of a stroke in user units, for an element's
    box is that of its middle line.
    """
    if isinstance(figure.geometry, ArcOutline):
        points, reach = _points_of(figure.geometry), REACH * figure.blur + figure.geometry.half_width
        low, high = np.floor(points.min(axis=0) - reach), np.ceil(points.max(axis=0) + reach)
        (left, top), (width, height) = low.tolist(), (high - low).tolist()
        return Region(left, top, width, height, True)
    wanted = REACH * figure.blur / np.maximum(box_of(figure.geometry) + 2.0 * rounding_of(figure), SMALLEST)
    return Region.around(*_stepped(wanted).tolist())


def shared_regions(drawing: Drawing, worth: float) -> dict[Figure, Region]:
    """For each blurred figure a region that others of its blur share, its rounding being a stroke.

    One filter more is worth blurring this share of the canvas' pixels in vain.
    """
    by_blur: dict[float, list[Figure]] = {}
    for item in drawing.items:
        if isinstance(item, Figure) and item.blur:
            by_blur.setdefault(item.blur, []).append(item)
    found: dict[Figure, Region] = {}
    for blur, figures in by_blur.items():
        canvas = Region.of_canvas(drawing, blur)
        for shared in _merged(_alike(figures), canvas, worth * drawing.width * drawing.height):
            found |= dict.fromkeys(shared.figures, shared.region(canvas))
    return found


class _Shared(NamedTuple):
    """Figures of one filter: the margins of their boxes [2] in their sides, the boxes' area, the number of figures.

    The area is infinite where a box is too thin for a region in shares of it, the number where the canvas can't be it.
    """

    figures: tuple[Figure, ...]
    margins: Points
    area: float
    number: float

    def __or__(self, other: _Shared) -> _Shared:
        margins = np.maximum(self.margins, other.margins)
        area, number = self.area + other.area, self.number + other.number
        return _Shared(self.figures + other.figures, margins, area, number)

    def region(self, canvas: Region) -> Region:
        """The cheaper one."""
        around = Region.around(*self.margins.tolist())
        return around if self.area * around.area <= self.number * canvas.area else canvas


def _alike(figures: Sequence[Figure]) -> list[_Shared]:
    """Figures that want the same margins, together, if the canvas can be the region of all or of none."""
    boxes = [np.maximum(box_of(figure.geometry), SMALLEST) for figure in figures]
    wanted = [
        (REACH * figure.blur + rounding_of(figure)) / box for figure, box in zip(figures, boxes, strict=True)
    ]
    margins = _rounded_up(np.array(wanted))
    if len(np.unique(margins, axis=0)) > MOST:
        margins = _stepped(np.array(wanted))
    found: dict[tuple[float, ...], _Shared] = {}
    for figure, box, own in zip(figures, boxes, margins, strict=True):
        number = 1.0 if isinstance(figure.geometry, PolygonOutline | ArcOutline | Path) else math.inf
        area = float(box.prod()) if number == math.inf or box.min() >= THIN else math.inf
        one, key = _Shared((figure,), own, area, number), (number, *own.tolist())
        found[key] = found[key] | one if key in found else one
    return list(found.values())


def _rounded_up(margins: Points) -> Points:
    """To two digits."""
    step = 10.0 ** np.maximum(np.floor(np.log10(margins)) - 1.0, -2.0)
    return np.asarray(np.ceil(margins / step) * step)


def _stepped(margins: Points) -> Points:
    """The next one of MARGINS for each."""
    return np.array(MARGINS)[np.minimum(np.searchsorted(MARGINS, margins), len(MARGINS) - 1)]


def _merged(groups: list[_Shared], canvas: Region, price: float) -> list[_Shared]:
    """Two become one, those first that save most, while a filter costs more than the pixels blurred in vain."""

    def pixels(margins: Points, areas: Points, numbers: Points) -> Points:
        around = areas * np.prod(1.0 + 2.0 * margins, axis=-1)
        return np.asarray(np.minimum(around, numbers * canvas.area))

    while len(groups) > 1:
        _, *columns = zip(*groups, strict=True)
        margins, areas, numbers = map(np.array, columns)
        alone = pixels(margins, areas, numbers)
        wider = np.maximum(margins[:, None], margins)
        both = pixels(wider, areas[:, None] + areas, numbers[:, None] + numbers)
        saved = price + alone[:, None] + alone - both
        np.fill_diagonal(saved, -math.inf)
        first, second = divmod(int(saved.argmax()), len(groups))
        if saved[first, second] <= 0:
            break
        rest = [group for index, group in enumerate(groups) if index not in (first, second)]
        groups = [*rest, groups[first] | groups[second]]
    return groups


def rounding_of(figure: Figure) -> float:
    """By how much a polygon or a line is larger than its own box, on each side, in user units; all else is not."""
    if isinstance(figure.geometry, ArcOutline):
        return figure.geometry.half_width
    return figure.geometry.rounding if isinstance(figure.geometry, PolygonOutline) else 0.0


def box_of(geometry: Geometry) -> Points:
    """Width and height [2] of a geometry in its own frame, without the rounding."""
    if isinstance(geometry, EllipseOutline):
        return 2.0 * np.array(geometry.radii)
    if isinstance(geometry, RectangleOutline):
        return 2.0 * np.array(geometry.half_size)
    if isinstance(geometry, PolygonOutline):
        return np.asarray(np.ptp(np.array(geometry.points), axis=0))
    if isinstance(geometry, ArcOutline):
        return np.asarray(np.ptp(_points_of(geometry), axis=0))
    points = [point for contour in geometry.contours for point in contour.points]
    return np.asarray(np.ptp(np.array(points), axis=0))


def _points_of(arc: ArcOutline) -> Points:
    """Points [N, 2] that a pen goes along."""
    return middle_line(arc).at(np.linspace(0.0, 1.0, ALONG))

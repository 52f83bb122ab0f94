"""The display list as SVG text, by svgwrite: what is said once for many, ids, classes, numbers."""

from __future__ import annotations

import hashlib
import math
import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import singledispatchmethod
from itertools import groupby
from typing import Any, TypeGuard
from xml.etree import ElementTree
from xml.sax.saxutils import escape

import numpy as np
import svgwrite

from ...outlines import ArcOutline, EllipseOutline, Point, PolygonOutline, RectangleOutline
from ...scene import Color
from ..exported import MARK
from .canvas import Points, growing, pairs
from .display import (
    Arc,
    Contour,
    Drawing,
    Figure,
    Geometry,
    Group,
    Item,
    LinearGradient,
    Path,
    RadialGradient,
    Stop,
    points_of,
)
from .filter_regions import Region, region_of, region_of_group, rounding_of, shared_regions
from .outlines import convex, sides
from .pieces import contour, middle_line
from .wording import compressible

Element = Any  # svgwrite has no types
Attributes = dict[str, str | None]

PREFIX = "@@"  # of ids, until the content that makes it is known
NEEDLESS = ("version", "baseProfile", "xmlns:ev", "xmlns:xlink")  # that svgwrite puts at the root
SHARED = ("fill", "fill-rule", "shape-rendering")  # attributes that a group says for all its items
FLAT = 0.05  # user units: a rounding below it is none
STROKES = {"stroke-width": "0", "stroke-linejoin": "round"}
# said by a class, never by a group: CairoSVG and Inkscape take the group's own colour for it then
OWN_COLOR, OWN_STROKE = ";fill:currentColor;stroke:currentColor", ";fill:none;stroke:currentColor"


@dataclass(frozen=True)
class Style:
    """How a drawing is written. `named`: with the figures' names as ids; `sized`: with a width and a height.

    `compact`: each figure with as few words as there are. The softness is a class, a polygon's rounding a stroke, in
    `currentColor` where the class can say that. One more filter is worth blurring the share `filter` of the canvas'
    pixels in vain.
    """

    named: bool = True
    compact: bool = False
    filter: float = 0.2
    sized: bool = False


def written(drawing: Drawing, title: str, style: Style, alt: str = "") -> str:
    """The whole SVG, described by `alt`. Ids begin with a hash of the content, so that drawings can share a page."""
    inner = _Writer(drawing, style).text()
    prefix = "s" + hashlib.sha256(inner.encode()).hexdigest()[:5]
    head, rest = inner.replace(PREFIX, prefix).split(">", 1)
    title, alt = (escape(text, {'"': "&quot;"}) for text in (title, alt))
    told = f"<desc>{alt}</desc>" if alt else ""
    return f"{head}>\n<title>{title}</title>{told}<!-- {MARK} -->{rest}\n"


class _Writer:
    """The growing document: definitions and classes, each said once however often it is used."""

    def __init__(self, drawing: Drawing, style: Style) -> None:
        self.drawing = drawing
        self.style = style
        width, height = drawing.width, drawing.height
        size = (number(width * drawing.scale, 4), number(height * drawing.scale, 4))
        self.svg = svgwrite.Drawing(
            size=size if style.sized else None,
            viewBox=f"0 0 {number(width, 4)} {number(height, 4)}",
            role="img",
            debug=False,
        )
        self.ids: dict[str, str] = {}
        self.classes: dict[str, str] = {}
        self.roundings = _usual_roundings(drawing.figures)
        self.strokes = style.compact and any(rounding_of(figure) > 0.0 for figure in drawing.figures)
        self.regions = shared_regions(drawing, style.filter) if style.compact else {}
        self.data = self._data() if style.compact else {}

    def text(self) -> str:
        """The document without its title, ids with PREFIX."""
        drawing, body = self.drawing, self.svg
        if drawing.ground is not None:
            body.add(body.rect((None, None), ("100%", "100%"), **_ground_fill(drawing.ground)))
        items = list(self._elements())
        if self.strokes:
            body = self.svg.add(self.svg.g(**STROKES))
            if any(isinstance(figure.geometry, ArcOutline) for figure in drawing.figures):
                body["stroke-linecap"] = "round"
        for item in items:
            body.add(item)
        if self.classes:
            rules = "".join(f".{name}{{{rule}}}" for rule, name in self.classes.items())
            self.svg.elements.insert(1, self.svg.style(rules))
        if not self.svg.defs.elements:
            self.svg.elements.remove(self.svg.defs)
        return _lean(self.svg.get_xml())

    def _elements(self) -> Iterator[Element]:
        """One for each item, or for a run of strokes of the same pen."""
        for pen, run in groupby(self.drawing.items, pen_of):
            first, *rest = run
            if pen is None or not rest or not self.strokes:
                yield from map(self.item, (first, *rest))
                continue
            figures = [item for item in (first, *rest) if isinstance(item, Figure)]
            arcs = [each.geometry for each in figures if isinstance(each.geometry, ArcOutline)]
            data = "".join(self._open(arc, alone=False) for arc in arcs)
            bent = next((figure for figure in figures if _is_bent(figure.geometry)), figures[0])
            yield self._with(self.svg.path(data), self._look(bent))

    def item(self, item: Item) -> Element:
        """A figure or a group; what a group's figures have in common is said by it."""
        name = f"{PREFIX}{item.name}" if self.style.named and item.name else None
        if isinstance(item, Figure):
            return self.element(item.geometry, self._look(item) | {"id": name})
        group = self.svg.g(opacity=opacity_text(item.opacity), id=name)
        if item.blur:
            group["filter"] = self._group_filter(item)
        made = [self.element(figure.geometry, self._look(figure)) for figure in item.items]
        for key in SHARED:
            values = {element.attribs.get(key) for element in made}
            if len(values) == 1 and None not in values:
                group[key] = values.pop()
                for element in made:
                    del element.attribs[key]
        for element in made:
            group.add(element)
        return group

    # --- how a figure looks ---------------------------------------------------------------------------------

    def _look(self, figure: Figure) -> Attributes:
        """The attributes of a figure."""
        if not self.style.compact:
            return self._painted(figure)
        rounding = rounding_of(figure)
        look: Attributes = {"opacity": opacity_text(figure.opacity)}
        paint = self.paint(figure.fill, figure)
        is_bent = _is_bent(figure.geometry)
        is_said_once = self.strokes and figure.blur > 0.0 and isinstance(figure.fill, tuple)
        if is_said_once:
            look["color"] = paint
        else:
            fill = "none" if is_bent else None if pen_of(figure) else paint
            look |= {"fill": fill, "stroke": paint if rounding else None}
        stroke = self.number(2.0 * rounding) if rounding else None
        if figure.blur:
            usual = stroke and rounding == self.roundings.get(figure.blur)
            rule = f";stroke-width:{self.fine(2.0 * rounding)}" if usual else ""
            own = (OWN_STROKE if is_bent else OWN_COLOR) if is_said_once else ""
            look["class"] = self._class(f"filter:{self._filter(figure)}{own}{rule}")
            stroke = None if usual else stroke
        return look | {"stroke-width": stroke}

    def _painted(self, figure: Figure) -> Attributes:
        look: Attributes = {"fill": self.paint(figure.fill, figure)}
        if isinstance(figure.geometry, ArcOutline):
            width = self.number(2.0 * figure.geometry.half_width)
            look = {"fill": "none", "stroke": look["fill"], "stroke-width": width, "stroke-linecap": "round"}
        if figure.blur:
            look["filter"] = self._filter(figure)
        else:
            is_plain = isinstance(figure.fill, tuple) and not isinstance(figure.geometry, ArcOutline)
            key = "fill-opacity" if is_plain else "opacity"
            look[key] = opacity_text(figure.opacity)
        if not figure.antialiased:
            look["shape-rendering"] = "crispEdges"
        return look

    @singledispatchmethod
    def paint(self, fill: Color, figure: Figure) -> str:
        """A fill as an attribute's value."""
        return color_text(fill)

    @paint.register
    def _(self, fill: LinearGradient, figure: Figure) -> str:
        ends = (self._within_element(point, figure.geometry) for point in (fill.start, fill.end))
        start, end = ((self.fine(x), self.fine(y)) for x, y in ends)
        made = self.svg.linearGradient(start, end, gradientUnits="userSpaceOnUse")
        return self._gradient(made, fill.stops)

    def _within_element(self, point: Point, geometry: Geometry) -> Point:
        """A point in the coordinates of the element that a geometry becomes: a turned one has its own."""
        if not self._is_turned(geometry):
            return point
        angle = geometry.angle % math.pi
        x, y = (a - b for a, b in zip(point, geometry.center, strict=True))
        x, y = x * math.cos(angle) + y * math.sin(angle), y * math.cos(angle) - x * math.sin(angle)
        left, top = (0.0, 0.0) if isinstance(geometry, EllipseOutline) else geometry.center
        return x + left, y + top

    def _is_turned(self, geometry: Geometry) -> TypeGuard[EllipseOutline | RectangleOutline]:
        """Whether the element that a geometry becomes has coordinates of its own."""
        round_ = isinstance(geometry, EllipseOutline) and len({*map(self.number, geometry.radii)}) == 1
        return isinstance(geometry, EllipseOutline | RectangleOutline) and not round_

    @paint.register
    def _(self, fill: RadialGradient, figure: Figure) -> str:
        """In user units, turned and squeezed where it is not round.

        Not in shares of its box, where that is no square: librsvg mistakes gradients that are stretched with a box.
        """
        geometry, (across, down) = figure.geometry, fill.radii
        radius, is_round = self.number(across), self.number(across) == self.number(down)
        if is_round and isinstance(geometry, EllipseOutline) and _has_rim_of(geometry, fill):
            return self._gradient(self.svg.radialGradient(), fill.stops)
        x, y = map(self.number, self._within_element(fill.center, geometry))
        if is_round:
            made = self.svg.radialGradient((x, y), radius, gradientUnits="userSpaceOnUse")
            return self._gradient(made, fill.stops)
        own = geometry.angle if self._is_turned(geometry) else 0.0
        turn = number(math.degrees(fill.angle - own) % 180.0, 2)
        steps = {f"translate({x} {y})": (x, y) != ("0", "0"), f"rotate({turn})": turn not in ("0", "180")}
        steps[f"scale(1 {number(down / across, 5)})"] = True
        made = self.svg.radialGradient(("0", "0"), radius, gradientUnits="userSpaceOnUse")
        made["gradientTransform"] = "".join(step for step, needed in steps.items() if needed)
        return self._gradient(made, fill.stops)

    def _gradient(self, gradient: Element, stops: Sequence[Stop]) -> str:
        for offset, color, opacity in stops:
            gradient.add_stop_color(number(offset, 3), color_text(color), opacity_text(opacity))
        return self._defined("g", gradient)

    def _filter(self, figure: Figure) -> str:
        """A blur, in a region that other figures can share.

        The opacity is part of it, for browsers round an attribute's down; not of a class, which all opacities share.
        """
        region = self.regions[figure] if self.style.compact else region_of(figure)
        made = self._blur(figure.blur, region)
        opacity = opacity_text(figure.opacity)
        if opacity is not None and not self.style.compact:
            made.feComponentTransfer(None).feFuncA("linear", slope=opacity)
        return self._defined("b", made)

    def _group_filter(self, group: Group) -> str:
        """A blur of a whole group."""
        return self._defined("b", self._blur(group.blur, region_of_group(group, self.drawing)))

    def _blur(self, deviation: float, region: Region | None) -> Element:
        made = self.svg.filter(color_interpolation_filters="sRGB", **(_attributes(region) if region else {}))
        made.feGaussianBlur(None, stdDeviation=self.fine(deviation))
        return made

    def _defined(self, letter: str, definition: Element) -> str:
        """A reference to a definition; the same one as before for equal content."""
        content = definition.tostring()
        if content not in self.ids:
            self.ids[content] = f"{PREFIX}{letter}{len(self.ids) + 1}"
            definition["id"] = self.ids[content]
            self.svg.defs.add(definition)
        return f"url(#{self.ids[content]})"

    def _class(self, rule: str) -> str:
        return self.classes.setdefault(rule, f"{PREFIX}{_letters(len(self.classes))}")

    # --- geometry -------------------------------------------------------------------------------------------

    @singledispatchmethod
    def element(self, geometry: Geometry, look: Attributes) -> Element:
        """A geometry as one element."""
        raise NotImplementedError(type(geometry))

    @element.register
    def _(self, geometry: EllipseOutline, look: Attributes) -> Element:
        (x, y), (across, down) = map(self.number, geometry.center), map(self.number, geometry.radii)
        if across == down:
            return self._with(self.svg.circle((x, y), across), look)
        turned = self.fine(math.degrees(geometry.angle) % 180.0)
        turn = "" if turned == "0" else f"rotate({turned})"
        made = self.svg.ellipse((None, None), (across, down), transform=f"translate({x} {y}){turn}")
        return self._with(made, look)

    @element.register
    def _(self, geometry: RectangleOutline, look: Attributes) -> Element:
        (x, y), (across, down) = geometry.center, geometry.half_size
        radius = self.number(geometry.corner_radius)
        turned = self.fine(math.degrees(geometry.angle) % 180.0)
        turn = None if turned == "0" else f"rotate({turned} {self.number(x)} {self.number(y)})"
        corner = (self.number(x - across), self.number(y - down))
        size = (self.number(2.0 * across), self.number(2.0 * down))
        made = self.svg.rect(corner, size, None if radius == "0" else radius, transform=turn)
        return self._with(made, look)

    @element.register
    def _(self, geometry: PolygonOutline, look: Attributes) -> Element:
        data = self.data[geometry] if self.style.compact else self._closed(geometry)
        return self._with(self.svg.path(data), look)

    @element.register
    def _(self, geometry: ArcOutline, look: Attributes) -> Element:
        data = self.data[geometry] if self.style.compact else self._open(geometry)
        return self._with(self.svg.path(data), look)

    @element.register
    def _(self, geometry: Path, look: Attributes) -> Element:
        alone = len(geometry.contours) == 1
        data = "".join(self._relative(contour, alone) for contour in geometry.contours)
        return self._with(self.svg.path(data), look | {"fill-rule": "evenodd"})

    def _with(self, element: Element, look: Mapping[str, str | None]) -> Element:
        element.attribs.update({key: value for key, value in look.items() if value is not None})
        return element

    def _data(self) -> dict[PolygonOutline | ArcOutline, str]:
        """Path data of each polygon and line, from the corner or the end and the way round that compress best."""
        figures = self.drawing.figures
        found = dict.fromkeys(
            figure.geometry for figure in figures if isinstance(figure.geometry, PolygonOutline | ArcOutline)
        )
        colors = "".join(color_text(figure.fill)[1:] for figure in figures if isinstance(figure.fill, tuple))
        return dict(zip(found, compressible([self._ways_round(each) for each in found], colors), strict=True))

    def _ways_round(self, geometry: PolygonOutline | ArcOutline) -> list[str]:
        if isinstance(geometry, ArcOutline):
            back = ArcOutline(geometry.end, geometry.start, -geometry.sagitta, geometry.half_width)
            return [self._open(geometry), self._open(back)]
        corners = np.array(geometry.points)
        return [
            self._relative(Contour.straight(pairs(np.roll(way, -first, axis=0))))
            for way in (corners, corners[::-1])
            for first in range(len(corners))
        ]

    def _open(self, arc: ArcOutline, alone: bool = True) -> str:
        """Path data of what a pen draws along."""
        return self._relative(contour([middle_line(arc)], self.drawing.digits), alone).removesuffix("z")

    def _closed(self, outline: PolygonOutline) -> str:
        """Path data of a polygon: straight edges moved outwards, joined by arcs."""
        points, rounding = np.array(outline.points), outline.rounding
        if rounding < FLAT:
            return f"M{self._joined(points)}Z"
        corners = convex(points)
        moved = [(a + n * rounding, b + n * rounding) for a, b, n in sides(corners)] or [(points[0],) * 2]
        radius = self.number(rounding if len(corners) > 2 else growing(rounding, self.drawing.digits))
        arc = f"A{radius} {radius} 0 0 1 "
        edges = [f"{self._joined(a[None])}L{self._joined(b[None])}" for a, b in moved]
        return f"M{arc.join(edges)}{arc}{self._joined(moved[0][0][None])}Z"

    def _joined(self, points: Points) -> str:
        return " ".join(f"{self.number(x)} {self.number(y)}" for x, y in points.tolist())

    def _relative(self, contour: Contour, alone: bool = True) -> str:
        """Path data by how far each point is from where its segment begins; rounding does not add up.

        Lines right after the `m` that a path begins with need no letter; any other `m` would count from the last start.
        """
        x, y = contour.start
        begins, last = ("m", "l") if alone and contour.begins_straight else ("M", "")
        parts = [f"{begins}{self.fine(x)} {self.fine(y)}"]
        for segment in contour.segments:
            points = points_of(segment)
            steps = [
                (round(a - x, self.drawing.digits), round(b - y, self.drawing.digits)) for a, b in points
            ]
            letter = "l" if len(points) == 1 else "c"
            values = " ".join(self.number(value) for step in steps for value in step)
            if isinstance(segment, Arc):
                letter, values = "a", f"{self._bow(segment)} {values}"
            parts.append((letter if letter != last else " ") + values)
            x, y, last = x + steps[-1][0], y + steps[-1][1], letter
        return "".join(parts).replace(" -", "-") + "z"

    def _bow(self, arc: Arc) -> str:
        """What path data says of an arc but its end: radii, turn, the larger part, clockwise."""
        across, down = map(self.number, arc.radii)
        turn = "0" if across == down else self.fine(math.degrees(arc.angle) % 180.0)
        return f"{across} {down} {turn} {arc.is_large:d} {arc.is_clockwise:d}"

    # --- numbers --------------------------------------------------------------------------------------------

    def number(self, value: float) -> str:
        """A coordinate or a length."""
        return number(value, self.drawing.digits)

    def fine(self, value: float) -> str:
        """A number that directions hang on: with two decimals more."""
        return number(value, self.drawing.digits + 2)


def _has_rim_of(outline: EllipseOutline, gradient: RadialGradient) -> bool:
    """Whether a gradient ends where an ellipse does."""
    return (gradient.center, gradient.radii) == (outline.center, outline.radii)


def _is_bent(geometry: Geometry) -> bool:
    """Whether it is a line that would have an area if it were filled."""
    return isinstance(geometry, ArcOutline) and geometry.sagitta != 0.0


def pen_of(item: Item) -> tuple[Color, float] | None:
    """The colour and the width of a stroke that is neither blurred nor translucent; None for all else."""
    if not isinstance(item, Figure) or not isinstance(item.geometry, ArcOutline):
        return None
    is_plain = item.opacity == 1.0 and not item.blur
    return (item.fill, item.geometry.half_width) if is_plain and isinstance(item.fill, tuple) else None


def _attributes(region: Region) -> dict[str, str]:
    names = ("x", "y", "width", "height")
    box = {name: number(value, 2) for name, value in zip(names, region[:4], strict=True)}
    return box | ({"filterUnits": "userSpaceOnUse"} if region.in_user_units else {})


def _usual_roundings(figures: Sequence[Figure]) -> dict[float, float]:
    """For each blur the rounding that most of its figures have."""
    counted = Counter((figure.blur, rounding_of(figure)) for figure in figures if rounding_of(figure))
    return {blur: rounding for (blur, rounding), _ in reversed(counted.most_common())}


def number(value: float, digits: int) -> str:
    """A plain decimal number without needless zeros."""
    text = f"{value:.{digits}f}"
    if "." in text:
        text = text.rstrip("0").rstrip(".")
    if text in ("-0", ""):
        return "0"
    return text.replace("0.", ".", 1) if text.startswith(("0.", "-0.")) else text


def _ground_fill(ground: tuple[float, ...]) -> dict[str, str]:
    red, green, blue, *alpha = ground
    sheer = {"fill_opacity": opacity_text(alpha[0])} if alpha else {}
    return {"fill": color_text((red, green, blue))} | {name: text for name, text in sheer.items() if text}


def color_text(color: Color) -> str:
    """A colour as hexadecimal digits, the short form where it says the same."""
    pairs = [f"{round(min(max(255.0 * channel, 0.0), 255.0)):02x}" for channel in color]
    if all(pair[0] == pair[1] for pair in pairs):
        pairs = [pair[0] for pair in pairs]
    return "#" + "".join(pairs)


def opacity_text(opacity: float) -> str | None:
    """An opacity, None for the default."""
    return None if opacity >= 0.9995 else number(opacity, 3)


def _letters(index: int) -> str:
    """A short name for each whole number: a, b, … z, ba, bb, …"""
    rest, last = divmod(index, 26)
    return (_letters(rest) if rest else "") + chr(ord("a") + last)


def _lean(root: ElementTree.Element) -> str:
    """The document as text, an element a line, without what nobody needs."""
    for name in NEEDLESS:
        root.attrib.pop(name, None)
    for parent in (root, *root.iter("defs")):
        parent.text = "\n"
        for child in parent:
            child.tail = "\n"
    text = ElementTree.tostring(root, encoding="unicode").replace(" />", "/>")
    return re.sub(r"<style[^>]*><!\[CDATA\[(.*?)\]\]></style>", r"<style>\1</style>", text)

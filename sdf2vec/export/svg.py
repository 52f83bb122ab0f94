"""A first SVG: every layer where its coverage is one half, with soft edges.

Circles and ellipses get a radial gradient, which says their coverage exactly; other soft edges are blurred by
a Gaussian of the same spread. Unions and shapes without an analytic outline are traced.
"""

from __future__ import annotations

import math
from functools import cache, singledispatch
from typing import Any

import numpy as np
import svgwrite

from ..blend import CUTOFF, MIN_FALLOFF_PIXELS, REACH, coverage, smooth_union
from ..errors import Sdf2vecError
from ..expr import VEC2, components_of, const, constant, scalarize, var, vec3
from ..files import one_line
from ..scene import Color, Layer, Scene
from ..shapes import KINDS, EllipseOutline, Outline, Point, PolygonOutline, RectangleOutline
from .constants import constants
from .options import Options

STOPS = 16
GAUSSIAN = math.pi / math.sqrt(3.0) / 10.0  # standard deviation of the edge's logistic profile, in falloffs
TRACE = 768  # grid cells along the shortest side when a contour is traced
MAX_CELLS = 2048  # grid cells along any side
CHUNK = 1 << 15  # grid points computed at a time
TOLERANCE = 0.05  # pixels that a traced contour may be simplified by


def svg(scene: Scene, options: Options) -> str:
    """The scene as SVG text in pixels of the fitted picture. Raises Sdf2vecError for additive scenes."""
    if scene.compositing == "additive":
        raise Sdf2vecError("svg: additive scenes can't be written as SVG; fit with --compositing over")
    return _Writer(scene, options).text()


class _Writer:
    """Collects definitions and elements of one drawing."""

    def __init__(self, scene: Scene, options: Options) -> None:
        self.scene = scene
        self.unit = float(min(scene.width, scene.height))  # pixels in a scene unit
        self.digits = max(2, 4 - int(math.log10(self.unit)))  # decimals: a drawing is shown at any size
        size = (scene.width, scene.height)
        self.drawing = svgwrite.Drawing(size=size, viewBox=f"0 0 {scene.width} {scene.height}", debug=False)
        self.drawing.attribs["role"] = "img"
        self.drawing.set_desc(title=one_line(options.title))
        self.count = 0

    def text(self) -> str:
        if self.scene.background:
            self.drawing.add(self.drawing.rect(size=("100%", "100%"), fill=_hex(self.scene.background)))
        for layer in self.scene.layers:
            for element in self._layer(layer):
                self.drawing.add(element)
        return str(self.drawing.tostring()) + "\n"

    def _layer(self, layer: Layer) -> list[Any]:
        outline_of = KINDS[layer.kind].outline
        soft = layer.falloff * self.unit > MIN_FALLOFF_PIXELS
        color = _mean_color(layer)
        if outline_of is None or len(layer.shapes) > 1:
            return self._traced(layer, color, soft)
        parameters = layer.shapes[0].named().values()
        if soft and isinstance(edge := outline_of(0.0, *parameters), EllipseOutline):
            return [self._gradient_ellipse(edge, layer, color)]
        element = _draw(outline_of(0.5 * layer.falloff, *parameters), self)
        return [self._painted(element, layer, color, soft)]

    def _painted(self, element: Any, layer: Layer, color: Color, soft: bool) -> Any:
        element.attribs["fill"] = _hex(color)
        if layer.opacity < 1.0:
            element.attribs["fill-opacity"] = _short(layer.opacity, 3)
        if soft:
            element.attribs["filter"] = self._blur(layer)
        return element

    def _blur(self, layer: Layer) -> str:
        low, high = _extent(layer)
        blur = self.drawing.defs.add(
            self.drawing.filter(
                id=self._new_id("blur"),
                filterUnits="userSpaceOnUse",
                start=self.point(low),
                size=[self.length(b - a) for a, b in zip(low, high, strict=True)],
            )
        )
        blur.attribs["color-interpolation-filters"] = "sRGB"
        blur.feGaussianBlur(in_="SourceGraphic", stdDeviation=self.length(GAUSSIAN * layer.falloff))
        return str(blur.get_funciri())

    def _gradient_ellipse(self, edge: EllipseOutline, layer: Layer, color: Color) -> Any:
        """An ellipse as large as the coverage reaches, painted by a gradient that is the coverage."""
        shortest = min(edge.radii)
        reach = 0.5 * layer.falloff + REACH * layer.falloff
        grown = 1.0 + reach / shortest
        gradient = self.drawing.defs.add(self.drawing.radialGradient(id=self._new_id("soft")))
        for distance in _stop_distances(layer.falloff):
            offset = (1.0 + distance / shortest) / grown
            if offset >= 0.0:
                self._stop(gradient, offset, color, layer.opacity * _coverage(distance, layer.falloff))
        if -shortest > (0.5 - REACH) * layer.falloff:
            self._stop(gradient, 0.0, color, layer.opacity * _coverage(-shortest, layer.falloff))
        gradient.elements.sort(key=lambda stop: float(stop.attribs["offset"]))
        outline = EllipseOutline(edge.center, (edge.radii[0] * grown, edge.radii[1] * grown), edge.angle)
        element = _draw(outline, self)
        element.attribs["fill"] = gradient.get_paint_server()
        return element

    def _stop(self, gradient: Any, offset: float, color: Color, opacity: float) -> None:
        gradient.add_stop_color(_short(offset, 4), _hex(color), _short(opacity, 4))

    def _traced(self, layer: Layer, color: Color, soft: bool) -> list[Any]:
        path = " ".join(self._path(contour) for contour in _trace(layer, self))
        if not path:
            return []
        element = self.drawing.path(d=path)
        element.attribs["fill-rule"] = "evenodd"
        return [self._painted(element, layer, color, soft)]

    def _path(self, points: np.ndarray) -> str:
        places = (self.point((x, y)) for x, y in points)
        return "M" + "L".join(f"{x} {y}" for x, y in places) + "Z"

    def point(self, p: Point) -> tuple[float, float]:
        """A scene point in pixels."""
        return (
            _short(p[0] * self.unit + self.scene.width / 2, self.digits),
            _short(p[1] * self.unit + self.scene.height / 2, self.digits),
        )

    def length(self, value: float) -> float:
        """A length of the scene in pixels."""
        return _short(value * self.unit, self.digits)

    def lengths(self, values: Point) -> tuple[float, float]:
        return self.length(values[0]), self.length(values[1])

    def _new_id(self, prefix: str) -> str:
        self.count += 1
        return f"{prefix}{self.count}"


# --- outlines ----------------------------------------------------------------------------------------------


@singledispatch
def _draw(outline: Outline, writer: _Writer) -> Any:
    raise NotImplementedError(type(outline))


@_draw.register
def _(outline: EllipseOutline, writer: _Writer) -> Any:
    center, radii = writer.point(outline.center), writer.lengths(outline.radii)
    if radii[0] == radii[1]:
        return writer.drawing.circle(center, radii[0])
    return _turned(writer.drawing.ellipse(center, radii), outline.angle, center)


@_draw.register
def _(outline: RectangleOutline, writer: _Writer) -> Any:
    center, half = outline.center, outline.half_size
    corner = writer.point((center[0] - half[0], center[1] - half[1]))
    radius = writer.length(outline.corner_radius)
    rect = writer.drawing.rect(corner, writer.lengths((2 * half[0], 2 * half[1])))
    if radius > 0:
        rect.attribs["rx"] = radius
    return _turned(rect, outline.angle, writer.point(center))


@_draw.register
def _(outline: PolygonOutline, writer: _Writer) -> Any:
    if outline.rounding * writer.unit < 0.05:
        return writer.drawing.polygon([writer.point(p) for p in outline.points])
    return writer.drawing.path(d=_rounded_polygon(outline, writer))


def _turned(element: Any, angle: float, center: Point) -> Any:
    degrees = _short(math.degrees(angle) % 180.0)
    if degrees:
        element.rotate(degrees, center)
    return element


def _rounded_polygon(outline: PolygonOutline, writer: _Writer) -> str:
    """Straight edges moved outwards, joined by arcs."""
    points = np.array(list(dict.fromkeys(outline.points)))
    edges = np.roll(points, -1, axis=0) - points
    area = np.sum(
        points[:, 0] * np.roll(points, -1, axis=0)[:, 1] - np.roll(points, -1, axis=0)[:, 0] * points[:, 1]
    )
    if area < 0:
        points = points[::-1]
        edges = np.roll(points, -1, axis=0) - points
    lengths = np.maximum(np.hypot(edges[:, 0], edges[:, 1]), 1e-9)
    outwards = np.stack([edges[:, 1], -edges[:, 0]], axis=1) / lengths[:, None] * outline.rounding
    radius = f"{writer.length(outline.rounding):g}"
    parts = []
    for start, end, out in zip(points, np.roll(points, -1, axis=0), outwards, strict=True):
        (x0, y0), (x1, y1) = writer.point(tuple(start + out)), writer.point(tuple(end + out))
        parts.append(f"{x0:g} {y0:g}L{x1:g} {y1:g}")
    return (
        "M" + f"A{radius} {radius} 0 0 1 ".join(parts) + f"A{radius} {radius} 0 0 1 {parts[0].split('L')[0]}Z"
    )


def _trace(layer: Layer, writer: _Writer) -> list[np.ndarray]:
    """Contours of coverage one half, each [M, 2] in scene units; cut off where they can't be seen."""
    from skimage.measure import approximate_polygon, find_contours

    margin = layer.falloff + 2.0 / writer.unit  # farther than a blur reaches
    edge = np.array(writer.scene.extent) / 2 + margin
    low, high = np.clip(_extent(layer), -edge, edge)
    if (low >= high).any():
        return []
    step = max(1.0 / TRACE, float((high - low).max()) / MAX_CELLS)
    x = np.arange(low[0] - step, high[0] + 2 * step, step)
    y = np.arange(low[1] - step, high[1] + 2 * step, step)
    level = 0.5 * layer.falloff
    field = np.pad(_distance_field(layer, x, y), 1, constant_values=level + step)  # closes what is cut off
    corner = (x[0] - step, y[0] - step)
    tolerance = TOLERANCE / (writer.unit * step)
    return [approximate_polygon(c, tolerance)[:, ::-1] * step + corner for c in find_contours(field, level)]


def _distance_field(layer: Layer, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Distances to a layer at all points of a grid, [Y, X]."""
    import torch

    from ..lower.torch import compile_torch
    from ..render.fused import threads_of_its_own

    p = var("p", VEC2)
    kind = KINDS[layer.kind]
    suffixes = [f"_{i}" for i in range(len(layer.shapes))]
    distances = [kind.distance(p, *kind.variables(suffix)) for suffix in suffixes]
    distance, _ = smooth_union(distances, [vec3(0.0)] * len(suffixes), const(layer.smoothness))
    inputs = [*components_of(p), *(s for suffix in suffixes for s in kind.scalars(suffix))]
    flat = [torch.tensor(v, dtype=torch.float64) for shape in layer.shapes for v in shape.parameters]
    columns = torch.from_numpy(x)[None, :]
    field = compile_torch([distance], inputs)
    chunks = torch.from_numpy(y)[:, None].split(max(1, CHUNK // len(x)))
    with threads_of_its_own():  # on such small pieces a second one mostly waits, for long when it has no core
        return np.concatenate([field(columns, rows, *flat)[0].numpy() for rows in chunks])


def _extent(layer: Layer) -> tuple[Point, Point]:
    """A box, in scene units, that holds all of a layer's coverage."""
    margin = (0.5 + REACH) * layer.falloff + layer.smoothness * math.log(len(layer.shapes))
    boxes = []
    for shape in layer.shapes:
        kind = KINDS[shape.kind]
        boxes.append([constant(s) for s in scalarize(kind.extent(const(margin), *constants(shape)))])
    lows, highs = np.array(boxes)[:, :2].min(axis=0), np.array(boxes)[:, 2:].max(axis=0)
    return (float(lows[0]), float(lows[1])), (float(highs[0]), float(highs[1]))


# --- numbers -----------------------------------------------------------------------------------------------


def _coverage(distance: float, falloff: float) -> float:
    return constant(scalarize(coverage(const(distance), const(falloff), const(0.0)))[0])


@cache
def _stop_places() -> tuple[float, ...]:
    """Where to put stops on the soft edge, −1..1, dense where the logistic curve bends."""
    reach = math.log(1.0 / CUTOFF - 1.0)
    z = np.linspace(-reach, reach, 4001)
    s = 1.0 / (1.0 + np.exp(-z))
    bend = np.abs(s * (1 - s) * (1 - 2 * s)) ** 0.5
    total = np.concatenate([[0.0], np.cumsum((bend[1:] + bend[:-1]) / 2)])
    return tuple(np.interp(np.linspace(0, total[-1], STOPS), total, z / reach))


def _stop_distances(falloff: float) -> list[float]:
    return [falloff * (0.5 + REACH * place) for place in _stop_places()]


def _mean_color(layer: Layer) -> Color:
    red, green, blue = np.mean([shape.color for shape in layer.shapes], axis=0).tolist()
    return red, green, blue


def _hex(color: Color) -> str:
    return "#" + "".join(f"{round(255 * channel):02x}" for channel in color)


def _short(value: float, digits: int = 2) -> float:
    return round(float(value), digits) + 0.0

"""Scenes whose shapes are known, drawn without this package's renderer: by resvg where sharp, else here in numpy.

What a soft edge, an ellipse's field and a cut-out are is said in docs/scene.md. Here that is written once more,
plainly, so that a mistake in the program's own expressions shows.
"""

from __future__ import annotations

import io
import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from PIL import Image
from scipy.special import expit

from ..arrays import Float32Array, Float64Array
from ..engines import resvg
from ..image import load
from ..scene import Color, Joint, Layer, Scene, Shape

SAMPLES = 8  # a pixel's, across and down
FAINT = 2.0  # falloffs from the outline: coverage is below a millionth


@dataclass(frozen=True)
class Figure:
    """An outline on a canvas, in pixels, y down: centre and radius; centre, radii or half sizes, angle; or corners."""

    kind: str  # circle, ellipse, box, triangle
    numbers: tuple[float, ...]

    @property
    def corners(self) -> Float64Array:
        """Points as rows: the three corners of a triangle, else the centre alone."""
        count = 3 if self.kind == "triangle" else 1
        return np.array(self.numbers[: 2 * count], np.float64).reshape(count, 2)

    @property
    def center(self) -> Float64Array:
        """Its middle, x and y."""
        middle: Float64Array = self.corners.mean(axis=0)
        return middle

    @property
    def sizes(self) -> tuple[float, float]:
        """The radii of a circle inside it and of one around it, both about its middle."""
        if self.kind == "circle":
            return self.numbers[2], self.numbers[2]
        if self.kind == "triangle":
            x, y = self.center
            inner = -float(distance(self, np.float64(x), np.float64(y)))
            return inner, float(np.hypot(*(self.corners - self.center).T).max())
        across, down = self.numbers[2:4]
        return min(across, down), max(across, down) if self.kind == "ellipse" else math.hypot(across, down)

    def scaled(self, factor: float) -> Figure:
        """The same about the same middle, larger or smaller."""
        if self.kind == "triangle":
            return Figure("triangle", tuple((self.center + factor * (self.corners - self.center)).ravel()))
        count = 1 if self.kind == "circle" else 2
        lengths = (factor * length for length in self.numbers[2 : 2 + count])
        return Figure(self.kind, (*self.numbers[:2], *lengths, *self.numbers[2 + count :]))

    def shape(self, side: int, color: Color = (0.0, 0.0, 0.0)) -> Shape:
        """The program's own shape of this outline, in its coordinates."""
        first = (*((self.corners - side / 2) / side).ravel(),)
        rest = self.numbers[len(first) :]
        if self.kind in ("ellipse", "box"):
            rest = (rest[0] / side, rest[1] / side, rest[2], *((0.0,) if self.kind == "box" else ()))
        else:
            rest = tuple(length / side for length in rest)
        return Shape(self.kind, (*map(float, first), *rest), color)


@dataclass(frozen=True)
class KnownShape:
    """A figure, from which another may be cut, in a colour. `falloff`: how wide its soft edge is, in pixels."""

    figure: Figure
    color: Color
    opacity: float = 1.0
    falloff: float = 0.0
    cut: Figure | None = None

    def layer(self, side: int) -> Layer:
        """The program's own layer that says the same."""
        shapes = [self.figure.shape(side, self.color)]
        shapes += [self.cut.shape(side)] if self.cut else []
        joints = (Joint("subtraction"),) * (len(shapes) - 1)
        return Layer(tuple(shapes), self.falloff / side, self.opacity, joints)

    def cover(self, x: Float64Array, y: Float64Array) -> Float64Array:
        """Coverage 0..1 at points in pixels: half of it where the distance is half the falloff."""
        field = distance(self.figure, x, y)
        if self.cut:
            field = np.maximum(field, -distance(self.cut, x, y))
        if not self.falloff:
            return np.where(field < 0, 1.0, 0.0)
        covered: Float64Array = expit(5 - 10 * field / self.falloff)
        return covered


@dataclass(frozen=True)
class KnownScene:
    """Known shapes, the last on top, on a square canvas of one colour."""

    side: int  # pixels
    background: Color
    shapes: tuple[KnownShape, ...] = ()
    jagged: bool = False  # whether it is drawn without antialiasing
    quality: int | None = None  # of the JPEG that a tool is given of it

    @property
    def is_sharp(self) -> bool:
        """Whether an SVG can say it."""
        return not any(shape.falloff for shape in self.shapes)

    @property
    def scene(self) -> Scene:
        """The program's own scene that says the same."""
        layers = tuple(shape.layer(self.side) for shape in self.shapes)
        return Scene(self.side, self.side, layers, self.background)

    @cached_property
    def pixels(self) -> Float32Array:
        """The picture, [side, side, 3], rounded to 8 bits: a sharp one as resvg draws it."""
        drawn = resvg.render(svg_of(self), self.side, self.side)[..., :3] if self.is_sharp else sampled(self)
        return (np.rint(drawn * 255) / 255).astype(np.float32)

    @property
    def given(self) -> Float32Array:
        """The picture that a tool is given: itself, or what a JPEG makes of it."""
        return self.pixels if self.quality is None else compressed(self.pixels, quality=self.quality)


# --- signed distances ---------------------------------------------------------------------------------------


def distance(figure: Figure, x: Any, y: Any) -> Any:
    """Signed distance of points to an outline, negative inside; an ellipse's field is that of a stretched disc."""
    return DISTANCES[figure.kind](x, y, *figure.numbers)


def _turned(x: Any, y: Any, middle_x: float, middle_y: float, angle: float) -> tuple[Any, Any]:
    """Points seen along the axes of a figure that is turned clockwise."""
    from_x, from_y, cosine, sine = x - middle_x, y - middle_y, math.cos(angle), math.sin(angle)
    return from_x * cosine + from_y * sine, from_y * cosine - from_x * sine


def _circle(x: Any, y: Any, middle_x: float, middle_y: float, radius: float) -> Any:
    return np.hypot(x - middle_x, y - middle_y) - radius


def _ellipse(x: Any, y: Any, middle_x: float, middle_y: float, wide: float, high: float, angle: float) -> Any:
    along, across = _turned(x, y, middle_x, middle_y, angle)
    return (np.hypot(along / wide, across / high) - 1) * min(wide, high)


def _box(x: Any, y: Any, middle_x: float, middle_y: float, wide: float, high: float, angle: float) -> Any:
    along, across = _turned(x, y, middle_x, middle_y, angle)
    beyond, below = abs(along) - wide, abs(across) - high
    outside = np.hypot(np.maximum(beyond, 0), np.maximum(below, 0))
    return np.where(np.maximum(beyond, below) > 0, outside, np.maximum(beyond, below))


def _triangle(x: Any, y: Any, *corners: float) -> Any:
    points = [complex(*corners[i : i + 2]) for i in (0, 2, 4)]
    place = x + 1j * y
    nearest: Any = np.inf
    sides = []
    for start, end in zip(points, points[1:] + points[:1], strict=True):
        relative = (place - start) / (end - start)  # 0..1 along the edge, the imaginary part across it
        along = np.clip(relative.real, 0, 1)
        nearest = np.minimum(nearest, abs(relative - along) * abs(end - start))
        sides.append(relative.imag > 0)
    inside = (sides[0] == sides[1]) & (sides[1] == sides[2])
    return np.where(inside, -nearest, nearest)


DISTANCES: dict[str, Callable[..., Any]] = {
    "circle": _circle,
    "ellipse": _ellipse,
    "box": _box,
    "triangle": _triangle,
}


# --- drawing ------------------------------------------------------------------------------------------------


def grid(side: int, samples: int = 1) -> tuple[Float64Array, Float64Array]:
    """x and y, [1, n] and [n, 1], of the pixels' centres, or of so many samples in each, across and down."""
    places = (np.arange(side * samples) + 0.5) / samples
    return places[None, :], places[:, None]


def sampled(known: KnownScene, samples: int = SAMPLES) -> Float64Array:
    """The picture [side, side, 3] as the mean of samples in each pixel."""
    x, y = grid(known.side, samples)
    image = np.tile(np.array(known.background, np.float64), (y.size, x.size, 1))
    for shape in known.shapes:
        rows, columns = _window(shape, x.size, samples)
        part = image[rows, columns]
        cover = shape.opacity * shape.cover(x[:, columns], y[rows])[..., None]
        part += cover * (np.array(shape.color) - part)
    drawn: Float64Array = image.reshape(known.side, samples, known.side, samples, 3).mean(axis=(1, 3))
    return drawn


def _window(shape: KnownShape, count: int, samples: int) -> tuple[slice, slice]:
    """The rows and columns of samples beyond which a shape is not seen."""
    inner, outer = shape.figure.sizes
    stretch = outer / inner if shape.figure.kind == "ellipse" else 1.0
    reach = outer + FAINT * shape.falloff * stretch + 1
    ends = [(int((c - reach) * samples), int((c + reach) * samples)) for c in shape.figure.center]
    columns, rows = (slice(max(low, 0), max(min(high, count), 0)) for low, high in ends)
    return rows, columns


def compressed(pixels: Float32Array, form: str = "JPEG", **options: Any) -> Float32Array:
    """Opaque pixels as a lossy file gives them back that Pillow writes; a JPEG with colour at half the resolution, if
    nothing else is said.
    """
    file = io.BytesIO()
    Image.fromarray(np.rint(pixels * 255).astype(np.uint8)).save(file, form, **options)
    return load(file.getvalue()).pixels


def svg_of(known: KnownScene) -> str:
    """A scene of sharp shapes as SVG text, cut-outs by masks."""
    side = known.side
    masks = "".join(
        f'<mask id="m{i}" maskUnits="userSpaceOnUse" x="0" y="0" width="{side}" height="{side}">'
        f'<rect width="{side}" height="{side}" fill="#fff"/>{_element(shape.cut, "")}</mask>'
        for i, shape in enumerate(known.shapes)
        if shape.cut
    )
    drawn = "".join(
        _element(
            shape.figure,
            f' fill="{_css(shape.color)}" fill-opacity="{shape.opacity:.6g}"'
            + (f' mask="url(#m{i})"' if shape.cut else ""),
        )
        for i, shape in enumerate(known.shapes)
    )
    ground = f'<rect width="{side}" height="{side}" fill="{_css(known.background)}"/>'
    edges = ' shape-rendering="crispEdges"' if known.jagged else ""
    head = f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {side} {side}"{edges}>'
    return f"{head}<defs>{masks}</defs>{ground}{drawn}</svg>"


def _css(color: Color) -> str:
    return "#" + "".join(f"{round(255 * value):02x}" for value in color)


def _element(figure: Figure, style: str) -> str:
    """An SVG element; a turned one has its style on a group around it, so that a mask there is not turned with it."""
    n = [f"{number:.6g}" for number in figure.numbers]
    if figure.kind == "circle":
        return f'<circle cx="{n[0]}" cy="{n[1]}" r="{n[2]}"{style}/>'
    if figure.kind == "triangle":
        return f'<path d="M{n[0]} {n[1]}L{n[2]} {n[3]}L{n[4]} {n[5]}Z"{style}/>'
    wide, high, angle = figure.numbers[2:]
    place = f"translate({n[0]} {n[1]}) rotate({math.degrees(angle):.6g})"
    if figure.kind == "ellipse":
        element = f'<ellipse rx="{n[2]}" ry="{n[3]}" transform="{place}"'
    else:
        size = f'width="{2 * wide:.6g}" height="{2 * high:.6g}"'
        element = f'<rect x="{-wide:.6g}" y="{-high:.6g}" {size} transform="{place}"'
    return f"<g{style}>{element}/></g>" if style else f"{element}/>"

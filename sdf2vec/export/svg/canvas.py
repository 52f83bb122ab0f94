"""From scene units to the numbers and elements of an SVG text. User units are pixels of the fitted picture."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from xml.sax.saxutils import escape, quoteattr

import numpy as np
from numpy.typing import NDArray

from ...scene import Color, Scene

Points = NDArray[np.float64]  # [N, 2]
ID_MARK = "@@"  # stands for the drawing's own prefix until its content is known
OWN_ID = "@own@"  # stands for a definition's id until it has one


@dataclass(frozen=True)
class Canvas:
    """A canvas of `width` × `height` user units, `unit` of them in a scene unit, `pixels` of the fitted picture in one.

    Coordinates get `digits` decimals: a twentieth of a pixel for a picture of 512, more for a smaller one,
    because a drawing is shown at any size.
    """

    width: float
    height: float
    unit: float
    digits: int
    pixels: float = 1.0

    @classmethod
    def of(cls, scene: Scene, coarser: int = 0) -> Canvas:
        """The canvas of a scene in pixels, with some decimals fewer than usual."""
        unit = float(min(scene.width, scene.height))
        digits = max(0, math.ceil(3.4 - math.log10(unit)), 1) - coarser
        return cls(scene.width, scene.height, unit, max(0, digits))

    @classmethod
    def whole(cls, scene: Scene, units: int) -> Canvas:
        """The canvas of a scene whose coordinates are whole numbers, so many units along the shortest side."""
        pixels = min(scene.width, scene.height) / units
        return cls(scene.width / pixels, scene.height / pixels, float(units), 0, pixels)

    def places(self, points: object) -> Points:
        """Scene points [N, 2] in user units, unrounded."""
        middle = np.array([self.width, self.height]) / 2
        return np.asarray(points, np.float64).reshape(-1, 2) * self.unit + middle

    def from_places(self, places: Points) -> Points:
        """Points in user units [N, 2] in scene units."""
        return (places - np.array([self.width, self.height]) / 2) / self.unit

    def number(self, value: float) -> str:
        """A coordinate or a length in user units."""
        return number(value, self.digits)

    def fine(self, value: float) -> str:
        """A number that directions hang on: with two decimals more."""
        return number(value, self.digits + 2)

    def rounded(self, points: Points) -> Points:
        """Points as they will be written."""
        return np.round(points, self.digits)

    def joined(self, points: Points) -> str:
        """Points as a list of coordinates."""
        return " ".join(f"{self.number(x)} {self.number(y)}" for x, y in points.tolist())

    def polygon_path(self, points: Points) -> str:
        """Path data of a closed polygon, straight lines throughout."""
        return f"M{self.joined(points)}Z"


def number(value: float, digits: int) -> str:
    """A plain decimal number without needless zeros."""
    text = f"{value:.{digits}f}"
    if "." in text:
        text = text.rstrip("0").rstrip(".")
    if text in ("-0", ""):
        return "0"
    return text.replace("0.", ".", 1) if text.startswith(("0.", "-0.")) else text


def color_text(color: Sequence[float], lift: float = 0.0) -> str:
    """A colour 0..1 as hexadecimal digits, the short form where it says the same; `lift` is in 8-bit levels."""
    pairs = [f"{round(min(max(255 * channel + lift, 0.0), 255.0)):02x}" for channel in color]
    if all(pair[0] == pair[1] for pair in pairs):
        pairs = [pair[0] for pair in pairs]
    return "#" + "".join(pairs)


def tag(name: str, *children: str, **attributes: str | None) -> str:
    """An element as text. `_` in an attribute's name stands for `-`; None leaves an attribute out."""
    written = "".join(
        f" {key.rstrip('_').replace('_', '-')}={quoteattr(value)}"
        for key, value in attributes.items()
        if value is not None
    )
    return f"<{name}{written}>{''.join(children)}</{name}>" if children else f"<{name}{written}/>"


@dataclass
class Document:
    """The growing drawing: definitions, each written once however often it is used, and the body."""

    canvas: Canvas
    named: bool = True
    definitions: dict[str, str] = field(default_factory=dict)
    styles: dict[str, str] = field(default_factory=dict)
    body: list[str] = field(default_factory=list)

    def define(self, kind: str, name: str, *children: str, **attributes: str | None) -> str:
        """Adds a definition and returns its id; the same one as before for equal content."""
        content = tag(name, *children, id=OWN_ID, **attributes)
        if content not in self.definitions:
            self.definitions[content] = f"{ID_MARK}{kind}{len(self.definitions) + 1}"
        return self.definitions[content]

    def style(self, rules: str) -> str:
        """Adds a class with some rules and returns its name; the same one as before for equal rules."""
        return self.styles.setdefault(rules, f"{ID_MARK}{_letters(len(self.styles))}")

    def id_of(self, kind: str, index: int) -> str | None:
        """The readable id of a shape's element."""
        return f"{ID_MARK}{kind}-{index + 1}" if self.named else None

    def text(self, title: str) -> str:
        """The whole SVG. Ids begin with a hash of the content, so that drawings can share a page."""
        definitions = [text.replace(OWN_ID, name, 1) for text, name in self.definitions.items()]
        lines = [tag("defs", "\n", *(f"{line}\n" for line in definitions))] if definitions else []
        if self.styles:
            rules = "".join(f".{name}{{{rules}}}" for rules, name in self.styles.items())
            lines.append(f"<style>{rules}</style>")
        inner = "\n".join([*lines, *self.body])
        canvas = self.canvas
        width, height, shown_width, shown_height = (
            number(side, 4)
            for side in (
                canvas.width,
                canvas.height,
                canvas.width * canvas.pixels,
                canvas.height * canvas.pixels,
            )
        )
        size = f'width="{shown_width}" height="{shown_height}" viewBox="0 0 {width} {height}"'
        head = f'<svg xmlns="http://www.w3.org/2000/svg" {size}'
        prefix = "s" + hashlib.sha256((head + inner).encode()).hexdigest()[:5]
        inner = inner.replace(ID_MARK, prefix)
        return f'{head} role="img">\n<title>{escape(title)}</title>\n{inner}\n</svg>\n'


def _letters(index: int) -> str:
    """A short name for each whole number: a, b, … z, ba, bb, …"""
    rest, last = divmod(index, 26)
    return (_letters(rest) if rest else "") + chr(ord("a") + last)


def url(name: str) -> str:
    """A reference to a definition as a paint or a filter."""
    return f"url(#{name})"


def opacity_text(opacity: float) -> str | None:
    """An opacity, None for the default."""
    return None if opacity >= 0.9995 else number(opacity, 3)


def mean_color(colors: Sequence[Color]) -> Color:
    """The mean of some colours."""
    red, green, blue = np.mean(colors, axis=0).tolist()
    return red, green, blue

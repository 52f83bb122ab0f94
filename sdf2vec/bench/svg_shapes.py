"""What an SVG of any program draws: its elements one by one, of which kind each is, how many numbers it is made of.

An element is a shape. A group that only moves or paints is what it holds; a group with an opacity, a filter, a mask or
a clip of its own is one shape, and so is a `<use>`.
"""

from __future__ import annotations

import copy
import math
import re
from collections.abc import Callable, Iterator
from itertools import pairwise
from typing import Any, NamedTuple
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

import numpy as np

from ..arrays import Float64Array
from ..engines.engine import EngineError

Corner = tuple[float, float]
UPRIGHT: Float64Array = np.eye(3)

DRAWN = (
    "path",
    "rect",
    "circle",
    "ellipse",
    "line",
    "polyline",
    "polygon",
    "text",
    "image",
    "use",
    "switch",
    "svg",
)
AS_ONE = ("opacity", "filter", "mask", "clip-path", "style")  # what makes a group one picture
LENGTHS = (
    "x",
    "y",
    "width",
    "height",
    "rx",
    "ry",
    "cx",
    "cy",
    "r",
    "x1",
    "y1",
    "x2",
    "y2",
    "fx",
    "fy",
    "offset",
)
NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")
COMMAND = re.compile(r"([MmZzLlHhVvCcSsQqTtAa])([^MmZzLlHhVvCcSsQqTtAa]*)")
ARC = re.compile(
    rf"\s*,?\s*({NUMBER.pattern})" * 3 + r"\s*,?\s*([01])" * 2 + rf"\s*,?\s*({NUMBER.pattern})" * 2
)
TRANSFORM = re.compile(r"(\w+)\s*\(([^)]*)\)")
STRAIGHT = 0.02  # how far a corner may be off, as a share of the outline's size


def name_of(element: Element) -> str:
    """The tag without its namespace."""
    return element.tag.rpartition("}")[2] if isinstance(element.tag, str) else ""


def parsed(svg: str) -> Element:
    """The root element. Raises EngineError for what is no XML."""
    try:
        return ElementTree.fromstring(svg)
    except ElementTree.ParseError as error:
        raise EngineError(f"the SVG is not well-formed XML: {error}") from None


# --- elements -----------------------------------------------------------------------------------------------


class Drawn(NamedTuple):
    """An element that counts as one shape, and what its transforms and those of the groups around it come to."""

    element: Element
    matrix: Float64Array  # [3, 3]


def shapes_of(root: Element, matrix: Float64Array = UPRIGHT) -> Iterator[Drawn]:
    """What is drawn within an element, from the lowest on."""
    for child in root:
        own = matrix @ matrix_of(child.get("transform", ""))
        if name_of(child) == "g" and not any(child.get(name) for name in AS_ONE):
            yield from shapes_of(child, own)
        elif name_of(child) in (*DRAWN, "g"):
            yield Drawn(child, own)


def matrix_of(transform: str) -> Float64Array:
    """The matrix of a `transform` attribute."""
    matrix = UPRIGHT
    for name, text in TRANSFORM.findall(transform):
        matrix = matrix @ _step(name, [float(number) for number in NUMBER.findall(text)])
    return matrix


def _step(name: str, n: list[float]) -> Float64Array:
    """The matrix of one transform."""
    if name == "rotate":
        cosine, sine = math.cos(math.radians(n[0])), math.sin(math.radians(n[0]))
        turn = np.array([[cosine, -sine, 0], [sine, cosine, 0], [0, 0, 1]])
        return turn if len(n) < 3 else _step("translate", n[1:]) @ turn @ _step("translate", [-n[1], -n[2]])
    rows: dict[str, Callable[[], Any]] = {
        "matrix": lambda: [n[::2], n[1::2]],
        "translate": lambda: [[1, 0, n[0]], [0, 1, n[1] if len(n) > 1 else 0]],
        "scale": lambda: [[n[0], 0, 0], [0, n[-1], 0]],
        "skewX": lambda: [[1, math.tan(math.radians(n[0])), 0], [0, 1, 0]],
        "skewY": lambda: [[1, 0, 0], [math.tan(math.radians(n[0])), 1, 0]],
    }
    return np.array([*rows[name](), [0, 0, 1]], np.float64)


def alone(svg: str) -> Iterator[tuple[Drawn, str]]:
    """Each shape, and the SVG in which nothing else is drawn."""
    whole = parsed(svg)
    for index, drawn in enumerate(shapes_of(whole)):
        root = copy.deepcopy(whole)
        others = [other.element for place, other in enumerate(shapes_of(root)) if place != index]
        parents = {child: parent for parent in root.iter() for child in parent}
        for other in others:
            parents[other].remove(other)
        yield drawn, ElementTree.tostring(root, encoding="unicode")


# --- kinds --------------------------------------------------------------------------------------------------


def kind_of(drawn: Drawn) -> str | None:
    """circle, ellipse, box or triangle, where an element is plainly one; a group of one shape is of its kind."""
    element, matrix = drawn
    tag = name_of(element)
    if tag == "g":
        inner = list(shapes_of(element, matrix))
        return kind_of(inner[0]) if len(inner) == 1 else None
    if tag in ("circle", "ellipse"):
        radii = [float(element.get(name) or element.get("r") or 0) for name in ("rx", "ry")]
        longest, shortest = np.linalg.svd(matrix[:2, :2] * radii, compute_uv=False)
        return "circle" if longest - shortest <= STRAIGHT * longest else "ellipse"
    corners = corners_of(element)
    return _kind_of_corners(np.array(corners) @ matrix[:2, :2].T) if corners else None


def corners_of(element: Element) -> list[Corner]:
    """The corners of a rectangle, a polygon or a path of one outline of straight lines; none of anything else."""
    if name_of(element) == "rect":
        wide, high = (float(element.get(name, 0)) for name in ("width", "height"))
        return [(0.0, 0.0), (wide, 0.0), (wide, high), (0.0, high)]
    if name_of(element) == "polygon":
        numbers = [float(n) for n in NUMBER.findall(element.get("points", ""))]
        return _without_repeats(list(zip(numbers[::2], numbers[1::2], strict=False)))
    if name_of(element) != "path":
        return []
    found: list[Corner] = []
    x = y = 0.0
    for place, (command, values) in enumerate(commands(element.get("d", ""))):
        kind = command.upper()
        if kind == "Z":
            continue
        if kind not in "MLHV" or (kind == "M" and place):
            return []
        width = 1 if kind in "HV" else 2
        for start in range(0, len(values), width):
            step = values[start : start + width]
            move = {"H": (*step, None), "V": (None, *step)}.get(kind, tuple(step))
            x, y = (
                now if value is None else value + (now if command.islower() else 0.0)
                for now, value in zip((x, y), move, strict=True)
            )
            found.append((x, y))
    return _without_repeats(found)


def commands(path: str) -> Iterator[tuple[str, list[float]]]:
    """The commands of a path's `d`, each with its numbers; an arc's flags may be written without a gap."""
    for command, text in COMMAND.findall(path):
        found = (
            (value for arc in ARC.findall(text) for value in arc) if command in "Aa" else NUMBER.findall(text)
        )
        yield command, [float(value) for value in found]


def _without_repeats(corners: list[Corner]) -> list[Corner]:
    """Corners of a closed outline, but not its end where it began, nor what lies on a straight line."""
    size = float(np.ptp(np.array(corners), axis=0).max()) if corners else 0.0
    kept = [a for a, b in pairwise([*corners, *corners[:1]]) if math.dist(a, b) > STRAIGHT * size]
    count = len(kept)
    return [b for i, b in enumerate(kept) if _height(kept[i - 1], b, kept[(i + 1) % count]) > STRAIGHT * size]


def _height(a: Corner, b: Corner, c: Corner) -> float:
    """How far b is from the line through a and c."""
    across = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
    return abs(across) / max(math.dist(a, c), 1e-12)


def _kind_of_corners(corners: Float64Array) -> str | None:
    """What a polygon is; [corners, 2]."""
    if len(corners) == 3:
        return "triangle"
    if len(corners) != 4:
        return None
    a, b, c, d = corners
    off = 2 * STRAIGHT * math.dist(a, c)
    is_parallel = math.dist(a + c, b + d) <= off
    return "box" if is_parallel and abs(math.dist(a, c) - math.dist(b, d)) <= off else None


# --- numbers ------------------------------------------------------------------------------------------------


def count_numbers(svg: str) -> int:
    """How many numbers say where things are: of outlines, gradients and transforms; no colours, no viewBox."""
    count = 0
    for element in parsed(svg).iter():
        tag = name_of(element)
        count += sum(len(values) for _, values in commands(element.get("d", ""))) if tag == "path" else 0
        for name in ("points", "transform", "gradientTransform", "stdDeviation"):
            count += len(NUMBER.findall(element.get(name, "")))
        count += (
            sum(name in element.attrib for name in LENGTHS) if tag not in ("svg", "filter", "mask") else 0
        )
    return count

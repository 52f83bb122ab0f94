"""Scenes of few shapes, and their SVG as text and as elements."""

import re
from typing import Any
from xml.etree import ElementTree

from sdf2vec import Layer, Scene, Shape
from sdf2vec.export.options import Options
from sdf2vec.export.svg import svg as write_svg

NAMESPACE = "{http://www.w3.org/2000/svg}"
Parameters = dict[str, Any]
WHITE, BLACK, ORANGE = (1.0, 1.0, 1.0), (0.0, 0.0, 0.0), (1.0, 0.6, 0.0)


def scene_of(*layers, width=150, height=100, background=BLACK):
    return Scene(width, height, layers, background)


def circle(x, y, radius, color=WHITE, falloff=0.2, opacity=1.0):
    return Layer((Shape.of("circle", color, center=(x, y), radius=radius),), falloff, opacity)


def triangle(*points, falloff=0.0, color=WHITE):
    return Layer((Shape.of("triangle", color, a=points[0], b=points[1], c=points[2]),), falloff)


def text_of(scene, **options):
    return write_svg(scene, Options(**options)).data


def parsed(scene, **options):
    return ElementTree.fromstring(text_of(scene, **options))


def drawn_in(root):
    """The elements that draw layers: all but title, definitions and background."""
    return [e for e in root if e.tag not in (f"{NAMESPACE}title", f"{NAMESPACE}defs")][1:]


def tags(root):
    return [element.tag.removeprefix(NAMESPACE) for element in root.iter()]


def numbers_of(path_data):
    return [float(number) for number in re.findall(r"-?(?:\d+\.?\d*|\.\d+)", path_data)]


SHARP: dict[str, Parameters] = {
    "circle": {"center": (0.1, 0), "radius": 0.3},
    "ellipse": {"center": (0.1, 0), "radii": (0.5, 0.2), "angle": 0.5},
    "box": {"center": (0.1, 0), "half_size": (0.5, 0.2), "angle": 0.5, "corner_radius": 0.1},
    "triangle": {"a": (0, -0.4), "b": (0.5, 0.3), "c": (-0.4, 0.2)},
    "displaced": {"center": (0, 0), "radius": 0.3, "amplitude": 0.1, "frequency": (12, 9)},
}

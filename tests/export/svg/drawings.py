"""Scenes of few shapes, their SVG as text and as elements, and what engines make of it."""

import math
import re
from functools import cache
from typing import Any
from xml.etree import ElementTree

import numpy as np
import torch

from sdf2vec import Layer, Scene, Shape, exported
from sdf2vec.engines import ENGINES
from sdf2vec.image import premultiply
from sdf2vec.render.reference import render

NAMESPACE = "{http://www.w3.org/2000/svg}"
Parameters = dict[str, Any]
BLURRING = ("resvg", "librsvg", "chromium", "firefox")
WHITE, BLACK, ORANGE = (1.0, 1.0, 1.0), (0.0, 0.0, 0.0), (1.0, 0.6, 0.0)


def scene_of(*layers, width=150, height=100, background=BLACK):
    return Scene(width, height, layers, background)


def circle(x, y, radius, color=WHITE, falloff=0.2, opacity=1.0):
    return Layer((Shape.of("circle", color, center=(x, y), radius=radius),), falloff, opacity)


def triangle(*points, falloff=0.0, color=WHITE):
    return Layer((Shape.of("triangle", color, a=points[0], b=points[1], c=points[2]),), falloff)


@cache
def made(scene, **options):
    """A scene's SVG, made once for all that look at it."""
    return exported(scene, "svg", **options)


def text_of(scene, **options):
    return made(scene, **options).data


def parsed(scene, **options):
    return ElementTree.fromstring(text_of(scene, **options))


def drawn_in(root):
    """The elements that draw layers: all but title, definitions and background."""
    return [e for e in root if e.tag not in (f"{NAMESPACE}title", f"{NAMESPACE}defs")][1:]


def tags(root):
    return [element.tag.removeprefix(NAMESPACE) for element in root.iter()]


@cache
def rendered(scene, width, height):
    """What is to be seen, premultiplied [H, W, 4], rendered once for all engines."""
    image = render(scene, width, height, dtype=torch.float64).permute(1, 2, 0).numpy()
    image.setflags(write=False)
    return image


def off_in(engine, scene, size=None, **options):
    """Drawn minus rendered, premultiplied [H, W, 4], 0..1."""
    width, height = size or (scene.width, scene.height)
    drawn = premultiply(ENGINES[engine].render(text_of(scene, **options), width, height))
    return drawn - rendered(scene, width, height)


def decibels(off):
    return -10 * math.log10(float(np.mean(np.square(off))))


def numbers_of(path_data):
    return [float(number) for number in re.findall(r"-?(?:\d+\.?\d*|\.\d+)", path_data)]


SHARP: dict[str, Parameters] = {
    "circle": {"center": (0.1, 0), "radius": 0.3},
    "ellipse": {"center": (0.1, 0), "radii": (0.5, 0.2), "angle": 0.5},
    "box": {"center": (0.1, 0), "half_size": (0.5, 0.2), "angle": 0.5, "corner_radius": 0.1},
    "triangle": {"a": (0, -0.4), "b": (0.5, 0.3), "c": (-0.4, 0.2)},
    "rounded_triangle": {"a": (0, -0.3), "b": (0.4, 0.2), "c": (-0.3, 0.1), "corner_radius": 0.1},
    "arc": {"a": (-0.3, -0.2), "b": (0.4, 0.1), "sagitta": 0.3, "half_width": 0.1},
    "displaced": {"center": (0, 0), "radius": 0.3, "amplitude": 0.1, "frequency": (12, 9)},
}

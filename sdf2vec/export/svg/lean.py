"""The smallest text that still blurs: one short element a shape, and classes for how soft and how round it is.

A polygon's round corners are a stroke in its own colour, as wide for all shapes of a class; colour is `currentColor`,
so that it is said once.
"""

from __future__ import annotations

import math

import numpy as np

from ...scene import Layer
from ...shapes import EllipseOutline, Outline, PolygonOutline, RectangleOutline
from .blur import GAUSSIAN, LEAST, quantised
from .canvas import Canvas, Document, Points, number, tag, url
from .outlines import convex, element, sharpened

MARGINS = (0.4, 1.0, 2.0, 5.0, 20.0, 100.0)  # of a filter region around an element, in its box
OPACITY_DIGITS = 2
GROUP = {"fill": "currentColor", "stroke": "currentColor", "stroke_width": "0", "stroke_linejoin": "round"}


def lean(layer: Layer, outline: Outline, soft: bool, document: Document) -> str:
    """A layer as one element in a group with the attributes `GROUP`."""
    canvas = document.canvas
    opacity = number(layer.opacity, OPACITY_DIGITS)
    look = {
        "color": document.color(layer.shapes[0].color),
        "opacity": None if opacity == "1" else opacity,
    }
    deviation = quantised(max(GAUSSIAN * layer.falloff * canvas.unit, LEAST)) if soft else 0.0
    if not isinstance(outline, PolygonOutline):
        name = _class(_box(outline) * canvas.unit, deviation, 0.0, document) if soft else None
        return element(outline, canvas, class_=name, **look)
    rounding = round(0.5 * deviation / GAUSSIAN, canvas.digits)  # half a falloff, as the class says it
    points = _corners(outline, rounding, canvas)
    name = _class(np.ptp(points, axis=0), deviation, rounding, document) if soft else None
    return tag("path", class_=name, **look, d=relative_path(points, canvas))


def _corners(outline: PolygonOutline, rounding: float, canvas: Canvas) -> Points:
    """The corners, in user units, of the polygon that becomes the outline when it is rounded so much."""
    own = outline.rounding * canvas.unit
    made = sharpened(outline, rounding / own) if own > 0 else outline
    assert isinstance(made, PolygonOutline)
    return canvas.places(convex(np.array(made.points, np.float64)))


def relative_path(points: Points, canvas: Canvas) -> str:
    """A closed polygon whose corners are said by where they lie from each other."""
    rounded = canvas.rounded(points)
    steps = np.diff(rounded, axis=0).ravel().tolist()
    start = " ".join(canvas.number(v) for v in rounded[0].tolist())
    rest = " ".join(canvas.number(v) for v in steps)
    return f"M{start}l{rest}z".replace(" -", "-")


def _class(sides: Points, deviation: float, rounding: float, document: Document) -> str:
    """The class for a softness, with a filter whose region is large enough for an element of this box [2]."""
    margin = (3.0 * deviation + rounding) / max(float(sides.min()), 0.1)
    share = next((step for step in MARGINS if step >= margin), MARGINS[-1])
    near, whole = f"-{100 * share:.0f}%", f"{100 + 200 * share:.0f}%"
    region = {"x": near, "y": near, "width": whole, "height": whole}
    blur = tag("feGaussianBlur", stdDeviation=f"{deviation:.3g}")
    filter_ = document.define("", "filter", blur, **region, color_interpolation_filters="sRGB")
    width = f";stroke-width:{document.canvas.number(2.0 * rounding)}" if rounding else ""
    return document.style(f"filter:{url(filter_)}{width}")


def _box(outline: Outline) -> Points:
    """Width and height [2] of a turned outline, in scene units."""
    if not isinstance(outline, EllipseOutline | RectangleOutline):
        raise NotImplementedError(type(outline))
    cosine, sine = abs(math.cos(outline.angle)), abs(math.sin(outline.angle))
    a, b = outline.radii if isinstance(outline, EllipseOutline) else outline.half_size
    return 2.0 * np.array([a * cosine + b * sine, a * sine + b * cosine])

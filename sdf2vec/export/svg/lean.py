"""The smallest text that still blurs: one short element a shape, and classes for how soft and how round it is.

A polygon's round corners are a stroke in its own colour, as wide for all shapes of a class; colour is `currentColor`,
so that it is said once. Coordinates are whole numbers, colours and opacities have few steps; the colours are solved
for with all that is coarse about the drawing known.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ...scene import Layer
from ...shapes import EllipseOutline, Outline, PolygonOutline
from .blur import GAUSSIAN, LEAST, Blurred, best_blur, trial_of
from .canvas import Canvas, Document, Points, color_text, mean_color, number, tag, url
from .curves import relative_polygon
from .field import distances
from .outlines import Traced, convex, distance_to, element, sharpened

GROUP = {"fill": "currentColor", "stroke": "currentColor", "stroke_width": "0", "stroke_linejoin": "round"}
TOLERANCE = 0.5  # user units that a traced contour may be off


class Grain(NamedTuple):
    """How coarse a small drawing is.

    `units` along the shortest side, how many `softnesses`, steps of `colors` and `opacities`, `margins` of a filter
    region around an element, in its box.
    """

    units: int
    softnesses: int
    colors: int
    opacities: int
    margins: tuple[float, ...]


FINE = Grain(512, 20, 255, 100, (0.4, 1.0, 2.0, 5.0, 20.0, 100.0))
COARSE = Grain(128, 8, 15, 10, (1.0, 5.0, 30.0))


def softnesses(falloffs: Sequence[float], canvas: Canvas, count: int) -> list[float]:
    """For each falloff the standard deviation of its class, in scene units; 0 for none. k-means of their logarithms."""
    from scipy.cluster.vq import kmeans2

    least = LEAST / canvas.pixels / canvas.unit
    wanted = np.log([max(GAUSSIAN * falloff, least) for falloff in falloffs if falloff])
    if not wanted.size:
        return [0.0] * len(falloffs)
    first = np.unique(np.quantile(wanted, (np.arange(count) + 0.5) / count))
    with warnings.catch_warnings():  # that a class is empty: there may be fewer softnesses than classes
        warnings.simplefilter("ignore", UserWarning)
        centers, labels = kmeans2(wanted, first, minit="matrix", missing="warn")
    found = iter(np.exp(centers[labels]).tolist())
    return [next(found) if falloff else 0.0 for falloff in falloffs]


def lean_blur(layer: Layer, outline: Outline | None, deviation: float, canvas: Canvas) -> Blurred | None:
    """A layer as a blurred outline with the numbers that will be written; None where nothing is seen."""
    size = (canvas.width, canvas.height, canvas.unit)
    if outline is None:
        blurred = best_blur(layer, size)
        if blurred is None or not isinstance(blurred.outline, Traced):
            return None
        return blurred._replace(outline=Traced(blurred.outline.contours, TOLERANCE), deviation=deviation)
    trial = trial_of(layer, size)
    if not isinstance(outline, PolygonOutline):
        return trial.judged(outline, distances(layer, trial.grid) - 0.5 * layer.falloff, deviation)
    rounding = (
        round(0.5 * deviation / GAUSSIAN * canvas.unit) / canvas.unit
    )  # half a falloff, as the class says it
    own = outline.rounding
    made = sharpened(outline, rounding / own) if own > 0 else outline
    assert isinstance(made, PolygonOutline)
    points = canvas.rounded(canvas.places(convex(np.array(made.points, np.float64))))
    drawn = PolygonOutline(tuple((x, y) for x, y in canvas.from_places(points).tolist()), rounding)
    return trial.judged(drawn, distance_to(drawn, trial.grid), deviation)


def lean(layer: Layer, blurred: Blurred, grain: Grain, document: Document) -> str:
    """A layer as one element in a group with the attributes `GROUP`."""
    canvas, outline = document.canvas, blurred.outline
    opacity = number(layer.opacity, 2)
    name = _class(blurred, grain, document) if blurred.deviation else None
    look = {
        "class_": name,
        "color": color_text(mean_color([shape.color for shape in layer.shapes])),
        "opacity": None if opacity == "1" else opacity,
    }
    if isinstance(outline, PolygonOutline):
        points = canvas.places(outline.points)
        texts = (relative_polygon(np.roll(points, -first, axis=0), canvas) for first in range(len(points)))
        return tag("path", **look, d=min(texts, key=len))
    return element(outline, canvas, **look)


def _class(blurred: Blurred, grain: Grain, document: Document) -> str:
    """The class for a softness, with a filter whose region is large enough for an element of this box."""
    canvas, outline = document.canvas, blurred.outline
    deviation = blurred.deviation * canvas.unit
    rounding = outline.rounding * canvas.unit if isinstance(outline, PolygonOutline) else 0.0
    needed = (3.0 * deviation + rounding) / max(float(_box(outline).min()) * canvas.unit, 0.1)
    share = next((step for step in grain.margins if step >= needed), grain.margins[-1])
    near, whole = number(-share, 1), number(1.0 + 2.0 * share, 1)
    region = {"x": near, "y": near, "width": whole, "height": whole}
    blur = tag("feGaussianBlur", stdDeviation=f"{deviation:.3g}")
    filter_ = document.define("", "filter", blur, **region, color_interpolation_filters="sRGB")
    width = f";stroke-width:{canvas.number(2.0 * rounding)}" if rounding else ""
    return document.style(f"filter:{url(filter_)}{width}")


def _box(outline: Outline | Traced) -> Points:
    """Width and height [2] of an outline without its rounding, in scene units."""
    if isinstance(outline, Traced | PolygonOutline):
        points = np.concatenate(outline.contours) if isinstance(outline, Traced) else np.array(outline.points)
        return np.asarray(np.ptp(points, axis=0))
    cosine, sine = abs(math.cos(outline.angle)), abs(math.sin(outline.angle))
    a, b = outline.radii if isinstance(outline, EllipseOutline) else outline.half_size
    return 2.0 * np.array([a * cosine + b * sine, a * sine + b * cosine])

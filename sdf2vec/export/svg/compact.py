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
from .bezier_fit import relative_polygon
from .blur import GAUSSIAN, LEAST, Blurred, best_blur, nearest, trial_of
from .canvas import Canvas, Document, Points, color_text, mean_color, number, tag, url
from .outlines import Traced, convex, core, distance_to, element, sharpened
from .sampling import distances

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


GRAINS = (
    Grain(512, 20, 255, 100, (0.4, 1.0, 2.0, 5.0, 20.0, 100.0)),
    Grain(512, 10, 15, 10, (0.4, 1.0, 2.0, 5.0, 30.0)),
    Grain(256, 10, 15, 10, (1.0, 2.0, 5.0, 30.0)),
    Grain(160, 6, 15, 10, (1.0, 5.0, 30.0)),
)


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
    """A layer as an outline, blurred if that is nearer, with the numbers to write; None where nothing is seen."""
    size = (canvas.width, canvas.height, canvas.unit)
    if outline is None:
        blurred = best_blur(layer, size)
        if blurred is None or not isinstance(blurred.outline, Traced):
            return None
        kept = deviation if blurred.deviation else 0.0
        return blurred._replace(outline=Traced(blurred.outline.contours, TOLERANCE), deviation=kept)
    trial = trial_of(layer, size)
    if isinstance(outline, EllipseOutline):
        field = distances(layer, trial.grid) - 0.5 * layer.falloff
        return nearest([trial.judged(outline, field, tried) for tried in (0.0, deviation)])
    polygons = [(_polygon(outline, tried, canvas), tried) for tried in (0.0, deviation)]
    return nearest(
        [trial.judged(polygon, distance_to(polygon, trial.grid), tried) for polygon, tried in polygons]
    )


def _polygon(outline: Outline, deviation: float, canvas: Canvas) -> PolygonOutline:
    """The nearest polygon with whole coordinates and rounding; of a triangle the rounding is that of its class."""
    points, own = core(outline) or (np.zeros((1, 2)), 0.0)
    by_class = isinstance(outline, PolygonOutline)
    rounding = _rounding(deviation, canvas) if by_class else round(own * canvas.unit) / canvas.unit
    made = PolygonOutline(_pairs(points), own)
    if own > 0 and isinstance(sharp := sharpened(made, rounding / own), PolygonOutline):
        made = sharp
    whole = canvas.rounded(canvas.places(convex(np.array(made.points, np.float64))))
    return PolygonOutline(_pairs(canvas.from_places(whole)), rounding)


def _rounding(deviation: float, canvas: Canvas) -> float:
    """Half the falloff that a standard deviation stands for, in whole units."""
    return round(0.5 * deviation / GAUSSIAN * canvas.unit) / canvas.unit


def _pairs(points: Points) -> tuple[tuple[float, float], ...]:
    return tuple((x, y) for x, y in points.tolist())


def lean(layer: Layer, blurred: Blurred, grain: Grain, document: Document) -> str:
    """A layer as one element in a group with the attributes `GROUP`."""
    opacity = number(layer.opacity, 2)
    look = {
        "class_": _class(blurred, grain, document) if blurred.deviation else None,
        "color": color_text(mean_color([shape.color for shape in layer.shapes])),
        "opacity": None if opacity == "1" else opacity,
    }
    outline, canvas = blurred.outline, document.canvas
    if isinstance(outline, EllipseOutline):
        return tag("ellipse", **look, **_ellipse(outline, canvas))
    if not isinstance(outline, PolygonOutline):
        return element(outline, canvas, **look)
    if outline.rounding != _rounding(blurred.deviation, canvas):
        look["stroke_width"] = canvas.number(2.0 * outline.rounding * canvas.unit)
    points = canvas.places(outline.points)
    texts = (relative_polygon(np.roll(points, -first, axis=0), canvas) for first in range(len(points)))
    return tag("path", **look, d=min(texts, key=len))


def _ellipse(outline: EllipseOutline, canvas: Canvas) -> dict[str, str]:
    """The attributes of an ellipse in whole units and degrees."""
    x, y = (number(v, 0) for v in canvas.places(outline.center)[0].tolist())
    rx, ry = (number(max(radius * canvas.unit, 1.0), 0) for radius in outline.radii)
    turned = number(math.degrees(outline.angle) % 180.0, 0)
    return {"rx": rx, "ry": ry, "transform": f"translate({x} {y})rotate({turned})"}


def _class(blurred: Blurred, grain: Grain, document: Document) -> str:
    """The class for a softness, with a filter whose region is large enough for an element of this box."""
    canvas, outline = document.canvas, blurred.outline
    deviation = blurred.deviation * canvas.unit
    own = outline.rounding if isinstance(outline, PolygonOutline) else 0.0
    needed = (3.0 * deviation + own * canvas.unit) / max(float(_box(outline).min()) * canvas.unit, 0.1)
    share = next((step for step in grain.margins if step >= needed), grain.margins[-1])
    near, whole = number(-share, 1), number(1.0 + 2.0 * share, 1)
    region = {"x": near, "y": near, "width": whole, "height": whole}
    blur = tag("feGaussianBlur", stdDeviation=f"{deviation:.3g}")
    filter_ = document.define("", "filter", blur, **region, color_interpolation_filters="sRGB")
    by_class = own and own == _rounding(blurred.deviation, canvas)
    width = f";stroke-width:{canvas.number(2.0 * own * canvas.unit)}" if by_class else ""
    return document.style(f"filter:{url(filter_)}{width}")


def _box(outline: Outline | Traced) -> Points:
    """Width and height [2] of an outline without its rounding, in scene units."""
    if isinstance(outline, Traced | PolygonOutline):
        points = np.concatenate(outline.contours) if isinstance(outline, Traced) else np.array(outline.points)
        return np.asarray(np.ptp(points, axis=0))
    cosine, sine = abs(math.cos(outline.angle)), abs(math.sin(outline.angle))
    a, b = outline.radii if isinstance(outline, EllipseOutline) else outline.half_size
    return 2.0 * np.array([a * cosine + b * sine, a * sine + b * cosine])

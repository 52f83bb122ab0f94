"""The smallest drawing that still blurs: one element a shape, of whole coordinates and few softnesses.

A polygon's round corners are as wide for all shapes of a softness; colours and opacities have few steps, which are
solved for with all that is coarse about the drawing known.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from ...blend import EDGE_DEVIATION
from ...clusters import clustered
from ...grain import Grain
from ...outlines import EllipseOutline, Outline, PolygonOutline
from ...scene import Layer, Scene
from .blur import LEAST, Blurred, nearest, trial_of
from .canvas import Canvas, pairs
from .display import Figure, Geometry, moved
from .outlines import Traced, convex, core, distance_to, edge_of, placed, sharpened
from .refit_appearance import Difference
from .sampling import distances

TOLERANCE = 0.5  # user units that a traced contour may be off


def compact_blurs(
    scene: Scene, soft: Sequence[bool], traced: Mapping[int, Blurred], grain: Grain, canvas: Canvas
) -> dict[int, Blurred]:
    """Every layer that is seen as an outline, blurred by one of few deviations or, where that is nearer, not at all.

    `traced`: the blurs of those layers that have no outline of their own.
    """
    falloffs = [layer.falloff if own else 0.0 for layer, own in zip(scene.layers, soft, strict=True)]
    deviations = softnesses(falloffs, canvas, grain.softnesses)
    found = {}
    for index, (layer, deviation) in enumerate(zip(scene.layers, deviations, strict=True)):
        outline = edge_of(layer, 0.5)
        if outline is not None:
            found[index] = _compact_blur(layer, outline, deviation, canvas)
        elif index in traced:
            found[index] = _coarsened(traced[index], deviation)
    return found


def softnesses(falloffs: Sequence[float], canvas: Canvas, count: int) -> list[float]:
    """For each falloff the standard deviation of its class, in scene units; 0 for none. k-means of their logarithms."""
    least = LEAST / canvas.pixels / canvas.unit
    wanted = np.log([max(EDGE_DEVIATION * falloff, least) for falloff in falloffs if falloff])
    if not wanted.size:
        return [0.0] * len(falloffs)
    found = iter(np.exp(clustered(wanted, count)).tolist())
    return [next(found) if falloff else 0.0 for falloff in falloffs]


def _coarsened(blurred: Blurred, deviation: float) -> Blurred:
    assert isinstance(blurred.outline, Traced)
    outline = Traced(blurred.outline.contours, TOLERANCE)
    return blurred._replace(outline=outline, deviation=deviation if blurred.deviation else 0.0)


def _compact_blur(layer: Layer, outline: Outline, deviation: float, canvas: Canvas) -> Blurred:
    """An outline with the numbers to write, blurred if that is nearer."""
    trial = trial_of(layer, canvas)
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
    of_class = 0.5 * deviation / EDGE_DEVIATION  # half the falloff that a standard deviation stands for
    wanted = of_class if isinstance(outline, PolygonOutline) else own
    rounding = round(wanted * canvas.unit) / canvas.unit
    made = PolygonOutline(pairs(points), own)
    if own > 0 and isinstance(sharp := sharpened(made, rounding / own), PolygonOutline):
        made = sharp
    whole = canvas.rounded(canvas.places(convex(np.array(made.points, np.float64))))
    return PolygonOutline(pairs(canvas.from_places(whole)), rounding)


def figure(layer: Layer, blurred: Blurred, canvas: Canvas) -> Figure:
    """A layer as one figure in its mean colour."""
    color = moved(np.mean(layer.colors, axis=0).tolist(), 0.0)
    geometry = _whole(placed(blurred.outline, canvas))
    return Figure(geometry, color, layer.opacity, blurred.deviation * canvas.unit)


def _whole(geometry: Geometry) -> Geometry:
    """The same; of an ellipse, radii of one unit or more and whole degrees."""
    if not isinstance(geometry, EllipseOutline):
        return geometry
    radii = (max(geometry.radii[0], 1.0), max(geometry.radii[1], 1.0))
    angle = math.radians(round(math.degrees(geometry.angle)))
    return EllipseOutline(geometry.center, radii, angle)


def drawn_difference(layer: Layer, canvas: Canvas) -> Difference:
    """What is off about the blurred figure that a soft layer is drawn by."""
    outline, trial = edge_of(layer, 0.5), trial_of(layer, canvas)
    assert outline is not None
    if isinstance(outline, EllipseOutline):
        distance = distances(layer, trial.grid) - 0.5 * layer.falloff
    else:
        distance = distance_to(outline, trial.grid)
    return trial.judged(outline, distance, EDGE_DEVIATION * layer.falloff).difference.coarse()


def drawn_figure(layer: Layer, canvas: Canvas) -> Figure:
    """A layer of a scene whose numbers a drawing can say, as they are."""
    outline = edge_of(layer, 0.5)
    assert outline is not None
    geometry = placed(outline, canvas)
    if (made := core(outline)) is not None:
        points, rounding = made
        geometry = PolygonOutline(pairs(canvas.rounded(canvas.places(points))), rounding * canvas.unit)
    return Figure(geometry, layer.colors[0], layer.opacity, EDGE_DEVIATION * layer.falloff * canvas.unit)

"""The smallest drawing that still blurs: one element a layer, of whole coordinates and few softnesses.

It is of a scene whose numbers it can say (`fit.drawable`). What is off about blurs is made up for by colours and
opacities, which have few steps.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ...blend import EDGE_DEVIATION
from ...grain import Grain
from ...outlines import EllipseOutline, Outline, PolygonOutline
from ...scene import Layer, Scene
from .blur import best_traced, trial_of
from .canvas import Canvas, pairs
from .display import Drawing, Figure, Geometry
from .outlines import Traced, core, distance_to, edge_of, placed
from .refit_appearance import HASTY, Difference, refitted
from .sampling import distances
from .sharp_edges import NOWHERE, sharp_edge
from .union_gradient import fill_of
from .visibility import LayerSamples, layers_at, showing

TOLERANCE = 0.5  # user units that a traced contour may be off


def drawn(scene: Scene, grain: Grain) -> tuple[Drawing, float]:
    """A scene whose numbers a drawing of this grain can say, as a display list, and how far that is off from its
    render, in 8-bit levels (root mean square), about.
    """
    canvas, samples = Canvas.whole(scene, grain.units), layers_at(scene)
    made = [_blurred(layer, canvas) for layer in scene.layers]
    off = {index: difference for index, (_, difference) in enumerate(made) if difference is not None}
    again, error = refitted(scene, samples, off, (), grain.colors, grain.opacities, HASTY)
    error += _mixed(scene, samples, canvas)
    return _drawing(again, [geometry for geometry, _ in made], canvas), 255.0 * math.sqrt(error)


def sketched(scene: Scene, grain: Grain) -> Drawing:
    """The same without all that makes up for what blurs do: of about as many bytes."""
    canvas = Canvas.whole(scene, grain.units)
    return _drawing(scene, [_edge(layer, canvas) for layer in scene.layers], canvas)


def _drawing(scene: Scene, geometries: Sequence[Geometry], canvas: Canvas) -> Drawing:
    items = (
        Figure(geometry, fill_of(layer, canvas).fill, layer.opacity, _deviation(layer) * canvas.unit)
        for layer, geometry in zip(scene.layers, geometries, strict=True)
        if geometry != NOWHERE
    )
    return Drawing(canvas.width, canvas.height, canvas.pixels, canvas.digits, scene.background, tuple(items))


def _deviation(layer: Layer) -> float:
    """The standard deviation of a layer's edge in scene units."""
    return EDGE_DEVIATION * layer.falloff


def _mixed(scene: Scene, samples: LayerSamples, canvas: Canvas) -> float:
    """The mean squared error of colours that a gradient does not say, about."""
    errors = np.array([fill_of(layer, canvas).error / 255.0 for layer in scene.layers])
    if not errors.any():
        return 0.0
    opacities = np.array([layer.opacity for layer in scene.layers], np.float32)[:, None]
    shown = (samples.covers * showing(samples.covers * opacities)).mean(axis=1)
    return float(shown @ np.square(errors))


# --- geometry -------------------------------------------------------------------------------------------------


def _edge(layer: Layer, canvas: Canvas) -> Geometry:
    """Where coverage is one half."""
    outline = edge_of(layer, 0.5)
    return sharp_edge(layer, canvas, TOLERANCE) if outline is None else _whole(outline, canvas)


def _blurred(layer: Layer, canvas: Canvas) -> tuple[Geometry, Difference | None]:
    """What is blurred, or is sharp, and what is then off about the layer."""
    if not layer.falloff:
        return _edge(layer, canvas), None
    outline = edge_of(layer, 0.5)
    if outline is None:
        return _traced(layer, canvas)
    trial = trial_of(layer, canvas)
    if isinstance(outline, EllipseOutline):
        distance = distances(layer, trial.grid) - 0.5 * layer.falloff
    else:
        distance = distance_to(outline, trial.grid)
    return _whole(outline, canvas), trial.judged(outline, distance, _deviation(layer)).difference.coarse()


def _traced(layer: Layer, canvas: Canvas) -> tuple[Geometry, Difference | None]:
    """A contour whose blur is nearest."""
    best = best_traced(layer, canvas, [_deviation(layer)])
    if best is None:
        return NOWHERE, None
    assert isinstance(best.outline, Traced)
    return placed(Traced(best.outline.contours, TOLERANCE), canvas), best.difference


def _whole(outline: Outline, canvas: Canvas) -> Geometry:
    """An outline in user units: corners on whole ones, radii of one unit or more."""
    if (made := core(outline)) is not None:
        points, rounding = made
        return PolygonOutline(pairs(canvas.rounded(canvas.places(points))), rounding * canvas.unit)
    geometry = placed(outline, canvas)
    assert isinstance(geometry, EllipseOutline)
    return replace(geometry, radii=(max(geometry.radii[0], 1.0), max(geometry.radii[1], 1.0)))

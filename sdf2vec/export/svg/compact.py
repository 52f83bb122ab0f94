"""The smallest drawing that still blurs: one element a layer, of whole coordinates and few softnesses.

It is of a scene whose numbers it can say (`fit.drawable`). What is off about blurs is made up for by colours and
opacities, which have few steps. The smallest blur whole runs of layers by one filter.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import islice

import numpy as np

from ...blend import EDGE_DEVIATION
from ...grain import Drawable, Grain, Run
from ...outlines import ArcOutline, EllipseOutline, Outline, PolygonOutline
from ...render.occlusion import showing
from ...scene import Layer, Scene
from .blur import best_traced, distances_from, trial_of
from .canvas import Canvas, Points, pairs
from .display import Drawing, Figure, Geometry, Group, Item, Path
from .outlines import Traced, core, edge_of, placed
from .refit_appearance import HASTY, Difference, refitted
from .sharp_edges import NOWHERE, sharp_edge
from .union_gradient import fill_of
from .visibility import LayerSamples, contrasts, layers_at

# User units or, if that is more, pixels of the fitted picture that a traced contour may be off.
TOLERANCE = 0.5, 0.1
STRAYED = 0.5  # of a contour's tolerance, that curves are off: the root of the mean square
RECTANGLE, LINE = 4, 2  # points
THIN = 1.0  # user units that a rectangle is wide where it is a line
ROUNDED = 1.0 / 12.0  # mean squared change of a number that is rounded to a whole one


def drawn(drawable: Drawable, grain: Grain) -> tuple[Drawing, float]:
    """What a drawing of this grain can say, as a display list, and how far that is off from the scene's render, in
    8-bit levels (root mean square), about; 0 for runs, which are as they were fitted.
    """
    if drawable.runs:
        return sketched(drawable, grain), 0.0
    scene = drawable.scene
    canvas, samples = _canvas(scene, grain), layers_at(scene)
    made = [_blurred(layer, canvas) for layer in scene.layers]
    geometries = [geometry for geometry, _ in made]
    off = {index: difference for index, (_, difference) in enumerate(made) if difference is not None}
    again, error = refitted(scene, samples, off, (), grain.colors, grain.opacities, HASTY)
    error += _mixed(scene, samples, canvas) + _moved(scene, samples, geometries, canvas)
    return _drawing(again, geometries, canvas), 255.0 * math.sqrt(error)


def sketched(drawable: Drawable, grain: Grain) -> Drawing:
    """The same without all that makes up for what blurs do: of about as many bytes."""
    scene = drawable.scene
    canvas = _canvas(scene, grain)
    return _drawing(scene, [_edge(layer, canvas) for layer in scene.layers], canvas, drawable.runs)


def _canvas(scene: Scene, grain: Grain) -> Canvas:
    return Canvas.whole(scene, grain.for_scene(scene).units)


def _drawing(
    scene: Scene, geometries: Sequence[Geometry], canvas: Canvas, runs: Sequence[Run] = ()
) -> Drawing:
    layers, items = zip(scene.layers, geometries, strict=True), list[Item]()
    for count, deviation in runs or (Run(len(geometries), 0.0),):
        run = [_figure(*layer, canvas) for layer in islice(layers, count) if layer[1] != NOWHERE]
        items += [Group(tuple(run), blur=deviation * canvas.unit)] if deviation and run else run
    return Drawing(canvas.width, canvas.height, canvas.pixels, canvas.digits, scene.background, tuple(items))


def _figure(layer: Layer, geometry: Geometry, canvas: Canvas) -> Figure:
    fill = fill_of(layer, canvas).fill
    return Figure(_rounded(geometry, canvas), fill, layer.opacity, _deviation(layer) * canvas.unit)


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


def _moved(scene: Scene, samples: LayerSamples, geometries: Sequence[Geometry], canvas: Canvas) -> float:
    """The mean squared error of edges that are not quite where they should be, about.

    An edge of a length that is moved by a little changes so many pixels by as much as it is moved.
    """
    moved = np.array([_squared_move(geometry, canvas) for geometry in geometries]) / canvas.unit**2
    if not moved.any():
        return 0.0
    covers, step = samples.covers.reshape(-1, samples.height, samples.width), scene.extent[0] / samples.width
    down, across = (np.diff(covers, axis=axis, append=0.0) for axis in (1, 2))
    lengths = np.hypot(down, across).sum(axis=(1, 2)) * step
    widths = np.array([max(scene.pixel, layer.falloff) for layer in scene.layers])
    shown = contrasts(scene, samples) * lengths * moved / widths
    return float(shown.sum() / (scene.extent[0] * scene.extent[1]))


def _squared_move(geometry: Geometry, canvas: Canvas) -> float:
    """By how much an edge is moved when it is written, in user units: the mean square."""
    if isinstance(geometry, Path) and any(contour.is_curved for contour in geometry.contours):
        return (STRAYED * _tolerance(canvas)) ** 2 + ROUNDED
    if isinstance(geometry, PolygonOutline):
        numbers = np.array(geometry.points)
    elif isinstance(geometry, ArcOutline):
        numbers = np.array([*geometry.start, *geometry.end])
    elif isinstance(geometry, EllipseOutline):
        numbers = np.array([*geometry.center, *geometry.radii])
    else:
        return ROUNDED
    return float(np.mean(np.square(canvas.rounded(numbers) - numbers)))


# --- geometry -------------------------------------------------------------------------------------------------


def _edge(layer: Layer, canvas: Canvas) -> Geometry:
    """Where coverage is one half."""
    outline = edge_of(layer, 0.5)
    return sharp_edge(layer, canvas, _tolerance(canvas)) if outline is None else _whole(outline, canvas)


def _blurred(layer: Layer, canvas: Canvas) -> tuple[Geometry, Difference | None]:
    """What is blurred, or is sharp, and what is then off about the layer."""
    if not layer.falloff:
        return _edge(layer, canvas), None
    outline = edge_of(layer, 0.5)
    if outline is None:
        return _traced(layer, canvas)
    trial = trial_of(layer, canvas)
    distance = distances_from(outline, layer, trial.grid)
    return _whole(outline, canvas), trial.judged(outline, distance, _deviation(layer)).difference.coarse()


def _traced(layer: Layer, canvas: Canvas) -> tuple[Geometry, Difference | None]:
    """A contour whose blur is nearest."""
    best = best_traced(layer, canvas, _deviation(layer))
    if best is None:
        return NOWHERE, None
    assert isinstance(best.outline, Traced)
    return placed(Traced(best.outline.contours, _tolerance(canvas)), canvas), best.difference


def _tolerance(canvas: Canvas) -> float:
    """How many user units a traced contour may be off."""
    units, pixels = TOLERANCE
    return max(units, pixels / canvas.pixels)


def _whole(outline: Outline, canvas: Canvas) -> Geometry:
    """An outline in user units: a polygon and a rounding, an arc, an ellipse with radii of one unit or more."""
    if (made := core(outline)) is not None:
        points, rounding = made
        corners = pairs(_thinned(canvas.places(points)))
        if len(corners) == LINE:
            start, end = corners
            return ArcOutline(start, end, 0.0, rounding * canvas.unit)
        return PolygonOutline(corners, rounding * canvas.unit)
    geometry = placed(outline, canvas)
    if isinstance(geometry, EllipseOutline):
        return replace(geometry, radii=(max(geometry.radii[0], 1.0), max(geometry.radii[1], 1.0)))
    return geometry


def _thinned(points: Points) -> Points:
    """The corners of a polygon [N, 2]; of a rectangle that has no width the two ends of a line."""
    if len(points) == RECTANGLE:
        for ends in (points, np.roll(points, 1, axis=0)):
            if np.linalg.norm(ends[::2] - ends[1::2], axis=1).max() < THIN:
                return (ends[::2] + ends[1::2]) / 2.0
    return points


def _rounded(geometry: Geometry, canvas: Canvas) -> Geometry:
    """Corners and ends as they will be written; the writer rounds other numbers."""
    if isinstance(geometry, ArcOutline):
        start, end = pairs(canvas.rounded(np.array([geometry.start, geometry.end])))
        return replace(geometry, start=start, end=end)
    if not isinstance(geometry, PolygonOutline):
        return geometry
    return replace(geometry, points=pairs(canvas.rounded(np.array(geometry.points))))

"""Where a layer's coverage is one half, as one geometry.

Of joined shapes whose edges nowhere cross, such as a ring, their own outlines make it up; other edges are traced.
"""

from __future__ import annotations

import numpy as np

from ...arrays import Float64Array
from ...scene import Layer
from .bezier_fit import smooth_path
from .canvas import Canvas
from .display import Geometry, Outlines, Path
from .isobands import layer_contours, trace_grid
from .outlines import TOLERANCE, edge_of, placed
from .sampling import distances

NEAR = 2.0  # user units, or grid cells where these are larger, around an edge
MOST = 16  # shapes
NOWHERE = Path(())  # of a contour that no place on the canvas reaches


def sharp_edge(layer: Layer, canvas: Canvas, tolerance: float) -> Geometry:
    """The edge of a layer in user units, of which a traced one may be so many off."""
    outline = edge_of(layer, 0.5) or uncrossed(layer, canvas)
    if outline is not None:
        return placed(outline, canvas)
    found = layer_contours(layer, [0.5], canvas)
    return smooth_path(found[0].contours, tolerance, canvas) if found else NOWHERE


def uncrossed(layer: Layer, canvas: Canvas) -> Outlines | None:
    """The outlines of a sharp layer's shapes in scene units, where what lies within an odd number of them is it.

    It is so where all are on the canvas, at no place of a grid two edges are near, the layer's is near where one of
    them is, and it covers what the outlines say.
    """
    shapes = [Layer((shape,), layer.falloff, layer.opacity) for shape in layer.shapes]
    outlines = tuple(outline for shape in shapes if (outline := edge_of(shape, 0.5)) is not None)
    if len(outlines) < len(shapes) or len(shapes) > MOST or (grid := trace_grid(layer, canvas)) is None:
        return None
    whole, each = distances(layer, grid), np.stack([distances(shape, grid) for shape in shapes])
    near = max(NEAR / canvas.unit, NEAR * grid.step)
    is_same = _is_parity(whole, each, near) and _is_near(whole, each, near, TOLERANCE / canvas.unit)
    return Outlines(outlines) if is_same else None


def _is_parity(whole: Float64Array, each: Float64Array, near: float) -> bool:
    """Whether a layer covers what lies within an odd number of edges, wherever none is near; two nowhere are."""
    close, inside = np.abs(each) < near, each < 0.0
    is_same = (whole < 0.0) == (inside.sum(axis=0) % 2 == 1)
    return bool(
        inside.any(axis=(1, 2)).all() and (close.sum(axis=0) < 2).all() and is_same[~close.any(axis=0)].all()
    )


def _is_near(whole: Float64Array, each: Float64Array, near: float, off: float) -> bool:
    """Whether a layer's edge is where those of its shapes are."""
    nearest = np.abs(each).min(axis=0)
    close = nearest < near / 2.0
    return bool((np.abs(np.abs(whole) - nearest)[close] < off).all())

"""Where a layer's coverage is one half, as one geometry: of outlines, where it is made of them, else traced."""

from __future__ import annotations

from ...scene import Layer
from .bezier_fit import smooth_path
from .canvas import Canvas
from .crossed import crossed
from .display import Geometry, Path
from .isobands import layer_contours
from .outlines import edge_of, placed

NOWHERE = Path(())  # of a contour that no place on the canvas reaches


def sharp_edge(layer: Layer, canvas: Canvas, tolerance: float) -> Geometry:
    """The edge of a layer in user units, which may be so many off where it is not that of its shapes."""
    outline = edge_of(layer, 0.5)
    if outline is not None:
        return placed(outline, canvas)
    made = crossed(layer, canvas, tolerance)
    if made is not None:
        return made
    found = layer_contours(layer, [0.5], canvas)
    return smooth_path(found[0].contours, tolerance, canvas) if found else NOWHERE

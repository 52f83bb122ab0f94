"""Each layer as items of the display list, by the construction that was planned for it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...outlines import EllipseOutline
from ...scene import Layer, Scene
from ...shapes import KINDS
from .bezier_fit import smooth_path, straight_path
from .blur import Blurred
from .canvas import Canvas
from .display import Drawing, Figure, Fill, Group, Item
from .gradients import SoftEdge, ellipse, radial, sliced
from .isobands import (
    Band,
    band_count,
    band_edges,
    cover_bands,
    edge_distance,
    layer_contours,
    stacked,
    trace_grid,
)
from .outlines import TOLERANCE, core, edge_of, placed, upright
from .plan import Detail, Plan
from .refit_appearance import refitted
from .sampling import covers
from .sharp_edges import NOWHERE, sharp_edge
from .union_gradient import fill_of, gradient_of, mean_color
from .union_partition import part_bands

TRANSPARENT_LIFT = 0.5  # 8-bit levels: on no ground browsers lose half of one at a blur
PARTS_COARSER = 8.0  # the parts of a union are dearer than other bands: every shape has bands of its own
NARROW = 12.0  # pixels: bands of a softer edge need no antialiasing
LOOSEST = 1.0  # user units that a contour of a soft edge may be off
MOST_PARTS = 16  # shapes of a union that have parts of their own; a larger one is painted with a gradient
MIXED = 7.5  # by so much more than the stops of an edge may a gradient through a union be off


def drawing(scene: Scene, plan: Plan, detail: Detail) -> Drawing:
    """The scene as a display list. Only `over`."""
    canvas = plan.canvas
    off = {index: blurred.difference for index, blurred in plan.blurred.items()}
    cut = [index for index, layer in enumerate(scene.layers) if plan.is_rounded_down(index, layer)]
    scene, _ = refitted(scene, plan.samples, off, cut)
    painter = Painter(plan, detail, 0.0 if scene.opaque else TRANSPARENT_LIFT)
    drawn = [painter.draw(layer, index) for index, layer in enumerate(scene.layers)]
    items = tuple(item for item in drawn if item is not None)
    return Drawing(canvas.width, canvas.height, canvas.pixels, canvas.digits, scene.background, items)


@dataclass(frozen=True)
class Painter:
    """Draws layers, each by its construction. `lift`: 8-bit levels that the colours of blurs are raised by."""

    plan: Plan
    detail: Detail
    lift: float

    def draw(self, layer: Layer, index: int) -> Item | None:
        """A layer; None where nothing can be seen."""
        item = self._drawn(layer, index)
        if item is None or (isinstance(item, Figure) and item.geometry == NOWHERE):
            return None
        return replace(item, name=f"{layer.shapes[0].kind}-{index + 1}")

    def _drawn(self, layer: Layer, index: int) -> Item | None:
        canvas, blurred = self.plan.canvas, self.plan.blurred.get(index)
        if layer.is_patch:
            return self._patch(layer, index)
        lift = self.lift if blurred is not None and blurred.deviation else 0.0
        fill, error = fill_of(layer, canvas, lift)
        if error > MIXED * self.detail.levels and 1 < len(layer.seen) <= MOST_PARTS:
            return self._parts(layer, self.plan.bands[index])
        if not self.plan.soft[index]:
            return self._sharp(layer, fill)
        if blurred:
            return _blur(layer, blurred, fill, canvas)
        return self._soft(layer, index, fill)

    def _sharp(self, layer: Layer, fill: Fill) -> Item | None:
        return Figure(sharp_edge(layer, self.plan.canvas, TOLERANCE), fill, layer.opacity)

    def _soft(self, layer: Layer, index: int, fill: Fill) -> Item | None:
        canvas = self.plan.canvas
        outline = edge_of(layer, 0.0)
        if outline is not None and self.plan.is_crisp and isinstance(fill, tuple):
            edge = SoftEdge(fill, layer.opacity, layer.falloff * canvas.unit, self.plan.stops[index])
            if (made := core(outline)) is not None:
                return sliced(canvas.places(made[0]), made[1] * canvas.unit, edge, canvas)
            if isinstance(outline, EllipseOutline):
                return ellipse(outline, edge, canvas)
        edges = [edge_distance(cover) for cover in band_edges(self.plan.bands[index])]
        return self._stacked(layer, [(fill, layer_contours(layer, edges, canvas))], TOLERANCE)

    def _parts(self, layer: Layer, bands: int) -> Item | None:
        """A union of several colours, shape by shape."""
        spread = float(np.var(layer.colors, axis=0).mean()) * layer.opacity**2
        count = max(bands // 2, band_count(spread, PARTS_COARSER * self.detail.levels))
        found = part_bands(layer, count, self.plan.canvas)
        fills = [gradient_of(shape, self.plan.canvas) or mean_color(shape) for shape in layer.seen]
        return self._stacked(layer, list(zip(fills, found, strict=True)), 2.0 * TOLERANCE)

    def _patch(self, layer: Layer, index: int) -> Item | None:
        """Coverage of its own: by one gradient where it is radial, else traced."""
        canvas, (fill, _) = self.plan.canvas, fill_of(layer, self.plan.canvas)
        patch = KINDS[layer.shapes[0].kind].patch
        if patch is not None and patch.radial and isinstance(fill, tuple):
            return radial(layer, fill, canvas)
        grid = trace_grid(layer, canvas)
        if grid is None:
            return None
        bands = cover_bands(covers(layer, grid, 1.0 / canvas.unit), self.plan.bands[index], grid, canvas)
        return self._stacked(layer, [(fill, bands)], TOLERANCE)

    def _stacked(self, layer: Layer, parts: Sequence[tuple[Fill, list[Band]]], least: float) -> Item | None:
        """Bands of one or several fills in a group; their contours may be off by `least` user units at least."""
        canvas = self.plan.canvas
        falloff = layer.falloff * canvas.unit
        wide = self.plan.rings and (falloff * canvas.pixels > NARROW or layer.is_patch)
        apart = wide and len(parts) == 1  # no two paths overlap: each can have the layer's opacity itself
        tolerance = min(max(least, 0.1 * falloff / max(1, len(parts[0][1]))), LOOSEST)
        path = straight_path if wide else smooth_path
        own = layer.opacity if apart else 1.0
        figures = tuple(
            Figure(path(contours, tolerance, canvas), fill, added * own, antialiased=not wide)
            for fill, bands in parts
            for contours, added in stacked(bands, wide)
        )
        return Group(figures, 1.0 if apart else layer.opacity) if figures else None


def _blur(layer: Layer, blurred: Blurred, fill: Fill, canvas: Canvas) -> Figure:
    outline = upright(blurred.outline) if blurred.deviation else blurred.outline
    return Figure(placed(outline, canvas), fill, layer.opacity, blurred.deviation * canvas.unit)

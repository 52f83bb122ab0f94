"""Each layer by the cheapest construction that is near enough."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ...scene import Layer, Scene
from ...shapes import KINDS, EllipseOutline, Outline
from .bands import band_count, band_levels, layer_contours
from .blur import Blurred, best_blur
from .canvas import Canvas, Document, Points, opacity_text, tag, url
from .curves import path_data
from .field import Array, extent
from .gradients import Paint, ellipse, sliced
from .lean import lean
from .outlines import core, element
from .pieces import piece_contours
from .shading import fill_of, is_mixed
from .stops import stop_count
from .weigh import contrasts

SHARP = 2.0  # user units: an edge softer than this is drawn soft
SMALL = 64.0  # user units along the shortest side: a picture smaller than this will be shown larger
BANDS_COARSER = 4.0  # bands are dear, and their steps alternate in sign
PIECES_COARSER = 8.0  # pieces are still dearer: every shape of a union has bands of its own
MIXED = 7.5  # by so much more than the stops of an edge may a gradient through a union be off
TOLERANCE = 0.05  # user units that a traced contour may be off


@dataclass(frozen=True)
class Detail:
    """How finely a drawing is made. `target` is the nearness in dB for which blurs are given up.

    `levels`: the error, in 8-bit levels, that the stops of one shape's edge may leave, and times
    BANDS_COARSER the bands of a traced one. `coarser`: decimals fewer. `named`: ids on shapes.
    `lean`: nothing but blurs, in the smallest text.
    """

    target: float = 46.0
    levels: float = 0.2
    coarser: int = 0
    named: bool = True
    lean: bool = False


@dataclass(frozen=True)
class Part:
    """A layer to draw and its place in the scene."""

    layer: Layer
    index: int


class Painter:
    """Draws layers into a document, each by its construction."""

    def __init__(self, document: Document, detail: Detail, plan: Plan) -> None:
        self.document = document
        self.canvas = document.canvas
        self.detail = detail
        self.plan = plan

    def draw(self, part: Part) -> str:
        """The element of a layer; empty where nothing can be seen."""
        layer = part.layer
        name = self.document.id_of(layer.kind, part.index)
        outline = edge_of(layer, 0.5)
        if is_mixed(layer, self.canvas, MIXED * self.detail.levels):
            return self._pieces(part, name)
        if self.detail.lean and outline is not None:
            return lean(layer, outline, is_soft(layer, self.canvas), self.document)
        if not is_soft(layer, self.canvas):
            return self._sharp(part, outline, name)
        if part.index in self.plan.blurred:
            return self._blur(part, self.plan.blurred[part.index], name)
        return self._soft(part, name)

    def _sharp(self, part: Part, outline: Outline | None, name: str | None) -> str:
        if outline is not None:
            return element(outline, self.canvas, id=name, **self._look(part))
        (found,) = layer_contours(part.layer, [0.5 * part.layer.falloff], self.canvas)
        if not found:
            return ""
        data = path_data(found, TOLERANCE, self.canvas)
        return tag("path", id=name, d=data, fill_rule="evenodd", **self._look(part))

    def _soft(self, part: Part, name: str | None) -> str:
        layer, unit = part.layer, self.canvas.unit
        edge = edge_of(layer, 0.0)
        color = layer.shapes[0].color
        paint = Paint(color, layer.opacity, layer.falloff * unit, self.plan.stops[part.index])
        if isinstance(edge, EllipseOutline):
            return ellipse(edge, paint, self.document, name)
        if edge is not None and (made := core(edge)) is not None:
            return sliced(self.canvas.places(made[0]), made[1] * unit, paint, self.document, name)
        return self._bands(part, name)

    def _bands(self, part: Part, name: str | None) -> str:
        layer = part.layer
        bands = band_levels(self.plan.bands[part.index])
        tolerance = max(TOLERANCE, 0.15 * layer.falloff * self.canvas.unit / len(bands))
        found = layer_contours(layer, [end * layer.falloff for end, _ in bands], self.canvas)
        covered = [(cover, contours) for contours, (_, cover) in zip(found, bands, strict=True)]
        paths = [
            tag("path", d=path_data(contours, tolerance, self.canvas), fill_opacity=added)
            for contours, added in steps(covered)
        ]
        if not paths:
            return ""
        look = {
            "fill": fill_of(layer, self.document),
            "opacity": opacity_text(layer.opacity),
        }
        return tag("g", *paths, id=name, fill_rule="evenodd", **look)

    def _pieces(self, part: Part, name: str | None) -> str:
        layer = part.layer
        spread = float(np.var([shape.color for shape in layer.shapes], axis=0).mean()) * layer.opacity**2
        count = max(self.plan.bands[part.index] // 2, band_count(spread, PIECES_COARSER * self.detail.levels))
        tolerance = max(2.0 * TOLERANCE, 0.15 * layer.falloff * self.canvas.unit / count)
        paths = []
        pieces = piece_contours(layer, count, self.canvas)
        for shape, bands in zip(layer.shapes, pieces, strict=True):
            color = self.document.color(shape.color)
            paths += [
                tag("path", d=path_data(found, tolerance, self.canvas), fill=color, fill_opacity=added)
                for found, added in steps(bands)
            ]
        return (
            tag("g", *paths, id=name, fill_rule="evenodd", opacity=opacity_text(layer.opacity))
            if paths
            else ""
        )

    def _blur(self, part: Part, blurred: Blurred, name: str | None) -> str:
        look = {
            "fill": fill_of(part.layer, self.document),
            "opacity": opacity_text(part.layer.opacity),  # as the paint's, Chromium would round it down
            "filter": url(self._filter(part.layer, blurred)),
        }
        return element(blurred.outline, self.canvas, id=name, **look)

    def _filter(self, layer: Layer, blurred: Blurred) -> str:
        deviation = self.canvas.fine(blurred.deviation * self.canvas.unit)
        blur = tag("feGaussianBlur", stdDeviation=deviation)
        region = self._region(layer, blurred)
        return self.document.define("blur", "filter", blur, color_interpolation_filters="sRGB", **region)

    def _region(self, layer: Layer, blurred: Blurred) -> dict[str, str]:
        """A filter region in shares of the element's box, so that shapes can share the filter."""
        box = extent(layer)
        margin = 3.0 * blurred.deviation
        inner = extent(layer, 0.5)
        shares = [
            margin / max(side, 1e-6)
            for side in (inner.right - inner.left, inner.bottom - inner.top)
            if box is not None
        ]
        steps = [_at_least(share) for share in shares]
        x, y = steps
        return {"x": f"-{x}%", "y": f"-{y}%", "width": f"{100 + 2 * x}%", "height": f"{100 + 2 * y}%"}

    def _look(self, part: Part) -> dict[str, str | None]:
        return {
            "fill": fill_of(part.layer, self.document),
            "fill_opacity": opacity_text(part.layer.opacity),
        }


def steps(bands: list[tuple[float, list[Points]]]) -> Iterator[tuple[list[Points], str | None]]:
    """The contours of nested bands, and the opacity that each adds to reach its coverage."""
    below = 0.0
    for cover, contours in bands:
        if contours:
            yield contours, opacity_text((cover - below) / (1.0 - below))
        below = cover


def is_soft(layer: Layer, canvas: Canvas) -> bool:
    """Whether a layer's edge is too soft for antialiasing to draw it."""
    return layer.falloff * canvas.unit > SHARP * min(1.0, canvas.unit / SMALL)


def _at_least(share: float) -> int:
    """Per cent, rounded up to one of a few steps."""
    steps = (10, 20, 30, 45, 60, 80, 110, 150, 200, 300, 450, 700, 1000, 2000, 5000)
    return next((step for step in steps if step >= 100 * share), 10000)


def edge_of(layer: Layer, falloffs: float) -> Outline | None:
    """The analytic contour of a single shape, so many falloffs outside."""
    outline_of = KINDS[layer.kind].outline
    if outline_of is None or len(layer.shapes) > 1:
        return None
    return outline_of(falloffs * layer.falloff, *layer.shapes[0].named().values())


@dataclass(frozen=True)
class Plan:
    """Which layers are drawn by a blur, how many stops the gradients of each layer have, and how many bands."""

    blurred: dict[int, Blurred]
    stops: list[int]
    bands: list[int]


def plan(scene: Scene, canvas: Canvas, detail: Detail, blurs: bool) -> Plan:
    """The cheapest constructions that keep to what is allowed."""
    weight = contrasts(scene) if scene.layers else np.zeros(0)
    stops = [stop_count(w, detail.levels) for w in weight.tolist()]
    bands = [band_count(w, BANDS_COARSER * detail.levels) for w in weight.tolist()]
    return Plan(_choose_blurs(scene, canvas, weight, detail.target) if blurs else {}, stops, bands)


def _choose_blurs(scene: Scene, canvas: Canvas, weight: Array, target: float) -> dict[int, Blurred]:
    """All layers that have a blur but the worst, which are given up until the target is reached."""
    size = (canvas.width, canvas.height, canvas.unit)
    soft = {i: layer for i, layer in enumerate(scene.layers) if is_soft(layer, canvas)}
    tried = {index: best_blur(layer, size) for index, layer in soft.items()}
    found = {index: blurred for index, blurred in tried.items() if blurred is not None}
    energy = {index: blurred.error * float(weight[index]) for index, blurred in found.items()}
    allowed = 10 ** (-target / 10) * scene.extent[0] * scene.extent[1]
    kept = sorted(energy, key=lambda index: (energy[index], index))
    total = np.cumsum([energy[index] for index in kept])
    return {index: found[index] for index, sum_ in zip(kept, total, strict=True) if sum_ <= allowed}

"""Each layer by the cheapest construction that is near enough."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ...scene import Layer, Scene
from ...shapes import KINDS, EllipseOutline, Outline
from .bezier_fit import path_data, polygon_data
from .blur import Blurred, best_blur
from .canvas import Canvas, Document, Points, color_text, opacity_text, tag, url
from .compact import Grain, lean, lean_blur, softnesses
from .gradient_stops import stop_count
from .gradients import Paint, ellipse, sliced
from .isobands import band_count, band_levels, layer_contours
from .outlines import TOLERANCE, core, element, upright
from .sampling import Array, extent
from .union_gradient import fill_of, is_mixed
from .union_partition import piece_contours
from .visibility import contrasts

SHARP = 2.0  # pixels: an edge softer than this is drawn soft
SMALL = 64.0  # pixels along the shortest side: a picture smaller than this will be shown larger
CUT = 4.0  # times as bad as others is the error of what the canvas' edge cuts off: there all layers err alike
TRANSPARENT_LIFT = 0.5  # 8-bit levels: on no ground browsers lose half of one at a blur
BANDS_COARSER = 4.0  # bands are dear, and their steps alternate in sign
PIECES_COARSER = 8.0  # pieces are still dearer: every shape of a union has bands of its own
SHOWN = 512.0  # pixels along the shortest side, at least, that a drawing is expected to be shown at
NARROW = 12.0  # pixels: bands of a softer edge need no antialiasing
LOOSEST = 1.0  # user units that a contour of a soft edge may be off
MIXED = 7.5  # by so much more than the stops of an edge may a gradient through a union be off


Bands = list[tuple[float, list[Points]]]  # coverage and contours, outermost first


@dataclass(frozen=True)
class Detail:
    """How finely a drawing is made. `target` is the nearness in dB for which blurs are given up.

    `levels`: the error, in 8-bit levels, that the stops of one shape's edge may leave, and times
    BANDS_COARSER the bands of a traced one. `coarser`: decimals fewer. `named`: ids on shapes.
    `lean`: nothing but blurs, in the smallest text, so coarse.
    """

    target: float = 47.0
    levels: float = 0.2
    coarser: int = 0
    named: bool = True
    lean: Grain | None = None


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
        if self.detail.lean:
            blurred = self.plan.blurred.get(part.index)
            return lean(layer, blurred, self.detail.lean, self.document) if blurred else ""
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
        tolerance = min(max(TOLERANCE, 0.15 * layer.falloff * self.canvas.unit / len(bands)), LOOSEST)
        found = layer_contours(layer, [end * layer.falloff for end, _ in bands], self.canvas)
        covered = [(cover, contours) for contours, (_, cover) in zip(found, bands, strict=True)]
        return self._stacked(part, [(fill_of(layer, self.document), covered)], tolerance, name)

    def _pieces(self, part: Part, name: str | None) -> str:
        layer = part.layer
        spread = float(np.var([shape.color for shape in layer.shapes], axis=0).mean()) * layer.opacity**2
        count = max(self.plan.bands[part.index] // 2, band_count(spread, PIECES_COARSER * self.detail.levels))
        tolerance = min(max(2.0 * TOLERANCE, 0.15 * layer.falloff * self.canvas.unit / count), LOOSEST)
        fills = [color_text(shape.color) for shape in layer.shapes]
        pieces = list(zip(fills, piece_contours(layer, count, self.canvas), strict=True))
        return self._stacked(part, pieces, tolerance, name)

    def _stacked(
        self, part: Part, pieces: list[tuple[str, Bands]], tolerance: float, name: str | None
    ) -> str:
        """Bands of one or several fills in a group."""
        wide = self.plan.rings and part.layer.falloff * self.canvas.unit * self.canvas.pixels > NARROW
        fill = pieces[0][0] if len(pieces) == 1 else None
        apart = wide and fill is not None  # no two paths overlap: each can have the layer's opacity itself
        paths = [
            tag(
                "path",
                d=(polygon_data if wide else path_data)(contours, tolerance, self.canvas),
                fill=own if fill is None else None,
                fill_opacity=opacity_text(added * part.layer.opacity if apart else added),
            )
            for own, bands in pieces
            for contours, added in (rings(bands) if wide else steps(bands))
        ]
        look = {
            "fill": fill,
            "fill_rule": "evenodd",
            "shape_rendering": "crispEdges" if wide else None,
            "opacity": None if apart else opacity_text(part.layer.opacity),
        }
        return tag("g", *paths, id=name, **look) if paths else ""

    def _blur(self, part: Part, blurred: Blurred, name: str | None) -> str:
        if not blurred.deviation:
            return element(blurred.outline, self.canvas, id=name, **self._look(part))
        filter_ = url(self._filter(part.layer, blurred))
        fill = fill_of(part.layer, self.document, self.plan.lift)
        return element(upright(blurred.outline), self.canvas, id=name, fill=fill, filter=filter_)

    def _filter(self, layer: Layer, blurred: Blurred) -> str:
        deviation = self.canvas.fine(blurred.deviation * self.canvas.unit)
        steps = [tag("feGaussianBlur", stdDeviation=deviation)]
        opacity = opacity_text(layer.opacity)  # here, for browsers round an attribute's down
        if opacity is not None:
            steps.append(tag("feComponentTransfer", tag("feFuncA", type="linear", slope=opacity)))
        region = self._region(layer, blurred)
        return self.document.define("blur", "filter", *steps, color_interpolation_filters="sRGB", **region)

    def _region(self, layer: Layer, blurred: Blurred) -> dict[str, str]:
        """A filter region in shares of the element's box, so that shapes can share the filter."""
        margin, inner = 3.0 * blurred.deviation, extent(layer, 0.5)
        sides = (inner.right - inner.left, inner.bottom - inner.top)
        x, y = (_at_least(margin / max(side, 1e-6)) for side in sides)
        return {"x": f"-{x}%", "y": f"-{y}%", "width": f"{100 + 2 * x}%", "height": f"{100 + 2 * y}%"}

    def _look(self, part: Part) -> dict[str, str | None]:
        return {
            "fill": fill_of(part.layer, self.document),
            "fill_opacity": opacity_text(part.layer.opacity),
        }


def rings(bands: Bands) -> Iterator[tuple[list[Points], float]]:
    """The contours around what lies between each band and the next, and the coverage there.

    Drawn without antialiasing every pixel belongs to one ring: nothing adds up, so nothing is lost to rounding. Not
    for cairo, which fills holes that are a single pixel wide.
    """
    for (cover, outer), (_, inner) in zip(bands, [*bands[1:], (1.0, [])], strict=True):
        if outer:
            yield outer + inner, cover


def steps(bands: Bands) -> Iterator[tuple[list[Points], float]]:
    """The contours of nested bands, and the opacity that each adds to reach its coverage: antialiased."""
    below = 0.0
    for cover, contours in bands:
        if contours:
            yield contours, (cover - below) / (1.0 - below)
        below = cover


def is_soft(layer: Layer, canvas: Canvas) -> bool:
    """Whether a layer's edge is too soft for antialiasing to draw it."""
    side = canvas.unit * canvas.pixels
    return layer.falloff * side > SHARP * min(1.0, side / SMALL)


def is_banded(layer: Layer, canvas: Canvas) -> bool:
    """Whether a layer is soft, and no gradient or slices could draw it."""
    return is_soft(layer, canvas) and edge_of(layer, 0.0) is None


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
    """Which layers are drawn by a blur, how many stops the gradients of each layer have, and how many bands.

    `lift`: 8-bit levels that the colours of blurs are raised by. `rings`: whether wide bands are rings.
    """

    blurred: dict[int, Blurred]
    stops: list[int]
    bands: list[int]
    lift: float
    rings: bool


def plan(scene: Scene, canvas: Canvas, detail: Detail, blurs: bool) -> Plan:
    """The cheapest constructions that keep to what is allowed."""
    weight = contrasts(scene) if scene.layers else np.zeros(0)
    stops = [stop_count(w, detail.levels) for w in weight.tolist()]
    side = max(canvas.unit * canvas.pixels, SHOWN)
    bands = [
        band_count(w, BANDS_COARSER * detail.levels, layer.falloff * side)
        for w, layer in zip(weight.tolist(), scene.layers, strict=True)
    ]
    if detail.lean:
        blurred = _lean_blurs(scene, canvas, detail.lean)
    else:
        blurred = _choose_blurs(scene, canvas, weight, detail.target) if blurs else {}
    return Plan(blurred, stops, bands, TRANSPARENT_LIFT if scene.background is None else 0.0, blurs)


def _lean_blurs(scene: Scene, canvas: Canvas, grain: Grain) -> dict[int, Blurred]:
    """All layers as blurs with few classes."""
    falloffs = [layer.falloff if is_soft(layer, canvas) else 0.0 for layer in scene.layers]
    deviations = softnesses(falloffs, canvas, grain.softnesses)
    tried = (
        lean_blur(layer, edge_of(layer, 0.5), deviation, canvas)
        for layer, deviation in zip(scene.layers, deviations, strict=True)
    )
    return {index: blurred for index, blurred in enumerate(tried) if blurred is not None}


def _worst(blurred: Blurred) -> float:
    return max(blurred.error, CUT * blurred.error_cut if blurred.error_cut > 2.0 * blurred.error else 0.0)


def _choose_blurs(scene: Scene, canvas: Canvas, weight: Array, target: float) -> dict[int, Blurred]:
    """All layers that have a blur but the worst, which are given up until the target is reached."""
    size = (canvas.width, canvas.height, canvas.unit)
    soft = {i: layer for i, layer in enumerate(scene.layers) if is_soft(layer, canvas)}
    tried = {index: best_blur(layer, size) for index, layer in soft.items()}
    found = {index: blurred for index, blurred in tried.items() if blurred is not None}
    energy = {index: _worst(blurred) * float(weight[index]) for index, blurred in found.items()}
    allowed = 10 ** (-target / 10) * scene.extent[0] * scene.extent[1]
    kept = sorted(energy, key=lambda index: (energy[index], index))
    total = np.cumsum([energy[index] for index in kept])
    return {index: found[index] for index, sum_ in zip(kept, total, strict=True) if sum_ <= allowed}

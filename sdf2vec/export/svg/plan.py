"""How finely a drawing is made, and which construction each layer gets."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from ...arrays import Float64Array
from ...scene import Layer, Scene
from .blur import Blurred, best_blur
from .canvas import Canvas
from .gradient_stops import stop_count
from .isobands import band_count
from .outlines import edge_of
from .visibility import LayerSamples, contrasts, layers_at

SHARP = 2.0  # pixels: an edge softer than this is drawn soft
SMALL = 64.0  # pixels along the shortest side: a picture smaller than this will be shown larger
CUT = 4.0  # times as bad as others is the error of what the canvas' edge cuts off: there all layers err alike
BANDS_COARSER = 4.0  # bands are dear, and their steps alternate in sign
SHOWN = 512.0  # pixels along the shortest side, at least, that a drawing is expected to be shown at


@dataclass(frozen=True)
class Detail:
    """How finely a drawing is made. `target` is the nearness in dB for which blurs are given up.

    `levels`: the error, in 8-bit levels, that the stops of one shape's edge may leave, and times
    BANDS_COARSER the bands of a traced one. `coarser`: decimals fewer. `named`: names on shapes.
    """

    target: float = 47.0
    levels: float = 0.2
    coarser: int = 0
    named: bool = True


DETAILS_EXACT = Detail(target=math.inf, levels=0.1)  # no blurs
# From what looks like the render to what is small. Names go last, for they are what a person edits by.
DETAILS = (
    Detail(),
    Detail(target=43.0, levels=0.3),
    Detail(target=40.0, levels=0.5),
    Detail(target=37.0, levels=0.8, coarser=1),
    Detail(target=34.0, levels=1.2, coarser=1),
    Detail(target=30.0, levels=2.0, coarser=1, named=False),
    Detail(target=0.0, levels=4.0, coarser=1, named=False),
)


@dataclass(frozen=True)
class Plan:
    """The canvas, which layers are soft, which are drawn by a blur, how many stops or bands each layer's edge has.

    `rings`: whether wide bands are rings. `is_crisp`: whether pixels can be kept to one slice each.
    """

    canvas: Canvas
    soft: list[bool]
    blurred: Mapping[int, Blurred]
    stops: list[int]
    bands: list[int]
    rings: bool
    samples: LayerSamples
    is_crisp: bool = True

    def is_rounded_down(self, index: int, layer: Layer) -> bool:
        """Whether a layer is drawn by what 8 bits take from most: a blur, or bands."""
        sliced = self.is_crisp and edge_of(layer, 0.0) is not None
        banded = (self.soft[index] or layer.is_patch) and not sliced
        return index in self.blurred or banded


@dataclass
class Planner:
    """What the drawings of a scene in all details have in common, found out when first needed."""

    scene: Scene
    filters: bool
    is_crisp: bool = True
    canvas: Canvas = field(init=False)

    def __post_init__(self) -> None:
        self.canvas = Canvas.of(self.scene)
        side = self.canvas.unit
        softest = SHARP * min(1.0, side / SMALL)
        self.soft = [layer.falloff * side > softest for layer in self.scene.layers]

    @property
    def can_be_small(self) -> bool:
        """Whether there may be blurs wherever a small drawing needs them."""
        return self.filters or not any(self.soft)

    @cached_property
    def samples(self) -> LayerSamples:
        return layers_at(self.scene)

    @cached_property
    def weights(self) -> Float64Array:
        return contrasts(self.scene, self.samples)

    @cached_property
    def blurs(self) -> dict[int, Blurred]:
        """The nearest blur of each soft layer."""
        layers = enumerate(self.scene.layers)
        tried = {i: best_blur(layer, self.canvas) for i, layer in layers if self.soft[i]}
        return {index: blurred for index, blurred in tried.items() if blurred is not None}

    def plan(self, detail: Detail) -> Plan:
        """The cheapest constructions that keep to what is allowed."""
        scene = self.scene
        stops = [stop_count(weight, detail.levels) for weight in self.weights.tolist()]
        side = max(self.canvas.unit, SHOWN)
        bands = [
            band_count(
                weight, BANDS_COARSER * detail.levels, math.inf if layer.is_patch else layer.falloff * side
            )
            for weight, layer in zip(self.weights.tolist(), scene.layers, strict=True)
        ]
        return Plan(
            Canvas.of(scene, detail.coarser),
            self.soft,
            self._near_enough(detail.target) if self.filters else {},
            stops,
            bands,
            self.filters and self.is_crisp,
            self.samples,
            self.is_crisp,
        )

    def _near_enough(self, target: float) -> dict[int, Blurred]:
        """The blurs of soft layers but the worst, which are given up until the target in dB is reached."""
        found = self.blurs
        energy = {index: _worst(blurred) * float(self.weights[index]) for index, blurred in found.items()}
        allowed = 10 ** (-target / 10) * self.scene.extent[0] * self.scene.extent[1]
        kept = sorted(energy, key=lambda index: (energy[index], index))
        total = np.cumsum([energy[index] for index in kept])
        return {index: found[index] for index, sum_ in zip(kept, total, strict=True) if sum_ <= allowed}


def _worst(blurred: Blurred) -> float:
    return max(blurred.error, CUT * blurred.error_cut if blurred.error_cut > 2.0 * blurred.error else 0.0)

"""The GPU renderer's kernels: text generated from the same expressions as everything else.

A text holds only the kinds of layer that a scene uses.
"""

from __future__ import annotations

from functools import cache
from types import ModuleType

from ..blend import COMPOSITING
from ..expr import VEC3, VEC4, components_of, scalarize, var
from ..lower.block import Block
from ..lower.triton import PREAMBLE, backward, forward
from ..templating import template
from . import compiled
from .kernels import PIXELS, TILE, Formula, LayerKind

SOLID = -1  # instead of a kind: the layer covers all of the tile, so its formula need not be looked at
MEASURED = 64  # tiles whose distance from a layer is looked at at once
REDUCED = 32  # pairs whose derivatives are added up at once


def text(layers: tuple[LayerKind, ...], compositing: str, channels: int) -> str:
    """The whole module for these kinds of layer and 3 or 4 channels of colour.

    A layer's row of numbers is that of `Formula.uniforms`, filled up to the longest, then colour and opacity.
    """
    parts = [PREAMBLE, *_blend_text(compositing, channels)]
    formulas = [Formula(layer) for layer in layers]
    for index, (layer, formula) in enumerate(zip(layers, formulas, strict=True)):
        parts += [f"# {layer.kind}, {layer.union_size} joined", *_layer_text(index, formula)]
    driver = template("tiles.triton.jinja").render(
        tile=TILE,
        pixels=PIXELS,
        farthest=(TILE - 1) / 2 * 2**0.5,
        channels=channels,
        unions=[layer.union_size > 1 for layer in layers],
        widest=max(len(formula.uniforms) for formula in formulas),
        solid=SOLID,
        measured=MEASURED,
        reduced=REDUCED,
    )
    return "\n\n".join([*parts, driver])


def _layer_text(index: int, formula: Formula) -> list[str]:
    """A layer's coverage and its derivatives, its bounds, and the distance at a point, of one row of numbers."""
    block, point = formula.block(f"layer{index}"), components_of(formula.point)
    bounds = Block(f"bounds{index}", formula.bounds(), (), formula.uniforms)
    distance = Block(f"distance{index}", scalarize(formula.distance), point, formula.uniforms)
    return [backward(block, rows=True), *(forward(part, rows=True) for part in (block, bounds, distance))]


def _blend_text(compositing: str, channels: int) -> list[str]:
    """Laying a colour (uniform; in a union varying) on what is below, all channels at once."""
    below, color, opacity, cover = var("below", VEC4), var("color", VEC3), var("opacity"), var("cover")
    outputs = scalarize(COMPOSITING[compositing](below, color, opacity, cover))[:channels]
    varying, tint = (*components_of(below)[:channels], cover), components_of(color)
    return [
        part
        for block in (
            Block("blend", outputs, varying, (*tint, opacity)),
            Block("blend_tint", outputs, (*varying, *tint), (opacity,)),
        )
        for part in (forward(block), backward(block, flows=block.varying))
    ]


@cache
def load(layers: tuple[LayerKind, ...], compositing: str, channels: int) -> ModuleType:
    """The module for these kinds of layer; Triton compiles its kernels when they are first launched."""
    return compiled.load_file(text(layers, compositing, channels))

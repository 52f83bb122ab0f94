"""The GPU renderer's kernels: text generated from the same expressions as everything else.

A text holds only the kinds of layer that a scene uses.
"""

from __future__ import annotations

from functools import cache
from types import ModuleType

from .. import kernel_cache
from ..expr import components_of, scalarize
from ..lower.block import Block
from ..lower.triton import PREAMBLE, backward, forward
from ..templating import template
from .kernels import LOOK, PIXELS, TILE, Formula, LayerKind, flows_of, solid

SOLID = -1  # instead of a kind: the layer covers all of the tile, so its formula need not be looked at
MEASURED = 64  # tiles whose distance from a layer is looked at at once
REDUCED = 32  # pairs whose derivatives are added up at once


def text(layers: tuple[LayerKind, ...], compositing: str, channels: int) -> str:
    """The whole module for these kinds of layer and 3 or 4 channels of colour.

    A layer's row of numbers is `kernels.LOOK`, then `Formula.uniforms`, filled up to the longest.
    """
    formulas = [Formula(layer) for layer in layers]
    parts = [PREAMBLE, *_both_ways(solid(compositing, channels), channels)]
    for index, (layer, formula) in enumerate(zip(layers, formulas, strict=True)):
        row, point = (*LOOK, *formula.uniforms), components_of(formula.point)
        parts += [
            f"# {layer.kind}, {layer.union_size} joined",
            *_both_ways(formula.drawn(f"layer{index}", compositing, channels), channels),
            forward(Block(f"bounds{index}", formula.bounds(), (), row), rows=True),
            forward(Block(f"distance{index}", scalarize(formula.distance), point, row), rows=True),
        ]
    driver = template("tiles.triton.jinja").render(
        tile=TILE,
        pixels=PIXELS,
        farthest=(TILE - 1) / 2 * 2**0.5,
        channels=channels,
        unions=[layer.union_size > 1 for layer in layers],
        row=len(LOOK) + max(len(formula.uniforms) for formula in formulas),
        solid=SOLID,
        measured=MEASURED,
        reduced=REDUCED,
    )
    return "\n\n".join([*parts, driver])


def _both_ways(block: Block, channels: int) -> tuple[str, str]:
    return forward(block, rows=True), backward(block, flows_of(channels), rows=True)


@cache
def load(layers: tuple[LayerKind, ...], compositing: str, channels: int) -> ModuleType:
    """The module for these kinds of layer; Triton compiles its kernels when they are first launched."""
    return kernel_cache.load_file(text(layers, compositing, channels))

"""The GPU renderer's kernels: text generated from the same expressions as everything else.

A text holds only the kinds of layer that a scene uses.
"""

from __future__ import annotations

from functools import cache
from types import ModuleType
from typing import Any

from ..blend import COMPOSITING
from ..expr import VEC3, VEC4, Expr, components_of, scalarize, var
from ..lower.block import Block
from ..lower.triton import PREAMBLE, backward, forward
from ..templating import template
from . import compiled
from .kernels import PIXELS, TILE, Formula, LayerKind

SOLID = -1  # instead of a kind: the layer covers all of the tile, so its distance need not be looked at
REDUCED = 32  # pairs whose derivatives are added up at once


def text(layers: tuple[LayerKind, ...], compositing: str, channels: int) -> str:
    """The whole module for these kinds of layer and 3 or 4 channels of colour."""
    parts = [PREAMBLE, *_blend_text(compositing)]
    for index, layer in enumerate(layers):
        block = Formula(layer).block(f"layer{index}")
        parts += [f"# {layer.kind}, {layer.union_size} joined", forward(block), backward(block)]
    kinds = [_kind(index, layer) for index, layer in enumerate(layers)]
    driver = template("tiles.triton.jinja").render(
        tile=TILE, pixels=PIXELS, channels=channels, kinds=kinds, solid=SOLID, reduced=REDUCED
    )
    return "\n\n".join([*parts, driver])


def _kind(index: int, layer: LayerKind) -> dict[str, Any]:
    """What the template has to know of a kind of layer."""
    return {"index": index, "union": layer.union_size > 1, "uniforms": len(Formula(layer).uniforms)}


def _blend_text(compositing: str) -> list[str]:
    """Laying a channel of colour, or alpha, on what is below; derivatives by all three (two) of these."""
    below, color, opacity, cover = var("below", VEC4), var("color", VEC3), var("opacity"), var("cover")
    red, _, _, alpha = scalarize(COMPOSITING[compositing](below, color, opacity, cover))
    tint, below_red, below_alpha = components_of(color)[0], components_of(below)[0], components_of(below)[3]
    blocks: tuple[tuple[Block, tuple[Expr, ...]], ...] = (
        (Block("blend_color", (red,), (below_red, cover), (tint, opacity)), (below_red, cover)),
        (Block("blend_tint", (red,), (below_red, cover, tint), (opacity,)), (below_red, cover, tint)),
        (Block("blend_alpha", (alpha,), (below_alpha, cover), (opacity,)), (below_alpha, cover)),
    )
    return [part for block, flows in blocks for part in (forward(block), backward(block, flows))]


@cache
def load(layers: tuple[LayerKind, ...], compositing: str, channels: int) -> ModuleType:
    """The module for these kinds of layer; Triton compiles its kernels when they are first launched."""
    return compiled.load_file(text(layers, compositing, channels))

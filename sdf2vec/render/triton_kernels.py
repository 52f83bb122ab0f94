"""The GPU renderer's kernels: text generated from the same expressions as everything else.

A text holds only the structures of layers that a scene has.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from types import ModuleType

from .. import kernel_cache
from ..expr import Expr
from ..graph import components_of, scalarize
from ..layer import Formula, P, Structure
from ..lower.block import Block
from ..lower.triton import PREAMBLE, backward, forward
from ..templating import template
from .kernels import carried, culling, drawn, filled
from .tiling import PIXELS, TILE

MEASURED = 64  # tiles whose distance from a layer is looked at at once
REDUCED = 32  # pairs whose derivatives are added up at once


def text(structures: tuple[Structure, ...], compositing: str, channels: int) -> str:
    """The whole module for layers of these structures and 3 or 4 channels of colour.

    A layer's row of numbers is `Formula.uniforms`, filled up to the longest.
    """
    formulas, parts = [Formula.of(structure) for structure in structures], [PREAMBLE]
    for index, formula in enumerate(formulas):
        row = formula.uniforms
        parts += [
            f"# {formula}",
            *_both_ways(drawn(formula, f"layer{index}", compositing, channels), channels),
            forward(Block(f"bounds{index}", culling(formula), (), row), rows=True),
            forward(Block(f"distance{index}", scalarize(formula.distance), components_of(P), row), rows=True),
        ]
    solid = _solid_blocks(formulas, compositing, channels)
    for block in dict.fromkeys(block for block in solid if block):
        parts += _both_ways(block, channels)
    driver = template("tiles.triton.jinja").render(
        tile=TILE,
        pixels=PIXELS,
        channels=channels,
        solid=[block.name if block else None for block in solid],
        row=max(len(formula.uniforms) for formula in formulas),
        kinds=len(formulas),
        measured=MEASURED,
        reduced=REDUCED,
    )
    return "\n\n".join([*parts, driver])


def _solid_blocks(formulas: Sequence[Formula], compositing: str, channels: int) -> list[Block | None]:
    """What becomes of a tile that a layer of each structure covers wholly; the same one for equal formulas.

    None where colours are mixed.
    """
    found: dict[tuple[Expr, ...], Block] = {}
    blocks: list[Block | None] = []
    for formula in formulas:
        block = filled(formula, f"solid{len(found)}", compositing, channels)
        blocks.append(found.setdefault(block.outputs, block) if formula.is_solid else None)
    return blocks


def _both_ways(block: Block, channels: int) -> tuple[str, str]:
    return forward(block, rows=True), backward(block, carried(channels), rows=True)


@cache
def load(structures: tuple[Structure, ...], compositing: str, channels: int) -> ModuleType:
    """The module for layers of these structures; Triton compiles its kernels when they are first launched."""
    return kernel_cache.load_file(text(structures, compositing, channels))

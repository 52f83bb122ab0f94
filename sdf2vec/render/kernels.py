"""The fused renderer's kernels: text generated from the same expressions as everything else.

A text holds only the structures of layers that a scene has.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from types import ModuleType

from .. import kernel_cache
from ..expr import Expr, const, var
from ..graph import components_of, scalarize, walk
from ..layer import NEVER, PIXEL, Formula, P, Structure
from ..lower.numba import PREAMBLE, Block, backward, forward, scalar
from ..operation import VEC4
from ..templating import template
from .tiling import TILE

FARTHEST = (
    1.001 * (TILE - 1) / 2 * 2**0.5
)  # pixels from a tile's centre to its farthest pixel centre, and rounding
BELOW = var("below", VEC4)


def drawn(formula: Formula, name: str, compositing: str, channels: int) -> Block:
    """What a block of pixels becomes when a layer is laid on it."""
    return _block(formula, name, formula.draw(BELOW, compositing), channels)


def solid_blocks(formulas: Sequence[Formula], compositing: str, channels: int) -> list[Block | None]:
    """For each structure what a block of pixels becomes that a layer covers wholly; the same one for equal formulas.

    None where colours are mixed.
    """
    found: dict[tuple[Expr, ...], Block] = {}
    blocks: list[Block | None] = []
    for formula in formulas:
        block = _block(formula, f"solid{len(found)}", formula.fill(BELOW, compositing), channels)
        used = set(walk(block.outputs))
        last = max(index for index, uniform in enumerate(block.uniforms) if uniform in used)
        block = replace(block, uniforms=block.uniforms[: last + 1])
        blocks.append(found.setdefault(block.outputs, block) if formula.is_solid else None)
    return blocks


def _block(formula: Formula, name: str, result: Expr, channels: int) -> Block:
    varying = (*components_of(P), *carried(channels))
    return Block(name, scalarize(result)[:channels], varying, formula.uniforms)


def carried(channels: int) -> tuple[Expr, ...]:
    """The channels of what lies below a layer: what one block hands on to the next."""
    return components_of(BELOW)[:channels]


def culling(formula: Formula) -> tuple[Expr, ...]:
    """The box beyond which a layer covers nothing; the distances at a tile's centre from which on it covers nothing
    of the tile, and up to which it covers all in its own colours. Scalars.
    """
    *box, outer, inner, slope = formula.bounds()
    around = slope * (FARTHEST * PIXEL)
    fills = inner - around if formula.is_solid else const(-NEVER)
    return tuple(scalar for expr in (*box, outer + around, fills) for scalar in scalarize(expr))


def text(structures: tuple[Structure, ...], compositing: str, channels: int) -> str:
    """The module that draws layers of these structures in 3 or 4 channels of colour.

    A layer's row of numbers is `Formula.uniforms`.
    """
    parts = [PREAMBLE]
    formulas = [Formula.of(structure) for structure in structures]
    for index, formula in enumerate(formulas):
        parts += [
            f"# {formula}",
            *_both_ways(drawn(formula, f"layer{index}", compositing, channels), channels),
        ]
    solid = solid_blocks(formulas, compositing, channels)
    for block in dict.fromkeys(block for block in solid if block):
        parts += _both_ways(block, channels)
    names = [block.name if block else None for block in solid]
    driver = template("tiles.py.jinja").render(channels=channels, solid=names)
    return "\n\n".join([*parts, driver])


def measuring_text(structures: tuple[Structure, ...]) -> str:
    """The module that says where layers of these structures are, whatever they are drawn in."""
    parts = [PREAMBLE]
    for index, formula in enumerate(map(Formula.of, structures)):
        parts += [
            f"# {formula}",
            scalar(f"bounds{index}", culling(formula), (), formula.uniforms),
            scalar(f"distance{index}", scalarize(formula.distance), components_of(P), formula.uniforms),
        ]
    return "\n\n".join([*parts, template("measures.py.jinja").render(kinds=len(structures))])


def _both_ways(block: Block, channels: int) -> tuple[str, str]:
    return forward(block, carried(channels)), backward(block, carried(channels))


@cache
def load(structures: tuple[Structure, ...], compositing: str, channels: int) -> ModuleType:
    """The compiled module that draws layers of these structures in 3 or 4 channels of colour."""
    return kernel_cache.load(text(structures, compositing, channels))


@cache
def load_measures(structures: tuple[Structure, ...]) -> ModuleType:
    """The compiled module that says where layers of these structures are."""
    return kernel_cache.load(measuring_text(structures))


def is_compiled(structures: tuple[Structure, ...], compositing: str, channels: int) -> bool:
    """Whether these kernels have been compiled before on this machine."""
    return kernel_cache.is_compiled(load(structures, compositing, channels).backward_tiles)

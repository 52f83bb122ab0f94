"""The fused renderer's kernels: text generated from the same expressions as everything else.

Every structure of layers is compiled by itself, whatever else a scene has; `tiling` calls it by its address.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cache

import numpy as np

from .. import kernel_cache
from ..arrays import IntArray
from ..expr import Expr, const, var
from ..graph import components_of, scalarize, walk
from ..kernel_cache import Entry
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


def filled(formula: Formula, name: str, compositing: str, channels: int) -> Block:
    """What a block of pixels becomes that a layer covers wholly: equal for all layers of a paint."""
    block = _block(formula, name, formula.fill(BELOW, compositing), channels)
    used = set(walk(block.outputs))
    last = max(index for index, uniform in enumerate(block.uniforms) if uniform in used)
    return replace(block, uniforms=block.uniforms[: last + 1])


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


@cache
def drawing(structure: Structure, compositing: str, channels: int) -> tuple[Entry, ...]:
    """`DRAW`, `DRAW_BACKWARD`, `FILL`, `FILL_BACKWARD` of layers of a structure, in 3 or 4 channels of colour.

    A layer's row of numbers is `Formula.uniforms`. The last two stand for the first two where a layer covers a whole
    tile, in a colour that is not mixed.
    """
    formula = Formula.of(structure)
    blocks = [drawn(formula, "layer", compositing, channels)]
    if formula.is_solid:
        blocks.append(filled(formula, "layer", compositing, channels))
    modules = [kernel_cache.load(drawing_text(block, channels)) for block in blocks]
    return tuple(entry for module in modules for entry in (module.draw, module.draw_backward))


@cache
def measuring(structure: Structure) -> tuple[Entry, Entry]:
    """`BOUNDS` and `DISTANCE` of layers of a structure, whatever they are drawn in."""
    module = kernel_cache.load(measuring_text(Formula.of(structure)))
    return module.bounds, module.distance


def drawing_text(block: Block, channels: int) -> str:
    """The module that draws what a block says on tiles."""
    driver = template("draw.py.jinja").render(name=block.name, channels=channels, numbers=len(block.uniforms))
    return "\n\n".join(
        [PREAMBLE, forward(block, carried(channels)), backward(block, carried(channels)), driver]
    )


def measuring_text(formula: Formula) -> str:
    """The module that says where a layer is."""
    numbers = formula.uniforms
    return "\n\n".join(
        [
            PREAMBLE,
            scalar("bounds_of", culling(formula), (), numbers),
            scalar("distance_at", scalarize(formula.distance), components_of(P), numbers),
            template("measure.py.jinja").render(numbers=len(numbers)),
        ]
    )


def addresses(entries: Sequence[tuple[Entry, ...]]) -> IntArray:
    """Where the entries of each structure are [structures, entries]; compiles what is not."""
    table = np.zeros((len(entries), max(map(len, entries))), np.int64)
    for row, each in zip(table, entries, strict=True):
        row[: len(each)] = [entry.address for entry in each]
    return table


def is_compiled(structures: Sequence[Structure], compositing: str, channels: int) -> bool:
    """Whether all kernels for layers of these structures have been compiled before on this machine."""
    entries = [entry for s in structures for entry in (*drawing(s, compositing, channels), *measuring(s))]
    return all(map(kernel_cache.is_compiled, entries))

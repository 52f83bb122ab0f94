"""The fused renderer's kernels: assembly generated from the same expressions as everything else.

Every structure of layers is compiled by itself, whatever else a scene has; `tiling` calls it by its address.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cache

import numpy as np

from ..arrays import IntArray
from ..expr import Expr, const, var
from ..graph import components_of, scalarize, walk
from ..kernel_cache import Assembly, Entry
from ..layer import NEVER, PIXEL, Formula, P, Structure
from ..lower.block import Block
from ..lower.llvm import assembled, backward, forward, scalar
from ..operation import VEC4
from .tiling import PIXELS, TILE

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
    assemblies = [Assembly(assembled(drawing_texts(block, channels))) for block in blocks]
    return tuple(assembly[name] for assembly in assemblies for name in ("layer", "layer_backward"))


@cache
def measuring(structure: Structure) -> tuple[Entry, Entry]:
    """`BOUNDS` and `DISTANCE` of layers of a structure, whatever they are drawn in."""
    formula = Formula.of(structure)
    bounds = scalar("bounds", culling(formula), (), formula.uniforms)
    distance = scalar("distance", scalarize(formula.distance), components_of(P), formula.uniforms)
    assembly = Assembly(assembled([bounds, distance]))
    return assembly["bounds"], assembly["distance"]


def drawing_texts(block: Block, channels: int) -> tuple[str, str]:
    """`NAME(u, first, last, x, y, below, kept)` lays a layer on pixels; `kept` takes what was there before.

    `NAME_backward(u, first, last, x, y, below, cotangent, grad)`: its derivatives, by the row of numbers added to
    `grad`, by what was below in place of `cotangent`.
    """
    point = {"x": 1, "y": 1, "below": channels}
    return (
        forward(block, point | {"kept": channels}, PIXELS, carried(channels)),
        backward(block, point | {"cotangent": channels}, PIXELS, carried(channels)),
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
    return all(entry.assembly.is_kept for entry in entries)

"""A function over a block of pixels, and its derivatives: what the lowerings to kernels have in common."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from ..expr import Expr, const, operation, var
from ..graph import adjoints, walk


@dataclass(frozen=True)
class Block:
    """A function of pixels: `outputs` (floats) of `varying` (one value a pixel) and `uniforms` (one row)."""

    name: str
    outputs: tuple[Expr, ...]
    varying: tuple[Expr, ...]
    uniforms: tuple[Expr, ...]


class Derivatives(NamedTuple):
    """Derivatives of Σ cotangentᵢ·outputᵢ of a block.

    `sums` are added up over the pixels as the variables sum0, sum1, …; `uniforms` are computed from these once
    for the block, None where nothing depends on that uniform.
    """

    cotangents: tuple[Expr, ...]  # the variables cotangent0, cotangent1, …
    sums: tuple[Expr, ...]
    carried: tuple[Expr, ...]  # by the varying inputs that were asked for, pixel by pixel
    uniforms: tuple[Expr | None, ...]


def derivatives(block: Block, carried: Sequence[Expr] = ()) -> Derivatives:
    """What depends on the pixel stays within the loop over pixels; the rest is chained after it."""
    outputs = without_divisions(block.outputs, block.varying)
    frontier = _frontier(outputs, dependent(outputs, block.varying))
    cotangents = tuple(var(f"cotangent{i}") for i in range(len(outputs)))
    found = adjoints(_summed(outputs, cotangents), leaves=set(frontier))
    wanted = [found.get(node, const(0.0)) for node in (*frontier, *carried)]
    inner = tuple(without_divisions(wanted, (*block.varying, *cotangents)))
    outer = adjoints({node: var(f"sum{i}") for i, node in enumerate(frontier)})
    chained = tuple(outer.get(uniform) for uniform in block.uniforms)
    return Derivatives(cotangents, inner[: len(frontier)], inner[len(frontier) :], chained)


def dependent(roots: Iterable[Expr], varying: Iterable[Expr]) -> set[Expr]:
    """The nodes whose value differs from pixel to pixel."""
    depends = set(varying)
    for node in walk(roots):
        if any(arg in depends for arg in node.args):
            depends.add(node)
    return depends


def without_divisions(roots: Sequence[Expr], varying: Iterable[Expr]) -> list[Expr]:
    """The same expressions with a·(1/b) for a/b where b is the same for all pixels."""
    depends = dependent(roots, varying)
    done: dict[Expr, Expr] = {}
    for node in walk(roots):
        args = tuple([done[arg] for arg in node.args])
        if node.op == "div" and node in depends and node.args[1] not in depends:
            done[node] = args[0] * (1.0 / args[1])
        else:
            done[node] = node if args == node.args else operation(node.op, *args)
    return [done[root] for root in roots]


def _summed(outputs: Sequence[Expr], cotangents: Sequence[Expr]) -> dict[Expr, Expr]:
    """Seeds by output; outputs that are the same expression share theirs."""
    total: dict[Expr, Expr] = {}
    for output, cotangent in zip(outputs, cotangents, strict=True):
        total[output] = total[output] + cotangent if output in total else cotangent
    return total


def _frontier(roots: Sequence[Expr], depends: set[Expr]) -> list[Expr]:
    """What the loop takes from outside: uniform nodes, constants aside, that pixelwise nodes use."""
    used = (arg for node in walk(roots) if node in depends for arg in node.args)
    direct = (root for root in roots if root not in depends)
    return list(dict.fromkeys(n for n in (*used, *direct) if n not in depends and n.op != "const"))

"""The fused renderer's kernels: text generated from the same expressions as everything else.

A text holds only the kinds of layer that a scene uses.
"""

from __future__ import annotations

from functools import cache
from types import ModuleType
from typing import NamedTuple

from .. import kernel_cache
from ..blend import COMPOSITING, coverage, reach, saturation, smooth_union, union_reach
from ..expr import VEC2, VEC3, VEC4, Expr, Operand, components_of, const, maximum, minimum, scalarize, var
from ..lower.numba import PREAMBLE, Block, backward, forward, scalar
from ..shapes import KINDS
from ..templating import template

TILE = 16  # pixels along a side of a tile, the block that kernels work on
PIXELS = TILE * TILE


BELOW, TINT, OPACITY = var("below", VEC4), var("color", VEC3), var("opacity")
LOOK = (*components_of(TINT), OPACITY)  # a layer's row of numbers begins with these; then `Formula.uniforms`


class LayerKind(NamedTuple):
    """What decides the formula of a layer: the kind of its shapes and how many are joined."""

    kind: str
    union_size: int


class Formula:
    """A layer's coverage (and colour, for a union) as expressions of a point and one row of uniforms."""

    def __init__(self, layer: LayerKind) -> None:
        kind, size = KINDS[layer.kind], layer.union_size
        suffixes = [f"_{i}" for i in range(size)]
        self.point = var("p", VEC2)
        self.pixel, self.falloff, self.smoothness = var("pixel"), var("falloff"), var("smoothness")
        self.parameters = [kind.variables(suffix) for suffix in suffixes]
        self.colors = [var(f"color{suffix}", VEC3) for suffix in suffixes]
        distances = [kind.distance(self.point, *row) for row in self.parameters]
        self.distance, self.color = smooth_union(distances, self.colors, self.smoothness)
        self.kind, self.size = kind, size

    @property
    def uniforms(self) -> tuple[Expr, ...]:
        """What its coverage needs: pixel, falloff, (smoothness,) parameters, (colours)."""
        scalars = tuple(s for row in self.parameters for v in row for s in components_of(v))
        if self.size == 1:
            return (self.pixel, self.falloff, *scalars)
        colors = (s for color in self.colors for s in components_of(color))
        return (self.pixel, self.falloff, self.smoothness, *scalars, *colors)

    def drawn(self, name: str, compositing: str, channels: int) -> Block:
        """What a block of pixels becomes when the layer is laid on it, of one row of numbers (see `LOOK`)."""
        color = TINT if self.size == 1 else self.color
        cover = coverage(self.distance, self.falloff, self.pixel)
        below = COMPOSITING[compositing](BELOW, color, OPACITY, cover)
        varying = (*components_of(self.point), *flows_of(channels))
        return Block(name, scalarize(below)[:channels], varying, (*LOOK, *self.uniforms))

    def bounds(self, slack: Operand = 0.0) -> tuple[Expr, ...]:
        """Box (low x, low y, high x, high y), distance from which coverage is 0, up to which 1, slope.

        They hold for every distance that is off by at most `slack`.
        """
        outer = reach(self.falloff, self.pixel) + slack
        inner = saturation(self.falloff, self.pixel) - slack
        margin = outer + union_reach(self.size, self.smoothness)
        boxes = [scalarize(self.kind.extent(margin, *row)) for row in self.parameters]
        slopes = [scalarize(self.kind.slope(*row))[0] for row in self.parameters]
        box, slope = list(boxes[0]), slopes[0]
        for other, steep in zip(boxes[1:], slopes[1:], strict=True):
            box = [pick(a, b) for pick, a, b in zip((minimum,) * 2 + (maximum,) * 2, box, other, strict=True)]
            slope = maximum(slope, steep)
        return (*box, *scalarize(outer), *scalarize(inner), *scalarize(slope))


def flows_of(channels: int) -> tuple[Expr, ...]:
    """The channels of what lies below a layer."""
    return components_of(BELOW)[:channels]


def solid(compositing: str, channels: int) -> Block:
    """What a block of pixels becomes when a layer that covers all of it is laid on it."""
    below = COMPOSITING[compositing](BELOW, TINT, OPACITY, const(1.0))
    return Block("solid", scalarize(below)[:channels], flows_of(channels), LOOK)


def text(layers: tuple[LayerKind, ...], compositing: str, channels: int) -> str:
    """The whole module for these kinds of layer and 3 or 4 channels of colour."""
    parts = [PREAMBLE, *_both_ways(solid(compositing, channels), channels)]
    for index, layer in enumerate(layers):
        formula = Formula(layer)
        row, point = (*LOOK, *formula.uniforms), components_of(formula.point)
        parts += [
            f"# {layer.kind}, {layer.union_size} joined",
            *_both_ways(formula.drawn(f"layer{index}", compositing, channels), channels),
            scalar(f"bounds{index}", formula.bounds(), (), row),
            scalar(f"distance{index}", scalarize(formula.distance), point, row),
        ]
    driver = template("tiles.py.jinja").render(
        tile=TILE,
        pixels=PIXELS,
        farthest=(TILE - 1) / 2 * 2**0.5,
        channels=channels,
        unions=[layer.union_size > 1 for layer in layers],
    )
    return "\n\n".join([*parts, driver])


def _both_ways(block: Block, channels: int) -> tuple[str, str]:
    return forward(block, flows_of(channels)), backward(block, flows_of(channels))


@cache
def load(layers: tuple[LayerKind, ...], compositing: str, channels: int) -> ModuleType:
    """The compiled module for these kinds of layer and 3 or 4 channels of colour."""
    return kernel_cache.load(text(layers, compositing, channels))


def is_compiled(layers: tuple[LayerKind, ...], compositing: str, channels: int) -> bool:
    """Whether these kernels have been compiled before on this machine."""
    return kernel_cache.is_compiled(load(layers, compositing, channels).backward_tiles)

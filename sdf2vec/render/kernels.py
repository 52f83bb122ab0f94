"""The fused renderer's kernels: text generated from the same expressions as everything else.

A text holds only the kinds of layer that a scene uses.
"""

from __future__ import annotations

from functools import cache
from types import ModuleType
from typing import NamedTuple

from ..blend import COMPOSITING, coverage, reach, saturation, smooth_union, union_reach
from ..expr import VEC2, VEC3, VEC4, Expr, components_of, maximum, minimum, scalarize, var
from ..lower.numba import PREAMBLE, Block, backward, forward, scalar
from ..shapes import KINDS
from ..templating import template
from . import compiled

TILE = 16  # pixels along a side of a tile, the block that kernels work on
PIXELS = TILE * TILE


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
        """A layer's row: pixel, falloff, (smoothness,) parameters, (colours)."""
        scalars = tuple(s for row in self.parameters for v in row for s in components_of(v))
        if self.size == 1:
            return (self.pixel, self.falloff, *scalars)
        colors = (s for color in self.colors for s in components_of(color))
        return (self.pixel, self.falloff, self.smoothness, *scalars, *colors)

    def block(self, name: str) -> Block:
        """Coverage of a block of pixels; for a union its three colour channels too."""
        cover = scalarize(coverage(self.distance, self.falloff, self.pixel))
        color = scalarize(self.color) if self.size > 1 else ()
        return Block(name, (*cover, *color), components_of(self.point), self.uniforms)

    def bounds(self) -> tuple[Expr, ...]:
        """Box (low x, low y, high x, high y), distance from which coverage is 0, up to which 1, slope."""
        outer, inner = reach(self.falloff, self.pixel), saturation(self.falloff, self.pixel)
        margin = outer + union_reach(self.size, self.smoothness)
        boxes = [scalarize(self.kind.extent(margin, *row)) for row in self.parameters]
        slopes = [scalarize(self.kind.slope(*row))[0] for row in self.parameters]
        box, slope = list(boxes[0]), slopes[0]
        for other, steep in zip(boxes[1:], slopes[1:], strict=True):
            box = [pick(a, b) for pick, a, b in zip((minimum,) * 2 + (maximum,) * 2, box, other, strict=True)]
            slope = maximum(slope, steep)
        return (*box, *scalarize(outer), *scalarize(inner), *scalarize(slope))


def text(layers: tuple[LayerKind, ...], compositing: str) -> str:
    """The whole module for these kinds of layer."""
    parts = [PREAMBLE, *_blend_text(compositing)]
    for index, layer in enumerate(layers):
        formula = Formula(layer)
        block = formula.block(f"layer{index}")
        parts += [
            f"# {layer.kind}, {layer.union_size} joined",
            forward(block, PIXELS),
            backward(block, PIXELS),
            scalar(f"bounds{index}", formula.bounds(), (), formula.uniforms),
            scalar(
                f"distance{index}",
                scalarize(formula.distance),
                components_of(formula.point),
                formula.uniforms,
            ),
        ]
    driver = template("tiles.py.jinja").render(tile=TILE, pixels=PIXELS, farthest=(TILE - 1) / 2 * 2**0.5)
    return "\n\n".join([*parts, _dispatch_text(layers), driver])


def _blend_text(compositing: str) -> list[str]:
    """Laying a channel of colour (uniform, or varying in a union) or alpha on what is below."""
    below, color, opacity, cover = var("below", VEC4), var("color", VEC3), var("opacity"), var("cover")
    red, _, _, alpha = scalarize(COMPOSITING[compositing](below, color, opacity, cover))
    tint, below_red, below_alpha = components_of(color)[0], components_of(below)[0], components_of(below)[3]
    blocks = (
        (Block("blend_color", (red,), (below_red, cover), (tint, opacity)), (below_red, cover)),
        (Block("blend_tint", (red,), (below_red, cover, tint), (opacity,)), (below_red, cover, tint)),
        (Block("blend_alpha", (alpha,), (below_alpha, cover), (opacity,)), (below_alpha, cover)),
    )
    return [
        part for block, flows in blocks for part in (forward(block, PIXELS), backward(block, PIXELS, flows))
    ]


def _dispatch_text(layers: tuple[LayerKind, ...]) -> str:
    """One function per task that picks the kernel of a layer by its index."""
    simple = [i for i, layer in enumerate(layers) if layer.union_size == 1]
    unions = [i for i, layer in enumerate(layers) if layer.union_size > 1]
    tints = ", ".join(f"tint[{c}]" for c in range(3))
    seeds = ", ".join(f"tint_seed[{c}]" for c in range(3))
    return "\n\n".join(
        [
            f"IS_UNION = np.array({[layer.union_size > 1 for layer in layers]})\nANY_UNION = {bool(unions)}",
            _cases("bounds", "u", [(i, f"return bounds{i}(u)") for i in range(len(layers))]),
            _cases("distance", "u, x, y", [(i, f"return distance{i}(u, x, y)") for i in range(len(layers))]),
            _cases(
                "layer",
                "u, x, y, cover, tint",
                [(i, f"layer{i}(u, x, y, cover)") for i in simple]
                + [(i, f"layer{i}(u, x, y, cover, {tints})") for i in unions],
            ),
            _cases(
                "layer_backward",
                "u, x, y, seed, tint_seed, grad",
                [(i, f"layer{i}_backward(u, x, y, seed, grad)") for i in simple]
                + [(i, f"layer{i}_backward(u, x, y, seed, {seeds}, grad)") for i in unions],
            ),
        ]
    )


def _cases(name: str, arguments: str, cases: list[tuple[int, str]]) -> str:
    *others, (_, last) = cases
    lines = [f"    if kind == {index}:\n        {line}\n        return" for index, line in others]
    lines = [line.removesuffix("\n        return") if "return " in line else line for line in lines]
    return "\n".join(["@njit(**OPTIONS)", f"def {name}(kind, {arguments}):", *lines, f"    {last}"]) + "\n"


@cache
def load(layers: tuple[LayerKind, ...], compositing: str) -> ModuleType:
    """The compiled module for these kinds of layer."""
    return compiled.load(text(layers, compositing))


def is_compiled(layers: tuple[LayerKind, ...], compositing: str) -> bool:
    """Whether these kernels have been compiled before on this machine."""
    return compiled.is_compiled(text(layers, compositing), "backward_tiles")

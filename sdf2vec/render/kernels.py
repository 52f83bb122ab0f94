"""Compiled kernels for the fused renderer: their text, their compilation, their place on disk.

The text is generated from the same expressions as everything else and holds only the kinds of layer that a
scene uses. It is written to the user's cache folder under a name made from the text and the versions of what
compiles it; numba keeps the machine code beside it.
"""

from __future__ import annotations

import hashlib
import importlib.util
import os
import sys
import warnings
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import NamedTuple

import numba
import numpy as np

from ..blend import COMPOSITING, coverage, reach, saturation, smooth_union, union_reach
from ..errors import Sdf2vecError
from ..expr import VEC2, VEC3, VEC4, Expr, components_of, maximum, minimum, scalarize, var
from ..files import write_atomically
from ..lower.numba import PREAMBLE, Block, backward, forward, scalar
from ..shapes import KINDS

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
    return "\n\n".join([*parts, _dispatch_text(layers), DRIVER])


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


DRIVER = f'''\
TILE, PIXELS = {TILE}, {PIXELS}
FARTHEST = f32({(TILE - 1) / 2 * 2**0.5!r})  # pixels from the centre of a tile to its farthest pixel centre


@njit(**OPTIONS)
def measure(kinds, uniforms, x, y, pixel, columns, rows, limits, ranges):
    """Bounds of every layer and the range of tiles it may touch; returns how many tiles that is in all."""
    total = 0
    for l in range(kinds.size):
        low_x, low_y, high_x, high_y, outer, inner, slope = bounds(kinds[l], uniforms[l])
        limits[l, 0], limits[l, 1], limits[l, 2] = outer, inner, slope
        side = TILE * pixel
        ranges[l, 0] = max(0, min(columns, floor((low_x - x[0]) / side + f32(0.03))))
        ranges[l, 1] = max(0, min(rows, floor((low_y - y[0]) / side + f32(0.03))))
        ranges[l, 2] = max(ranges[l, 0], min(columns, floor((high_x - x[0]) / side + f32(0.01)) + 1))
        ranges[l, 3] = max(ranges[l, 1], min(rows, floor((high_y - y[0]) / side + f32(0.01)) + 1))
        total += (ranges[l, 2] - ranges[l, 0]) * (ranges[l, 3] - ranges[l, 1])
    return total


@njit(**OPTIONS)
def find_pairs(kinds, uniforms, x, y, pixel, columns, limits, ranges, tiles, layers, full):
    """Pairs of a tile and a layer that covers some of it, in draw order; returns how many."""
    count = 0
    middle = f32((TILE - 1) * 0.5) * pixel
    for l in range(kinds.size):
        around = FARTHEST * pixel * limits[l, 2] * f32(1.001)
        for row in range(ranges[l, 1], ranges[l, 3]):
            for column in range(ranges[l, 0], ranges[l, 2]):
                d = distance(kinds[l], uniforms[l], x[column * TILE] + middle, y[row * TILE] + middle)
                if d - around < limits[l, 0]:
                    tiles[count] = row * columns + column
                    layers[count] = l
                    full[count] = d + around < limits[l, 1]
                    count += 1
    return count


@njit(**OPTIONS)
def sort_pairs(count, tiles, layers, full, starts, sorted_layers, sorted_full):
    """Groups the pairs by tile, keeping the draw order; `starts` is where each tile's begin."""
    for i in range(count):
        starts[tiles[i] + 1] += 1
    for t in range(starts.size - 1):
        starts[t + 1] += starts[t]
    places = starts[:-1].copy()
    for i in range(count):
        place = places[tiles[i]]
        sorted_layers[place], sorted_full[place] = layers[i], full[i]
        places[tiles[i]] += 1


@njit(**OPTIONS)
def lowest_visible(start, end, layers, full, kinds, opacity, hides):
    """The first pair of a tile that is not wholly hidden by an opaque one above it."""
    if hides:
        for q in range(end - 1, start, -1):
            if full[q] and opacity[layers[q]] == ONE and not IS_UNION[kinds[layers[q]]]:
                return q
    return start


@njit(**OPTIONS)
def cover_layer(kind, is_full, u, x, y, cover, tint):
    if is_full and not IS_UNION[kind]:
        cover[:] = ONE
    else:
        layer(kind, u, x, y, cover, tint)


@njit(**OPTIONS)
def blend(channel, union, color, opacity, below, cover, tint, pair, out):
    """Lays one channel of a layer on what is below."""
    if channel == 3:
        pair[0] = opacity
        blend_alpha(pair, below, cover, out)
    elif union:
        pair[0] = opacity
        blend_tint(pair, below, cover, tint[channel], out)
    else:
        pair[0], pair[1] = color[channel], opacity
        blend_color(pair, below, cover, out)


@njit(**OPTIONS)
def forward_tiles(
    first, step, starts, layers, full, kinds, uniforms, colors, opacity, background, hides, x, y, columns, image
):
    """Draws every step-th tile into image [C, H, W]."""
    channels, height, width = image.shape
    px, py = np.empty(PIXELS, f32), np.empty(PIXELS, f32)
    cover, tint, pair = np.empty(PIXELS, f32), np.empty((3, PIXELS), f32), np.empty(2, f32)
    below = np.empty((channels, PIXELS), f32)
    for tile in range(first, starts.size - 1, step):
        top, left = tile // columns * TILE, tile % columns * TILE
        place_pixels(top, left, x, y, px, py)
        for c in range(channels):
            below[c, :] = background[c]
        start = lowest_visible(starts[tile], starts[tile + 1], layers, full, kinds, opacity, hides)
        for q in range(start, starts[tile + 1]):
            l = layers[q]
            cover_layer(kinds[l], full[q], uniforms[l], px, py, cover, tint)
            for c in range(channels):
                blend(c, IS_UNION[kinds[l]], colors[l], opacity[l], below[c], cover, tint, pair, below[c])
        for r in range(min(TILE, height - top)):
            for s in range(min(TILE, width - left)):
                for c in range(channels):
                    image[c, top + r, left + s] = below[c, r * TILE + s]


@njit(**OPTIONS)
def place_pixels(top, left, x, y, px, py):
    for r in range(TILE):
        for s in range(TILE):
            px[r * TILE + s] = x[left + s]
            py[r * TILE + s] = y[top + r]


@njit(**OPTIONS)
def backward_tiles(
    first, step, starts, layers, full, kinds, uniforms, colors, opacity, background, hides, x, y, columns,
    seed_image, longest, grads, background_grads
):
    """Derivatives of every step-th tile: a row of `grads` per pair (uniforms, colour, opacity)."""
    channels, height, width = seed_image.shape
    row = uniforms.shape[1]
    px, py = np.empty(PIXELS, f32), np.empty(PIXELS, f32)
    covers = np.empty((longest, PIXELS), f32)
    belows = np.empty((longest + 1, channels, PIXELS), f32)
    tints = np.empty((longest if ANY_UNION else 1, 3, PIXELS), f32)
    seed, flow = np.empty((channels, PIXELS), f32), np.empty(PIXELS, f32)
    cover_seed, tint_seed = np.empty(PIXELS, f32), np.empty((3, PIXELS), f32)
    pair, pair_grad = np.empty(2, f32), np.empty(2, f32)
    for tile in range(first, starts.size - 1, step):
        top, left = tile // columns * TILE, tile % columns * TILE
        place_pixels(top, left, x, y, px, py)
        for c in range(channels):
            belows[0, c, :] = background[c]
        start = lowest_visible(starts[tile], starts[tile + 1], layers, full, kinds, opacity, hides)
        for q in range(start, starts[tile + 1]):
            l, k = layers[q], q - start
            tint = tints[k % tints.shape[0]]
            cover_layer(kinds[l], full[q], uniforms[l], px, py, covers[k], tint)
            for c in range(channels):
                blend(
                    c, IS_UNION[kinds[l]], colors[l], opacity[l], belows[k, c], covers[k], tint, pair, belows[k + 1, c]
                )
        seed[:] = ZERO
        for r in range(min(TILE, height - top)):
            for s in range(min(TILE, width - left)):
                for c in range(channels):
                    seed[c, r * TILE + s] = seed_image[c, top + r, left + s]
        for q in range(starts[tile + 1] - 1, start - 1, -1):
            l, k = layers[q], q - start
            union, grad = IS_UNION[kinds[l]], grads[q]
            cover_seed[:] = ZERO
            if union:
                tint_seed[:] = ZERO
            tint = tints[k % tints.shape[0]]
            for c in range(channels):
                flow[:] = ZERO
                pair_grad[:] = ZERO
                pair[0] = opacity[l]
                if c == 3:
                    blend_alpha_backward(pair, belows[k, c], covers[k], seed[c], flow, cover_seed, pair_grad)
                    grad[row + 3] += pair_grad[0]
                elif union:
                    blend_tint_backward(
                        pair, belows[k, c], covers[k], tint[c], seed[c], flow, cover_seed, tint_seed[c], pair_grad
                    )
                    grad[row + 3] += pair_grad[0]
                else:
                    pair[0], pair[1] = colors[l, c], opacity[l]
                    blend_color_backward(pair, belows[k, c], covers[k], seed[c], flow, cover_seed, pair_grad)
                    grad[row + c] += pair_grad[0]
                    grad[row + 3] += pair_grad[1]
                seed[c, :] = flow
            if union or not full[q]:
                layer_backward(kinds[l], uniforms[l], px, py, cover_seed, tint_seed, grad)
        for c in range(channels):
            for i in range(PIXELS):
                background_grads[tile, c] += seed[c, i]


@njit(**OPTIONS)
def reduce_pairs(layers, grads, totals):
    """Adds the pairs' derivatives up by layer, in a fixed order."""
    for q in range(layers.size):
        for i in range(grads.shape[1]):
            totals[layers[q], i] += grads[q, i]
'''


# --- compiling ---------------------------------------------------------------------------------------------


@cache
def load(layers: tuple[LayerKind, ...], compositing: str) -> ModuleType:
    """The compiled module for these kinds of layer; compiles on first use, from the cache folder later."""
    source = text(layers, compositing)
    path = kernel_path(source)
    try:
        if not path.exists():
            write_atomically(path, source.replace("CACHE", "True", 1).encode())
        return _import(path)
    except (Sdf2vecError, OSError, RuntimeError) as error:
        _warn_once(str(error))
        module = ModuleType(path.stem)
        exec(compile(source.replace("CACHE", "False", 1), str(path), "exec"), module.__dict__)
        return module


def is_cached(layers: tuple[LayerKind, ...], compositing: str) -> bool:
    """Whether these kernels have been compiled before on this machine."""
    path = kernel_path(text(layers, compositing))
    return any((path.parent / "__pycache__").glob(f"{path.stem}.backward_tiles*.nbi"))


def kernel_path(source: str) -> Path:
    """Where a module of this text is kept: the name is made from the text and the compilers' versions."""
    versions = (numba.__version__, np.__version__, sys.version)
    key = hashlib.sha256("\n".join((source, *versions)).encode()).hexdigest()[:20]
    return cache_folder() / f"kernels_{key}.py"


def cache_folder() -> Path:
    """`$SDF2VEC_CACHE`, or the user's cache folder as the system has it."""
    if own := os.environ.get("SDF2VEC_CACHE"):
        return Path(own)
    if sys.platform == "win32":
        return Path(os.environ.get("LOCALAPPDATA", Path.home() / "AppData" / "Local")) / "sdf2vec"
    if sys.platform == "darwin":
        return Path.home() / "Library" / "Caches" / "sdf2vec"
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "sdf2vec"


def _import(path: Path) -> ModuleType:
    spec = importlib.util.spec_from_file_location(path.stem, path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[path.stem] = module
    spec.loader.exec_module(module)
    return module


@cache
def _warn_once(reason: str) -> None:
    warnings.warn(
        f"kernels are compiled anew each time: no cache folder ({reason})", RuntimeWarning, stacklevel=3
    )

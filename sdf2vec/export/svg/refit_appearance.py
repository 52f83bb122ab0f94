"""Colours and opacities solved again against the coverage that the drawing really has.

A blur is only near a layer's coverage, and where many edges lie on each other all are off in the same direction; and
8 bits cut off the faint ends of soft layers, of which many add up.
Colours are in the picture linearly, and so, nearly, are opacities: each is solved by least squares in turn, near
to what it was and within its range.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from ...arrays import BoolArray, Float32Array, Float64Array
from ...deferred import deferred
from ...render.occlusion import showing
from ...scene import Layer, Scene
from .sampling import SampleGrid
from .visibility import LayerSamples, steps_over

CELLS = 64  # of a difference that is kept, along its longest side
LARGEST = 2048  # layers: more equations than these are not solved
ROUNDS, HASTY = 3, 1  # of opacities, then colours; of those for what was fitted to be drawn
RIDGE = 1e-3  # how much, of a mean layer's weight, the old value counts
GREY = 0.5 / 255.0  # channels that differ by less are the same
FREEDOM = 0.1  # that an opacity may change by
ROUNDING = (
    0.2  # added before 8-bit alpha is rounded down: browsers on the CPU do that, others take the nearest
)


map_coordinates: Callable[..., Float64Array] = deferred("scipy.ndimage", "map_coordinates")


class Difference(NamedTuple):
    """Drawn coverage minus the layer's own, [Y, X] on a grid."""

    grid: SampleGrid
    off: Float64Array | Float32Array

    def coarse(self) -> Difference:
        """The same by its means over blocks of cells: all that a small canvas needs of it, and little to keep."""
        block = math.ceil(max(self.off.shape) / CELLS)
        whole = np.pad(self.off, [(0, -size % block) for size in self.off.shape], mode="edge")
        rows, columns = (size // block for size in whole.shape)
        means = whole.reshape(rows, block, columns, block).mean(axis=(1, 3), dtype=np.float32)
        step, middle = self.grid.step, (block - 1) / 2
        x, y = (
            axis[0] + (np.arange(count) * block + middle) * step
            for axis, count in ((self.grid.x, columns), (self.grid.y, rows))
        )
        return Difference(SampleGrid(x, y, step * block), means)


class Refitted(NamedTuple):
    """A scene and the mean squared error of its drawing, about."""

    scene: Scene
    error: float = 0.0


def refitted(
    scene: Scene,
    samples: LayerSamples,
    drawn: Mapping[int, Difference],
    cut: Sequence[int] = (),
    colors: int = 0,
    opacities: int = 0,
    rounds: int = ROUNDS,
) -> Refitted:
    """The scene with the colours and opacities whose drawing is nearest to the scene's render.

    `drawn`: what is off about the layers that are not drawn exactly. `cut`: layers whose alpha renderers round down
    to 8 bits. `colors`, `opacities`: these become whole numbers of so many steps; the colours are chosen together,
    so that the error of one makes up for another's. 0 leaves them free. Only `over`.
    """
    if not 0 < len(scene.layers) <= LARGEST or not (drawn or cut or colors):
        return Refitted(scene)
    stack, wanted = _stack(scene, samples, drawn, cut)
    best, least = stack, stack.error(wanted)
    for _ in range(rounds if drawn or cut else 0):
        stack = stack.with_opacities(wanted).with_colors(wanted)
        if (error := stack.error(wanted)) < least:
            best, least = stack, error
    if colors:
        best = best.rounded(wanted, colors, opacities)
    return Refitted(best.painted(scene), best.error(wanted))


@dataclass(frozen=True, eq=False)
class Stack:
    """Layers on a small canvas: coverage [N, P] as drawn, colours [N, 3, P or 1], opacities [N]; on a ground.

    `first`: colours and opacities before anything was solved. `plain` [N]: whether a layer has a single colour.
    """

    covers: Float32Array
    colors: Float32Array
    opacities: Float64Array
    ground: Float64Array  # [4] premultiplied
    plain: BoolArray
    first: tuple[Float32Array, Float64Array]

    @property
    def alphas(self) -> Float32Array:
        return np.asarray(self.covers * self.opacities[:, None].astype(np.float32))

    @property
    def single_colors(self) -> Float64Array:
        """The colours of the layers that have a single one, [M, 3]."""
        return np.asarray(self.colors.mean(axis=2, dtype=np.float64)[self.plain])

    def shown(self) -> tuple[Float32Array, Float32Array]:
        """How much of each layer shows through those above it [N, P], and of the ground [P]."""
        alphas = self.alphas
        hidden = showing(alphas)
        return hidden, hidden[0] * (1.0 - alphas[0])

    @cached_property
    def picture(self) -> Float64Array:
        """Premultiplied colour and, without an opaque ground, alpha [3 or 4, P]."""
        hidden, rest = self.shown()
        weights = hidden * self.alphas
        if self.colors.shape[2] == 1:
            color = self.colors[:, :, 0].T @ weights
        else:
            color = np.einsum("np,ncp->cp", weights, self.colors)
        drawn = np.concatenate([color, 1.0 - rest[None]]) + self.ground[:, None] * rest
        return drawn[: self.channels].astype(np.float64)

    @property
    def channels(self) -> int:
        """Of the picture."""
        return 3 if self.ground[3] == 1.0 else 4

    def error(self, wanted: Float64Array) -> float:
        """Mean squared difference from a picture."""
        return float(np.mean(np.square(self.picture - wanted)))

    def with_colors(self, wanted: Float64Array) -> Stack:
        """The single colours that come nearest to a picture [3 or 4, P]."""
        gram, right = self._color_equations(wanted)
        solved = _bounded(gram, right, np.zeros_like(right), np.ones_like(right))
        return self._recolored(solved)

    def rounded(self, wanted: Float64Array, steps: int, opacities: int) -> Stack:
        """Opacities in whole steps, never 0, and the single colours in steps that then come nearest to a picture."""
        shown = np.maximum(np.round(self.opacities * opacities), 1.0) / opacities
        return replace(self, opacities=shown)._stepped(wanted, steps)

    def _stepped(self, wanted: Float64Array, steps: int) -> Stack:
        """The colours in steps, changed one by one while that brings them nearer."""
        gram, right = self._color_equations(wanted)
        colors = self.single_colors
        if np.ptp(self.first[0], axis=1).max() < GREY:  # stays grey, which each channel by itself would not
            right, colors = right.mean(axis=1, keepdims=True), colors.mean(axis=1, keepdims=True)
        colors = np.round(colors * steps) / steps
        for _ in range(20):
            before = colors.copy()
            for i in range(len(colors)):
                best = colors[i] + (right[i] - gram[i] @ colors) / gram[i, i]
                colors[i] = np.round(np.clip(best, 0.0, 1.0) * steps) / steps
            if np.array_equal(colors, before):
                break
        return self._recolored(np.broadcast_to(colors, (len(colors), 3)))

    def with_opacities(self, wanted: Float64Array) -> Stack:
        """The opacities that come nearest to a picture [3 or 4, P], where one layer's change leaves the others'."""
        slopes = np.stack([slope.ravel() for slope in self._slopes()])
        off = (wanted - self.picture).astype(np.float32).ravel()
        first = self.first[1]
        gram, right = _equations(slopes, off[:, None], self.opacities[:, None], first[:, None])
        low, high = np.maximum(first - FREEDOM, 0.0), np.minimum(first + FREEDOM, 1.0)
        return replace(self, opacities=_bounded(gram, right, low[:, None], high[:, None])[:, 0])

    def painted(self, scene: Scene) -> Scene:
        """The scene with this stack's colours and opacities."""
        means = self.colors.mean(axis=2).tolist()
        layers = [
            _painted(layer, means[i] if self.plain[i] else None, opacity)
            for i, (layer, opacity) in enumerate(zip(scene.layers, self.opacities.tolist(), strict=True))
        ]
        return replace(scene, layers=tuple(layers))

    def _slopes(self) -> Iterator[Float32Array]:
        """For each layer the change of the picture [3 or 4, P] with its opacity."""
        alphas = self.alphas
        steps = steps_over(alphas, self.colors, self.ground)
        for step, share in zip(steps, self.covers * showing(alphas), strict=True):
            yield (step * share)[: self.channels]

    def _color_equations(self, wanted: Float64Array) -> tuple[Float64Array, Float64Array]:
        """Gram matrix and right side of the least squares for the single colours."""
        weights = (self.shown()[0] * self.alphas)[self.plain]
        off = (wanted - self.picture)[:3].astype(np.float32)
        return _equations(weights, off.T, self.single_colors, self.first[0].mean(axis=2)[self.plain])

    def _recolored(self, solved: Float64Array) -> Stack:
        colors = self.colors.copy()
        colors[self.plain] = solved[:, :, None]
        return replace(self, colors=colors)


def _stack(
    scene: Scene, samples: LayerSamples, drawn: Mapping[int, Difference], cut: Sequence[int]
) -> tuple[Stack, Float64Array]:
    """The scene's layers as they are drawn, and its render, on a small canvas."""
    covers, colors, width, height = samples
    ground = np.array(scene.ground)
    opacities = np.array([layer.opacity for layer in scene.layers])
    plain = np.array([len(set(layer.colors)) == 1 for layer in scene.layers])
    exact = Stack(covers, colors, opacities, ground, plain, (colors, opacities))
    x = (np.arange(width) + 0.5 - width / 2) / min(width, height)
    y = (np.arange(height) + 0.5 - height / 2) / min(width, height)
    off = exact.covers.copy()
    for index, difference in drawn.items():
        _add(difference, x, y, off[index].reshape(height, width))
    off = np.clip(off, 0.0, 1.0)
    for index in cut:
        levels = 255.0 * max(float(opacities[index]), 1e-6)
        off[index] = np.floor(off[index] * levels + ROUNDING) / levels
    return replace(exact, covers=off), exact.picture


def _add(difference: Difference, x: Float64Array, y: Float64Array, cover: Float32Array) -> None:
    """Adds a difference to coverage [Y, X] at the places x and y, interpolated."""
    grid, off = difference
    across, down = (x - grid.x[0]) / grid.step, (y - grid.y[0]) / grid.step
    columns = np.flatnonzero((across > -0.5) & (across < len(grid.x) - 0.5))
    rows = np.flatnonzero((down > -0.5) & (down < len(grid.y) - 0.5))
    if columns.size and rows.size:
        places = np.meshgrid(down[rows], across[columns], indexing="ij")
        cover[np.ix_(rows, columns)] += map_coordinates(off, places, order=1, mode="nearest")


def _equations(
    slopes: Float32Array, off: Float32Array, now: Float64Array, first: Float64Array
) -> tuple[Float64Array, Float64Array]:
    """Gram matrix [N, N] and right side [N, K] of the least squares for values that are `now` [N, K].

    `slopes` [N, M]: how the picture changes with each; `off` [M, K]: how far the picture is from the wanted one. A
    ridge keeps values near to what they were at `first` [N, K].
    """
    gram = (slopes @ slopes.T).astype(np.float64)
    ridge = RIDGE * float(np.trace(gram)) / len(gram) + 1e-12 if len(gram) else 0.0
    right = (slopes @ off).astype(np.float64) + gram @ now + ridge * first
    return gram + ridge * np.eye(len(gram)), right


def _bounded(gram: Float64Array, right: Float64Array, low: Float64Array, high: Float64Array) -> Float64Array:
    """Solves gram·x = right [N, K] within bounds: what leaves them is put there, and the rest solved again."""
    found = np.empty_like(right)
    for k in range(right.shape[1]):
        free, x = np.ones(len(gram), bool), np.zeros(len(gram))
        for _ in range(6):
            x[free] = np.linalg.solve(
                gram[np.ix_(free, free)], right[free, k] - gram[np.ix_(free, ~free)] @ x[~free]
            )
            outside = free & ((x < low[:, k]) | (x > high[:, k]))
            x = np.clip(x, low[:, k], high[:, k])
            if not outside.any():
                break
            free &= ~outside
        found[:, k] = x
    return found


def _painted(layer: Layer, color: list[float] | None, opacity: float) -> Layer:
    if color is None:
        return replace(layer, opacity=opacity)
    red, green, blue = color
    shapes = tuple(replace(shape, color=(red, green, blue)) for shape in layer.shapes)
    return replace(layer, shapes=shapes, opacity=opacity)

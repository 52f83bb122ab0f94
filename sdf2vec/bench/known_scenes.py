"""Scenes by chance for which it is known what a fit should find: every shape of them can be seen.

`apart`: no shape touches another. `overlap`: every second lies on others, and none is hidden by more than a part.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from ..arrays import BoolArray, Float64Array
from ..scene import Color
from .known_drawing import DISTANCES, Figure, KnownScene, KnownShape, distance, grid

COUNTS = (0, 1, 2, 4, 8, 16, 32)
SIDE = 192  # pixels
LARGEST = 0.2  # of the side: a shape's radius
FILLED = {"apart": 0.35, "overlap": 1.0}  # share of the canvas that the discs of all radii would cover
MODES = tuple(FILLED)
CONTRAST = 0.15  # of the scale from 0 to 1: what a shape changes, in some channel
GAP = 3.0  # pixels between shapes that lie apart
SHOWN = 0.6  # share of each shape that no other hides
LAID_ON = 0.1  # least share of every second shape that lies on others, where shapes overlap
SHRINK = 0.99  # after each place that does not suit
HOLE = 0.3  # least share of a figure that a cut-out takes
TRANSLUCENT = (0.4, 0.7)
SOFTNESS = (0.2, 0.5)  # falloffs, as shares of a shape's least half width
SOFTEST_EDGE = 3.0  # pixels: a narrower falloff would not be told from a sharp edge
CUTTABLE = 8.0  # pixels of least half width


def known_scene(count: int, mode: str, soft: bool, seed: int, side: int = SIDE) -> KnownScene:
    """`count` shapes; where `soft`, about half of them have soft edges. The same arguments give the same scene."""
    chance = np.random.default_rng((seed, count, MODES.index(mode), int(soft)))
    canvas = Canvas.empty(side, _color(chance))
    largest = side * min(LARGEST, math.sqrt(FILLED[mode] / (math.pi * max(count, 1))))
    scale = 1.0
    while len(canvas.shapes) < count:
        shape = _shape(chance, largest * chance.uniform(0.7, 1.2) * scale, soft, side)
        if not canvas.add(shape, mode):
            scale = max(SHRINK * scale, 0.5)
    return KnownScene(side, canvas.background, tuple(canvas.shapes))


# --- shapes by chance ---------------------------------------------------------------------------------------


def _color(chance: np.random.Generator) -> Color:
    red, green, blue = (round(float(level) / 255, 5) for level in chance.integers(0, 256, 3))
    return red, green, blue


def _shape(chance: np.random.Generator, size: float, soft: bool, side: int) -> KnownShape:
    """A shape whose radius is about `size`, anywhere within the canvas."""
    x, y = chance.uniform(size + GAP, side - size - GAP, 2)
    figure = _figure(chance, str(chance.choice(list(DISTANCES))), x, y, size)
    half = figure.sizes[0]
    cut = _cut(chance, figure) if half >= CUTTABLE and chance.random() < 0.3 else None
    narrowest = half - cut.sizes[0] if cut and cut.kind == figure.kind else half
    falloff = (
        max(SOFTEST_EDGE, chance.uniform(*SOFTNESS) * narrowest) if soft and chance.random() < 0.6 else 0.0
    )
    opacity = chance.uniform(*TRANSLUCENT) if chance.random() < 0.3 else 1.0
    return KnownShape(figure, _color(chance), round(opacity, 3), round(falloff, 3), cut)


def _figure(chance: np.random.Generator, kind: str, x: float, y: float, size: float) -> Figure:
    """An outline of a kind, of which no other kind is nearly the same."""
    turn = chance.uniform(0, math.pi) if chance.random() < 0.5 else 0.0
    if kind == "circle":
        return Figure(kind, (x, y, size))
    if kind == "ellipse":
        return Figure(kind, (x, y, size, size * chance.uniform(0.4, 0.7), turn))
    if kind == "box":
        return Figure(kind, (x, y, 0.9 * size, 0.9 * size * chance.uniform(0.4, 1.0), turn))
    angles = chance.uniform(0, math.tau) + np.array([0, 1, 2]) * math.tau / 3 + chance.uniform(-0.4, 0.4, 3)
    reach = size * chance.uniform(0.9, 1.4, 3)
    corners = np.stack([x + reach * np.cos(angles), y + reach * np.sin(angles)], axis=1)
    return Figure(kind, tuple(corners.ravel()))


def _cut(chance: np.random.Generator, figure: Figure) -> Figure:
    """What is cut from a figure: a smaller one about the same middle, or a disc about it."""
    if chance.random() < 0.6:
        return figure.scaled(chance.uniform(0.6, 0.7))
    x, y = figure.center
    return Figure("circle", (x, y, chance.uniform(0.65, 0.8) * figure.sizes[0]))


# --- where they go ------------------------------------------------------------------------------------------


@dataclass
class Canvas:
    """What has been put on a canvas: its picture at the pixels' centres, and of each shape where it is, and shown."""

    background: Color
    image: Float64Array  # [side, side, 3]
    near: BoolArray  # [side, side]: where shapes are, and the gap around them
    shapes: list[KnownShape]
    masks: list[BoolArray]  # [side, side] each
    shown: list[BoolArray]

    @classmethod
    def empty(cls, side: int, background: Color) -> Canvas:
        """Nothing but a colour."""
        image = np.tile(np.array(background, np.float64), (side, side, 1))
        return cls(background, image, np.zeros((side, side), bool), [], [], [])

    def add(self, shape: KnownShape, mode: str) -> bool:
        """Puts a shape on top, where it suits; tells whether it did."""
        x, y = grid(len(self.image))
        reach = distance(shape.figure, x, y) < 1.1 * shape.falloff + GAP
        at_edge = reach[[0, -1]].any() or reach[:, [0, -1]].any()
        if at_edge or (mode == "apart" and (reach & self.near).any()):
            return False
        cover = shape.cover(x, y)
        mask = cover >= 0.5
        if (mode == "overlap" and not self._lies_well(mask)) or not self._is_seen(shape, mask):
            return False
        self.image += (shape.opacity * cover)[..., None] * (np.array(shape.color) - self.image)
        self.near |= reach
        if shape.opacity == 1.0:
            self.shown = [shown & ~mask for shown in self.shown]
        self.shapes.append(shape)
        self.masks.append(mask)
        self.shown.append(mask)
        return True

    def _lies_well(self, mask: BoolArray) -> bool:
        """Whether it lies on others, if it is its turn, and hides none of them too much."""
        if len(self.masks) % 2 and (mask & np.any(self.masks, axis=0)).sum() < LAID_ON * mask.sum():
            return False
        return all(
            (shown & ~mask).sum() >= SHOWN * own.sum()
            for own, shown in zip(self.masks, self.shown, strict=True)
        )

    def _is_seen(self, shape: KnownShape, mask: BoolArray) -> bool:
        """Whether it changes the picture, and a hole in it can be told from none."""
        if not mask.any():
            return False
        change = shape.opacity * np.abs(np.array(shape.color) - self.image[mask]).max(axis=1)
        if np.quantile(change, 0.1) < CONTRAST:
            return False
        whole = replace(shape, cut=None).cover(*grid(len(mask))) >= 0.5
        return not shape.cut or bool(mask.sum() <= (1 - HOLE) * whole.sum())

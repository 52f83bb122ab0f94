"""How many of a picture's known shapes an answer has found: a scene of this program, or the SVG of any other.

A shape is where it can be seen: covered by half at least, and not hidden by what lies above. A found shape is a true
one again where it is of the same kind and both cover the same pixels but for a quarter (IoU ≥ 0.75). A cut-out is
judged by its pixels alone: a ring is one layer of two joined discs, or a disc upon a disc, which is one shape too many.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy.optimize import linear_sum_assignment

from ..api import render
from ..arrays import BoolArray, Float32Array, Float64Array
from ..engines import resvg
from ..scene import Layer, Scene
from .known_drawing import KnownScene, grid
from .svg_shapes import alone, kind_of

ALIKE = 0.75  # intersection over union
SEEN = 0.25  # share of a shape's colour that what lies above lets through
ENOUGH = 40.0  # dB
BEST = 99.0  # dB, of equal pictures
WHOLE = 0.999  # share of the canvas that a background covers
WHITE = (1.0, 1.0, 1.0)


class Found(NamedTuple):
    """One shape of an answer: its kind where that is known, its coverage [H, W] 0..1 without its opacity."""

    kind: str | None
    cover: Float64Array
    opacity: float = 1.0


@dataclass(frozen=True, eq=False)
class Answer:
    """What a tool made of a picture: the picture again, [H, W, 3], and its shapes, the last on top."""

    pixels: Float32Array
    shapes: tuple[Found, ...]
    seconds: float = 0.0


class Verdict(NamedTuple):
    """What an answer is worth. `outlines`: shapes found whatever their kind; `matched`: of the right one as well."""

    true: int
    found: int
    matched: int
    outlines: int
    psnr: float  # dB
    seconds: float

    @property
    def ratio(self) -> float:
        """Found shapes for each true one; of a flat picture one more than were found."""
        return self.found / self.true if self.true else 1.0 + self.found

    @property
    def told(self) -> str:
        """In a line."""
        return (
            f"{self.found} of {self.true} shapes, {self.matched} right, {self.outlines} outlines, {self.psnr:.1f} dB, "
            f"{self.seconds:.1f} s"
        )


def f1(verdicts: Sequence[Verdict], of_kind: bool = True) -> float:
    """F1 of all shapes of some scenes together; 1 where there are none and none was found."""
    matched = sum(verdict.matched if of_kind else verdict.outlines for verdict in verdicts)
    total = sum(verdict.true + verdict.found for verdict in verdicts)
    return 2 * matched / total if total else 1.0


# --- answers ------------------------------------------------------------------------------------------------


def true_answer(known: KnownScene) -> Answer:
    """The shapes that there are."""
    x, y = grid(known.side)
    shapes = (Found(shape.figure.kind, shape.cover(x, y), shape.opacity) for shape in known.shapes)
    return Answer(known.pixels, tuple(shapes))


def scene_answer(scene: Scene, seconds: float = 0.0) -> Answer:
    """What a scene of this program draws, each layer a shape."""
    shapes = (Found(layer.shapes[0].kind, _cover(layer, scene), layer.opacity) for layer in scene.layers)
    return Answer(render(scene), tuple(shapes), seconds)


def _cover(layer: Layer, scene: Scene) -> Float64Array:
    """A layer's coverage: what it draws in opaque white on black."""
    shapes = tuple(replace(shape, color=WHITE, paint="flat", paint_parameters=()) for shape in layer.shapes)
    white = replace(layer, shapes=shapes, opacity=1.0)
    drawn = render(replace(scene, layers=(white,), background=(0.0, 0.0, 0.0), compositing="over"))
    return drawn[..., 0].astype(np.float64)


def svg_answer(svg: str, side: int, seconds: float = 0.0) -> Answer:
    """What an SVG draws, over black, each element a shape; a first one that covers all is its background.

    Raises EngineError for what is no SVG.
    """
    drawn = resvg.render(svg, side, side)
    shapes = []
    for index, (only, text) in enumerate(alone(svg)):
        alpha = resvg.render(text, side, side)[..., 3].astype(np.float64)
        opacity = float(alpha.max())
        if opacity and not (index == 0 and (alpha >= 0.5).mean() >= WHOLE):
            shapes.append(Found(kind_of(only), alpha / opacity, opacity))
    return Answer(drawn[..., :3] * drawn[..., 3:], tuple(shapes), seconds)


# --- judging ------------------------------------------------------------------------------------------------


def visible(shapes: Sequence[Found]) -> list[BoolArray]:
    """Of each shape the pixels where it is seen."""
    masks: list[BoolArray] = []
    through: Float64Array | float = 1.0
    for shape in reversed(shapes):
        masks.append((shape.cover >= 0.5) & (np.asarray(through) >= SEEN))
        through = through * (1.0 - shape.opacity * shape.cover)
    return masks[::-1]


def overlaps(true: Sequence[BoolArray], found: Sequence[BoolArray]) -> Float64Array:
    """Intersection over union of each true mask with each found one, [true, found]."""
    if not true or not found:
        return np.zeros((len(true), len(found)))
    a, b = (np.stack(masks).reshape(len(masks), -1).astype(np.float64) for masks in (true, found))
    both = a @ b.T
    either = a.sum(axis=1)[:, None] + b.sum(axis=1)[None, :] - both
    return np.where(either > 0, both / np.maximum(either, 1.0), 0.0)


def pairs(allowed: BoolArray) -> int:
    """The most pairs of rows and columns, each used once, that are allowed."""
    rows, columns = linear_sum_assignment(allowed, maximize=True)
    return int(allowed[rows, columns].sum())


def judged(known: KnownScene, answer: Answer) -> Verdict:
    """How well an answer says what is known."""
    true = true_answer(known).shapes
    alike = overlaps(visible(true), visible(answer.shapes)) >= ALIKE
    kinds = np.array([[a.kind == b.kind for b in answer.shapes] for a in true], bool).reshape(alike.shape)
    matched, outlines = pairs(alike & kinds), pairs(alike)
    levels = np.rint(np.clip(answer.pixels, 0, 1) * 255)
    near = psnr(known.pixels, (levels / 255).astype(np.float32))
    return Verdict(len(true), len(answer.shapes), matched, outlines, near, answer.seconds)


def psnr(picture: Float32Array, other: Float32Array) -> float:
    """Peak signal-to-noise ratio in dB, of equal pictures that of less than any level."""
    error = float(np.square(picture - other).mean(dtype=np.float64))
    return min(-10 * math.log10(error), BEST) if error else BEST

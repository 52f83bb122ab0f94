"""Additive scenes in a format that only knows light on light: sums through the blend mode `difference`.

|below − color| subtracts as long as the sum stays in 0..1; between two inversions of the whole canvas (`difference`
with white) it adds. The order of the terms is free, so they are put such that the sum stays in range.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ...scene import Color, Layer, Scene
from .sampling import Array
from .visibility import layers_at

SIDE = 64  # pixels along the shortest side of the canvas that sums are watched on
MOST_TURNS = 40  # changes between adding and subtracting
SLACK = 0.004  # by which a sum may leave 0..1: one level


class Term(NamedTuple):
    """The positive or the negative part of a layer, as a layer of positive colours."""

    layer_index: int
    sign: int
    layer: Layer


def terms(scene: Scene) -> tuple[list[Term], float]:
    """All parts in an order that keeps the sum in range, and the root mean square of what is cut off where not."""
    covers, colors = layers_at(scene, SIDE)
    wanted = np.repeat(_ground(scene), covers.shape[1], axis=1)
    state = wanted.copy()
    for color, cover in zip(colors, covers, strict=True):
        wanted += color * cover
    waiting = {sign: _parts(scene, sign) for sign in (1, -1)}
    ordered: list[Term] = []
    for turn in range(MOST_TURNS):
        sign, forced = (-1, 1)[turn % 2], turn >= MOST_TURNS - 2
        left = []
        for term in waiting[sign]:
            after = state + sign * np.maximum(sign * colors[term.layer_index], 0.0) * covers[term.layer_index]
            if forced or (after.min() >= -SLACK and after.max() <= 1.0 + SLACK):
                state = np.clip(after, 0.0, 1.0)
                ordered.append(term)
            else:
                left.append(term)
        waiting[sign] = left
    return ordered, float(np.sqrt(np.mean(np.square(state - np.clip(wanted, 0.0, 1.0)))))


def _ground(scene: Scene) -> Array:
    return np.array(scene.background or (0.0, 0.0, 0.0))[:, None]


def _parts(scene: Scene, sign: int) -> list[Term]:
    """The parts of one sign that add anything."""
    return [
        Term(index, sign, _signed(layer, sign))
        for index, layer in enumerate(scene.layers)
        if any(sign * channel > 0.5 / 255 for shape in layer.shapes for channel in shape.color)
    ]


def _signed(layer: Layer, sign: int) -> Layer:
    shapes = tuple(replace(shape, color=_part(shape.color, sign)) for shape in layer.shapes)
    return replace(layer, shapes=shapes, opacity=1.0)


def _part(color: Color, sign: int) -> Color:
    red, green, blue = (max(sign * channel, 0.0) for channel in color)
    return red, green, blue


def alternating(ordered: list[Term], draw: Callable[[Term], str], inversion: str) -> list[str]:
    """Elements of all terms in order, with inversions of the canvas around those that add."""
    lines, inverted = [], False
    for term in ordered:
        if (term.sign > 0) != inverted:
            lines.append(inversion)
            inverted = not inverted
        lines.append(draw(term))
    return [*lines, inversion] if inverted else lines

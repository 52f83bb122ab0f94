"""Frames among strokes: four lines, and bows between them, that go around a rectangle."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import NamedTuple

import numpy as np

from ..arrays import BoolArray, Float64Array
from .bones import pixels_of
from .strokes import BLUNT, Line, Stroke

STRAIGHT = 0.03  # sine of the angle by which sides are not parallel, or not at right angles, at most
WITHIN = 0.97  # share of a frame that lies in the region, and of a stroke that is a part of it
SURELY, HARDLY = 0.8, 0.25  # pixels within its edge of what a frame surely covers; of what is half covered
MOSTLY = 0.7  # share of it that lies in the region where its corners are not round, too, which those of a frame may be
STEPS, FINEST = 16, 0.5  # radii that are tried at first; pixels between those in the end
SIDES = 4  # lines of a frame, at least


@dataclass(frozen=True, eq=False)
class Frame:
    """A stroke around a rectangle about a middle [2] in pixels; its own sides are half as long as `sides`, turned by an
    angle; the radius is that of the stroke's middle line at corners.
    """

    middle: Float64Array
    sides: tuple[float, float]
    angle: float
    radius: float
    half: float

    @property
    def length(self) -> float:
        return 4.0 * sum(self.sides)

    def covers(self, points: Float64Array, more: float = BLUNT) -> BoolArray:
        """Which points [N, 2] it covers, or lie so few pixels beyond its edge."""
        along = np.array([math.cos(self.angle), math.sin(self.angle)])
        away = points - self.middle
        own = np.abs(np.stack([away @ along, away @ np.array([-along[1], along[0]])], axis=1))
        beyond = own - np.array(self.sides) + self.radius
        off = np.linalg.norm(np.maximum(beyond, 0.0), axis=1) + np.minimum(beyond.max(axis=1), 0.0)
        return np.asarray(np.abs(off - self.radius) <= self.half + more)


class Region(NamedTuple):
    """All pixels (x, y) of a plane [N, 2], and which of them are in a region [N]."""

    pixels: Float64Array
    inside: BoolArray


def framed(found: Sequence[Stroke], inside: BoolArray) -> list[Stroke | Frame]:
    """Strokes of a region [H, W] with frames in place of those that go around rectangles."""
    region = Region(pixels_of(np.ones_like(inside)), inside.reshape(-1))
    own = region.pixels[region.inside]
    lines = [stroke for stroke in found if isinstance(stroke, Line)]
    frames: list[Frame] = []
    left = list(found)
    for sharp, sides in sorted(_rectangles(lines), key=lambda each: -each[0].length):
        if not all(side in left for side in sides) or not _lies_in(sharp, region, MOSTLY):
            continue
        frame = _rounded(sharp, region)
        if _lies_in(frame, region, WITHIN):
            parts = [stroke for stroke in left if _is_part(stroke, frame, own)]
            if sum(isinstance(part, Line) for part in parts) >= SIDES:
                frames.append(frame)
                left = [stroke for stroke in left if stroke not in parts]
    return [*frames, *left]


def _rectangles(lines: Sequence[Line]) -> Iterator[tuple[Frame, tuple[Line, ...]]]:
    """Frames, without a radius, of which two pairs of lines may be the sides, and these."""
    pairs = [(one, other) for one, other in combinations(lines, 2) if _across(one, other) < STRAIGHT]
    for along, across in combinations(pairs, 2):
        if abs(_direction(along[0]) @ _direction(across[0])) < STRAIGHT:
            frame = _frame(along, across)
            if min(frame.sides) > frame.half:
                yield frame, (*along, *across)


def _frame(along: tuple[Line, Line], across: tuple[Line, Line]) -> Frame:
    """The one whose middle line goes along two lines and two others at right angles to them."""
    x = _direction(along[0])
    y = np.array([-x[1], x[0]])
    (top, bottom), (left, right) = (
        sorted(float((line.start + line.end) @ way) / 2.0 for line in pair)
        for pair, way in ((along, y), (across, x))
    )
    middle = x * (left + right) / 2.0 + y * (top + bottom) / 2.0
    half = float(np.mean([line.half for line in (*along, *across)]))
    return Frame(middle, ((right - left) / 2.0, (bottom - top) / 2.0), math.atan2(x[1], x[0]), 0.0, half)


def _rounded(frame: Frame, region: Region) -> Frame:
    """A frame with the radius with which it differs least from a region: looked for ever more finely."""
    most = min(frame.sides)
    step = most / STEPS
    tried = np.arange(0.0, most, step)
    while True:
        frames = [replace(frame, radius=float(radius)) for radius in tried]
        best = min(frames, key=lambda each: int((each.covers(region.pixels, -HARDLY) != region.inside).sum()))
        if step <= FINEST:
            return best
        step /= 4.0
        tried = np.clip(best.radius + step * np.arange(-4, 5), 0.0, most)


def _direction(line: Line) -> Float64Array:
    return line.direction(line.start)


def _across(one: Line, other: Line) -> float:
    """The sine of the angle between two lines."""
    (a, b), (c, d) = _direction(one), _direction(other)
    return abs(float(a * d - b * c))


def _lies_in(frame: Frame, region: Region, share: float) -> bool:
    """Whether more than a share of a frame is in a region."""
    own = frame.covers(region.pixels, -SURELY)
    return bool(own.any()) and float(region.inside[own].mean()) > share


def _is_part(stroke: Stroke, frame: Frame, pixels: Float64Array) -> bool:
    """Whether nearly all pixels [N, 2] that a stroke covers are a frame's."""
    own = pixels[stroke.covers(pixels)]
    return bool(len(own)) and float(frame.covers(own).mean()) > WITHIN

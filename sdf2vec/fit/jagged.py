"""Edges in steps, as they are drawn without antialiasing, made smooth again, so that what is found is the shape that
was drawn and not its steps.

Where an edge goes on in its direction after a step of one pixel, it ran halfway up that step and through the middle of
what is straight beside it; pixels take the colour beyond as far as it reaches into them (morphological antialiasing:
Reshetov 2009). Where an edge turns by more it has a corner, which stays.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ..arrays import BoolArray, Float32Array, Float64Array

ALIKE = 3.5 / 255  # by which pixels of one colour differ at most
STEPPED = 0.5  # share of the corners that are at steps of one pixel, of slopes


def is_jagged(pixels: Float32Array) -> bool:
    """Whether most corners of the edges of a picture [H, W, C] are steps of slopes and curves: where it is antialiased
    there are pixels between, and pixel art has other corners.
    """
    edges = [~alike(pixels[1:], pixels[:-1]), ~alike(pixels[:, 1:], pixels[:, :-1])]
    corners = int(((edges[0][:, 1:] ^ edges[0][:, :-1]) & (edges[1][1:] ^ edges[1][:-1])).sum())
    turned = np.swapaxes(pixels, 0, 1)
    runs = (_Runs.below(each) for each in (pixels, pixels[::-1], turned, turned[::-1]))
    return sum(each.steps for each in runs) > STEPPED * corners


def smoothed(pixels: Float32Array) -> Float32Array:
    """A picture [H, W, C] with smooth edges in place of those in steps."""
    down = _reached(pixels)
    across = tuple(np.swapaxes(part, 0, 1) for part in _reached(np.swapaxes(pixels, 0, 1)))
    # an edge at 45° has steps in both directions, which say the same
    further = down[0] >= across[0]
    share = np.where(further, down[0], across[0])[..., None]
    return (pixels * (1.0 - share) + np.where(further[..., None], down[1], across[1])).astype(np.float32)


def _reached(pixels: Float32Array) -> tuple[Float32Array, Float32Array]:
    """The share [H, W] of each pixel that the colours above and below it reach into, and these, times it [H, W, C]."""
    share, color = np.zeros(pixels.shape[:2], np.float32), np.zeros_like(pixels)
    for picture, shares, colors in ((pixels, share, color), (pixels[::-1], share[::-1], color[::-1])):
        for row, column, part in _Runs.below(picture).parts():
            np.add.at(shares, (row, column), part)
            np.add.at(colors, (row, column), part[:, None] * picture[row + 1, column])
    return share, color


@dataclass(frozen=True, eq=False)
class _Runs:
    """Straight stretches of edges below rows of pixels; where the edge goes on a pixel higher before or after one, how
    many of its pixels lie on the slope to there, else 0.
    """

    row: np.ndarray
    first: np.ndarray
    length: np.ndarray
    before: Float64Array
    after: Float64Array

    @classmethod
    def below(cls, pixels: Float32Array) -> _Runs:
        """Those of a picture [H, W, C]."""
        padded = np.pad(pixels, ((1, 0), (1, 1), (0, 0)), constant_values=np.inf)  # beyond, nothing is alike
        with np.errstate(invalid="ignore"):
            beside, under = alike(padded[:, :-1], padded[:, 1:]), alike(padded[:-1], padded[1:])
            edge = ~under[1:] & np.isfinite(padded[1:-1]).all(axis=2)
            rising = alike(padded[1:-1, :-1], padded[2:, 1:])  # from a pixel to that below and after it
            falling = alike(padded[1:-1, 1:], padded[2:, :-1])
        goes_on = edge[:, :-1] & edge[:, 1:] & beside[1:-1] & beside[2:]
        starts = edge & ~np.pad(goes_on, ((0, 0), (1, 0)))
        row, first = np.nonzero(starts)
        last = np.nonzero(edge & ~np.pad(goes_on, ((0, 0), (0, 1))))[1]
        # what is below rises beside the end by one pixel: there above it the edge goes on
        rises_after = edge[:, :-1] & beside[2:] & falling & beside[:-2] & under[:-1, :-1]
        rises_before = edge[:, 1:] & beside[2:] & rising & beside[:-2] & under[:-1, 1:]
        number, length = np.cumsum(starts).reshape(starts.shape) - 1, last - first + 1

        def slope(rises: BoolArray, end: np.ndarray, beyond: np.ndarray) -> Float64Array:
            """Half of it, or as much as beyond the step, if that is less: it is straight between two curves."""
            next_length = length[number[row - 1, np.clip(beyond, 0, number.shape[1] - 1)]]
            return np.where(rises[row, end], np.minimum(0.5 * length, next_length), 0.0)

        before = slope(np.pad(rises_before, ((0, 0), (1, 0))), first, first - 1)
        after = slope(np.pad(rises_after, ((0, 0), (0, 1))), last, last + 1)
        return cls(row, first - 1, length, before, after)

    @property
    def steps(self) -> int:
        """How often an edge goes on in its direction a pixel higher."""
        return int(np.count_nonzero(self.before) + np.count_nonzero(self.after))

    def parts(self) -> Iterator[tuple[np.ndarray, np.ndarray, Float32Array]]:
        """Rows, columns and shares of pixels above the edges into which what is below reaches, for both ends."""
        index = np.repeat(np.arange(len(self.row)), self.length)
        along = np.arange(len(index)) - np.repeat(np.cumsum(self.length) - self.length, self.length)
        for slope, place in ((self.before, along), (self.after, self.length[index] - 1 - along)):
            chosen = place < slope[index]
            share = _triangle(place[chosen], slope[index][chosen])
            yield self.row[index][chosen], (self.first[index] + along)[chosen], share


def alike(one: np.ndarray, other: np.ndarray, limit: float | Float32Array = ALIKE) -> BoolArray:
    """Which pixels differ by no more than a limit, of all or each, in any channel."""
    found = np.ones(one.shape[:-1], bool)
    for channel in range(one.shape[-1]):  # a reduction over the last axis takes five times as long
        found &= np.abs(one[..., channel] - other[..., channel]) <= limit
    return found


def _triangle(place: np.ndarray, length: np.ndarray) -> Float32Array:
    """The area, from `place` to the next, below a line that falls from half a pixel to nothing in a length."""
    begin, end = (np.minimum(each / length, 1.0) for each in (place, place + 1))
    area: Float32Array = (0.5 * length * ((end - begin) - 0.5 * (end**2 - begin**2))).astype(np.float32)
    return area

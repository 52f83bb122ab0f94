"""The middle lines of a region that is of one width, branch by branch, half-way between its edges."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from scipy import ndimage
from skimage.morphology import skeletonize

from ..arrays import BoolArray, Float64Array

EVEN = 0.15, 0.8  # by which half the width differs along a line, at most: share of it, and pixels
MOSTLY = 0.8  # share of all lines along which it does not
LONGER = 2.0  # than wide: all of them together, at least
# widths: a shorter branch with a free end is what a corner makes; times they are taken off
SPUR, PASSES = 1.1, 3
CLEAR = 0.8  # half widths around where branches meet: there they are bent
LEAST = 5  # points that a line is told by
# standard deviations in pixels of what takes the steps of pixels off edges, and off a path
EDGE, PATH = 0.5, 2.0
REACH, SAMPLED = 1.5, 0.25  # widths on both sides where edges are looked for; pixels between samples


class MiddleLine(NamedTuple):
    """Points (x, y) [N, 2] in pixels, one after the other, where a region is of its usual width, and half of that; the
    last is about the first again where it is closed.
    """

    points: Float64Array
    half: float


def middle_lines(coverage: Float64Array) -> Iterator[MiddleLine]:
    """Those of a region's coverage [H, W]; none where it is not of one width."""
    inside = coverage > 0.5
    bones = skeletonize(inside)
    if not bones.any():
        return
    depth = depth_of(inside)
    half = float(np.median(depth[bones]))
    bones = _without_spurs(bones, half)
    if not _is_even(depth[bones], half):
        return
    for path in _branches(bones, half):
        middles, halves = _centred(path, coverage, half)
        even = np.abs(halves - half) <= _uneven(half)
        if even.sum() >= LEAST:
            yield MiddleLine(middles[even], float(np.median(halves[even])))


def depth_of(inside: BoolArray) -> Float64Array:
    """How far it is from the middle of each pixel of a region to its edge, [H, W]."""
    return np.asarray(ndimage.distance_transform_edt(np.pad(inside, 1))[1:-1, 1:-1] - 0.5)


def pixels_of(mask: BoolArray) -> Float64Array:
    """Those (x, y) of a mask, [N, 2]."""
    return np.stack(np.nonzero(mask)[::-1], axis=1).astype(np.float64)


def seen(points: Float64Array, plane: Float64Array) -> Float64Array:
    """What a plane [H, W] has at points (x, y) [N, 2]; 0 off it."""
    return np.asarray(ndimage.map_coordinates(plane, points.T[::-1], order=1, cval=0.0))


def _is_even(depths: Float64Array, half: float) -> bool:
    is_long = len(depths) >= LONGER * 2.0 * half
    return is_long and bool(np.mean(np.abs(depths - half) <= _uneven(half)) >= MOSTLY)


def _uneven(half: float) -> float:
    """By how many pixels half the width may differ."""
    share, pixels = EVEN
    return max(share * half, pixels)


AROUND = np.array([(-1, -1), (-1, 0), (-1, 1), (0, 1), (1, 1), (1, 0), (1, -1), (0, -1)])


def _without_spurs(bones: BoolArray, half: float) -> BoolArray:
    """A middle line without short branches that end freely."""
    for _ in range(PASSES):
        forks = _forks(bones)
        labels, count = ndimage.label(bones & ~forks, np.ones((3, 3)))
        lengths = ndimage.sum_labels(bones, labels, np.arange(count + 1))
        near = np.unique(labels[ndimage.binary_dilation(forks, np.ones((3, 3)))])
        ends = np.unique(labels[bones & (_neighbours(bones).sum(0) <= 1)])
        spurs = [n for n in np.intersect1d(near, ends) if n and lengths[n] < SPUR * 2.0 * half]
        if not spurs:
            break
        bones = skeletonize(bones & ~np.isin(labels, spurs))
    return bones


def _neighbours(bones: BoolArray) -> BoolArray:
    """Whether each pixel's eight neighbours are bones, in turn [8, H, W]."""
    padded = np.pad(bones, 1)
    height, width = bones.shape
    return np.stack([padded[1 + y : 1 + y + height, 1 + x : 1 + x + width] for y, x in AROUND])


def _forks(bones: BoolArray) -> BoolArray:
    """Where three and more branches meet, and the pixels beside."""
    around = _neighbours(bones)
    meeting = (around & ~np.roll(around, 1, axis=0)).sum(0) >= 3
    found: BoolArray = ndimage.binary_dilation(bones & meeting, np.ones((3, 3))) & bones
    return found


def _branches(bones: BoolArray, half: float) -> Iterator[Float64Array]:
    """The points (x, y) [N, 2] of each, away from where branches meet; of a closed one the last is the first again."""
    forks = _forks(bones)
    is_away = ndimage.distance_transform_edt(~forks) > CLEAR * half if forks.any() else ~forks
    labels, _ = ndimage.label(bones & is_away, np.ones((3, 3)))
    for number, window in enumerate(ndimage.find_objects(labels), 1):
        path = _path(labels[window] == number)
        if len(path) >= LEAST:
            yield path + np.array([window[1].start, window[0].start])


def _path(own: BoolArray) -> Float64Array:
    """The pixels (x, y) of a thin line, one after the other."""
    left = {(int(y), int(x)) for y, x in zip(*np.nonzero(own), strict=True)}
    ends = own & (_neighbours(own).sum(0) <= 1)
    starts = ends if ends.any() else own
    y, x = (int(side[0]) for side in np.nonzero(starts))
    path = [(y, x)]
    left.discard((y, x))
    steps = sorted(AROUND.tolist(), key=lambda step: abs(step[0]) + abs(step[1]))
    while step := next(
        ((y + down, x + right) for down, right in steps if (y + down, x + right) in left), None
    ):
        path.append(step)
        left.discard(step)
        y, x = step
    if not ends.any() and len(path) > LEAST:
        path.append(path[0])
    return np.array(path, np.float64)[:, ::-1]


def _centred(path: Float64Array, coverage: Float64Array, half: float) -> tuple[Float64Array, Float64Array]:
    """A path's points half-way between the edges on both sides [N, 2], and half the width there [N]; infinite where
    there is no edge."""
    closed = "wrap" if (path[0] == path[-1]).all() else "nearest"
    smooth = ndimage.gaussian_filter1d(path, PATH, axis=0, mode=closed)
    along = np.gradient(smooth, axis=0)
    along /= np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-9)
    across = np.stack([-along[:, 1], along[:, 0]], axis=1)
    plane = ndimage.gaussian_filter(coverage, EDGE, mode="constant")
    steps = np.arange(0.0, 2.0 * REACH * half, SAMPLED)
    sides = [_edge(path, side * across, steps, plane) for side in (1.0, -1.0)]
    halves = (sides[0] + sides[1]) / 2.0
    aside = np.where(np.isfinite(halves), sides[0], 0.0) - np.where(np.isfinite(halves), halves, 0.0)
    return path + across * aside[:, None], halves


def _edge(points: Float64Array, ways: Float64Array, steps: Float64Array, plane: Float64Array) -> Float64Array:
    """How far it is from each point along its way to where a plane falls to a half; infinite where it doesn't."""
    places = points[:, None] + steps[:, None] * ways[:, None]
    values = seen(places.reshape(-1, 2), plane).reshape(places.shape[:2])
    beyond = values < 0.5
    first = np.maximum(beyond.argmax(axis=1), 1)
    rows = np.arange(len(points))
    before, after = values[rows, first - 1], values[rows, first]
    share = np.clip((before - 0.5) / np.maximum(before - after, 1e-9), 0.0, 1.0)
    return np.where(beyond.any(axis=1), steps[first - 1] + share * SAMPLED, np.inf)

"""Lines too thin to be regions of one colour: one to three pixels wide, on what they cross.

What regions don't explain is told by its colour: how much of each pixel it covers, where the rest is of one or two
regions. Enlarged that is a region of its own, of which the strokes are those of the lines; they are as wide as what is
covered asks for. A line goes on below one of another colour that crosses it.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Sequence
from dataclasses import replace

import numpy as np
import torch
from scipy import ndimage

from ..arrays import BoolArray, Float64Array, IntArray
from ..blend import OVER
from ..render import fused
from ..render.tensors import Group, SceneTensors
from .areas import Area
from .frames import Frame, framed
from .joining import topped
from .offers import common_color
from .region_graph import NEAR, Regions
from .strokes import Line, Stroke, strokes
from .stroking import KINDS_OF_STROKES, layers_of
from .surroundings import Surroundings
from .transparency import Overlay

FINER, MARGIN = 3, 3  # pixels of the enlarged coverage in one; around it, so that edges are seen on all sides
SMOOTH = 0.5  # pixels: standard deviation of what takes the steps off lines that are not antialiased
WIDEST = 5  # pixels, with those at its edges, of a region that may be a part of a line
OFF = 12.0 / 255  # by which a pixel differs from what regions make of it, at least
COLORS = 6  # of lines
# quantile of how much of a colour pixels show, and that share of it: what has more than all of it is more of a line
NEARLY, MORE = 0.85, 0.95
PARTS, MOST = 200, 100  # of one colour; lines: more are a texture
MOST_FRAMED = 8  # strokes among which frames are looked for: more are a grid
LEAST = 6.0  # pixels that a line covers
PEAK = 0.5  # share of the coverage along its middle where a line ends
# share of a line that its strokes miss or cover too much, where it is blurred by so many pixels
WRONG, BLUR = 0.35, 0.8
MOSTLY = 0.6  # share of what no region explains that lines do, at least
SEEN, CORE = 0.1, 0.4  # coverage of a pixel by a line, at its edge; in its middle
AROUND = np.ones((3, 3))
# rows and columns: directions of lines
WAYS = np.array([(0, 1), (1, 2), (1, 1), (2, 1), (1, 0), (2, -1), (1, -1), (1, -2)])
FAR = 8  # steps at most in which one line crosses another
TINY = 1e-9


def hairlines(
    regions: Regions, around: Surroundings, kinds: Collection[str]
) -> tuple[list[Group], BoolArray]:
    """Layers of those of a picture, and the regions [R] that are parts of them; none where there may be no shapes of
    their kinds, or they are little of what no region explains: then that is made of other things.
    """
    slim = _slim(regions)
    none: tuple[list[Group], BoolArray] = [], np.zeros_like(slim)
    if not KINDS_OF_STROKES.issubset(kinds):
        return none
    pixels = around.target.permute(1, 2, 0).numpy().astype(np.float64)
    low, high = _beside(regions, ~slim)
    off = _unexplained(pixels, low, high)
    found = list(_covered(pixels, off, low, high))
    near = [ndimage.binary_dilation(coverage > CORE, AROUND) for _, coverage in found]
    hidden = np.array(near, bool).reshape(-1, *off.shape)
    layers: list[Group] = []
    for index, (color, coverage) in enumerate(found):
        others: BoolArray = np.delete(hidden, index, axis=0).max(axis=0, initial=False)
        layers += _lines_of(_across(coverage, others), color, regions, around)
        if len(layers) > MOST:
            return none
    cover = _cover(layers, around)
    if off[cover > SEEN].sum() <= MOSTLY * off.sum():
        return none
    return layers, slim & (regions.count(cover > 0.5) > 0.5 * regions.areas)


def _cover(layers: Sequence[Group], around: Surroundings) -> Float64Array:
    """How much of each pixel some opaque layers cover together [H, W]."""
    scene = topped(SceneTensors([], torch.zeros(4), OVER, around.scene.size), layers)
    height, width = around.shape
    return np.asarray(fused.composite(scene, width, height)[3].numpy().astype(np.float64))


def _slim(regions: Regions) -> BoolArray:
    """Which regions [R] are nowhere wider than a line."""
    labels = regions.labels
    wide = ndimage.maximum_filter(labels, WIDEST) == ndimage.minimum_filter(labels, WIDEST)
    return np.asarray(regions.count(wide) == 0)


def _covered(
    pixels: Float64Array, off: Float64Array, low: Float64Array, high: Float64Array
) -> Iterator[tuple[Float64Array, Float64Array]]:
    """The colours [C] of what regions don't explain, and how much of each pixel they cover [H, W]."""
    for _ in range(COLORS):
        if np.sum(off > 0.0) < LEAST:
            return
        color = _color_of(pixels, off, low, high)
        coverage = np.where(off > 0.0, _amount(pixels, color, low, high).clip(0.0, 1.0), 0.0)
        core = coverage > CORE
        if not core.any():
            return
        near = ndimage.binary_dilation(core, AROUND)
        yield color, np.where(near, coverage, 0.0)
        off = np.where(near & (coverage > 0.0), 0.0, off)


# --- what covers a pixel ------------------------------------------------------------------------------------


def _beside(regions: Regions, chosen: BoolArray) -> tuple[Float64Array, Float64Array]:
    """The colours [H, W, C] of one of some regions [R] near each pixel, and of another if there are two."""
    black = np.zeros((1, regions.colors.shape[1]))
    colors = np.concatenate([black, regions.colors])
    own = regions.place(chosen)
    if not own.any():
        return colors[regions.labels], colors[regions.labels]
    rows, columns = ndimage.distance_transform_edt(~own, return_distances=False, return_indices=True)
    labels = regions.labels[rows, columns]
    high: IntArray = ndimage.maximum_filter(labels, NEAR)
    low: IntArray = ndimage.minimum_filter(labels, NEAR)
    return colors[low], colors[high]


def _unexplained(pixels: Float64Array, low: Float64Array, high: Float64Array) -> Float64Array:
    """By how much pixels [H, W] differ from all mixtures of two colours; 0 where that is little."""
    off = np.abs(pixels - _between(pixels, low, high)).max(axis=2)
    return np.where(off > OFF, off, 0.0)


def _between(pixels: Float64Array, low: Float64Array, high: Float64Array) -> Float64Array:
    """The mixture of two colours that is nearest to each pixel [H, W, C]."""
    change = high - low
    share = ((pixels - low) * change).sum(2) / np.maximum((change**2).sum(2), TINY)
    return np.asarray(low + np.clip(share, 0.0, 1.0)[..., None] * change)


def _color_of(pixels: Float64Array, off: Float64Array, low: Float64Array, high: Float64Array) -> Float64Array:
    """The colour [C] of a line: the commonest of what differs, by how much it does; of that which is more of the same,
    if there is some, nearly the most: edges may be commoner than what they are the edges of.
    """
    differs = off > 0.0
    colors, weights = torch.from_numpy(pixels[differs]), torch.from_numpy(off[differs] ** 2)
    color = np.asarray(common_color(colors, weights).numpy())
    amount = _amount(pixels, color, low, high) * differs
    most = float(np.quantile(amount[amount > CORE], NEARLY)) if (amount > CORE).any() else 1.0
    return np.asarray(np.median(pixels[amount >= MORE * most], axis=0)) if MORE * most > 1.0 else color


def _amount(pixels: Float64Array, color: Float64Array, low: Float64Array, high: Float64Array) -> Float64Array:
    """How much of a colour pixels [H, W, C] show beside a mixture of two others (least squares): more than all of it if
    they differ more in the same way, and nothing where they show something else.
    """
    change, own, away = high - low, color - low, pixels - low
    cc, co, oo = (change**2).sum(2), (change * own).sum(2), (own**2).sum(2)
    ca, oa = (change * away).sum(2), (own * away).sum(2)
    both = (cc * oa - co * ca) / np.maximum(cc * oo - co**2, TINY)
    alone = oa / np.maximum(oo, TINY)
    is_plane = cc * oo - co**2 > 1e-3 * cc * oo
    found = np.where(is_plane, both, alone)
    rest, left = pixels - found[..., None] * color, 1.0 - found[..., None]
    foreign = np.abs(rest - _between(rest, left * low, left * high)).max(axis=2) > 2.0 * OFF
    return np.where(foreign, 0.0, found)


def _across(coverage: Float64Array, unseen: BoolArray) -> Float64Array:
    """A coverage [H, W] that goes on where it is not seen, if it is there on both sides."""
    if not unseen.any():
        return coverage
    found = np.where(unseen, 0.0, coverage)
    between = np.zeros_like(found)
    for way in WAYS:
        ahead, behind = (_first_seen(found, unseen, sign * way) for sign in (1, -1))
        between = np.maximum(between, np.minimum(ahead, behind))
    return np.where(unseen, between, coverage)


def _first_seen(values: Float64Array, unseen: BoolArray, way: IntArray) -> Float64Array:
    """What is seen first from each pixel in a direction; 0 where that is too far."""
    found, left = np.zeros_like(values), unseen.copy()
    for step in range(1, FAR + 1):
        moved, hidden = (_moved(plane, step * way) for plane in (values, unseen))
        found = np.where(left & ~hidden, moved, found)
        left &= hidden
    return found


def _moved(plane: np.ndarray, way: IntArray) -> np.ndarray:
    """A plane whose pixels are those so far down and to the right; at its sides those of the side."""
    rows, columns = (np.arange(side) + step for side, step in zip(plane.shape, way.tolist(), strict=True))
    height, width = plane.shape
    return plane[np.ix_(rows.clip(0, height - 1), columns.clip(0, width - 1))]


# --- lines --------------------------------------------------------------------------------------------------


def _lines_of(
    coverage: Float64Array, color: Float64Array, regions: Regions, around: Surroundings
) -> Iterator[Group]:
    """Layers of lines of a colour [C], of which pixels are covered so far [H, W]."""
    labels, count = ndimage.label(coverage > SEEN, AROUND)
    if count > PARTS:
        return
    none = np.zeros(len(regions.colors), bool)
    for number, (rows, columns) in enumerate(ndimage.find_objects(labels), 1):
        own = np.where(labels[rows, columns] == number, coverage[rows, columns], 0.0)
        if own.sum() < LEAST:
            continue
        window = around.window(rows, columns)
        inside = torch.from_numpy(own.astype(np.float32)).flatten()
        known = torch.ones_like(inside)
        area = Area(Overlay(1.0, color, none, ~none), inside, known, (rows, columns), window, False)
        found = _strokes_of(own)
        layers = layers_of(found, area) if len(found) <= MOST else []
        if layers and _wrong(_cover(layers, around)[rows, columns], own) < WRONG * own.sum():
            yield from layers


def _wrong(cover: Float64Array, wanted: Float64Array) -> float:
    """Pixels covered wrongly by what may be drawn without antialiasing."""
    return float(np.abs(ndimage.gaussian_filter(cover - wanted, BLUR)).sum())


def _strokes_of(coverage: Float64Array) -> list[Stroke | Frame]:
    """Those of a coverage [H, W], in its pixels; as wide as what is covered asks for."""
    plane = _enlarged(coverage)
    depth = ndimage.maximum_filter(plane, FINER * 2 + 1)
    peak = float(np.median(depth[plane > PEAK * plane.max()]))
    drawn = strokes(plane / peak)
    found = framed(drawn, plane > PEAK * peak) if len(drawn) <= MOST_FRAMED else [*drawn]
    length = sum(stroke.length for stroke in found) / FINER
    half = float(coverage.sum()) / 2.0 / max(length, TINY)
    return [_smaller(stroke, half) for stroke in found]


def _enlarged(coverage: Float64Array) -> Float64Array:
    smooth = ndimage.gaussian_filter(np.pad(coverage, MARGIN), SMOOTH)
    height, width = smooth.shape
    rows, columns = ((np.arange(side * FINER) + 0.5) / FINER - 0.5 for side in (height, width))
    places = np.meshgrid(rows, columns, indexing="ij")
    return np.asarray(ndimage.map_coordinates(smooth, places, order=3, mode="nearest").clip(0.0, 1.0))


def _smaller(stroke: Stroke | Frame, half: float) -> Stroke | Frame:
    """A stroke of an enlarged coverage in pixels, with half the width that it has; its tips stay."""

    def place(point: Float64Array) -> Float64Array:
        return np.asarray((point + 0.5) / FINER - 0.5 - MARGIN)

    more = stroke.half / FINER - half
    if isinstance(stroke, Line):
        way = more * (stroke.end - stroke.start) / max(stroke.length, TINY)
        return Line(place(stroke.start) - way, place(stroke.end) + way, half, square=True)
    if isinstance(stroke, Frame):
        across, down = (side / FINER for side in stroke.sides)
        return replace(
            stroke, middle=place(stroke.middle), sides=(across, down), radius=stroke.radius / FINER, half=half
        )
    turn = min(more * FINER / stroke.radius, (math.tau - stroke.span) / 2.0)
    return replace(
        stroke,
        middle=place(stroke.middle),
        radius=stroke.radius / FINER,
        first=stroke.first - turn,
        span=stroke.span + 2.0 * turn,
        half=half,
        square=True,
    )

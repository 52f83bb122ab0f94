"""Pictures made of upright rectangles, pixel by pixel, as pixel art, codes and boards are: boxes tell them exactly.

Pixels are taken together to cells, between lines on which anything changes. Colours lie on each other in an order, so
that a box may go on below what is laid on it: each colour's cells are covered by as few rectangles as a greedy set
cover takes (Chvátal 1979) of all that are maximal.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from scipy import ndimage

from ..arrays import BoolArray, Float32Array, Float64Array, IntArray
from ..blend import EDGE_DEVIATION
from ..deferred import deferred
from ..scene import Color, Layer, Scene, Shape
from .jagged import alike

KIND = "box"
LINES = 256  # along a side, at most, on which anything changes
LOOKED_AT = 16  # rows of pixels, about, that tell most pictures from these
CORNERS = 4  # that a box adds to a picture, at most
OFF = 8.0 / 255  # by which pixels of an edge are off at most, where others cross it
SOFTEST = 6  # pixels of an edge between cells, at most
SOFT = 0.9  # of half a box, its falloff, at most
SPECK = 4  # pixels of a picture that may be enlarged, that are one of it
SPECKLED = 0.25  # of the colours
OF_COLORS = 1.8  # boxes for each colour, at least: of gradients there are as many colours as boxes
OF_CELLS, FEW = 0.5, 4  # boxes for each cell, at most, but always so many: gradients take one for each

label: Callable[..., Any] = deferred("skimage.measure", "label")


@dataclass(frozen=True, eq=False)
class Cells:
    """A picture's cells [R, Q]: places of the lines between them in pixels, with both ends; colours [K, C], and which.

    `deviation`: the standard deviation of their edges in pixels, 0 for sharp ones.
    """

    across: Float64Array
    down: Float64Array
    colors: Float32Array
    which: IntArray
    deviation: float

    @classmethod
    def of(cls, pixels: Float32Array, limit: float) -> Cells | None:
        """Those of a picture [H, W, C], which changes where pixels differ by more than a limit; None of too many."""
        turned = np.swapaxes(pixels, 0, 1)
        if len(_lines(turned[:, :: 1 + len(pixels) // LOOKED_AT], limit)) > LINES + 1:  # as of any photograph
            return None
        down, across = _lines(pixels, limit), _lines(turned, limit)
        if max(len(down), len(across)) > LINES + 1:
            return None
        cells = pixels[down[:-1]][:, across[:-1]]
        if not alike(pixels, cells.repeat(np.diff(down), 0).repeat(np.diff(across), 1), limit).all():
            return None
        places_down, cells, softness = _between_edges(down, cells)
        places_across, columns, more = _between_edges(across, np.swapaxes(cells, 0, 1))
        colors, which = _told_apart(np.swapaxes(columns, 0, 1), limit)
        deviation = math.sqrt(np.mean([*softness, *more])) if softness or more else 0.0
        return cls(places_across, places_down, colors, which, deviation)

    @property
    def fewest(self) -> int:
        """So many boxes at least: each adds one colour, and four corners at most, where one of four cells differs."""
        below, beside = self.which[1:] != self.which[:-1], self.which[:, 1:] != self.which[:, :-1]
        corners = (below[:, 1:] ^ below[:, :-1]) & (beside[1:] ^ beside[:-1])
        return max(int(corners.sum()) // CORNERS, len(self.colors) - 1)

    @property
    def is_solid(self) -> bool:
        """Whether all colours are opaque, or none at all."""
        return bool(np.isin(self._alphas, (0.0, 1.0)).all())

    @property
    def is_antialiased(self) -> bool:
        """Whether many colours are but of single pixels that are apart, as they are along slopes and curves."""
        largest = np.zeros(len(self.colors))
        np.maximum.at(largest, self.which, np.bincount(self._parts.ravel(), self.sizes.ravel())[self._parts])
        single = largest <= min(self.sizes.min(), SPECK)
        return int(single.sum()) > max(SPECKLED * len(single), FEW)

    @property
    def is_soft(self) -> bool:
        """Whether cells are next to others of hardly another colour, as they are in gradients."""
        return any(
            bool((alike(self.colors[one], self.colors[other]) & (one != other)).any())
            for one, other in ((self.which[1:], self.which[:-1]), (self.which[:, 1:], self.which[:, :-1]))
        )

    def color(self, number: int) -> Color:
        """A colour by its number."""
        red, green, blue = self.colors[number, :3].tolist()
        return red, green, blue

    @cached_property
    def sizes(self) -> Float64Array:
        """How many pixels each cell has, [R, Q]."""
        return np.outer(np.diff(self.down), np.diff(self.across))

    @cached_property
    def ground(self) -> int | None:
        """The number of the colour that most of the rim has; none where anything is transparent."""
        if not self._alphas.all():
            return None
        return int(np.bincount(self.which[self._rim], self.sizes[self._rim]).argmax())

    @property
    def depths(self) -> IntArray:
        """How many edges are between each cell and the ground, or what is transparent, [R, Q]: there it is 0."""
        if self.ground is None:
            on_ground = self._alphas[self.which] == 0.0
        else:
            on_ground = np.isin(self._parts, self._parts[self._rim & (self.which == self.ground)])
        depths = np.where(on_ground, 0, -1)
        while (depths < 0).any():
            reached = ndimage.binary_dilation(depths >= 0) & (depths < 0)
            depths[np.isin(self._parts, self._parts[reached])] = depths.max() + 1
        return depths

    @property
    def _alphas(self) -> Float32Array:
        """That of each colour, [K]."""
        return self.colors[:, 3] if self.colors.shape[1] == 4 else np.ones(len(self.colors), np.float32)

    @cached_property
    def _parts(self) -> IntArray:
        """The numbers of the connected parts of one colour, [R, Q]."""
        parts: IntArray = label(self.which, background=-1, connectivity=1)
        return parts

    @property
    def _rim(self) -> BoolArray:
        """Which cells are at a side of the picture, [R, Q]."""
        rim = np.ones(self.which.shape, bool)
        rim[1:-1, 1:-1] = False
        return rim


class Tile(NamedTuple):
    """A rectangle of cells: rows and columns from one up to another."""

    top: int
    bottom: int
    left: int
    right: int


def mosaic(pixels: Float32Array, most: int, limit: float = 0.0) -> Scene | None:
    """The boxes that premultiplied pixels [H, W, C] are made of, at most so many; None where there is more to them.

    `limit`: by how much pixels of one colour may differ.
    """
    cells = Cells.of(pixels, limit)
    if cells is None or cells.fewest > most or not cells.is_solid or cells.is_soft or cells.is_antialiased:
        return None
    most = min(most, max(int(OF_CELLS * cells.which.size), FEW))
    best = None
    for order in _orders(cells):
        if (found := _laid(cells, order, most)) is not None:
            best, most = found, len(found) - 1
    enough = OF_COLORS * (len(cells.colors) - 1)
    return None if best is None or FEW < len(best) < enough else _scene(cells, best)


def _lines(pixels: Float32Array, limit: float) -> IntArray:
    """Where rows of pixels differ from those before: so many rows down, and both ends."""
    changes = np.flatnonzero(~alike(pixels[1:], pixels[:-1], limit).all(axis=1)) + 1
    return np.array([0, *changes, len(pixels)])


def _told_apart(cells: Float32Array, limit: float) -> tuple[Float32Array, IntArray]:
    """The colours [K, C] of cells [R, Q, C], and which each has [R, Q]: those that are alike are one, the commonest."""
    colors, which, counts = np.unique(
        cells.reshape(-1, cells.shape[2]), axis=0, return_inverse=True, return_counts=True
    )
    same = np.full(len(colors), -1)
    for color in np.argsort(-counts, kind="stable"):
        if same[color] < 0:
            same[(same < 0) & alike(colors, colors[color], limit)] = color
    kept, numbers = np.unique(same, return_inverse=True)
    return colors[kept], numbers[which].reshape(cells.shape[:2])


def _between_edges(lines: IntArray, rows: Float32Array) -> tuple[Float64Array, Float32Array, list[float]]:
    """Lines [R + 1] and rows [R, Q, C] without those of one pixel that are soft or antialiased edges between wide ones.

    There is one line, in the middle of the edge. And the variances of edges of several pixels.
    """
    places, kept, variances = lines[:-1].astype(np.float64), np.ones(len(rows), bool), list[float]()
    for before, after in pairwise(np.flatnonzero(np.diff(lines) > 1).tolist()):
        count = after - before - 1
        shares = _shares(rows[before : after + 1]) if 0 < count <= SOFTEST else None
        if shares is not None:
            kept[before + 1 : after] = False
            places[after] = lines[before + 1] + (1.0 - shares).sum()
            variances += [_variance(shares)] if count > 1 else []
    return np.array([*places[kept], lines[-1]]), rows[kept], variances


def _shares(rows: Float32Array) -> Float64Array | None:
    """Of rows [N, Q, C] the shares that those between have of the last, the rest being the first; None for no edge."""
    first, change = rows[0], rows[-1] - rows[0]
    if not change.any():
        return None
    shares = ((rows[1:-1] - first) * change).sum(axis=(1, 2)) / (change**2).sum()
    is_edge = (np.diff(shares, prepend=0.0, append=1.0) > -OFF).all()
    is_edge = is_edge and alike(rows[1:-1], first + shares[:, None, None] * change, OFF).all()
    return shares.astype(np.float64) if is_edge else None


def _variance(shares: Float64Array) -> float:
    """That of the places where an edge rises to the shares of so many pixels, and to 1."""
    rises, places = np.diff(shares, prepend=0.0, append=1.0), np.arange(len(shares) + 1)
    return float(rises @ (places - rises @ places) ** 2)


# --- what lies on what ----------------------------------------------------------------------------------------


def _orders(cells: Cells) -> Iterator[list[BoolArray]]:
    """Ways in which a picture may be laid: cells [R, Q] of one colour each, the lowest first, but for the ground."""
    depths, sizes = cells.depths, cells.sizes
    parts = [
        (depth, (depths == depth) & (cells.which == color))
        for depth in range(1, depths.max() + 1)
        for color in np.unique(cells.which[depths == depth])
    ]
    for sign in (-1.0, 1.0):
        yield [part for _, part in sorted(parts, key=lambda each: (each[0], sign * sizes[each[1]].sum()))]
    whole = [(depths > 0) & (cells.which == color) for color in range(len(cells.colors))]
    yield sorted(filter(np.any, whole), key=lambda part: -sizes[part].sum())


def _laid(cells: Cells, order: Sequence[BoolArray], most: int) -> list[tuple[Tile, Tile, int]] | None:
    """Rectangles that show a picture, the lowest first: what they may be, what is seen of them, their colours.

    None where they are more than so many.
    """
    found: list[tuple[Tile, Tile, int]] = []
    free = np.logical_or.reduce(order) if order else np.zeros_like(cells.which, bool)
    for part in order:
        color = int(cells.which[part][0])
        found += [(tile, _shrunk(tile, part), color) for tile in covered(part, free)]
        if len(found) > most:
            return None
        free = free & ~part
    return found


# --- rectangles -----------------------------------------------------------------------------------------------


def covered(part: BoolArray, free: BoolArray) -> list[Tile]:
    """Few rectangles that cover a part of all cells [R, Q], within the free ones: each covers most of what is left.

    Where cells of the part meet one covers all of them: between two that only touch, a line is seen at other sizes.
    """
    tiles, whole = _maximal(free), _with_seams(part)
    # the same rectangles in rows and columns of cells and of what is between them
    seams = 2 * tiles - np.array([0, 1, 0, 1])
    left, chosen = whole.copy(), list[int]()
    while left.any():
        best = int(np.argmax(_sums(left, seams)))
        left[_within(seams[best])] = False
        chosen.append(best)
    needed = _needed(seams[chosen], whole)
    return [Tile(*tile) for tile in tiles[chosen][needed].tolist()]


def _with_seams(part: BoolArray) -> BoolArray:
    """Cells [R, Q] and, between them, where two or four of them meet, [2R - 1, 2Q - 1]."""
    rows, columns = part.shape
    found = np.zeros((2 * rows - 1, 2 * columns - 1), bool)
    found[::2, ::2] = part
    found[1::2, ::2] = part[1:] & part[:-1]
    found[:, 1::2] = found[:, 2::2] & found[:, :-1:2]
    return found


def _maximal(free: BoolArray) -> IntArray:
    """All rectangles of free cells that no other has in it, [N, 4]."""
    bits = [0, *(int.from_bytes(row.tobytes(), "little") for row in np.packbits(free, 1, "little")), 0]
    found = list[Tile]()
    for top in range(1, len(bits) - 1):
        whole = bits[top]
        for bottom in range(top + 1, len(bits)):
            if not whole & ~bits[top - 1]:  # all of it goes on above
                break
            if whole & ~bits[bottom]:
                found += [
                    Tile(top - 1, bottom - 1, left, right)
                    for left, right, run in _runs(whole)
                    if run & ~bits[top - 1] and run & ~bits[bottom]
                ]
            whole &= bits[bottom]
    return np.array(found)


def _runs(bits: int) -> Iterator[tuple[int, int, int]]:
    """Where runs of ones in a number begin and end, from the lowest on, and these ones alone."""
    while bits:
        lowest = bits & -bits
        after = ((bits + lowest) ^ bits) & (bits + lowest)
        run = after - lowest
        yield lowest.bit_length() - 1, after.bit_length() - 1, run
        bits ^= run


def _sums(cells: BoolArray, tiles: IntArray) -> IntArray:
    """How many cells each of some rectangles [N, 4] has."""
    table: IntArray = np.pad(cells.cumsum(0).cumsum(1), ((1, 0), (1, 0)))
    top, bottom, left, right = tiles.T
    found: IntArray = table[bottom, right] - table[top, right] - table[bottom, left] + table[top, left]
    return found


def _needed(tiles: IntArray, part: BoolArray) -> list[bool]:
    """Which of some rectangles [N, 4] cover something of a part that no others do."""
    times, owns = np.zeros(part.shape, int), [_within(tile) for tile in tiles]
    for own in owns:
        times[own] += 1
    found = []
    for own in owns:
        found.append(bool((times[own][part[own]] == 1).any()))
        times[own] -= not found[-1]
    return found


def _shrunk(tile: Tile, part: BoolArray) -> Tile:
    """The least rectangle with all that one has of a part."""
    rows, columns = np.nonzero(part[_within(tile)])
    top, left = tile.top + int(rows.min()), tile.left + int(columns.min())
    return Tile(top, tile.top + int(rows.max()) + 1, left, tile.left + int(columns.max()) + 1)


def _within(tile: Tile | IntArray) -> tuple[slice, slice]:
    """Where a rectangle's cells are."""
    top, bottom, left, right = tile
    return slice(top, bottom), slice(left, right)


# --- the scene ------------------------------------------------------------------------------------------------


def _scene(cells: Cells, tiles: Sequence[tuple[Tile, Tile, int]]) -> Scene:
    """Boxes in the places of rectangles."""
    width, height = (int(places[-1]) for places in (cells.across, cells.down))
    ground = cells.ground
    bare = Scene(width, height, (), None if ground is None else cells.color(ground))
    return replace(bare, layers=tuple(_box(cells, *each, bare.pixel) for each in tiles))


def _box(cells: Cells, whole: Tile, seen: Tile, color: int, pixel: float) -> Layer:
    """A hidden edge is half way between where it may be and what is seen: away from the edges of what hides it."""
    sides = zip((cells.across, cells.down), _ends(cells, whole), _ends(cells, seen), strict=True)
    (left, right), (top, bottom) = (
        ((_hidden(*ends) - 0.5 * places[-1]) * pixel).tolist() for places, *ends in sides
    )
    half = 0.5 * (right - left), 0.5 * (bottom - top)
    falloff = min(cells.deviation / EDGE_DEVIATION * pixel, SOFT * min(half))
    sizes = (each - 0.5 * falloff for each in half)
    numbers = (0.5 * (left + right), 0.5 * (top + bottom), *sizes, 0.0, 0.0)
    return Layer((Shape(KIND, numbers, cells.color(color)),), falloff, 1.0)


def _ends(cells: Cells, tile: Tile) -> tuple[Float64Array, Float64Array]:
    """Where a rectangle begins and ends along x and y, in pixels."""
    return cells.across[[tile.left, tile.right]], cells.down[[tile.top, tile.bottom]]


def _hidden(whole: Float64Array, seen: Float64Array) -> Float64Array:
    """Edges between two places each, on a whole pixel where these are not one."""
    return np.where(whole == seen, seen, np.round(0.5 * (whole + seen)))

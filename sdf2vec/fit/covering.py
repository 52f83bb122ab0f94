"""A region that several shapes of one colour cover together: bars that cross, a cloud of discs.

One after the other, the largest bar within the region is laid on what the others leave; shapes of every kind start from
it, and the one that covers most joins the layer.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import torch
from scipy import ndimage

from ..arrays import BoolArray, Float64Array
from ..blend import UNION
from ..layer import Part
from ..paints import FLAT
from ..render.tensors import Group
from ..shapes import KINDS
from ..units import Placed
from .candidates import Mask, Opening, Proposer, joined_sharply, own_cover, single
from .corners import triangles
from .surroundings import Surroundings

DIRECTIONS = 24  # of bars, in half a turn
SEEDS = 4  # places where bars are laid
PARTS = 8  # of a region, at most
STARTS = 3  # of a kind of shape
STRICT = 4.0  # how much it matters what is covered too much, against what is not covered
# share of a region that may be left by all parts, if each covers as much of what is left as the last did
LEFT = 0.02
BOX, TRIANGLE = "box", "triangle"
# how much it counts what a shape covers: a simple kind is the likelier
SIMPLE, OTHER = {"circle": 1.0, BOX: 0.96}, 0.92


class Bar(NamedTuple):
    """A rectangle in pixels: its middle (x, y), half its length and width, its turn, and how many pixels it gains."""

    middle: Float64Array
    half: tuple[float, float]
    turn: float
    gain: int


@dataclass(frozen=True, eq=False)
class Covering:
    """A region of a colour [1, 3]: where it is, [P], where that is known, [P], and the looks of its layer, which has no
    shape.
    """

    inside: torch.Tensor
    known: torch.Tensor
    color: torch.Tensor
    looks: Group
    around: Surroundings
    proposer: Proposer
    # of its outline, (x, y) [N, 2] in scene units, between which triangles are laid; where it is none, bars are
    corners: torch.Tensor | None = None

    def layers(self) -> Iterator[Group]:
        """Layers of two, three and more shapes joined sharply, which cover ever more; none once that gets hopeless."""
        layer, left, size = self.looks, self.inside, float(self.inside.sum())
        share = 1.0
        for rest in reversed(range(PARTS)):
            found = self._with_one_more(layer, left)
            if found is None:
                return
            layer, left = found, left * (1.0 - own_cover(found, len(layer.structure), self.around))
            before, share = share, float(left.sum()) / size
            if share * (share / before) ** rest > LEFT:
                return
            if rest < PARTS - 1:
                yield layer

    def _with_one_more(self, layer: Group, left: torch.Tensor) -> Group | None:
        """A layer with the shape that covers most of what is left [P], and little else; None where none does."""
        too_much = (self.known - self.inside).clamp_min(0.0)
        if not ((left > 0.5) & (too_much < 0.5)).any():
            return None
        index = len(layer.structure)
        mask = Mask(left + STRICT * too_much, left, 0.0)
        place = Opening(layer, index, UNION if index else "", self.color, mask)
        lay_out = self._along_bar if self.corners is None else self._triangles
        best, most = layer, 0.0
        for made in lay_out(place, left, too_much):
            cover = own_cover(made, index, self.around)
            gain = float((cover * (left - STRICT * too_much)).sum())
            gain *= 1.0 if self.corners is not None else SIMPLE.get(made.structure[index].kind, OTHER)
            if gain > most:
                best, most = made, gain
        return joined_sharply(best) if most else None

    def _along_bar(self, place: Opening, left: torch.Tensor, too_much: torch.Tensor) -> list[Group]:
        """The layer with shapes of every kind from where the largest bar is, and from what is left [P]."""
        bar = widest(self.around.plane(left > 0.5), self.around.plane(too_much < 0.5))
        if bar is None:
            return []
        starts = [self._placed(bar), self.proposer.placed(left, self.around)]
        return [
            made
            for kind in self.proposer.kinds
            for _, made in self.proposer.optima(kind, [place] * 2, starts, self.around, STARTS)
        ]

    def _triangles(self, place: Opening, left: torch.Tensor, too_much: torch.Tensor) -> list[Group]:
        """The layer with triangles between corners of the outline that cover most of what is left [P]."""
        if TRIANGLE not in self.proposer.kinds or self.corners is None:
            return []
        points = self.around.pixels(self.corners).numpy().astype(np.float64)
        planes = self.around.plane(left), self.around.plane(STRICT * too_much)
        return [with_triangle(place, ends, self.around) for ends in triangles(points, *planes, STARTS)]

    def _placed(self, bar: Bar) -> Placed:
        """Where shapes start that are to be where a bar is."""
        pixel = self.around.points[2]
        length, width = ((half + 0.5) * pixel for half in bar.half)
        size = (length * width).sqrt()
        own = next(p.start for p in KINDS[BOX].parameters if len(p.start) == 2 and p.positive)
        stretches = torch.stack([length / own[0], width / own[1]]) / size
        middle = self.around.places(torch.from_numpy(bar.middle))
        return Placed(middle[None].float(), size[None], torch.tensor([bar.turn]), stretches[None])


def with_triangle(place: Opening, ends: Float64Array, around: Surroundings) -> Group:
    """The layer with a triangle [3, 2] in pixels in a place."""
    at = around.places(torch.from_numpy(ends).float())
    return place.filled(place.part(TRIANGLE, FLAT), dict(zip("abc", at[:, None], strict=True)))


def parted(layer: Group) -> list[Group]:
    """A layer of opaque shapes that are joined sharply as layers of one shape each."""
    return [single(layer, index, Part(part.kind, part.paint)) for index, part in enumerate(layer.structure)]


# --- bars ---------------------------------------------------------------------------------------------------


def widest(wanted: BoolArray, allowed: BoolArray) -> Bar | None:
    """The bar within what is allowed [H, W] that has the most of what is wanted, or nearly; None where nothing is."""
    return max(_bars(wanted, allowed), key=lambda bar: bar.gain, default=None)


def _bars(wanted: BoolArray, allowed: BoolArray) -> Iterator[Bar]:
    """Those in many directions at some places."""
    beyond = np.pad(~allowed, 1, constant_values=True)
    edge = _points(beyond & ndimage.binary_dilation(~beyond, np.ones((3, 3)))) - 1.0
    points = _points(wanted)
    for seed in _seeds(wanted, allowed):
        for turn in np.arange(DIRECTIONS) * (np.pi / DIRECTIONS):
            yield _bar(seed, float(turn), edge, points)


def _points(mask: BoolArray) -> Float64Array:
    """x and y of the pixels of a mask, [2, N]."""
    rows, columns = np.nonzero(mask)
    return np.stack([columns, rows]).astype(np.float64)


def _seeds(wanted: BoolArray, allowed: BoolArray) -> Iterator[Float64Array]:
    """Places (x, y) that are wanted, far from where nothing may be, and from each other."""
    depth = ndimage.distance_transform_edt(np.pad(allowed, 1))[1:-1, 1:-1] * wanted
    y, x = np.ogrid[: depth.shape[0], : depth.shape[1]]
    for _ in range(SEEDS):
        row, column = np.unravel_index(depth.argmax(), depth.shape)
        if depth[row, column] <= 0:
            return
        yield np.array([column, row], np.float64)
        depth = np.where(np.hypot(x - column, y - row) < 1.5 * depth[row, column], 0.0, depth)


def _bar(seed: Float64Array, turn: float, edge: Float64Array, points: Float64Array) -> Bar:
    """The largest bar in a direction that has no point of an edge [2, E] within; a seed is across from its middle line.
    What it gains is counted among points [2, N].
    """
    ways = np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
    along, across = ways @ (edge - seed[:, None])
    beside = across[np.abs(along) < 0.75]
    over, under = beside[beside > 0].min(initial=np.inf), -beside[beside < 0].max(initial=-np.inf)
    aside = (over - under) / 2.0 if np.isfinite(over + under) else 0.0
    order = np.abs(across - aside).argsort(kind="stable")
    along, width = along[order], np.abs(across - aside)[order]
    ahead = np.minimum.accumulate(np.where(along >= 0, along, np.inf))
    behind = np.minimum.accumulate(np.where(along < 0, -along, np.inf))
    wide = np.append(width[1:], width[-1])
    best = int((np.where(np.isfinite(ahead + behind), ahead + behind, 0.0) * wide).argmax())
    front, back = ahead[best] - 0.5, behind[best] - 0.5
    half = float(front + back) / 2.0, float(wide[best]) - 0.5
    middle = seed + ways[1] * aside + ways[0] * (front - back) / 2.0
    own = np.abs(ways @ (points - middle[:, None]))
    return Bar(middle, half, turn, int(((own[0] <= half[0]) & (own[1] <= half[1])).sum()))

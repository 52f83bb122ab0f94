"""Where an overlay is and where that is known, and how well layers cover it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import torch
from scipy import ndimage
from skimage.morphology import convex_hull_image

from ..arrays import BoolArray, Float64Array
from ..blend import INTERSECTION, SUBTRACTION, UNION
from ..layer import FALLOFF_SLOT, OPACITY_SLOT, row_width
from ..paints import FLAT
from ..render.tensors import Group
from .arcs import Arc, arcs
from .candidates import Mask, Opening, Proposer, own_cover
from .corners import corners
from .covering import TRIANGLE, parted, with_triangle
from .initialization import straight
from .surroundings import Surroundings
from .transparency import Overlay
from .windows import Part

EXACT = 0.36  # pixels by which an outline is off in the mean, at most
LEAST_SIDE = 12  # pixels of one of its sides: the outer one, and those around holes
LEAST_OFF = 0.15  # below that an outline is no better
GROSSLY = 0.01  # share of it that may be wrong in finer surroundings, by more than an edge
GOOD = 0.25  # share of a layer that its shape may miss, at most
BITTEN = 0.05  # share of what is cut out of a shape that is beyond its edge: a bite, no hole
PRICE = 0.04  # of a number, in logarithms of what is missed
FULL, BLURRED = np.ones((3, 3)), 2  # pixels on both sides of an edge that may be of both colours
CIRCLE = "circle"
NEAR = 2  # pixels around what is looked at
TINY = 1e-9


@dataclass(frozen=True, eq=False)
class Outlined:
    """A layer of one shape, or of several that are joined, for an overlay; of strokes `more` layers with it.

    `off`: by how many pixels its outline is off, in the mean, and `worst`: on the side where that is most; `missed`:
    the share of the overlay that is wrong; `bitten`: whether what is cut out of it goes beyond its edge; `soft`:
    whether the overlay's edge is.
    """

    layer: Group
    overlay: Overlay
    off: float
    worst: float
    missed: float
    soft: bool
    more: tuple[Group, ...] = ()
    bitten: bool = False

    @property
    def score(self) -> float:
        """What is the less the better."""
        return self.priced(LEAST_OFF, PRICE)

    def priced(self, least: float, price: float) -> float:
        """The same where it is no better that an outline is off by less than the least, and each number has a price."""
        return math.log(max(self.off, self.worst, least)) + price * row_width(self.layer.structure)

    @property
    def is_good(self) -> bool:
        """Whether it has the overlay's outline."""
        return self.off < EXACT and self.missed < GOOD

    @property
    def is_unlikely(self) -> bool:
        """Whether it has the outline of what may well be part of another shape, or is not as exact on each side."""
        return self.bitten or self.worst >= EXACT

    @property
    def is_joined(self) -> bool:
        """Whether it is of several shapes."""
        return len(self.layer.structure) > 1 or bool(self.more)

    @property
    def layers(self) -> list[Group]:
        """Its layers, those out of which nothing is cut as layers of one shape each."""
        return [
            one
            for layer in self.all
            for one in (parted(layer) if all(part.adds for part in layer.structure) else [layer])
        ]

    @property
    def all(self) -> tuple[Group, ...]:
        """Its layers."""
        return self.layer, *self.more

    @property
    def is_opaque(self) -> bool:
        return self.overlay.opacity == 1.0

    @property
    def rank(self) -> tuple[bool, bool, int, float]:
        """What is the less the likelier: of translucent layers what explains the most regions is."""
        covered = 0 if self.is_opaque else -int(self.overlay.inside.sum())
        return self.is_unlikely, self.is_joined, covered, self.score

    @property
    def is_plain(self) -> bool:
        """Whether it is one opaque shape."""
        return self.is_opaque and not self.is_joined

    def lies_under(self, other: Outlined) -> bool:
        """Whether another one shows what is under it where this one is."""
        return bool((self.overlay.inside & other.overlay.outside).any())


@dataclass(frozen=True, eq=False)
class Area:
    """Where an overlay is, [P], and where it is known whether it is, [P], in a window of some surroundings."""

    overlay: Overlay
    inside: torch.Tensor
    known: torch.Tensor
    part: Part  # that window of the surroundings
    around: Surroundings
    soft: bool  # its edge

    @property
    def name(self) -> tuple[bytes, ...]:
        """What tells it from others, whatever is known around it."""
        x, y, pixel = self.around.points
        ends = torch.stack([x[0], y[0], pixel])
        return self.overlay.color.tobytes(), self.inside.numpy().tobytes(), ends.numpy().tobytes()

    @property
    def key(self) -> tuple[bytes, ...]:
        """What its outline follows from."""
        return *self.name, self.known.numpy().tobytes()

    @cached_property
    def planes(self) -> tuple[BoolArray, BoolArray]:
        """Which pixels [H, W] it has, and of which it is known."""
        inside, known = (self.around.plane(mask > 0.5) for mask in (self.inside, self.known))
        return inside, known

    @property
    def near(self) -> bytes:
        """What is known next to it and in its box."""
        inside, known = self.planes
        rows, columns = (np.flatnonzero(inside.any(axis=axis)) for axis in (1, 0))
        if not len(rows):
            return b""
        low, high = (np.array([rows[end], columns[end]]) for end in (0, -1))
        (top, left), (bottom, right) = np.maximum(low - NEAR, 0), high + NEAR + 1
        return known[top:bottom, left:right].tobytes()

    @cached_property
    def edge(self) -> float:
        """The length of its outline in pixels, where it is known."""
        _, lengths = self.sides
        return max(float(lengths.sum()), 1.0)

    @cached_property
    def sides(self) -> tuple[torch.Tensor, torch.Tensor]:
        """Which side of its outline is nearest to each point [P], the outer one or one around a hole; their lengths [S]
        in pixels, where it is known.
        """
        inside, known = self.planes
        parts, count = ndimage.label(known & ~inside, FULL)
        beside = ndimage.maximum_filter(parts, footprint=ndimage.generate_binary_structure(2, 1))
        lengths = torch.from_numpy(np.bincount(beside[inside], minlength=max(count, 1) + 1)[1:]).float()
        if count < 2:
            return torch.zeros(inside.size, dtype=torch.long), lengths
        rows, columns = ndimage.distance_transform_edt(
            parts == 0, return_distances=False, return_indices=True
        )
        return torch.from_numpy(parts[rows, columns].ravel() - 1).long(), lengths

    @cached_property
    def coverage(self) -> Float64Array:
        """How much of each pixel it covers [H, W]: at its edge by where the pixel's colour is between its own and that
        of what is beside it.
        """
        inside = self.around.plane(self.inside > 0.5)
        near, core = (
            ndimage.binary_dilation(inside, FULL, BLURRED),
            ndimage.binary_erosion(inside, FULL, BLURRED, border_value=1),
        )
        if near.all():
            return inside.astype(np.float64)
        rows, columns = ndimage.distance_transform_edt(near, return_distances=False, return_indices=True)
        pixels = self.around.target.numpy().astype(np.float64)
        beside = pixels[:, rows, columns]
        change = self.overlay.color[:, None, None] - beside
        share = ((pixels - beside) * change).sum(0) / np.maximum((change**2).sum(0), TINY)
        return np.where(near & ~core, np.clip(share, 0.0, 1.0), inside)

    def outlined(self, layer: Group) -> Outlined:
        """How well a layer covers it."""
        return self.all_outlined([layer])[0]

    def outlined_together(self, layers: Sequence[Group]) -> Outlined:
        """How well some layers cover it that lie on each other."""
        first, *more = layers
        wrong = (self.cover(layers) * self.known - self.inside).abs()
        return replace(self._judged(first, wrong), more=tuple(more))

    def all_outlined(self, layers: Sequence[Group]) -> list[Outlined]:
        """The same of some layers of one structure, each alone."""
        wrong = (_covers(layers, self.around) * self.known - self.inside).abs()
        return [self._judged(layer, own) for layer, own in zip(layers, wrong, strict=True)]

    def _judged(self, layer: Group, wrong: torch.Tensor) -> Outlined:
        """A layer that covers points wrongly by so much [P]."""
        off, (nearest, lengths) = float(wrong.sum()), self.sides
        long = lengths.where(lengths >= LEAST_SIDE, math.inf)  # of short ones the mean says little
        worst = float((wrong.new_zeros(len(lengths)).index_add_(0, nearest, wrong) / long).max())
        return Outlined(layer, self.overlay, off / self.edge, worst, off / self._size, self.soft)

    @property
    def _size(self) -> float:
        """In pixels."""
        return max(float(self.inside.sum()), TINY)

    def is_told_as_in(self, coarse: Area, layers: Sequence[Group]) -> bool:
        """Whether layers that have its outline in coarser surroundings miss nothing of it here but at their edge."""
        pixels = max(round(EXACT * float(coarse.around.points[2] / self.around.points[2])) + 1, 2)
        wrong = self.around.plane((self.cover(layers) * self.known - self.inside).abs() > 0.5)
        squares = ndimage.binary_opening(wrong, np.ones((pixels, pixels)))
        return float(squares.sum()) < GROSSLY * self._size

    def is_bitten(self, layer: Group) -> bool:
        """Whether a shape that is cut out of the first goes beyond its edge, or one that leaves a part of it does."""
        joins = [part.join for part in layer.structure]
        if INTERSECTION in joins:
            return True
        base, *cuts = (own_cover(layer, index, self.around) for index in range(len(joins)))
        return any(
            (cut * (1.0 - base)).sum() > BITTEN * cut.sum()
            for cut, join in zip(cuts, joins[1:], strict=True)
            if join == SUBTRACTION
        )

    def cover(self, layers: Sequence[Group]) -> torch.Tensor:
        """Coverage [P] of layers that lie on each other, without their opacity."""
        return cover_at(layers, self.around)

    def corners(self) -> torch.Tensor:
        """Those of its outline, (x, y) [N, 2] in scene units."""
        found = corners(self.around.plane(self.inside), self.around.plane(self.known))
        return self.around.places(torch.from_numpy(found).float())

    def arcs(self, fine: Area) -> list[Arc]:
        """Those of its outline, in its own pixels, as they are in finer surroundings."""
        ratio = float(fine.around.points[2] / self.around.points[2])
        found = arcs(fine.around.plane(fine.inside), fine.around.plane(fine.known))
        middles = torch.tensor([[arc.x, arc.y] for arc in found]).reshape(-1, 2)
        moved = self.around.pixels(fine.around.places(middles)).tolist()
        return [
            arc._replace(x=x, y=y, radius=arc.radius * ratio)
            for arc, (x, y) in zip(found, moved, strict=True)
        ]

    def hull(self) -> torch.Tensor:
        """Where it may be if it is convex: others may hide parts of it, [P]."""
        around = convex_hull_image(self.around.plane(self.inside > 0.5))
        return torch.from_numpy(around).flatten() * (1.0 - self.known + self.inside)

    @property
    def color(self) -> torch.Tensor:
        """The straight colour [1, 3] of the overlay."""
        return straight(torch.tensor(self.overlay.color[None], dtype=torch.float32))[:, :3]

    def opening(self, too_much: float = 1.0) -> Opening:
        """A place for its first shape; by how much it matters what that covers too much."""
        alpha = self.overlay.opacity * float(self.overlay.color[3] if len(self.overlay.color) == 4 else 1.0)
        looks = {OPACITY_SLOT: torch.tensor([[alpha]]), FALLOFF_SLOT: torch.zeros(1, 1)}
        matters = self.known * torch.where(self.inside > 0, 1.0, too_much)
        mask = Mask(matters, self.inside, 0.0)
        return Opening(Group((), torch.tensor([0]), looks), 0, "", self.color, mask)

    def cut(self, base: Group) -> Opening:
        """A place for a shape that is cut out of one which covers too much."""
        matters = self.known * self.cover([base])
        too_much = (matters - self.inside).clamp_min(0.0)
        return Opening(base, len(base.structure), SUBTRACTION, self.color, Mask(matters, too_much, 0.0))

    def with_circle(self, x: float, y: float, radius: float, place: Opening) -> Group:
        """The layer with a circle, in pixels, in a place."""
        middle = self.around.places(torch.tensor([[x, y]]))
        circle = {"center": middle, "radius": torch.full((1, 1), radius) * self.around.points[2]}
        return place.filled(place.part(CIRCLE, FLAT), circle)

    def joining(self, base: Group) -> Opening:
        """A place for one more shape that is joined to a layer."""
        mask = Mask(self.known, self.inside, 0.0)
        return Opening(base, len(base.structure), UNION, self.color, mask)

    def wedges(self, arc: Arc, base: Group, proposer: Proposer) -> list[Group]:
        """A layer of which a triangle from the middle of a circle leaves what is seen, or takes away the rest."""
        found = arc.wedge(self.around.plane(self.inside))
        if found is None or TRIANGLE not in proposer.kinds:
            return []
        is_within, ends = found
        place = self.meeting(base) if is_within else self.cut(base)
        return [with_triangle(place, ends, self.around)]

    def meeting(self, base: Group) -> Opening:
        """A place for a shape of which only what it has in common with one that covers too much is left."""
        matters = self.known * self.cover([base])
        return Opening(base, len(base.structure), INTERSECTION, self.color, Mask(matters, self.inside, 0.0))


def cover_at(layers: Sequence[Group], around: Surroundings) -> torch.Tensor:
    """Coverage [P] of layers that lie on each other, without their opacity, at the points of some surroundings."""
    left = torch.ones_like(around.points[0])
    for layer in layers:
        left = left * (1.0 - _covers([layer], around)[0])
    return 1.0 - left


def _covers(layers: Sequence[Group], around: Surroundings) -> torch.Tensor:
    """The same [G, P] of layers of one structure, each alone."""
    return around.covers(layers[0].structure, torch.cat([layer.rows() for layer in layers]))

"""The least that does the job, shape by shape: a circle for an ellipse, opaque for translucent, sharp for soft.

A change is tried, its other numbers descend a little, and it is kept where the picture stays as near.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache

import torch

from ..expr import const
from ..graph import scalarize
from ..kind import SMALLEST
from ..layer import FALLOFF_SLOT, JOIN, OPACITY_SLOT, Part, Slot, slots
from ..lower.torch import Tensors, compile_torch
from ..paints import BASE, FLAT
from ..render.tensors import Group, SceneTensors
from ..shapes import KINDS
from ..units import ANGLE, COLOR
from .candidates import ROUNDED, joined_sharply, reductions
from .joining import Search, inserted
from .surroundings import Surroundings, View, error_of, layer_at

STEPS = 10  # of a changed layer
RISE = 1.02  # of the error, at most, by one change
BENT = 1.0  # pixels between an arc and a line that may be straight
UPRIGHT = 0.05  # radians off, at most, of what is tried upright
NEARLY_OPAQUE = 0.3  # on one colour, opacity and colour may stand for each other
UNSEEN = (0.25 / 255) ** 2  # by which the mean squared error may always rise: a quarter of a level
CLOSE = 0.005  # squared distance of colours that may become one
SOFTEST = 4.0  # pixels of falloff, at most, of what is tried sharp

Change = tuple[Group, tuple[Slot, ...]]  # a layer, and what of it must stay
Propose = Callable[[Group, View], Iterator[Change]]


def simplified(scene: SceneTensors, view: View, search: Search, worst: float) -> SceneTensors:
    """The scene with simpler layers, while its mean squared error hardly rises or stays below the worst."""
    trial = Trial(view, search, _limit(scene, view, worst))
    for order in range(scene.layer_count):
        kept: tuple[Slot, ...] = ()
        for change in CHANGES:
            while (made := trial.changed(scene, order, change, kept)) is not None:
                scene, still = made
                kept = (*kept, *still)
    return scene


def _limit(scene: SceneTensors, view: View, worst: float) -> float:
    """Up to which mean squared error a change is kept."""
    error = error_of(scene, view)
    return max(worst, RISE * error, error + UNSEEN)


def sharing(scene: SceneTensors, view: View, worst: float) -> SceneTensors:
    """The scene with colours that are close to one of a layer below made the same, while it stays good enough."""
    limit = _limit(scene, view, worst)
    shared: list[torch.Tensor] = []
    for order in range(scene.layer_count):
        layer = layer_at(scene, order)
        own = layer.of(BASE.name, 0)
        close = sorted(
            (color for color in shared if _distance(color, own) < CLOSE),
            key=lambda color: _distance(color, own),
        )
        if close and layer.structure[0].paint == FLAT:
            recolored = inserted(scene, _with_color(layer, close[0]))
            if error_of(recolored, view) <= limit:
                scene = recolored
                continue
        shared.append(own)
    return scene


def _distance(one: torch.Tensor, other: torch.Tensor) -> float:
    return float((one - other).square().sum())


def _with_color(layer: Group, color: torch.Tensor) -> Group:
    """The layer with another colour of its first shape."""
    slot = Slot(0, BASE)
    return Group(layer.structure, layer.order, {**layer.values, slot: color})


@dataclass(frozen=True)
class Trial:
    """Changes are tried on a picture, and kept up to a mean squared error."""

    view: View
    search: Search
    limit: float

    def changed(
        self, scene: SceneTensors, order: int, change: Propose, kept: tuple[Slot, ...]
    ) -> tuple[SceneTensors, tuple[Slot, ...]] | None:
        """The scene after the first change of a layer that is good enough, and what must stay since then."""
        for layer, still in change(layer_at(scene, order), self.view):
            is_new = not still or not set(still).issubset(kept)
            if is_new and {part.kind for part in layer.structure}.issubset(self.search.layers.kinds):
                tried = self._moved(scene, layer, (*kept, *still))
                if error_of(tried, self.view) <= self.limit:
                    return tried, still
        return None

    def _moved(self, scene: SceneTensors, layer: Group, still: tuple[Slot, ...]) -> SceneTensors:
        """The scene with a layer whose other numbers have moved a little."""
        around = Surroundings.of(scene, int(layer.order), self.view)
        tried = self.search.trained(layer, around, STEPS, lambda slot: slot not in still)
        return inserted(scene, tried.layer)


# --- changes --------------------------------------------------------------------------------------------------


def _fewer_parts(layer: Group, view: View) -> Iterator[Change]:
    """The layer without one of its shapes."""
    yield from ((fewer, ()) for fewer in reductions(layer))


def _circle(layer: Group, view: View) -> Iterator[Change]:
    """A shape as a circle of about its extent: what is mostly hidden may be any kind, and this has fewest numbers.

    Not where a paint is stretched over it.
    """
    for index, part in enumerate(layer.structure):
        if part.kind != "circle" and part.paint == FLAT and KINDS[part.kind].patch is None:
            center, radius = middle_of(layer, index)
            yield (
                with_part(layer, index, part._replace(kind="circle"), {"center": center, "radius": radius}),
                (),
            )


def _triangle(layer: Group, view: View) -> Iterator[Change]:
    """A triangle with corners that are a little round as one with sharp corners whose sides lie where its sides do."""
    for index, part in enumerate(layer.structure):
        if part.kind != ROUNDED:
            continue
        corners = torch.stack([layer.of(name, index) for name in "abc"])
        middle, radius = _incircle(corners)
        further = layer.of("corner_radius", index) / radius
        if float(further) < 1.0:
            sharp = middle + (corners - middle) * (1.0 + further)
            own = dict(zip("abc", sharp, strict=True))
            yield with_part(layer, index, part._replace(kind="triangle"), own), ()


def _incircle(corners: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
    """The middle [1, 2] and radius [1, 1] of the circle that touches the sides of a triangle [3, 1, 2] from within."""
    opposite = (corners.roll(1, 0) - corners.roll(2, 0)).norm(dim=2, keepdim=True).clamp_min(SMALLEST)
    around = opposite.sum(0)
    (x, y), (to_x, to_y) = ((corners[i] - corners[0]).unbind(1) for i in (1, 2))
    radius = (x * to_y - y * to_x).abs()[:, None] / around
    return (opposite * corners).sum(0) / around, radius.clamp_min(SMALLEST)


def middle_of(layer: Group, index: int) -> tuple[torch.Tensor, torch.Tensor]:
    """Where a shape of a layer is [1, 2], and half the mean of its sides [1, 1]."""
    low_x, low_y, high_x, high_y = _extent(layer.structure[index].kind)(*layer.shape(index))
    center = torch.stack([low_x + high_x, low_y + high_y], dim=1) / 2
    return center, (high_x - low_x + high_y - low_y)[:, None] / 4


@cache
def _extent(kind: str) -> Callable[..., Tensors]:
    """The box around a shape from its numbers."""
    return compile_torch(
        scalarize(KINDS[kind].extent(const(0.0), *KINDS[kind].variables())), KINDS[kind].scalars()
    )


def with_part(layer: Group, index: int, part: Part, own: dict[str, torch.Tensor]) -> Group:
    """The layer with another part in the place of one, of which these numbers are known; the rest is what it was."""
    structure = (*layer.structure[:index], part, *layer.structure[index + 1 :])
    new = {
        Slot(index, parameter): own[parameter.name] for parameter in part.parameters if parameter.name in own
    }
    values = {slot: new[slot] if slot in new else layer.values[slot] for slot in slots(structure)}
    return Group(structure, layer.order, values)


def _flat(layer: Group, view: View) -> Iterator[Change]:
    """A shape in one colour, the mean of those that it is painted with."""
    for index, part in enumerate(layer.structure):
        if part.adds and part.paint != FLAT:
            colors = [
                v for slot, v in layer.values.items() if slot.part == index and slot.parameter.unit is COLOR
            ]
            mean = torch.stack(colors).mean(0)
            yield with_part(layer, index, part._replace(paint=FLAT), {BASE.name: mean}), ()


def _upright(layer: Group, view: View) -> Iterator[Change]:
    """Angles next to a right angle as just that; a quarter turn is a change of sides, so that 0 will do."""
    for slot, turn in layer.values.items():
        if slot.parameter.unit is not ANGLE or slot.part is None:
            continue
        quarters = round(float(turn) / (math.pi / 2))
        if abs(float(turn) - quarters * math.pi / 2) > UPRIGHT:
            continue
        turned = layer.setting(slot, 0.0)
        yield (_sides_swapped(turned, slot.part) if quarters % 2 else turned), (slot,)


def _sides_swapped(layer: Group, part: int) -> Group:
    """The layer with the extents of one of its shapes along x and y exchanged."""
    values = {
        slot: tensor.flip(1) if slot.part == part and _is_extent(slot) else tensor
        for slot, tensor in layer.values.items()
    }
    return Group(layer.structure, layer.order, values)


def _is_extent(slot: Slot) -> bool:
    return slot.parameter.unit.name == "length" and slot.parameter.width == 2


def _opaque(layer: Group, view: View) -> Iterator[Change]:
    if float(layer.opacity) >= NEARLY_OPAQUE:
        yield layer.setting(OPACITY_SLOT, 1.0), (OPACITY_SLOT,)


def _sharp(layer: Group, view: View) -> Iterator[Change]:
    pixel = 1.0 / min(view.target.shape[1:])
    if float(layer.falloff) <= SOFTEST * pixel or layer.structure[0].paint != FLAT:
        yield layer.setting(FALLOFF_SLOT, 0.0), (FALLOFF_SLOT,)


def _joined_sharply(layer: Group, view: View) -> Iterator[Change]:
    """The layer with all its shapes joined without smoothness."""
    joins = tuple(slot for slot in layer.values if slot.parameter is JOIN)
    if joins:
        yield joined_sharply(layer), joins


def _unrounded(layer: Group, view: View) -> Iterator[Change]:
    for slot in layer.values:
        if slot.part is not None and slot.parameter.name == "corner_radius":
            yield layer.setting(slot, 0.0), (slot,)


def _straight(layer: Group, view: View) -> Iterator[Change]:
    """An arc that is hardly bent as a line."""
    pixel = 1.0 / min(view.target.shape[1:])
    for slot, tensor in layer.values.items():
        if slot.part is not None and slot.parameter.name == "sagitta" and abs(float(tensor)) <= BENT * pixel:
            yield layer.setting(slot, 0.0), (slot,)


CHANGES: tuple[Propose, ...] = (
    _fewer_parts,
    _circle,
    _triangle,
    _flat,
    _joined_sharply,
    _unrounded,
    _straight,
    _upright,
    _opaque,
    _sharp,
)

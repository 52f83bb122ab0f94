"""The numbers of a packed scene in as few bits as its picture allows, for a scene that is fitted to them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial

import torch

from ..compact_file import PRECISIONS
from ..layer import Slot, slots
from ..render.tensors import Group
from ..scene import Scene
from ..steps import Steps
from ..units import Parameter
from .exported import Exported
from .packed_bits import OWN, PLACE, SHARED, Boxes, Layout, Precision
from .packing import Packed, Packer
from .rounding import Bits, Chooser, Rounded

GREY = 1.5 / 255.0  # by which the channels of a grey may differ, all of which are fitted again
GROUND_DECIMALS = 3
ROOM = 0.01  # scene units that a fit may move edges by without other cells
LOOKED_AT = dict(zip(PRECISIONS, (1, 5, 5, 5), strict=True))  # bits at first; of places, in falloffs
LEAST = dict(zip(PRECISIONS, (-4, 2, 2, 2), strict=True))
MOST = dict(zip(PRECISIONS, (12, 16, 14, 14), strict=True))


class PackedRounding:
    """A scene as words: for how near they are to be, in dB from its render, what they can say and the text."""

    def __init__(
        self, scene: Scene, slack: float, text: Callable[[Scene, Packed], Exported], boxes: Boxes = OWN
    ) -> None:
        self.slack, self.text = slack, text
        self.packer = Packer(scene, slack + ROOM, boxes, GREY)
        self.chooser = Chooser.of(
            scene, _counts(scene, self.packer.layout), self._said, LOOKED_AT, LEAST, MOST
        )

    def __call__(self, aim: float) -> Rounded:
        precision = _precision(self.chooser.bits(aim))
        counts = self.packer.bit_counts(precision)

        def write(said: Scene) -> tuple[Exported, Scene]:
            packer = self.packer.moved(_on_brief_ground(said), self.slack)
            found = packer.quantised(precision, counts)
            return self.text(found, packer.pack(precision, counts)), found

        return Rounded(partial(self._steps, precision, counts), write)

    def _said(self, bits: Bits) -> Scene:
        precision = _precision(bits)
        return self.packer.quantised(precision, self.packer.bit_counts(precision))

    def _steps(self, precision: Precision, counts: list[int], group: Group) -> Mapping[Slot, Steps]:
        """The steps of a group's numbers."""
        layers = group.order.tolist()
        places = torch.tensor([counts[index] for index in layers])[:, None]
        return {slot: self._steps_of(slot.parameter, layers, precision, places) for slot in group.values}

    def _steps_of(
        self, parameter: Parameter, layers: list[int], precision: Precision, places: torch.Tensor
    ) -> Steps:
        codec = parameter.unit.codec
        bits = places if codec.precision == PLACE else getattr(precision, codec.precision)
        ends = torch.tensor([self.packer.ends(index, parameter) for index in layers], dtype=torch.float64)
        low, high = (codec.root(end) for end in ends.unbind(1))
        return Steps.between(low, high, 2.0**bits - 1.0)


class SmallestPacked:
    """The same with a box for each layer; or, where it `may_share` and that takes fewer bytes, with one for all: none
    is skipped then, which takes some GPUs twice as long.
    """

    def __init__(
        self, scene: Scene, slack: float, text: Callable[[Scene, Packed], Exported], may_share: bool
    ) -> None:
        self.scene = scene
        ways = (OWN, SHARED) if may_share else (OWN,)
        self.ways = [PackedRounding(scene, slack, text, boxes) for boxes in ways]

    def __call__(self, aim: float) -> Rounded:
        return min((way(aim) for way in self.ways), key=lambda made: len(made.write(self.scene)[0].raw))


def _on_brief_ground(scene: Scene) -> Scene:
    """The scene on a ground said in few digits."""
    if scene.background is None:
        return scene
    red, green, blue, *alpha = (round(value, GROUND_DECIMALS) for value in scene.background)
    return replace(scene, background=(red, green, blue, alpha[0]) if alpha else (red, green, blue))


def _precision(bits: Bits) -> Precision:
    return Precision(bits["place"], bits["falloff"], bits["color"], bits["opacity"])


def _counts(scene: Scene, layout: Layout) -> dict[str, int]:
    """How many fractions there are of each precision."""
    found = dict.fromkeys(PRECISIONS, 0)
    for layer in scene.layers:
        for slot in slots(layer.structure):
            found[slot.parameter.unit.codec.precision] += layout.width(slot.parameter)
    return {name: count for name, count in found.items() if count}

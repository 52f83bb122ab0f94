"""A scene as tensors: what renderers compute with and what fitting optimises.

Layers of the same structure form a group, so that one lowered formula evaluates all of them.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import torch

from ..layer import Slot, Structure, slots
from ..scene import Ground, Layer, Scene
from ..shapes import KINDS
from ..units import COLOR


@dataclass(eq=False)
class Group:
    """G layers of one structure: a tensor [G, width] for each slot of their rows."""

    structure: Structure
    order: torch.Tensor  # [G] int64: place of each layer in the draw order
    values: dict[Slot, torch.Tensor]

    def __len__(self) -> int:
        return len(self.order)

    def of(self, name: str, part: int | None = None) -> torch.Tensor:
        """A parameter's tensor [G, width]; of the layer unless a part is told."""
        return next(v for s, v in self.values.items() if s.part == part and s.parameter.name == name)

    @property
    def opacity(self) -> torch.Tensor:
        """[G, 1]"""
        return self.of("opacity")

    @property
    def falloff(self) -> torch.Tensor:
        """[G, 1]"""
        return self.of("falloff")

    @property
    def colors(self) -> list[torch.Tensor]:
        """All colours of paints that can be seen, each [G, 3]."""
        return [
            tensor
            for slot, tensor in self.values.items()
            if slot.part is not None and slot.parameter.unit is COLOR and self.structure[slot.part].adds
        ]

    def shape(self, part: int) -> list[torch.Tensor]:
        """The numbers of one shape, [G] each, in the order of a flat parameter row."""
        parameters = KINDS[self.structure[part].kind].parameters
        return [column for p in parameters for column in self.values[Slot(part, p)].unbind(1)]

    def rows(self) -> torch.Tensor:
        """The layers' rows [G, U]: see `layer.slots`."""
        return torch.cat(list(self.values.values()), dim=1)

    def each(self, change: Callable[[torch.Tensor], torch.Tensor]) -> Group:
        """A group with all tensors changed, the draw order's too: moved, or some rows taken."""
        values = {slot: change(tensor) for slot, tensor in self.values.items()}
        return Group(self.structure, change(self.order), values)

    def setting(self, slot: Slot, value: float) -> Group:
        """The layers with one number in a slot."""
        values = {**self.values, slot: torch.full_like(self.values[slot], value)}
        return Group(self.structure, self.order, values)

    def joined(self, other: Group) -> Group:
        """The rows of both, this group's first."""
        values = {slot: torch.cat([tensor, other.values[slot]]) for slot, tensor in self.values.items()}
        return Group(self.structure, torch.cat([self.order, other.order]), values)


@dataclass(eq=False)
class SceneTensors:
    """A whole scene; `size` is the canvas in scene units, `background` premultiplied RGBA."""

    groups: list[Group]
    background: torch.Tensor  # [4]
    compositing: str
    size: tuple[float, float]

    @property
    def layer_count(self) -> int:
        return sum(map(len, self.groups))

    @property
    def shape_count(self) -> int:
        return sum(len(group) * len(group.structure) for group in self.groups)

    @torch.no_grad()
    def take(self, other: SceneTensors) -> None:
        """Takes over the numbers of a scene of the same layers, in place."""
        for group, new in zip(self.groups, other.groups, strict=True):
            for slot, values in group.values.items():
                values.copy_(new.values[slot])
        self.background.copy_(other.background)

    @property
    def transparent(self) -> bool:
        """Whether there is no ground."""
        return float(self.background[3].detach()) == 0.0

    @property
    def opaque(self) -> bool:
        """Whether the ground is."""
        return float(self.background[3].detach()) == 1.0


def on_device(tensors: SceneTensors, device: str) -> SceneTensors:
    """The same scene with its tensors on another device."""
    groups = [group.each(lambda tensor: tensor.to(device)) for group in tensors.groups]
    return SceneTensors(groups, tensors.background.to(device), tensors.compositing, tensors.size)


def from_scene(scene: Scene, dtype: torch.dtype = torch.float32, device: str = "cpu") -> SceneTensors:
    """The scene's numbers as tensors."""
    members: dict[Structure, list[int]] = defaultdict(list)
    for index, layer in enumerate(scene.layers):
        members[layer.structure].append(index)
    places = {kind: place for place, kind in enumerate(KINDS)}
    groups = sorted(members.items(), key=lambda item: (places[item[0][0].kind], len(item[0]), item[0]))
    return SceneTensors(
        [_group(scene, structure, order, dtype, device) for structure, order in groups],
        torch.tensor(scene.ground, dtype=dtype, device=device),
        scene.compositing,
        scene.extent,
    )


def _group(scene: Scene, structure: Structure, order: list[int], dtype: torch.dtype, device: str) -> Group:
    rows = torch.tensor([scene.layers[index].numbers for index in order], dtype=dtype, device=device)
    parts = rows.split([slot.parameter.width for slot in slots(structure)], dim=1)
    values = dict(zip(slots(structure), (part.clone() for part in parts), strict=True))
    return Group(structure, torch.tensor(order, device=device), values)


def to_scene(tensors: SceneTensors, width: int, height: int) -> Scene:
    """The tensors as a scene on a canvas of this many pixels. Raises SceneError for values out of range."""
    layers: dict[int, Layer] = {}
    for group in tensors.groups:
        layers |= zip(group.order.tolist(), _layers(group), strict=True)
    ordered = tuple(layers[i] for i in sorted(layers))
    return Scene(width, height, ordered, _straight(tensors.background.tolist()), tensors.compositing)


def _layers(group: Group) -> Iterator[Layer]:
    return (Layer.from_numbers(group.structure, row) for row in group.rows().tolist())


def _straight(ground: list[float]) -> Ground:
    """The background of a scene from premultiplied RGBA."""
    *light, alpha = ground
    red, green, blue = (min(value / alpha, 1.0) if alpha else 0.0 for value in light)
    return red, green, blue, alpha

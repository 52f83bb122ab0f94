"""A scene as tensors: what renderers compute with and what fitting optimises.

Layers of the same kind and number of shapes form a group, so that one lowered formula evaluates all of them.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import torch

from ..scene import Color, Layer, Scene, Shape
from ..shapes import KINDS


@dataclass
class Group:
    """G layers of K shapes of one kind each."""

    kind: str
    order: torch.Tensor  # [G] int64: place of each layer in the draw order
    parameters: dict[str, torch.Tensor]  # name → [G, K, 1 or 2]
    colors: torch.Tensor  # [G, K, 3]
    falloff: torch.Tensor  # [G] scene units
    opacity: torch.Tensor  # [G]
    smoothness: torch.Tensor  # [G] scene units; of no meaning for K = 1

    @property
    def union_size(self) -> int:
        return self.colors.shape[1]

    def tensors(self) -> Iterator[tuple[str, torch.Tensor]]:
        """Everything that can be optimised, by the name that its learning rate has."""
        for parameter in KINDS[self.kind].parameters:
            yield parameter.unit, self.parameters[parameter.name]
        yield "color", self.colors
        yield "falloff", self.falloff
        yield "opacity", self.opacity
        if self.union_size > 1:
            yield "smoothness", self.smoothness

    def each(self, change: Callable[[torch.Tensor], torch.Tensor]) -> Group:
        """A group with all tensors changed, the draw order's too: moved, or some rows taken."""
        parameters = {name: change(values) for name, values in self.parameters.items()}
        look = map(change, (self.colors, self.falloff, self.opacity, self.smoothness))
        return Group(self.kind, change(self.order), parameters, *look)

    def joined(self, other: Group) -> Group:
        """The rows of both, this group's first."""
        parameters = {name: torch.cat([a, other.parameters[name]]) for name, a in self.parameters.items()}
        looks = [(g.order, g.colors, g.falloff, g.opacity, g.smoothness) for g in (self, other)]
        order, *look = (torch.cat(pair) for pair in zip(*looks, strict=True))
        return Group(self.kind, order, parameters, *look)


@dataclass
class SceneTensors:
    """A whole scene; `size` is the canvas in scene units, `background` premultiplied RGBA."""

    groups: list[Group]
    background: torch.Tensor  # [4]
    compositing: str
    size: tuple[float, float]

    @property
    def layer_count(self) -> int:
        return sum(len(group.order) for group in self.groups)

    @property
    def transparent(self) -> bool:
        return float(self.background[3].detach()) == 0.0


def on_device(tensors: SceneTensors, device: str) -> SceneTensors:
    """The same scene with its tensors on another device."""
    groups = [group.each(lambda tensor: tensor.to(device)) for group in tensors.groups]
    return SceneTensors(groups, tensors.background.to(device), tensors.compositing, tensors.size)


def from_scene(scene: Scene, dtype: torch.dtype = torch.float32, device: str = "cpu") -> SceneTensors:
    """The scene's numbers as tensors."""
    members: dict[tuple[str, int], list[int]] = defaultdict(list)
    for index, layer in enumerate(scene.layers):
        members[layer.kind, len(layer.shapes)].append(index)
    places = {kind: place for place, kind in enumerate(KINDS)}
    groups = sorted(members.items(), key=lambda item: (places[item[0][0]], item[0][1]))
    background = (*scene.background, 1.0) if scene.background is not None else (0.0,) * 4
    return SceneTensors(
        [_group(scene, kind, order, dtype, device) for (kind, _), order in groups],
        torch.tensor(background, dtype=dtype, device=device),
        scene.compositing,
        scene.extent,
    )


def _group(scene: Scene, kind: str, order: list[int], dtype: torch.dtype, device: str) -> Group:
    layers = [scene.layers[index] for index in order]

    def tensor(values: list[object]) -> torch.Tensor:
        return torch.tensor(values, dtype=dtype, device=device)

    flat = tensor([[shape.parameters for shape in layer.shapes] for layer in layers])  # [G, K, P]
    widths = [len(parameter.start) for parameter in KINDS[kind].parameters]
    names = [parameter.name for parameter in KINDS[kind].parameters]
    return Group(
        kind,
        torch.tensor(order, device=device),
        dict(zip(names, (part.clone() for part in flat.split(widths, dim=2)), strict=True)),
        tensor([[shape.color for shape in layer.shapes] for layer in layers]),
        tensor([layer.falloff for layer in layers]),
        tensor([layer.opacity for layer in layers]),
        tensor([layer.smoothness for layer in layers]),
    )


def to_scene(tensors: SceneTensors, width: int, height: int) -> Scene:
    """The tensors as a scene on a canvas of this many pixels. Raises SceneError for values out of range."""
    layers: dict[int, Layer] = {}
    for group in tensors.groups:
        layers |= zip(group.order.tolist(), _layers(group), strict=True)
    background = None if tensors.transparent else _color(tensors.background[:3].tolist())
    return Scene(width, height, tuple(layers[i] for i in sorted(layers)), background, tensors.compositing)


def _layers(group: Group) -> Iterator[Layer]:
    flat = torch.cat([group.parameters[p.name] for p in KINDS[group.kind].parameters], dim=2)
    rows = (flat, group.colors, group.falloff, group.opacity, group.smoothness)
    for values, colors, falloff, opacity, smoothness in zip(*(row.tolist() for row in rows), strict=True):
        shapes = (Shape(group.kind, tuple(v), _color(c)) for v, c in zip(values, colors, strict=True))
        yield Layer(tuple(shapes), falloff, opacity, smoothness)


def _color(values: list[float]) -> Color:
    red, green, blue = values
    return red, green, blue

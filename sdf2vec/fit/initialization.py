"""Where the shapes of a fit start: denser and smaller where the picture has detail, or anywhere."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import torch

from ..blend import COMPOSITING, UNION
from ..layer import Part, Structure, slots
from ..paints import FLAT
from ..render.tensors import Group, SceneTensors
from ..units import COLOR, FALLOFF, OPACITY, SMOOTHNESS, Parameter, Placed
from .presets import Start

UNIFORM_SHARE = 0.35  # of the shapes goes anywhere, the rest where the picture changes
CANDIDATES = 8  # positions tried for each shape; the one farthest from the others, in their sizes, is taken
START_FALLOFF = 0.4  # of a shape's size
LARGEST_SIZE = 0.35  # size of a shape, for a canvas of area 1
START_OPACITY = 0.8  # of an opaque picture, where colours are not signed
HOLES = 0.02  # share of a picture that may have less alpha than its ground
FAINTEST_GROUND = 1 / 255  # of alpha
APART = 0.02  # by which equal layers are moved, in units of each number
START_SMOOTHNESS = 0.25  # of a smooth union, of the size of its layer


@dataclass(frozen=True)
class Layers:
    """What new layers are made of: any of these kinds in this paint, so many joined in each, under this compositing.

    `shares`: how much of the layers each kind gets, summing to 1; all the same without.
    """

    kinds: tuple[str, ...]
    compositing: str
    union: int = 1
    paint: str = FLAT
    shares: tuple[float, ...] = ()

    @property
    def structures(self) -> list[Structure]:
        """One for each kind."""
        more = self.union - 1
        return [
            (Part(kind, self.paint), *(Part(kind, self.paint, UNION) for _ in range(more)))
            for kind in self.kinds
        ]

    @property
    def signed(self) -> bool:
        """Whether colours are."""
        return COMPOSITING[self.compositing].signed


@dataclass(frozen=True, eq=False)
class Places:
    """Where and how large layers start: centres [N, 2] and sizes [N] in scene units, straight RGBA [N, 4]."""

    centers: torch.Tensor
    sizes: torch.Tensor
    colors: torch.Tensor

    def __len__(self) -> int:
        return len(self.sizes)

    def rows(self, index: torch.Tensor) -> Places:
        """Some of them."""
        return Places(self.centers[index], self.sizes[index], self.colors[index])


def place(
    target: torch.Tensor,
    size: tuple[float, float],
    layers: Layers,
    count: int,
    start: Start,
    generator: torch.Generator,
) -> SceneTensors:
    """Start values for `count` layers.

    `target` is premultiplied, [3 or 4, H, W]; `size` is the canvas in scene units. Large shapes come first in
    the draw order.
    """
    density = (
        detail(target) if start.spread == "detail" else torch.full(target.shape[1:], 1 / target[0].numel())
    )
    centers, sizes = _spread(density, size, count, generator)
    order = sizes.argsort(descending=True, stable=True)
    centers, sizes = centers[order], sizes[order]
    background = background_of(target)
    colors = colors_at(target, centers, size)
    if layers.signed:
        colors[:, :3] = 0.3 * (colors[:, :3] - background[:3]) if start.colors == "picture" else 0.0
    groups = groups_at(Places(centers, sizes, colors), layers, generator)
    if start.falloff is not None:
        for group in groups:
            group.falloff.fill_(start.falloff)
    return SceneTensors(groups, background, layers.compositing, size)


def groups_at(places: Places, layers: Layers, generator: torch.Generator, first: int = 0) -> list[Group]:
    """New layers at these places, one group for each kind; their draw order begins with `first`.

    Several kinds are dealt out at random, in their shares.
    """
    dealt = _deal(layers, len(places), generator)
    return [
        _group(structure, first + rows, places.rows(rows), layers, generator)
        for index, structure in enumerate(layers.structures)
        for rows in [(dealt == index).nonzero()[:, 0]]
    ]


def _deal(layers: Layers, count: int, generator: torch.Generator) -> torch.Tensor:
    """Which kind each of so many layers gets, [count]."""
    if not layers.shares:
        return torch.randint(len(layers.kinds), (count,), generator=generator)
    ends = torch.tensor(layers.shares).cumsum(0)[:-1]
    return torch.bucketize(torch.rand(count, generator=generator), ends, right=True)


def empty_groups(layers: Layers) -> list[Group]:
    """A group without layers for each kind."""
    nowhere = Places(torch.zeros(0, 2), torch.zeros(0), torch.zeros(0, 4))
    return groups_at(nowhere, layers, torch.Generator())


@torch.no_grad()
def tell_apart(tensors: SceneTensors, generator: torch.Generator) -> None:
    """Moves layers that are the same as another a little, in place: added up, descent would move all of them alike."""
    for group in tensors.groups:
        same = group.rows().unique(dim=0, return_inverse=True)[1] if len(group) > 1 else group.order
        twice = [index for index, which in enumerate(same.tolist()) if which in same[:index]]
        for tensor in group.values.values():
            moves = torch.randn(len(twice), tensor.shape[1], generator=generator) * APART
            tensor[twice] += moves.to(tensor)


def detail(target: torch.Tensor) -> torch.Tensor:
    """How much the picture changes at each pixel, [H, W], normalised to sum 1, with a share everywhere."""
    padded = torch.nn.functional.pad(target[None], (1, 1, 1, 1), mode="replicate")[0]
    across = padded[:, 1:-1, 2:] - padded[:, 1:-1, :-2]
    down = padded[:, 2:, 1:-1] - padded[:, :-2, 1:-1]
    change = (across.square() + down.square()).sum(dim=0).sqrt()
    uniform = torch.full_like(change, 1.0 / change.numel())
    total = change.sum()
    return uniform if total == 0 else UNIFORM_SHARE * uniform + (1 - UNIFORM_SHARE) * change / total


def _spread(
    density: torch.Tensor, size: tuple[float, float], count: int, generator: torch.Generator
) -> tuple[torch.Tensor, torch.Tensor]:
    """Centres [N, 2] drawn from a density over pixels, kept apart; and the size [N] that each has room for."""
    height, width = density.shape
    picked = torch.multinomial(density.flatten(), count * CANDIDATES, replacement=True, generator=generator)
    jitter = torch.rand((2, len(picked)), generator=generator)
    x = ((picked % width + jitter[0]) / width - 0.5) * size[0]
    y = ((picked // width + jitter[1]) / height - 0.5) * size[1]
    area = size[0] * size[1] / density.numel()
    room = (
        (area / (density.flatten()[picked] * count * math.pi))
        .sqrt()
        .clamp(max=LARGEST_SIZE * math.sqrt(size[0] * size[1]))
    )
    points = torch.stack([x, y], dim=1).reshape(count, CANDIDATES, 2)
    room = room.reshape(count, CANDIDATES)
    centers, sizes = points[:, 0].clone(), room[:, 0].clone()
    for i in range(1, count):
        apart = torch.cdist(points[i], centers[:i]) / (room[i][:, None] + sizes[:i])  # [CANDIDATES, i]
        best = int(apart.amin(dim=1).argmax())
        centers[i], sizes[i] = points[i, best], room[i, best]
    return centers, sizes


def background_of(target: torch.Tensor) -> torch.Tensor:
    """The mean colour of a picture, with the alpha that nearly all of it has; premultiplied RGBA.

    Nothing where the picture is transparent: what is laid over a ground can't take its alpha away.
    """
    mean = target.mean(dim=(1, 2))
    if len(target) == 3:
        return torch.cat([mean, torch.ones(1)])
    alpha = target[3].flatten().sort().values[int(HOLES * target[3].numel())]
    return torch.zeros(4) if alpha < FAINTEST_GROUND else mean * (alpha / mean[3])


def colors_at(target: torch.Tensor, centers: torch.Tensor, size: tuple[float, float]) -> torch.Tensor:
    """Straight RGBA of a premultiplied picture [C, H, W] at points [N, 2] in scene units, [N, 4]."""
    height, width = target.shape[1:]
    column = ((centers[:, 0] / size[0] + 0.5) * width).long().clamp(0, width - 1)
    row = ((centers[:, 1] / size[1] + 0.5) * height).long().clamp(0, height - 1)
    return straight(target[:, row, column].T)


def straight(premultiplied: torch.Tensor) -> torch.Tensor:
    """Straight RGBA [N, 4] of premultiplied RGB or RGBA [N, 3 or 4]."""
    if premultiplied.shape[1] == 3:
        return torch.cat([premultiplied, torch.ones(len(premultiplied), 1)], dim=1).clamp(0.0, 1.0)
    alpha = premultiplied[:, 3:]
    return torch.cat([premultiplied[:, :3] / alpha.clamp(min=1e-3), alpha], dim=1).clamp(0.0, 1.0)


def _group(
    structure: Structure, order: torch.Tensor, places: Places, layers: Layers, generator: torch.Generator
) -> Group:
    """Layers of one structure; the shapes of a union lie around its centre, each smaller than the whole."""
    turns = torch.rand((len(places), layers.union), generator=generator) * 2 * math.pi
    around = 2 * math.pi * torch.arange(layers.union) / layers.union + turns[:, :1]
    away = 0.0 if layers.union == 1 else 0.6 * places.sizes[:, None]
    centers = places.centers[:, None] + torch.stack([around.cos() * away, around.sin() * away], dim=2)
    sizes = (places.sizes / math.sqrt(layers.union))[:, None].expand(-1, layers.union)
    placed = [Placed(centers[:, i], sizes[:, i], turns[:, i]) for i in range(layers.union)]
    looks = {
        OPACITY.name: places.colors[:, 3:] * (1.0 if layers.signed else START_OPACITY),
        FALLOFF.name: places.sizes[:, None] * START_FALLOFF,
        SMOOTHNESS.name: places.sizes[:, None] * START_SMOOTHNESS,
        COLOR.name: places.colors[:, :3],
    }
    values = {slot: start_of(slot.parameter, placed[slot.part or 0], looks) for slot in slots(structure)}
    return Group(structure, order, values)


def start_of(parameter: Parameter, placed: Placed, looks: Mapping[str, torch.Tensor]) -> torch.Tensor:
    """Where a parameter starts [N, width]: by its unit, or in `looks` by the unit's name."""
    unit = parameter.unit
    return looks[unit.name].clone() if unit.start is None else unit.start(parameter.start, placed)

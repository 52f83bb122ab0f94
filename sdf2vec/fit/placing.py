"""Where the shapes of a fit start: denser and smaller where the picture has detail."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import torch

from ..render.tensors import Group, SceneTensors
from ..shapes import KINDS, Kind

UNIFORM_SHARE = 0.35  # of the shapes goes anywhere, the rest where the picture changes
CANDIDATES = 8  # positions tried for each shape; the one farthest from the others, in their sizes, is taken
FALLOFF = 0.4  # of a shape's size
LARGEST = 0.35  # size of a shape, for a canvas of area 1


def place(
    target: torch.Tensor,
    size: tuple[float, float],
    kinds: Sequence[str],
    count: int,
    compositing: str,
    generator: torch.Generator,
) -> SceneTensors:
    """Start values for `count` shapes.

    `target` is premultiplied, [3 or 4, H, W]; `size` is the canvas in scene units. Large shapes come first in
    the draw order.
    """
    centers, sizes = _spread(detail(target), size, count, generator)
    order = sizes.argsort(descending=True, stable=True)
    centers, sizes = centers[order], sizes[order]
    background = _background(target)
    colors = _colors(target, centers, size)
    assigned = torch.randint(len(kinds), (count,), generator=generator)
    groups = [
        _group(KINDS[kind], rows, centers[rows], sizes[rows], colors[:, rows], compositing, generator)
        for index, kind in enumerate(kinds)
        if len(rows := (assigned == index).nonzero()[:, 0])
    ]
    if compositing == "additive":
        for group in groups:
            group.colors = 0.3 * (group.colors - background[:3])
    return SceneTensors(groups, background, compositing, size)


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
        .clamp(max=LARGEST * math.sqrt(size[0] * size[1]))
    )
    points = torch.stack([x, y], dim=1).reshape(count, CANDIDATES, 2)
    room = room.reshape(count, CANDIDATES)
    centers, sizes = points[:, 0].clone(), room[:, 0].clone()
    for i in range(1, count):
        apart = torch.cdist(points[i], centers[:i]) / (room[i][:, None] + sizes[:i])  # [CANDIDATES, i]
        best = int(apart.amin(dim=1).argmax())
        centers[i], sizes[i] = points[i, best], room[i, best]
    return centers, sizes


def _background(target: torch.Tensor) -> torch.Tensor:
    if len(target) == 4:
        return torch.zeros(4)
    return torch.cat([target.mean(dim=(1, 2)), torch.ones(1)])


def _colors(target: torch.Tensor, centers: torch.Tensor, size: tuple[float, float]) -> torch.Tensor:
    """RGB and alpha of the picture at the centres, straight, [4, N]."""
    height, width = target.shape[1:]
    column = ((centers[:, 0] / size[0] + 0.5) * width).long().clamp(0, width - 1)
    row = ((centers[:, 1] / size[1] + 0.5) * height).long().clamp(0, height - 1)
    found = target[:, row, column]
    alpha = found[3] if len(found) == 4 else torch.ones(len(centers))
    return torch.cat([found[:3] / alpha.clamp(min=1e-3), alpha[None]]).clamp(0.0, 1.0)


def _group(
    kind: Kind,
    order: torch.Tensor,
    centers: torch.Tensor,
    sizes: torch.Tensor,
    colors: torch.Tensor,
    compositing: str,
    generator: torch.Generator,
) -> Group:
    turns = torch.rand(len(order), generator=generator) * 2 * math.pi
    parameters = {
        parameter.name: _START[parameter.unit](torch.tensor(parameter.start), centers, sizes, turns)[:, None]
        for parameter in kind.parameters
    }
    opacity = colors[3] * 0.8 if compositing == "over" else colors[3]
    return Group(
        kind.name,
        order,
        parameters,
        colors[:3].T[:, None].clone(),
        sizes * FALLOFF,
        opacity,
        torch.zeros(len(order)),
    )


def _start_position(
    start: torch.Tensor, centers: torch.Tensor, sizes: torch.Tensor, turns: torch.Tensor
) -> torch.Tensor:
    cosine, sine = turns.cos(), turns.sin()
    offset = torch.stack([cosine * start[0] - sine * start[1], sine * start[0] + cosine * start[1]], dim=1)
    return centers + offset * sizes[:, None]


_START: dict[str, Callable[[torch.Tensor, torch.Tensor, torch.Tensor, torch.Tensor], torch.Tensor]] = {
    "position": _start_position,
    "length": lambda start, centers, sizes, turns: start * sizes[:, None],
    "angle": lambda start, centers, sizes, turns: start + turns[:, None],
    "frequency": lambda start, centers, sizes, turns: start / sizes[:, None],
}

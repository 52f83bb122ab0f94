"""The dense renderer in blocks of pixels, each with the layers that touch it only: for devices without kernels.

The same function as `reference`, on any device and in any dtype.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import torch
from torch.utils.checkpoint import checkpoint

from ..layer import Formula, Structure
from ..lower.torch import Tensors, compile_torch
from .fused import uniform_rows
from .reference import canvas, composite_points
from .tensors import Group, SceneTensors

BLOCK = 64  # pixels along a side


def composite(tensors: SceneTensors, width: int, height: int, channels: int = 4) -> torch.Tensor:
    """Premultiplied RGBA (or RGB, for 3 channels) before clamping, [channels, height, width].

    Differentiable in every tensor of the scene.
    """
    x, y, pixel = canvas(tensors, width, height)
    x, y = x.reshape(height, width), y.reshape(height, width)
    boxes = [_boxes(group, float(pixel)) for group in tensors.groups]
    bands = [
        torch.cat(
            [_block(tensors, boxes, *pair, pixel)[:channels] for pair in _across(x_band, y_band)], dim=2
        )
        for x_band, y_band in zip(x.split(BLOCK), y.split(BLOCK), strict=True)
    ]
    return torch.cat(bands, dim=1)


def _across(x: torch.Tensor, y: torch.Tensor) -> list[tuple[torch.Tensor, torch.Tensor]]:
    return list(zip(x.split(BLOCK, dim=1), y.split(BLOCK, dim=1), strict=True))


def _block(
    tensors: SceneTensors, boxes: list[torch.Tensor], x: torch.Tensor, y: torch.Tensor, pixel: torch.Tensor
) -> torch.Tensor:
    """One block of the canvas, [4, h, w]. `boxes`: for each group, on the CPU, [G, 4]."""
    edges = x[0, 0].item(), y[0, 0].item(), x[-1, -1].item(), y[-1, -1].item()
    touching = [_touching(box, *edges).to(x.device) for box in boxes]
    groups = [
        group.each(lambda tensor, rows=rows: tensor[rows])  # type: ignore[misc]
        for group, rows in zip(tensors.groups, touching, strict=True)
        if len(rows)
    ]
    part = SceneTensors(groups, tensors.background, tensors.compositing, tensors.size)
    points = (part, x.flatten(), y.flatten(), pixel)
    if torch.is_grad_enabled():
        image: torch.Tensor = checkpoint(composite_points, *points, use_reentrant=False)
    else:
        image = composite_points(*points)
    return image.reshape(4, *x.shape)


def _touching(box: torch.Tensor, left: float, top: float, right: float, bottom: float) -> torch.Tensor:
    """Rows of the layers whose box meets a block."""
    across = (box[:, 0] <= right) & (box[:, 2] >= left)
    return (across & (box[:, 1] <= bottom) & (box[:, 3] >= top)).nonzero()[:, 0]


@torch.no_grad()
def _boxes(group: Group, pixel: float) -> torch.Tensor:
    """The boxes outside of which a group's layers cover nothing, [G, 4], on the CPU."""
    low_x, low_y, high_x, high_y, *_ = _bounds(group.structure)(*uniform_rows(group, pixel).unbind(1))
    return torch.stack([low_x, low_y, high_x, high_y], dim=1).cpu()


@cache
def _bounds(structure: Structure) -> Callable[..., Tensors]:
    formula = Formula.of(structure)
    return compile_torch(formula.bounds(), formula.uniforms)

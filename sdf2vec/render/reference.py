"""The reference renderer: every shape at every pixel, in plain torch, any dtype, any device.

Slow and simple: it is what everything else is compared with. Memory stays bounded: pixels go in chunks, and
with gradients each chunk is recomputed in the backward pass.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, lru_cache

import numpy as np
import torch
from torch.utils.checkpoint import checkpoint

from ..blend import COMPOSITING, display, pixel_size, scene_point
from ..expr import var
from ..graph import components_of, scalarize
from ..layer import Formula, P, Structure
from ..lower.torch import Tensors, compile_torch
from ..operation import VEC2, VEC3, VEC4
from ..scene import Scene
from .tensors import Group, SceneTensors, from_scene

DISPLAYED = 1 << 22  # numbers that are clamped at a time
CHUNK = 1 << 22  # layers × pixels held at a time


def render(
    scene: Scene,
    width: int | None = None,
    height: int | None = None,
    dtype: torch.dtype = torch.float32,
    device: str = "cpu",
) -> torch.Tensor:
    """The scene as a screen shows it: premultiplied RGBA, [4, height, width], 0..1.

    Without a size, at the scene's own. On a canvas of another shape the scene is fitted inside, centred, and
    what lies beyond its edges shows.
    """
    with torch.no_grad():
        tensors = from_scene(scene, dtype, device)
        image = composite(tensors, width or scene.width, height or scene.height)
        return displayed(image)


def displayed(image: torch.Tensor) -> torch.Tensor:
    """What a screen shows of premultiplied RGBA [4, H, W]: clamped. In parts, for a large picture takes much memory."""
    parts, shown = max(1, image.numel() // DISPLAYED), torch.empty_like(image)
    for part, of in zip(shown.chunk(parts, 1), image.chunk(parts, 1), strict=True):
        part.copy_(torch.stack(_display()(*of)))
    return shown


def composite(tensors: SceneTensors, width: int, height: int) -> torch.Tensor:
    """Premultiplied RGBA before clamping, [4, height, width], differentiable in every tensor of the scene."""
    x, y, pixel = canvas(tensors, width, height)
    step = max(1, CHUNK // max(1, tensors.layer_count))
    chunks = list(zip(x.split(step), y.split(step), strict=True))
    if torch.is_grad_enabled() and len(chunks) > 1:
        parts = [
            checkpoint(composite_points, tensors, *chunk, pixel, use_reentrant=False) for chunk in chunks
        ]
    else:
        parts = [composite_points(tensors, *chunk, pixel) for chunk in chunks]
    return torch.cat(parts, dim=1).reshape(4, height, width)


def canvas(tensors: SceneTensors, width: int, height: int) -> Tensors:
    """Scene coordinates x [P], y [P] of all pixel centres, row by row, and the size of a pixel []."""
    like = tensors.background
    columns = torch.arange(width, dtype=like.dtype, device=like.device) + 0.5
    rows = torch.arange(height, dtype=like.dtype, device=like.device) + 0.5
    y, x = torch.meshgrid(rows, columns, indexing="ij")
    sizes = [like.new_tensor(value) for value in (width, height, *tensors.size)]
    return _canvas()(x.flatten(), y.flatten(), *sizes)


@lru_cache(maxsize=8)
def canvas_axes(
    size: tuple[float, float], columns: int, rows: int, width: int, height: int
) -> tuple[np.ndarray, np.ndarray, np.float32]:
    """Scene coordinates x [columns], y [rows] of pixel centres, and the size of a pixel; float32.

    The canvas has this size in scene units, and width × height pixels; the axes may go on beyond its edges.
    """
    sizes = [torch.tensor(value, dtype=torch.float64) for value in (width, height, *size)]
    places = torch.arange(max(columns, rows), dtype=torch.float64) + 0.5
    x, y, pixel = _canvas()(places, places, *sizes)
    return x[:columns].numpy().astype(np.float32), y[:rows].numpy().astype(np.float32), np.float32(pixel)


def composite_points(
    tensors: SceneTensors, x: torch.Tensor, y: torch.Tensor, pixel: torch.Tensor
) -> torch.Tensor:
    """Premultiplied RGBA [4, P] before clamping, at points x [P], y [P], for a canvas with this size of pixel."""
    layers: dict[int, tuple[torch.Tensor, torch.Tensor, torch.Tensor]] = {}
    for group in tensors.groups:
        cover, color = group_coverage(group, tensors.compositing, x, y, pixel)
        layers |= zip(group.order.tolist(), zip(cover, color, group.opacity, strict=True), strict=True)
    image = tensors.background[:, None].expand(4, len(x))
    for index in sorted(layers):
        cover, color, opacity = layers[index]
        image = lay(tensors.compositing, image, color, opacity, cover)
    return image


def lay(
    compositing: str, below: torch.Tensor, color: torch.Tensor, opacity: torch.Tensor, cover: torch.Tensor
) -> torch.Tensor:
    """Layers, each on what is below it [4, P]: colours [..., 3, P or 1], opacities [..., P or 1], coverage [..., P].

    Of three channels the colours alone.
    """
    blend_color, blend_alpha = _blending(compositing)
    (rgb,) = blend_color(below[:3], color, opacity[..., None, :], cover[..., None, :])
    if len(below) == 3:
        return rgb
    (alpha,) = blend_alpha(below[3], opacity, cover)
    return torch.cat([rgb, alpha[..., None, :]], dim=-2)


def group_coverage(
    group: Group, compositing: str, x: torch.Tensor, y: torch.Tensor, pixel: torch.Tensor
) -> tuple[torch.Tensor, torch.Tensor]:
    """Coverage [G, P] and colour [G, 3, P or 1] of a group's layers at points x [P], y [P]."""
    return rows_coverage(group.structure, group.rows()[..., None], compositing, x, y, pixel)


def rows_coverage(
    structure: Structure,
    rows: torch.Tensor,
    compositing: str,
    x: torch.Tensor,
    y: torch.Tensor,
    pixel: torch.Tensor,
) -> tuple[torch.Tensor, torch.Tensor]:
    """The same from the layers' rows [G, U, 1], or from rows of their own for each point [G, U, P]."""
    cover, *color = _layer(structure, compositing)(x, y, pixel, *rows.unbind(1))
    return cover, torch.stack(color, dim=1)


@torch.no_grad()
def layers_at(
    tensors: SceneTensors, x: torch.Tensor, y: torch.Tensor, pixel: torch.Tensor
) -> tuple[torch.Tensor, torch.Tensor]:
    """Coverage [L, P] and colour [L, 3, P or 1] of a scene's layers, in draw order, at points x [P], y [P]."""
    order = torch.cat([group.order for group in tensors.groups]).argsort()
    covers, colors = zip(
        *(group_coverage(group, tensors.compositing, x, y, pixel) for group in tensors.groups), strict=True
    )
    widest = max(color.shape[2] for color in colors)
    return torch.cat(covers)[order], torch.cat([color.expand(-1, -1, widest) for color in colors])[order]


# --- lowered formulas --------------------------------------------------------------------------------------


@cache
def _layer(structure: Structure, compositing: str) -> Callable[..., Tensors]:
    """Coverage and colour of a layer."""
    formula = Formula.of(structure)
    return compile_torch([formula.cover(compositing), formula.color], [*components_of(P), *formula.uniforms])


@cache
def _blending(compositing: str) -> tuple[Callable[..., Tensors], Callable[..., Tensors]]:
    """One colour channel, and alpha, of laying a layer on what is below."""
    below, color, opacity, cover = var("below", VEC4), var("color", VEC3), var("opacity"), var("cover")
    red, _, _, alpha = scalarize(COMPOSITING[compositing].draw(below, color, opacity, cover))
    below_red, *_, below_alpha = components_of(below)
    return (
        compile_torch([red], [below_red, components_of(color)[0], opacity, cover]),
        compile_torch([alpha], [below_alpha, opacity, cover]),
    )


@cache
def _display() -> Callable[..., Tensors]:
    color = var("color", VEC4)
    return compile_torch([display(color)], components_of(color))


@cache
def _canvas() -> Callable[..., Tensors]:
    pixel, resolution, size = var("pixel", VEC2), var("resolution", VEC2), var("size", VEC2)
    inputs = [*components_of(pixel), *components_of(resolution), *components_of(size)]
    return compile_torch([scene_point(pixel, resolution, size), pixel_size(resolution, size)], inputs)

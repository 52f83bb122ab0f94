"""Draws a scene with the renderer that suits its size: the reference, or the fused one for large jobs."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np
import torch

from ..arrays import Float32Array
from ..image import fitted_size, unpremultiply
from ..scene import Scene
from ..threads import threads_of_its_own
from . import fused, reference
from .tensors import SceneTensors, from_scene

LARGE = 1 << 25  # layers × pixels from which compiling kernels pays for what is drawn once
# shapes × pixels, with derivatives, while kernels compile: for a sort of layers, and each shape in it
PART = 1 << 22
GLANCE = 256  # shortest side, in pixels, at most
GLANCES = 16  # of a scene, about, while its numbers are rounded


def draw(scene: Scene, width: int | None = None, height: int | None = None) -> torch.Tensor:
    """The scene as a screen shows it: premultiplied RGBA, [4, height, width], 0..1, float32.

    The same numbers every time: what has been compiled before does not count.
    """
    width, height = width or scene.width, height or scene.height
    if is_large(scene, width, height):
        return _drawn_fused(from_scene(scene), width, height)
    return reference.render(scene, width, height)


def pixels_of(scene: Scene, width: int | None = None, height: int | None = None) -> Float32Array:
    """The scene as an array [height, width, 3], or [.., 4] with straight alpha when it is transparent; 0..1."""
    pixels: Float32Array = draw(scene, width, height).permute(1, 2, 0).numpy()
    return np.ascontiguousarray(pixels[..., :3]) if scene.opaque else unpremultiply(pixels)


def is_large(scene: Scene, width: int, height: int) -> bool:
    """Whether the reference would take long, so that compiling kernels pays."""
    return len(scene.layers) * width * height >= LARGE


Compose = Callable[[SceneTensors, int, int], torch.Tensor]


def composer(tensors: SceneTensors, width: int, height: int, channels: int, times: int) -> Compose:
    """What draws a scene so often, and its derivatives: premultiplied, before clamping, [channels, H, W]."""
    shapes = sum(len(group) * len(group.structure) for group in tensors.groups)
    compiling = PART * sum(1 + len(group.structure) for group in tensors.groups)
    if shapes * width * height * times < compiling:
        return lambda tensors, width, height: reference.composite(tensors, width, height)[:channels]
    return partial(fused.composite, channels=channels)


def glance(scene: Scene) -> Float32Array:
    """The scene on a small canvas, before clamping, [3 or 4, H, W]: what roundings of it are compared with."""
    tensors, size = (
        from_scene(scene),
        fitted_size(scene.width, scene.height, min(GLANCE, scene.width, scene.height)),
    )
    channels = 3 if scene.opaque else 4
    with torch.no_grad(), threads_of_its_own():
        pixels: Float32Array = composer(tensors, *size, channels, GLANCES)(tensors, *size).numpy()
    return pixels


def draw_fast(scene: Scene, width: int, height: int) -> torch.Tensor:
    """The same, by the kernels that a fit has left where there are any; then digits differ beyond the sixth."""
    tensors = from_scene(scene)
    if fused.is_compiled(tensors, 3 if _is_opaque(tensors) else 4):
        return _drawn_fused(tensors, width, height)
    return draw(scene, width, height)


@torch.no_grad()
def _drawn_fused(tensors: SceneTensors, width: int, height: int) -> torch.Tensor:
    return reference.displayed(_composite(tensors, width, height))


def _is_opaque(tensors: SceneTensors) -> bool:
    """Over an opaque background the picture is opaque: the kernels of a fit, of 3 channels, are enough."""
    return tensors.opaque and tensors.compositing == "over"


def _composite(tensors: SceneTensors, width: int, height: int) -> torch.Tensor:
    if not _is_opaque(tensors):
        return fused.composite(tensors, width, height)
    color = fused.composite(tensors, width, height, 3)
    return torch.cat([color, torch.ones_like(color[:1])])

"""Draws a scene with the renderer that suits its size: the reference, or the fused one for large jobs."""

from __future__ import annotations

import torch

from ..scene import Scene
from . import fused, reference
from .tensors import SceneTensors, from_scene

LARGE = 1 << 25  # layers × pixels from which compiling kernels pays


def draw(scene: Scene, width: int | None = None, height: int | None = None) -> torch.Tensor:
    """The scene as a screen shows it: premultiplied RGBA, [4, height, width], 0..1, float32."""
    width, height = width or scene.width, height or scene.height
    if len(scene.layers) * width * height < LARGE:
        return reference.render(scene, width, height)
    with torch.no_grad():
        return reference.displayed(_composite(from_scene(scene), width, height))


def _composite(tensors: SceneTensors, width: int, height: int) -> torch.Tensor:
    """Over an opaque background the picture is opaque: the kernels of a fit, of 3 channels, are enough."""
    if tensors.transparent or tensors.compositing != "over":
        return fused.composite(tensors, width, height)
    color = fused.composite(tensors, width, height, 3)
    return torch.cat([color, torch.ones_like(color[:1])])

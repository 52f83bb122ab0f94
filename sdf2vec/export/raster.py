"""The torch render as a PNG."""

from __future__ import annotations

from ..image import encode_png, fitted_size, unpremultiply
from ..scene import Scene
from .options import Options


def png(scene: Scene, options: Options) -> bytes:
    """The scene rendered with its shortest side at `options.size` pixels; transparent scenes keep alpha."""
    from ..render.reference import render

    width, height = scene.width, scene.height
    if options.size:
        width, height = fitted_size(width, height, options.size)
    pixels = render(scene, width, height).permute(1, 2, 0).numpy()
    return encode_png(pixels[..., :3] if scene.background else unpremultiply(pixels))

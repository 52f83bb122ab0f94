"""The torch render as a PNG."""

from __future__ import annotations

from ..errors import Sdf2vecError
from ..image import MAX_PIXELS, encode_png, fitted_size, unpremultiply
from ..scene import Scene
from .options import Options


def png(scene: Scene, options: Options) -> bytes:
    """The scene rendered with its shortest side at `options.size` pixels; transparent scenes keep alpha.

    Raises Sdf2vecError for more than MAX_PIXELS pixels.
    """
    from ..render.draw import draw

    width, height = scene.width, scene.height
    if options.size:
        width, height = fitted_size(width, height, options.size)
    if width * height > MAX_PIXELS:
        limit = MAX_PIXELS // 10**6
        raise Sdf2vecError(
            f"png: {width} x {height} is more than {limit} megapixels; choose a smaller --size"
        )
    pixels = draw(scene, width, height).permute(1, 2, 0).numpy()
    return encode_png(pixels[..., :3] if scene.background else unpremultiply(pixels))

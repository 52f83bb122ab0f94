"""The torch render as a PNG, and the scene file."""

from __future__ import annotations

from ..errors import Sdf2vecError
from ..image import MAX_PIXELS, encode_png, fitted_size
from ..render.draw import pixels_of
from ..scene import Scene
from ..scene_file import dumps
from .exported import Exported
from .options import Options


def png(scene: Scene, options: Options) -> Exported:
    """The scene rendered with its shortest side at `options.size` pixels; transparent scenes keep alpha.

    Raises Sdf2vecError for more than MAX_PIXELS pixels.
    """
    width, height = scene.width, scene.height
    if options.size:
        width, height = fitted_size(width, height, options.size)
    if width * height > MAX_PIXELS:
        limit = MAX_PIXELS // 10**6
        raise Sdf2vecError(
            f"png: {width} x {height} is more than {limit} megapixels; choose a smaller --size"
        )
    return Exported(encode_png(pixels_of(scene, width, height)))


def json(scene: Scene, options: Options) -> Exported:
    """The scene file."""
    return Exported(dumps(scene))

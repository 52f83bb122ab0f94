"""The torch render as a PNG, and the scene file."""

from __future__ import annotations

from ..errors import Sdf2vecError
from ..image import encode_png, fitted_size
from ..limits import PIXELS
from ..render.draw import pixels_of
from ..scene import Scene
from ..scene_file import dumps
from .exported import Exported
from .options import Options


def png(scene: Scene, options: Options) -> Exported:
    """The scene rendered with its shortest side at `options.size` pixels; transparent scenes keep alpha.

    Raises Sdf2vecError for more than `limits.PIXELS`.
    """
    width, height = scene.width, scene.height
    if options.size:
        width, height = fitted_size(width, height, options.size)
    if width * height > PIXELS.most:
        limit, advice = PIXELS.number, PIXELS.advice(width * height)
        raise Sdf2vecError(
            f"png: {width} x {height} is more than {limit} megapixels; choose a smaller --size, {advice}"
        )
    return Exported(encode_png(pixels_of(scene, width, height)))


def json(scene: Scene, options: Options) -> Exported:
    """The scene file."""
    return Exported(dumps(scene))

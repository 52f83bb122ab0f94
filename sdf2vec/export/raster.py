"""The render as a picture file, and the scene file."""

from __future__ import annotations

import math

from ..arrays import Float32Array
from ..errors import Sdf2vecError
from ..image import encode, fitted_size
from ..limits import PIXELS
from ..render.draw import pixels_of
from ..scene import Scene
from ..scene_file import dumps
from .exported import MARK, Exported
from .options import Options

MAX_WEBP, MAX_JPEG = 16383, 65500  # pixels along a side that the formats can say


def png(scene: Scene, options: Options) -> Exported:
    """As PNG; transparent scenes keep alpha. Raises Sdf2vecError for too many pixels."""
    return Exported(encode(_rendered(scene, options, "png"), "PNG", MARK))


def webp(scene: Scene, options: Options) -> Exported:
    """As WebP; transparent scenes keep alpha. Raises Sdf2vecError for too many pixels."""
    return Exported(encode(_rendered(scene, options, "webp", MAX_WEBP), "WEBP", MARK))


def jpg(scene: Scene, options: Options) -> Exported:
    """As JPEG; transparent scenes lie on white. Raises Sdf2vecError for too many pixels."""
    pixels = _rendered(scene, options, "jpg", MAX_JPEG)
    if scene.opaque:
        return Exported(encode(pixels, "JPEG", MARK))
    opaque = 1.0 - pixels[..., 3:] * (1.0 - pixels[..., :3])
    return Exported(encode(opaque, "JPEG", MARK), notes=("jpg: has no transparency: on white",))


def _rendered(scene: Scene, options: Options, name: str, longest: float = math.inf) -> Float32Array:
    """The scene with its shortest side at `options.size` pixels, at most `limits.PIXELS` in all."""
    width, height = scene.width, scene.height
    if options.size:
        width, height = fitted_size(width, height, options.size)
    too_large, smaller = f"{name}: {width} x {height} is more than", "choose a smaller --size"
    if max(width, height) > longest:
        raise Sdf2vecError(f"{too_large} {longest} pixels along a side; {smaller}")
    if width * height > PIXELS.most:
        raise Sdf2vecError(
            f"{too_large} {PIXELS.number} megapixels; {smaller}, {PIXELS.advice(width * height)}"
        )
    return pixels_of(scene, width, height)


def json(scene: Scene, options: Options) -> Exported:
    """The scene file."""
    return Exported(dumps(scene))

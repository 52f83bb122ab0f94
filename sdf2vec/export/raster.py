"""The render as a picture file, and the scene file."""

from __future__ import annotations

import math

from ..arrays import Float32Array
from ..errors import Sdf2vecError
from ..image import MAX_PIXELS, encode, fitted_size
from ..render.draw import pixels_of
from ..scene import Scene
from ..scene_file import dumps
from .exported import MARK, Exported
from .options import Options

MAX_WEBP, MAX_JPEG = 16383, 65500  # pixels along a side that the formats can say


def png(scene: Scene, options: Options) -> Exported:
    """As PNG; transparent scenes keep alpha. Raises Sdf2vecError for too many pixels."""
    return Exported(encode(_rendered(scene, options), "PNG", MARK))


def webp(scene: Scene, options: Options) -> Exported:
    """As WebP; transparent scenes keep alpha. Raises Sdf2vecError for too many pixels."""
    return Exported(encode(_rendered(scene, options, MAX_WEBP), "WEBP", MARK))


def jpg(scene: Scene, options: Options) -> Exported:
    """As JPEG; transparent scenes lie on white. Raises Sdf2vecError for too many pixels."""
    pixels = _rendered(scene, options, MAX_JPEG)
    if scene.background is not None:
        return Exported(encode(pixels, "JPEG", MARK))
    opaque = 1.0 - pixels[..., 3:] * (1.0 - pixels[..., :3])
    return Exported(encode(opaque, "JPEG", MARK), notes=("jpg: has no transparency: on white",))


def _rendered(scene: Scene, options: Options, longest: float = math.inf) -> Float32Array:
    """The scene with its shortest side at `options.size` pixels."""
    width, height = scene.width, scene.height
    if options.size:
        width, height = fitted_size(width, height, options.size)
    limit = f"{MAX_PIXELS // 10**6} megapixels" if width * height > MAX_PIXELS else ""
    limit = f"{longest} pixels along a side" if max(width, height) > longest else limit
    if limit:
        raise Sdf2vecError(f"{width} x {height} is more than {limit}; choose a smaller --size")
    return pixels_of(scene, width, height)


def json(scene: Scene, options: Options) -> Exported:
    """The scene file."""
    return Exported(dumps(scene))

"""The public functions, in the words of the command line. Torch is imported when first needed."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .export import EXPORTERS
from .export import export as _export
from .export.options import Options
from .fit.settings import check_choice, settings_of
from .image import Picture, premultiply, unpremultiply
from .image import load as _load_picture
from .scene import Scene

if TYPE_CHECKING:
    from .fit.loop import Progress
    from .roundtrip import Check, Size

FLIP_RESOLUTION = 1000  # FLIP takes long: pictures of more pixels than the square are scaled down for it


def fit(
    image: Any,
    shapes: int | None = None,
    *,
    callback: Callable[[Progress], bool] | None = None,
    **options: Any,
) -> Scene:
    """Fits `shapes` shapes to a picture: 256, or as many as the start scene has, unless told.

    `image`: a path, bytes, a file object, a PIL image or an array [H, W], [H, W, 3] or [H, W, 4] (sRGB-coded;
    integers, or floats 0..1). `callback` is called with the progress after every step and ends the fit by returning
    True. The same arguments give the same scene. Options:

    `kind` ("triangle"): a name in `sdf2vec.KINDS`, several, or "mixed" for all. `union` (1): how many shapes are
    joined smoothly in each layer. `compositing`: "over" or "additive". `preset` ("balanced"): also "fast", "best" or
    "thesis". `loss`: "l1", "mse", "ssim" or "flip", a mixture like "l1:0.8,ssim:0.2", or pairs of name and weight;
    None leaves it to the preset. `seed` (0). `device` ("auto"): also "cpu", "cuda" or "mps". `weights`: a picture
    that is bright where errors matter. `start`: a scene, or its file, to go on from. `palette`: the only colours
    there may be, "#123,#a0b1c2" or tuples 0..1. `colors`: how many there may be. `min_area`: the least area of a
    shape, a share of the canvas. `max_falloff`: the softest an edge may be, a share of the shortest side; 0 for sharp
    shapes. `trials` (0): how often a few shapes are tried elsewhere at the end.

    Raises Sdf2vecError for anything that can't be fitted.
    """
    settings = settings_of(shapes, **options)
    picture = image if isinstance(image, Picture) else _load_picture(image)
    from .fit.loop import fit_picture

    return fit_picture(picture, settings, callback or (lambda progress: False))


def render(scene: Scene, width: int | None = None, height: int | None = None) -> NDArray[np.float32]:
    """The scene as an array [height, width, 3], or [.., 4] with straight alpha when it is transparent; 0..1."""
    from .render.draw import draw

    pixels: NDArray[np.float32] = draw(scene, width, height).permute(1, 2, 0).numpy()
    return np.ascontiguousarray(pixels[..., :3]) if scene.background else unpremultiply(pixels)


def export(scene: Scene, target: str, **options: Any) -> str | bytes:
    """The scene as text ("glsl", "shadertoy", "wgsl", "three", "godot", "svg", "data-uri", "html", "component",
    "json") or as bytes ("png", "pdf").

    Options: those of `sdf2vec.export.options.Options`, for example `size`, `layout`, `title`, `svg_profile`. Raises
    Sdf2vecError.
    """
    return _export(scene, target, Options(**options))


def check_export(scene: Scene, target: str, options: Options) -> None:
    """Raises Sdf2vecError for a target that can't hold a scene of this sort, before there is one."""
    _export(scene, target, replace(options, svg_size_limit=None))


def check(
    scene: Scene, targets: Iterable[str] | None = None, sizes: Sequence[Size] | None = None
) -> list[Check]:
    """Re-renders exports on the real engines present and compares them with the render; see `sdf2vec.roundtrip`."""
    from .roundtrip import check as run

    return run(scene, targets, sizes)


class Quality(NamedTuple):
    """How near a scene's render comes to a picture."""

    psnr: float  # dB
    flip: float
    flip_size: tuple[int, int]  # width and height in pixels at which FLIP was computed


def quality(scene: Scene, picture: Picture) -> Quality:
    """PSNR and mean FLIP of the scene's render against the picture, premultiplied.

    FLIP is that of both scaled down to about a million pixels, where they have more.
    """
    import torch

    from .fit.loop import scaled
    from .flip import flip
    from .metrics import psnr
    from .render.draw import draw_fast

    pixels = premultiply(picture.pixels) if picture.has_alpha else picture.pixels
    drawn = draw_fast(scene, picture.width, picture.height)[: pixels.shape[2]]
    target = torch.from_numpy(np.ascontiguousarray(pixels.transpose(2, 0, 1)))
    small = [scaled(planes.permute(1, 2, 0).numpy(), FLIP_RESOLUTION) for planes in (drawn, target)]
    height, width = small[0].shape[1:]
    return Quality(float(psnr(drawn, target)), float(flip(*small)), (width, height))


def check_targets(targets: Sequence[str]) -> None:
    """Raises Sdf2vecError for an unknown export target."""
    for target in targets:
        check_choice("target", target, tuple(EXPORTERS))

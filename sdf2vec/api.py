"""The public functions, in the words of the command line. Torch is imported when first needed."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .blend import COMPOSITING
from .errors import Sdf2vecError
from .export import EXPORTERS
from .export import export as _export
from .export.options import Options
from .fit.presets import DEFAULT, PRESETS, Loss
from .image import Picture, premultiply, unpremultiply
from .image import load as _load_picture
from .scene import MAX_SHAPES, Scene
from .shapes import KINDS

if TYPE_CHECKING:
    from .fit.loop import Progress
    from .roundtrip import Check, Size

MIXED = "mixed"
LOSS_NAMES = ("l1", "mse", "ssim", "flip")
DEVICES = ("auto", "cpu", "cuda", "mps")
FLIP_RESOLUTION = 1000  # FLIP takes long: pictures of more pixels than the square are scaled down for it


def fit(
    image: Any,
    shapes: int = 256,
    *,
    kind: str | Sequence[str] = "triangle",
    compositing: str = "over",
    preset: str = DEFAULT,
    loss: str | Sequence[tuple[str, float]] | None = None,
    seed: int = 0,
    device: str = "auto",
    callback: Callable[[Progress], bool] | None = None,
) -> Scene:
    """Fits `shapes` shapes to a picture.

    `image`: a path, bytes, a file object, a PIL image or an array [H, W], [H, W, 3] or [H, W, 4] (sRGB-coded;
    integers, or floats 0..1). `kind`: a name in `sdf2vec.KINDS`, several, or "mixed" for all. `compositing`:
    "over" or "additive". `loss`: "l1", "mse", "ssim" or "flip", a mixture like "l1:0.8,ssim:0.2", the same as pairs
    of name and weight; None leaves it to the preset. `device`: "auto", "cpu", "cuda" or "mps". `callback` is called
    with the progress after every step and ends the fit by returning True. The same arguments give the same scene.
    Raises Sdf2vecError for anything that can't be fitted.
    """
    kinds = check_settings(shapes, kind, compositing, preset, loss, seed)
    _check_choice("device", device, DEVICES)
    picture = image if isinstance(image, Picture) else _load_picture(image)
    from .fit.loop import Settings, fit_picture

    settings = Settings(int(shapes), kinds, compositing, preset, losses_of(loss), int(seed), device)
    return fit_picture(picture, settings, callback or (lambda progress: False))


def render(scene: Scene, width: int | None = None, height: int | None = None) -> NDArray[np.float32]:
    """The scene as an array [height, width, 3], or [.., 4] with straight alpha when it is transparent; 0..1."""
    from .render.draw import draw

    pixels: NDArray[np.float32] = draw(scene, width, height).permute(1, 2, 0).numpy()
    return np.ascontiguousarray(pixels[..., :3]) if scene.background else unpremultiply(pixels)


def export(scene: Scene, target: str, **options: Any) -> str | bytes:
    """The scene as "glsl", "shadertoy", "wgsl", "svg", "data-uri", "json" (text), "png" or "pdf" (bytes).

    Options: `size`, `glsl`, `layout`, `title`, `svg_profile`, `svg_size_limit`, as in
    `sdf2vec.export.options.Options`. Raises Sdf2vecError.
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
    from .render.draw import draw

    pixels = premultiply(picture.pixels) if picture.has_alpha else picture.pixels
    drawn = draw(scene, picture.width, picture.height)[: pixels.shape[2]]
    target = torch.from_numpy(np.ascontiguousarray(pixels.transpose(2, 0, 1)))
    small = [scaled(planes.permute(1, 2, 0).numpy(), FLIP_RESOLUTION) for planes in (drawn, target)]
    height, width = small[0].shape[1:]
    return Quality(float(psnr(drawn, target)), float(flip(*small)), (width, height))


def check_settings(
    shapes: int,
    kind: str | Sequence[str],
    compositing: str,
    preset: str,
    loss: str | Sequence[tuple[str, float]] | None,
    seed: int,
) -> tuple[str, ...]:
    """The kinds of shape by name. Raises Sdf2vecError for the first setting that `fit` can't take."""
    kinds = kinds_of(kind)
    _check_choice("compositing", compositing, tuple(COMPOSITING))
    _check_choice("preset", preset, tuple(PRESETS))
    losses_of(loss)
    _check_whole("number of shapes", shapes, 1, MAX_SHAPES)
    _check_whole("seed", seed, 0, 2**63 - 1)
    return kinds


def kinds_of(kind: str | Sequence[str]) -> tuple[str, ...]:
    """Names of kinds from one name, several, or "mixed". Raises Sdf2vecError for an unknown one."""
    names = [kind] if isinstance(kind, str) else list(kind)
    for name in names:
        _check_choice("kind", name, (*KINDS, MIXED))
    if not names:
        raise Sdf2vecError("at least one kind of shape is needed")
    return tuple(KINDS) if MIXED in names else tuple(dict.fromkeys(names))


def losses_of(loss: str | Sequence[tuple[str, float]] | None) -> Loss | None:
    """Names and weights from a text like "l1:0.8,ssim:0.2", or from pairs; None stays None.

    A name without a weight has the weight 1. Raises Sdf2vecError for what is no loss, and for a loss given twice.
    """
    if loss is None:
        return None
    terms = tuple(map(_term, loss.split(",") if isinstance(loss, str) else loss))
    names = [name for name, _ in terms]
    if not names:
        raise Sdf2vecError(f"at least one loss is needed: {', '.join(LOSS_NAMES)}")
    for name in names:
        if names.count(name) > 1:
            raise Sdf2vecError(f"loss {name!r} is given twice")
    return terms


def _term(part: str | tuple[str, float]) -> tuple[str, float]:
    try:
        name, weight = _name_and_weight(part) if isinstance(part, str) else part
        weight = float(weight)
    except (TypeError, ValueError):
        raise Sdf2vecError(f"a loss is given as name or name:weight, got {part!r}") from None
    _check_choice("loss", name, LOSS_NAMES)
    if not 0 < weight < math.inf:
        raise Sdf2vecError(f"the weight of loss {name!r} must be positive and finite, got {weight:g}")
    return name, weight


def _name_and_weight(text: str) -> tuple[str, str]:
    name, colon, weight = text.partition(":")
    return name.strip(), weight if colon else "1"


def check_targets(targets: Sequence[str]) -> None:
    """Raises Sdf2vecError for an unknown export target."""
    for target in targets:
        _check_choice("target", target, tuple(EXPORTERS))


def _check_whole(what: str, value: Any, low: int, high: int) -> None:
    if isinstance(value, bool) or not hasattr(value, "__index__") or not low <= value <= high:
        raise Sdf2vecError(f"the {what} must be a whole number between {low} and {high}, got {value}")


def _check_choice(what: str, value: str, known: Sequence[str]) -> None:
    if value not in known:
        raise Sdf2vecError(f"unknown {what} {value!r}; choose from {', '.join(known)}")

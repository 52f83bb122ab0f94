"""The public functions, in the words of the command line. Torch is imported when first needed."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from .blend import COMPOSITING
from .errors import Sdf2vecError
from .export import EXPORTERS
from .export import export as _export
from .export.options import Options
from .fit.presets import DEFAULT, PRESETS
from .image import Picture, premultiply, unpremultiply
from .image import load as _load_picture
from .scene import MAX_SHAPES, Scene
from .shapes import KINDS

if TYPE_CHECKING:
    from .fit.loop import Progress
    from .roundtrip import Check, Size

MIXED = "mixed"
LOSS_NAMES = ("l1", "mse", "ssim")
DEVICES = ("auto", "cpu", "cuda", "mps")


def fit(
    image: Any,
    shapes: int = 256,
    *,
    kind: str | Sequence[str] = "triangle",
    compositing: str = "over",
    preset: str = DEFAULT,
    loss: str | None = None,
    seed: int = 0,
    device: str = "auto",
    callback: Callable[[Progress], bool] | None = None,
) -> Scene:
    """Fits `shapes` shapes to a picture.

    `image`: a path, bytes, a file object, a PIL image or an array [H, W], [H, W, 3] or [H, W, 4] (sRGB-coded;
    integers, or floats 0..1). `kind`: a name in `sdf2vec.KINDS`, several, or "mixed" for all. `compositing`:
    "over" or "additive". `loss`: "l1", "mse" or "ssim"; None leaves it to the preset.
    `device`: "auto", "cpu", "cuda" or "mps". `callback` is called with
    the progress after every step and ends the fit by returning True. The same arguments give the same scene.
    Raises Sdf2vecError for anything that can't be fitted.
    """
    kinds = check_settings(shapes, kind, compositing, preset, loss, seed)
    _check_choice("device", device, DEVICES)
    picture = image if isinstance(image, Picture) else _load_picture(image)
    from .fit.loop import Settings, fit_picture

    weighted = ((loss, 1.0),) if loss else None
    settings = Settings(int(shapes), kinds, compositing, preset, weighted, int(seed), device)
    return fit_picture(picture, settings, callback or (lambda progress: False))


def render(scene: Scene, width: int | None = None, height: int | None = None) -> NDArray[np.float32]:
    """The scene as an array [height, width, 3], or [.., 4] with straight alpha when it is transparent; 0..1."""
    from .render.draw import draw

    pixels: NDArray[np.float32] = draw(scene, width, height).permute(1, 2, 0).numpy()
    return np.ascontiguousarray(pixels[..., :3]) if scene.background else unpremultiply(pixels)


def export(scene: Scene, target: str, **options: Any) -> str | bytes:
    """The scene as "glsl", "shadertoy", "wgsl", "svg", "json" (text) or "png" (bytes).

    Options: `size`, `glsl`, `layout`, `title`, as in `sdf2vec.export.options.Options`. Raises Sdf2vecError.
    """
    return _export(scene, target, Options(**options))


def check(
    scene: Scene, targets: Iterable[str] | None = None, sizes: Sequence[Size] | None = None
) -> list[Check]:
    """Re-renders exports on the real engines present and compares them with the render; see `sdf2vec.roundtrip`."""
    from .roundtrip import check as run

    return run(scene, targets, sizes)


def psnr(scene: Scene, picture: Picture) -> float:
    """Peak signal-to-noise ratio in dB of the scene's render against the picture, premultiplied."""
    import torch

    from .metrics import psnr as measure
    from .render.draw import draw

    pixels = premultiply(picture.pixels) if picture.has_alpha else picture.pixels
    target = torch.from_numpy(np.ascontiguousarray(pixels.transpose(2, 0, 1)))
    return float(measure(draw(scene, picture.width, picture.height)[: len(target)], target))


def check_settings(
    shapes: int, kind: str | Sequence[str], compositing: str, preset: str, loss: str | None, seed: int
) -> tuple[str, ...]:
    """The kinds of shape by name. Raises Sdf2vecError for the first setting that `fit` can't take."""
    kinds = kinds_of(kind)
    _check_choice("compositing", compositing, tuple(COMPOSITING))
    _check_choice("preset", preset, tuple(PRESETS))
    if loss is not None:
        _check_choice("loss", loss, LOSS_NAMES)
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

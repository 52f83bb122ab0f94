"""The public functions, in the words of the command line. What is heavy is imported when first needed."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Callable, Iterable, Sequence
from typing import TYPE_CHECKING, Any, Literal, Unpack

from .declared import checked, documented
from .deferred import deferred
from .errors import Sdf2vecError
from .export.exported import Exported
from .export.options import Options
from .exports import Exports, share_of_limit
from .fit.settings import Settings, settings_of
from .keywords import ExportKeywords, FitKeywords
from .scene import SHOWN, Scene

if TYPE_CHECKING:
    from .arrays import Float32Array
    from .fit.auto import Fitted
    from .fit.loop import Progress
    from .image import Picture
    from .keywords import PictureSource
    from .roundtrip import Check, Size

NOTEBOOK = 512  # shortest side, in pixels, of what a notebook shows
_load_picture: Callable[[Any], Picture] = deferred("sdf2vec.image", "load")
_fitted_picture: Callable[..., Fitted] = deferred("sdf2vec.fit.auto", "fitted_picture")
_render: Callable[..., Float32Array] = deferred("sdf2vec.render.draw", "pixels_of")
_check: Callable[..., list[Check]] = deferred("sdf2vec.roundtrip", "check")


def fit(
    image: PictureSource,
    shapes: int | Literal["auto"] | None = None,
    *,
    callback: Callable[[Progress], bool] | None = None,
    **options: Unpack[FitKeywords],
) -> Scene:
    """Fits `shapes` shapes to a picture, no more than it needs unless told: the scene of `fitted`."""
    return fitted(image, shapes, callback=callback, **options).scene


@documented(Settings)
def fitted(
    image: PictureSource,
    shapes: int | Literal["auto"] | None = None,
    *,
    callback: Callable[[Progress], bool] | None = None,
    share: Callable[[Scene], float] | None = None,
    **options: Unpack[FitKeywords],
) -> Fitted:
    """Fits shapes to a picture, and tells what was decided about their number and whether a target was met.

    `image`: a path, bytes, a file object, a PIL image or an array [H, W], [H, W, 3] or [H, W, 4] (sRGB-coded;
    integers, or floats 0..1). `callback` is called with the progress after every step and ends the fit by returning
    True. `share` says how much of a size limit a scene takes, 1 for all of it (`share_of(targets, max_bytes=…)`); an
    automatic number of shapes keeps within it. The same arguments give the same scene. `kind` and `palette` may also be
    sequences, `loss` pairs of name and weight. Raises Sdf2vecError for anything that can't be fitted.
    """
    settings = settings_of(shapes, **options)
    return _fitted_picture(_load_picture(image), settings, callback or (lambda progress: False), share)


def share_of(targets: Sequence[str], **options: Unpack[ExportKeywords]) -> Callable[[Scene], float]:
    """How much of `max_bytes` the largest of some exports of a scene takes, each in a small form: for `fitted`.

    Raises Sdf2vecError for an unknown target and for a limit that is none.
    """
    return share_of_limit(targets, checked(Options, options))


def render(scene: Scene, width: int | None = None, height: int | None = None) -> Float32Array:
    """The scene as an array [height, width, 3], or [.., 4] with straight alpha when it is transparent; 0..1.

    Of one side alone the other follows, in the scene's proportions; without any it has the size of the fitted picture.
    """
    if width and not height:
        height = max(1, round(width * scene.height / scene.width))
    elif height and not width:
        width = max(1, round(height * scene.width / scene.height))
    return _render(scene, width, height)


def export(
    scene: Scene, target: str, *, picture: PictureSource | None = None, **options: Unpack[ExportKeywords]
) -> str | bytes:
    """The scene in a target format, a key of `sdf2vec.export.EXPORTERS`: text, or bytes for "pdf", "sdf" and pictures.

    Options: those of `exported`. Raises Sdf2vecError, also for a size limit that can't be kept to.
    """
    made = exported(scene, target, picture=picture, **options)
    if not made.met:
        raise Sdf2vecError(made.notes[-1])
    return made.data


@documented(Options)
def exported(
    scene: Scene, target: str, *, picture: PictureSource | None = None, **options: Unpack[ExportKeywords]
) -> Exported:
    """The scene in a target format, with the files that belong beside it and what was chosen or given up.

    `picture`: what it was fitted to, in any form that `fit` takes; a drawing is then small, and near to that.
    Raises Sdf2vecError for an unknown target and for what can't be exported.
    """
    near = None if picture is None else _load_picture(picture)
    return Exports(scene, near).export(target, checked(Options, options))


def _png(scene: Scene) -> str:
    return b64encode(exported(scene, "png", size=min(NOTEBOOK, scene.width, scene.height)).raw).decode()


SHOWN |= {"image/png": _png, "image/svg+xml": lambda scene: str(export(scene, "svg", svg_size="fixed"))}


def check(
    scene: Scene, targets: Iterable[str] | None = None, sizes: Sequence[Size] | None = None
) -> list[Check]:
    """Re-renders exports on the real engines present and compares them with the render; see `sdf2vec.roundtrip`."""
    return _check(scene, targets, sizes)

"""Keywords of the public functions, for type checkers. Written by `python -m sdf2vec.keyword_text`."""

from __future__ import annotations

from collections.abc import Sequence
from os import PathLike
from typing import TYPE_CHECKING, Any, Literal, Protocol, TypedDict

if TYPE_CHECKING:
    from numpy.typing import NDArray
    from PIL.Image import Image

    from .image import Picture
    from .scene import Color, Scene


class Readable(Protocol):
    """A binary stream."""

    def read(self, size: int, /) -> bytes:
        """So many bytes."""


if TYPE_CHECKING:
    PictureSource = (
        str | PathLike[str] | bytes | bytearray | memoryview | Readable | Image | Picture | NDArray[Any]
    )


class FitKeywords(TypedDict, total=False):
    """What a fit takes."""

    kind: str | Sequence[str]
    compositing: Literal["over", "additive"]
    preset: Literal["fast", "balanced", "best", "thesis"]
    loss: str | Sequence[tuple[str, float]] | None
    seed: int
    device: Literal["auto", "cpu", "cuda", "mps"]
    union: int
    paint: Literal["flat", "linear", "radial", "linear3", "radial3"]
    min_area: float | None
    max_falloff: float | None
    start: str | PathLike[str] | Scene | None
    trials: int
    cuts: int
    palette: str | Sequence[Color | str] | None
    colors: int | None
    weights: PictureSource | None
    max_shapes: int
    target_psnr: float | None
    target_flip: float | None


class ExportKeywords(TypedDict, total=False):
    """What an export takes."""

    size: int | None
    glsl: Literal["es300", "330", "es100"]
    layout: Literal["auto", "readable", "table", "tiled", "packed", "data", "buffer"]
    framing: Literal["fit", "cover", "crop"] | None
    animate: bool
    svg_profile: Literal["filters", "portable", "inkscape"]
    svg_fidelity: Literal["picture", "render", "exact"]
    svg_size: Literal["responsive", "fixed"]
    max_bytes: str | int | None
    title: str
    alt: str
    alone: bool
    drawing: str
    original: bytes | None

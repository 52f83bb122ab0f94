"""What a user may choose about an export."""

from __future__ import annotations

from dataclasses import dataclass

from ..blend import FRAMINGS
from ..errors import Sdf2vecError

GLSL_VERSIONS = {"es300": "300 es", "330": "330", "es100": "100"}
LAYOUTS = ("auto", "readable", "table", "tiled", "packed", "data")
SVG_PROFILES = ("filters", "portable")


@dataclass(frozen=True)
class Options:
    """`size`: shortest side of a PNG in pixels, None for the scene's own. `glsl`: key of GLSL_VERSIONS.

    `layout`: how a shader holds its shapes, "auto" picks; see `sdf2vec.export.layouts`. `framing`: "fit" or
    "cover", what a shader does on a canvas of another shape. `animate`: shapes of a Shadertoy breathe.
    `alone`: no files beside the text. `original`: PNG or JPEG that a page compares with.
    `title` is named in the header. `svg_profile`: "filters" may use blur filters and blend modes, "portable"
    neither. `svg_size_limit`: the most bytes that an SVG may have, None for as many as it takes to look like the
    render. Raises Sdf2vecError for an unknown name or an impossible size.
    """

    size: int | None = None
    glsl: str = "es300"
    layout: str = "auto"
    title: str = "a picture"
    svg_profile: str = "filters"
    svg_size_limit: int | None = None
    framing: str = "fit"
    animate: bool = False
    alone: bool = False
    original: bytes | None = None

    def __post_init__(self) -> None:
        _check("GLSL version", self.glsl, tuple(GLSL_VERSIONS))
        _check("layout", self.layout, LAYOUTS)
        _check("framing", self.framing, tuple(FRAMINGS))
        if self.size is not None and not 1 <= self.size <= 16384:
            raise Sdf2vecError(f"size must be between 1 and 16384 pixels, got {self.size}")
        _check("SVG profile", self.svg_profile, SVG_PROFILES)
        if self.svg_size_limit is not None and self.svg_size_limit < 1:
            raise Sdf2vecError(f"the SVG size limit must be at least 1 byte, got {self.svg_size_limit}")


def _check(what: str, value: str, known: tuple[str, ...]) -> None:
    if value not in known:
        raise Sdf2vecError(f"unknown {what} {value!r}; choose from {', '.join(known)}")

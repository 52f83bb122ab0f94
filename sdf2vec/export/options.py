"""What a user may choose about an export."""

from __future__ import annotations

from dataclasses import dataclass, field

from ..blend import COMPOSITING, FRAMINGS
from ..errors import Sdf2vecError
from ..scene import Scene

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


@dataclass(frozen=True)
class Accepts:
    """Which scenes an exporter takes: of these compositings, additive ones perhaps on an opaque ground only."""

    compositing: tuple[str, ...] = field(default_factory=lambda: tuple(COMPOSITING))
    additive_needs_ground: bool = False

    def refusal(self, scene: Scene) -> str:
        """Why a scene is not taken; empty where it is."""
        if scene.compositing not in self.compositing:
            return "without blend modes"
        transparent = scene.compositing == "additive" and scene.background is None
        return "on a transparent ground" if transparent and self.additive_needs_ground else ""


def _check(what: str, value: str, known: tuple[str, ...]) -> None:
    if value not in known:
        raise Sdf2vecError(f"unknown {what} {value!r}; choose from {', '.join(known)}")

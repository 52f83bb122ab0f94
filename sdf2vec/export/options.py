"""What a user may choose about an export."""

from __future__ import annotations

from dataclasses import dataclass

from ..errors import Sdf2vecError

GLSL_VERSIONS = {"es300": "300 es", "330": "330"}
LAYOUTS = ("auto", "readable", "table")
SVG_PROFILES = ("filters", "portable")


@dataclass(frozen=True)
class Options:
    """`size`: shortest side of a PNG in pixels, None for the scene's own. `glsl`: key of GLSL_VERSIONS.

    `layout`: "readable" has a line for every shape, "table" a loop over a table, "auto" picks by the number of
    shapes. `title` is named in the header. `svg_profile`: "filters" may use blur filters and blend modes, "portable"
    neither. `svg_size_limit`: the most bytes that an SVG may have, None for as many as it takes to look like the
    render. Raises Sdf2vecError for an unknown name or an impossible size.
    """

    size: int | None = None
    glsl: str = "es300"
    layout: str = "auto"
    title: str = "a picture"
    svg_profile: str = "filters"
    svg_size_limit: int | None = None

    def __post_init__(self) -> None:
        if self.glsl not in GLSL_VERSIONS:
            raise Sdf2vecError(f"unknown GLSL version {self.glsl!r}; choose from {', '.join(GLSL_VERSIONS)}")
        if self.layout not in LAYOUTS:
            raise Sdf2vecError(f"unknown layout {self.layout!r}; choose from {', '.join(LAYOUTS)}")
        if self.size is not None and not 1 <= self.size <= 16384:
            raise Sdf2vecError(f"size must be between 1 and 16384 pixels, got {self.size}")
        if self.svg_profile not in SVG_PROFILES:
            raise Sdf2vecError(
                f"unknown SVG profile {self.svg_profile!r}; choose from {', '.join(SVG_PROFILES)}"
            )
        if self.svg_size_limit is not None and self.svg_size_limit < 1:
            raise Sdf2vecError(f"the SVG size limit must be at least 1 byte, got {self.svg_size_limit}")

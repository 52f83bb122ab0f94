"""What a user may choose about an export, and which scenes an exporter then takes."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated

from msgspec import Struct

from ..blend import COMPOSITING, FRAMINGS
from ..declared import choice, number, plain
from ..scene import Scene

GLSL_VERSIONS = {"es300": "300 es", "330": "330", "es100": "100"}
BUFFER = "buffer"  # a Shadertoy of two tabs
LAYOUTS = ("auto", "readable", "table", "tiled", "packed", "data", BUFFER)
SVG_PROFILES = ("filters", "portable", "inkscape")
PICTURE, RENDER, EXACT = SVG_FIDELITIES = ("picture", "render", "exact")
FIXED = "fixed"
SVG_SIZES = ("responsive", FIXED)


Size = Annotated[int, number("size in pixels", "PIXELS", 1, 16384, "shortest side of a PNG, JPEG or WebP")]


class Options(Struct, frozen=True, kw_only=True):
    """What a user may choose about an export; `declared.checked` makes one of values that may be wrong."""

    size: Size | None = None
    glsl: Annotated[str, choice("GLSL version", "version of the GLSL", GLSL_VERSIONS)] = "es300"
    layout: Annotated[str, choice("layout", "how shaders hold shapes", LAYOUTS)] = "auto"
    framing: (
        Annotated[
            str,
            choice(
                "framing",
                "how shaders fill a canvas of another shape: crop for pasted ones, else fit",
                FRAMINGS,
            ),
        ]
        | None
    ) = None
    animate: Annotated[bool, plain("the shapes of a Shadertoy breathe")] = False
    svg_profile: Annotated[
        str,
        choice(
            "SVG profile",
            "with blur filters; without, for every renderer; without what needs crisp edges, for Inkscape",
            SVG_PROFILES,
        ),
    ] = SVG_PROFILES[0]
    svg_fidelity: Annotated[
        str,
        choice(
            "SVG fidelity",
            "to the picture: small, hardly any of it lost; to the render; exact: without blurs",
            SVG_FIDELITIES,
        ),
    ] = PICTURE
    svg_size: Annotated[
        str,
        choice("SVG size", "an SVG as large as where it is put, or as the picture, in pixels", SVG_SIZES),
    ] = SVG_SIZES[0]
    max_bytes: (
        Annotated[
            str | int,
            plain(
                "at most so many bytes, of 4000gz gzipped: fewer shapes where their number is auto, coarser drawings, "
                "denser text",
                "BYTES",
            ),
        ]
        | None
    ) = None
    title: Annotated[str, plain("what an export calls the picture (default: its name)", "TEXT")] = "a picture"
    alt: Annotated[str, plain("what is in the picture, for who can't see an SVG or a page", "TEXT")] = ""
    alone: Annotated[bool, plain("no files beside the text")] = False
    drawing: Annotated[str, plain("small SVG of the scene, in place of a page's own")] = ""
    original: Annotated[bytes | None, plain("PNG, JPEG or WebP that a page compares with")] = None


@dataclass(frozen=True)
class Accepts:
    """Which scenes an exporter takes: of these compositings."""

    compositing: tuple[str, ...] = field(default_factory=lambda: tuple(COMPOSITING))

    def refusal(self, scene: Scene) -> str:
        """Why a scene is not taken; empty where it is."""
        return "" if scene.compositing in self.compositing else "without blend modes"

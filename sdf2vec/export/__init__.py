"""Exporters: each turns a scene into a text or bytes. `EXPORTERS` is the list of all."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from ..errors import Sdf2vecError
from ..scene import Scene, dumps
from . import raster, shader, svg
from .options import Options


def _nothing(scene: Scene, options: Options) -> tuple[str, ...]:
    return ()


@dataclass(frozen=True)
class Exporter:
    """`suffix` is what a file name gets in place of the picture's; `about` is one line for the user.

    `notes` says, a line each, what an export had to give up.
    """

    suffix: str
    write: Callable[[Scene, Options], str | bytes]
    about: str
    notes: Callable[[Scene, Options], tuple[str, ...]] = _nothing


def _json(scene: Scene, options: Options) -> str:
    return dumps(scene)


EXPORTERS: dict[str, Exporter] = {
    "glsl": Exporter(".glsl", shader.glsl, "fragment shader, GLSL ES 3.00 or 3.30"),
    "shadertoy": Exporter(".shadertoy.glsl", shader.shadertoy, "mainImage to paste into Shadertoy"),
    "wgsl": Exporter(".wgsl", shader.wgsl, "fragment shader for WebGPU"),
    "svg": Exporter(".svg", svg.svg, "SVG that looks the same in every renderer", svg.notes),
    "data-uri": Exporter(".uri.txt", svg.data_uri, "that SVG as a data URI", svg.notes),
    "pdf": Exporter(".pdf", svg.pdf, "the portable SVG as PDF, by CairoSVG"),
    "json": Exporter(".scene.json", _json, "the scene itself"),
    "png": Exporter(".render.png", raster.png, "the render, at any --size"),
}


def export(scene: Scene, target: str, options: Options | None = None) -> str | bytes:
    """The scene in a target format: text, or bytes for PNG and PDF. Raises Sdf2vecError for an unknown target."""
    if target not in EXPORTERS:
        raise Sdf2vecError(f"unknown target {target!r}; choose from {', '.join(EXPORTERS)}")
    return EXPORTERS[target].write(scene, options or Options())

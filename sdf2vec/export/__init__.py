"""Exporters: each turns a scene into a text or bytes. `EXPORTERS` is the list of all."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from ..errors import Sdf2vecError
from ..scene import Scene, dumps
from . import raster, shader, svg
from .options import Options


@dataclass(frozen=True)
class Exporter:
    """`suffix` is what a file name gets in place of the picture's; `about` is one line for the user."""

    suffix: str
    write: Callable[[Scene, Options], str | bytes]
    about: str


def _json(scene: Scene, options: Options) -> str:
    return dumps(scene)


EXPORTERS: dict[str, Exporter] = {
    "glsl": Exporter(".glsl", shader.glsl, "fragment shader, GLSL ES 3.00 or 3.30"),
    "shadertoy": Exporter(".shadertoy.glsl", shader.shadertoy, "mainImage to paste into Shadertoy"),
    "wgsl": Exporter(".wgsl", shader.wgsl, "fragment shader for WebGPU"),
    "svg": Exporter(".svg", svg.svg, "SVG with gradients and blurred edges"),
    "json": Exporter(".scene.json", _json, "the scene itself"),
    "png": Exporter(".render.png", raster.png, "the render, at any --size"),
}


def export(scene: Scene, target: str, options: Options | None = None) -> str | bytes:
    """The scene in a target format: text, or bytes for PNG. Raises Sdf2vecError for an unknown target."""
    if target not in EXPORTERS:
        raise Sdf2vecError(f"unknown target {target!r}; choose from {', '.join(EXPORTERS)}")
    return EXPORTERS[target].write(scene, options or Options())

"""Exporters: each turns a scene into a text or bytes. `EXPORTERS` is the list of all."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from ..errors import Sdf2vecError
from ..scene import Scene
from ..scene_file import dumps
from . import component, page, raster, shader, svg
from .options import Options


def _nothing(scene: Scene, options: Options) -> tuple[str, ...]:
    return ()


@dataclass(frozen=True)
class Exporter:
    """`suffix` is what a file name gets in place of the picture's; `about` is one line for the user.

    `notes` says, a line each, what was chosen or had to be given up. `beside` gives files that belong next to the
    export, by what takes the place of its suffix.
    """

    suffix: str
    write: Callable[[Scene, Options], str | bytes]
    about: str
    notes: Callable[[Scene, Options], tuple[str, ...]] = _nothing
    beside: Callable[[Scene, Options], dict[str, bytes]] = lambda scene, options: {}


def _shader(name: str, suffix: str, about: str) -> Exporter:
    def write(scene: Scene, options: Options) -> str:
        return shader.shader(scene, name, options).text

    def notes(scene: Scene, options: Options) -> tuple[str, ...]:
        return (shader.shader(scene, name, options).about,)

    def beside(scene: Scene, options: Options) -> dict[str, bytes]:
        if name == "three":  # it holds its own data
            return {}
        return shader.files_beside(shader.shader(scene, name, options), suffix)

    return Exporter(suffix, write, about, notes, beside)


def _json(scene: Scene, options: Options) -> str:
    return dumps(scene)


EXPORTERS: dict[str, Exporter] = {
    "glsl": _shader("glsl", ".glsl", "fragment shader, GLSL ES 3.00, ES 1.00 or 3.30"),
    "shadertoy": _shader("shadertoy", ".shadertoy.glsl", "mainImage to paste into Shadertoy"),
    "wgsl": _shader("wgsl", ".wgsl", "shader module for WebGPU"),
    "three": _shader("three", ".three.js", "three.js material, an ES module"),
    "godot": _shader("godot", ".gdshader", "canvas item shader for Godot 4"),
    "svg": Exporter(".svg", svg.svg, "SVG that looks the same in every renderer", svg.notes),
    "data-uri": Exporter(".uri.txt", svg.data_uri, "that SVG as a data URI", svg.notes),
    "pdf": Exporter(".pdf", svg.pdf, "the portable SVG as PDF, by CairoSVG", svg.pdf_notes),
    "html": Exporter(".html", page.html, "one page without dependencies: shader, drawing, copy buttons"),
    "component": Exporter(
        ".sdf-image.js", component.component, "<sdf-image>, an element that shows scene files"
    ),
    "json": Exporter(".scene.json", _json, "the scene itself"),
    "png": Exporter(".render.png", raster.png, "the render, at any --size"),
}


def export(scene: Scene, target: str, options: Options | None = None) -> str | bytes:
    """The scene in a target format: text, or bytes for PNG and PDF. Raises Sdf2vecError for an unknown target."""
    return _exporter(target).write(scene, options or Options())


def beside(scene: Scene, target: str, options: Options | None = None) -> dict[str, bytes]:
    """Files that an export needs next to it, by what takes the place of the picture's suffix."""
    return _exporter(target).beside(scene, options or Options())


def _exporter(target: str) -> Exporter:
    if target not in EXPORTERS:
        raise Sdf2vecError(f"unknown target {target!r}; choose from {', '.join(EXPORTERS)}")
    return EXPORTERS[target]

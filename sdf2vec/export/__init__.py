"""Exporters: each a plain function of a scene and the user's options. `EXPORTERS` lists all; see `sdf2vec.exports`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

from ..deferred import deferred
from ..errors import Sdf2vecError
from ..scene import MAX_SHAPES, Scene
from .exported import Exported
from .options import Accepts, Options


@dataclass(frozen=True)
class Exporter:
    """`suffix` is what a file name gets in place of the picture's; `about` is one line for the user.

    `accepts` says which scenes `write` takes, `most_shapes` how many shapes they may have.
    """

    suffix: str
    write: Callable[[Scene, Options], Exported]
    about: str
    accepts: Callable[[Options], Accepts] = lambda options: Accepts()
    most_shapes: Callable[[Options], int] = lambda options: MAX_SHAPES

    def check_count(self, count: int, options: Options) -> None:
        """Raises Sdf2vecError for more shapes than the target can serve."""
        most = self.most_shapes(options)
        if count > most:
            raise Sdf2vecError(
                f"{self.suffix[1:]}: {count} shapes are more than its text can hold ({most}); "
                "write glsl or wgsl to files, which hold data, or json, or fit fewer"
            )


def _shader(name: str, suffix: str, about: str) -> Exporter:
    module = "sdf2vec.export.shader"
    write, most_shapes = deferred(module, "exported"), deferred(module, "most_shapes")
    return Exporter(
        suffix, partial(write, name=name, suffix=suffix), about, most_shapes=partial(most_shapes, name=name)
    )


def _svg(name: str, suffix: str, about: str) -> Exporter:
    module = "sdf2vec.export.svg"
    return Exporter(suffix, deferred(module, name), about, deferred(module, "accepts"))


EXPORTERS: dict[str, Exporter] = {
    "glsl": _shader("glsl", ".glsl", "fragment shader, GLSL ES 3.00, ES 1.00 or 3.30"),
    "shadertoy": _shader("shadertoy", ".shadertoy.glsl", "mainImage to paste into Shadertoy"),
    "wgsl": _shader("wgsl", ".wgsl", "shader module for WebGPU"),
    "three": _shader("three", ".three.js", "three.js material, an ES module"),
    "godot": _shader("godot", ".gdshader", "canvas item shader for Godot 4"),
    "svg": _svg("svg", ".svg", "SVG that looks the same in every renderer"),
    "data-uri": _svg("data_uri", ".uri.txt", "that SVG as a data URI"),
    "pdf": Exporter(
        ".pdf",
        deferred("sdf2vec.export.svg", "pdf"),
        "the portable SVG as PDF, by CairoSVG",
        lambda options: Accepts(("over",)),
    ),
    "html": Exporter(
        ".html",
        deferred("sdf2vec.export.page", "html"),
        "one page without dependencies: shader, drawing, copy buttons",
    ),
    "component": Exporter(
        ".sdf-image.js",
        deferred("sdf2vec.export.component", "component"),
        "<sdf-image>, an element that shows scene files",
    ),
    "json": Exporter(".scene.json", deferred("sdf2vec.export.raster", "json"), "the scene itself"),
    "png": Exporter(".render.png", deferred("sdf2vec.export.raster", "png"), "the render, at any --size"),
}

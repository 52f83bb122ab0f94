"""SVG that looks like the render wherever it is opened; see docs/svg.md."""

from __future__ import annotations

from functools import lru_cache

from ...errors import Sdf2vecError
from ...files import one_line
from ...scene import Scene
from ..options import Options
from .canvas import Canvas, Document, color_text, tag
from .layers import Detail, Painter, Part, plan


def svg(scene: Scene, options: Options) -> str:
    """The scene as SVG text in pixels of the fitted picture. Raises Sdf2vecError for what can't be written."""
    if scene.compositing == "additive":
        raise Sdf2vecError("svg: additive scenes can't be written as SVG; fit with --compositing over")
    return _drawing(scene, options.svg_profile, Detail()).text(one_line(options.title))


@lru_cache(maxsize=8)
def _drawing(scene: Scene, profile: str, detail: Detail) -> Document:
    document = Document(Canvas.of(scene, detail.coarser), detail.named)
    if scene.background is not None:
        document.body.append(tag("rect", width="100%", height="100%", fill=color_text(scene.background)))
    painter = Painter(document, detail, plan(scene, document.canvas, detail, profile == "filters"))
    for index, layer in enumerate(scene.layers):
        drawn = painter.draw(Part(layer, index))
        if drawn:
            document.body.append(drawn)
    return document

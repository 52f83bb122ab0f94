"""One HTML file that shows a scene: a shader where there is WebGL 2, else a drawing. It loads nothing."""

from __future__ import annotations

import base64
import json
from dataclasses import replace

import numpy as np

from ..errors import Sdf2vecError
from ..files import one_line
from ..scene import Scene
from ..templating import template
from .options import Options
from .raster import png
from .shader import DATA_WIDTH, Shader, shader
from .svg import svg

LABELS = {"shadertoy": "Shadertoy", "glsl": "GLSL", "wgsl": "WGSL", "svg": "SVG"}


def html(scene: Scene, options: Options) -> str:
    """A page that needs no network, with buttons that copy the scene in other forms."""
    plain = Options(title=options.title)
    made = shader(scene, "glsl", replace(plain, layout="data"))
    texts = {"fragment": made.text} | _texts(scene, replace(plain, alone=True))
    return template("page.html.jinja").render(
        scene=scene,
        title=one_line(options.title),
        fallback=_inline(texts["svg"]) if "svg" in texts else _image(scene, plain),
        original=_data_url(options.original) if options.original else "",
        labels={name: label for name, label in LABELS.items() if name in texts},
        texts=json.dumps(texts, ensure_ascii=False).replace("<", "\\u003c"),
        data=base64.b64encode(_floats(made)).decode(),
        width=DATA_WIDTH,
    )


def _texts(scene: Scene, options: Options) -> dict[str, str]:
    texts = {name: shader(scene, name, options).text for name in ("shadertoy", "glsl", "wgsl")}
    try:
        return texts | {"svg": svg(scene, options)}
    except Sdf2vecError:  # no drawing can show such a scene
        return texts


def _floats(made: Shader) -> bytes:
    data = np.zeros((1, DATA_WIDTH, 4), "<f4") if made.data is None else made.data.astype("<f4")
    return data.tobytes()


def _inline(drawing: str) -> str:
    """An SVG as part of a page: without its declaration, and as large as its place."""
    start = drawing.index("<svg")
    return drawing[start:].strip().replace("<svg", '<svg style="width:100%;height:100%"', 1)


def _image(scene: Scene, options: Options) -> str:
    return f'<img src="{_data_url(png(scene, options))}" alt="" style="width:100%;height:100%">'


def _data_url(data: bytes) -> str:
    kind = "png" if data.startswith(b"\x89PNG") else "jpeg"
    return f"data:image/{kind};base64,{base64.b64encode(data).decode()}"

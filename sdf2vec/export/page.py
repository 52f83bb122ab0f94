"""One HTML file that shows a scene: a shader where there is WebGL 2, else a drawing. It loads nothing."""

from __future__ import annotations

import base64
import hashlib
import json
import re
from html import escape

import numpy as np
from msgspec.structs import replace

from ..errors import Sdf2vecError
from ..files import one_line, shown_as
from ..limits import TEXT_SHAPES
from ..scene import Scene
from ..templating import template
from .exported import Exported
from .options import Options
from .raster import png
from .shader import DATA_WIDTH, Shader, most_shapes, shader
from .svg import svg

FALLBACK = 1 << 20  # pixels
POLICY = "what the page may do"  # where the template has it
SCRIPT = re.compile(r'<script type="module">(.*?)</script>', re.DOTALL)
STYLE = re.compile(r"<style>(.*?)</style>", re.DOTALL)
LABELS = {"shadertoy": "Shadertoy", "glsl": "GLSL", "wgsl": "WGSL", "svg": "SVG"}


def html(scene: Scene, options: Options) -> Exported:
    """A page that needs no network, with buttons that copy the scene in other forms."""
    plain = Options(title=options.title, alt=options.alt)
    made = shader(scene, "glsl", replace(plain, layout="data"))
    alone = replace(plain, alone=True)
    served = [name for name in LABELS if name != "svg" and scene.shape_count <= most_shapes(alone, name)]
    texts = {name: shader(scene, name, alone).text for name in served}
    drawing = _drawing(scene, plain)
    text = template("page.html.jinja").render(
        scene=scene,
        title=one_line(options.title),
        alt=one_line(options.alt or options.title),
        fallback=drawing or _image(scene, plain),
        original=_data_url(options.original) if options.original else "",
        labels={
            name: label for name, label in LABELS.items() if name in served or (name == "svg" and drawing)
        },
        texts=json.dumps({"fragment": made.text, **texts}, ensure_ascii=False).replace("<", "\\u003c"),
        data=base64.b64encode(_floats(made)).decode(),
        width=DATA_WIDTH,
        policy=POLICY,
    )
    return Exported(text.replace(POLICY, policy_of(text), 1))


def policy_of(page: str) -> str:
    """The Content-Security-Policy that a page works under: the script and the styles that it has, by their hashes."""
    scripts, styles = (
        [f"'sha256-{base64.b64encode(hashlib.sha256(part.encode()).digest()).decode()}'" for part in found]
        for found in (SCRIPT.findall(page), STYLE.findall(page))
    )
    allowed = {"script-src": scripts, "style-src": styles, "img-src": ["data:"]}
    told = (f"{name} {' '.join(dict.fromkeys(values))}" for name, values in allowed.items())
    return "; ".join(["default-src 'none'", "base-uri 'none'", "form-action 'none'", *told])


def _drawing(scene: Scene, options: Options) -> str:
    """The SVG as part of a page, or nothing where no drawing can show the scene, or only a very large one."""
    if scene.shape_count > TEXT_SHAPES:
        return ""
    try:
        drawing = str(svg(scene, options).data)
    except Sdf2vecError:
        return ""
    return drawing[drawing.index("<svg") :].strip()


def _floats(made: Shader) -> bytes:
    data = np.zeros((1, DATA_WIDTH, 4), "<f4") if made.data is None else made.data.astype("<f4")
    return data.tobytes()


def _image(scene: Scene, options: Options) -> str:
    """The render, of FALLBACK pixels at most, as part of a page."""
    shortest, longest = sorted((scene.width, scene.height))
    if shortest * longest > FALLBACK:
        options = replace(options, size=max(1, int(shortest * (FALLBACK / shortest / longest) ** 0.5)))
    told = escape(one_line(options.alt or options.title))
    return f'<img src="{_data_url(png(scene, options).raw)}" alt="{told}">'


def _data_url(data: bytes) -> str:
    return f"data:image/{shown_as(data)};base64,{base64.b64encode(data).decode()}"

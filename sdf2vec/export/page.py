"""One HTML file that shows a scene: a shader where there is WebGL 2, else a drawing. It loads nothing.

It holds the scene once, as a compact file, from which its script makes what is drawn and the texts that it copies.
"""

from __future__ import annotations

import base64
import hashlib
import json
import math
import re
from html import escape

from msgspec.structs import replace

from ..compact_file import read
from ..errors import Sdf2vecError
from ..files import one_line, shown_as
from ..limits import TEXT_SHAPES
from ..scene import Scene
from ..templating import template
from .compact_scene import fine
from .exported import Exported
from .options import Options
from .page_texts import PageTexts
from .raster import png
from .records import Form, Variant, form_of
from .script import script_parts
from .shader import most_shapes
from .svg import svg

FALLBACK = 1 << 20  # pixels
NEAR, MANY = 57.0, 256  # dB that the page's scene is from the one it was made of, where it has so many shapes
SLOPE, FARTHEST, NEAREST = 32.0, 46.0, 105.0  # fewer can have more: by ten times fewer; at least, and at most
POLICY = "what the page may do"  # where the template has it
SCRIPT = re.compile(r'<script type="module">(.*?)</script>', re.DOTALL)
STYLE = re.compile(r"<style>(.*?)</style>", re.DOTALL)
CHECK = re.compile(r"^ *(?:require|oneOf)\(.*\);\n", re.MULTILINE)  # of files: a page's own needs none
REMARK = re.compile(r"(^|[ \t])[ \t]*// .*$", re.MULTILINE)
BLANK = re.compile(r"\n\s*\n")
FILLED = r"\$\{(?:[^`{}]|`[^`]*`)*\}"  # in a template, with templates in it
TOKEN = re.compile(
    rf"""(?P<kept>"(?:\\.|[^"\\])*"|`(?:{FILLED}|\\.|[^`\\])*`|(?<=[+])\ (?=[+])|(?<=-)\ (?=-)|\n(?=\w))
    |\s+(?=[^\w$])|(?<=[^\w$])\s+""",
    re.VERBOSE,
)
TAG = re.compile(r"<(?=[/!?a-zA-Z])")
ESCAPE = re.compile(r"\\.")
LABELS = {"shadertoy": "Shadertoy", "glsl": "GLSL", "wgsl": "WGSL", "svg": "SVG"}


def html(scene: Scene, options: Options) -> Exported:
    """A page that needs no network, with buttons that copy the scene in other forms."""
    plain = Options(title=options.title, alt=options.alt)
    alone = replace(plain, alone=True)
    served = [name for name in LABELS if name != "svg" and scene.shape_count <= most_shapes(alone, name)]
    drawing, file = _inline(options.drawing) or _drawing(scene, plain), fine(scene, _aim(scene.shape_count))
    held = read(file)
    texts = PageTexts.of(held, served, alone)
    text = template("page.html.jinja").render(
        scene=scene,
        title=one_line(options.title),
        alt=one_line(options.alt or options.title),
        fallback=drawing or _image(scene, plain),
        original=_data_url(options.original) if options.original else "",
        labels={
            name: label for name, label in LABELS.items() if name in served or (name == "svg" and drawing)
        },
        texts=_in_lines(texts.texts),
        tabled=texts.tabled,
        file=base64.b64encode(file).decode(),
        places="\n".join(texts.functions),
        policy=POLICY,
        **script_parts([_form(held)], own=True),
    )
    text = SCRIPT.sub(lambda match: f'<script type="module">{lean(match[1])}</script>', text)
    return Exported(text.replace(POLICY, policy_of(text), 1))


def _aim(shapes: int) -> float:
    """How near the page's scene is to be: half as many shapes can have numbers that are three times as fine."""
    return min(max(NEAR + SLOPE * math.log10(MANY / max(shapes, 1)), FARTHEST), NEAREST)


def _form(scene: Scene) -> Form:
    """The form of the scene's records; of one without any that of some."""
    return form_of(scene) if scene.layers else Form((Variant("circle"),), (), scene.compositing)


def lean(script: str) -> str:
    """A script without remarks, checks of its scene, and what else only sets it off.

    Shaders in it keep their lines: so gzip finds them alike to those in the texts.
    """
    plain = BLANK.sub("\n", REMARK.sub("", CHECK.sub("", script)))
    return TOKEN.sub(lambda match: match["kept"] or "", plain)


def _in_lines(texts: object) -> str:
    """JSON that can't end a script, its line breaks as they are: so lines of texts and of the script are alike."""
    said = json.dumps(texts, ensure_ascii=False, separators=(",", ":"))
    return ESCAPE.sub(lambda match: "\n" if match[0] == "\\n" else match[0], TAG.sub("\\\\u003c", said))


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
        return _inline(str(svg(scene, options).data))
    except Sdf2vecError:
        return ""


def _inline(drawing: str) -> str:
    """An SVG as part of a page."""
    return drawing[drawing.find("<svg") :].strip()


def _image(scene: Scene, options: Options) -> str:
    """The render, of FALLBACK pixels at most, as part of a page."""
    shortest, longest = sorted((scene.width, scene.height))
    if shortest * longest > FALLBACK:
        options = replace(options, size=max(1, int(shortest * (FALLBACK / shortest / longest) ** 0.5)))
    told = escape(one_line(options.alt or options.title))
    return f'<img src="{_data_url(png(scene, options).raw)}" alt="{told}">'


def _data_url(data: bytes) -> str:
    return f"data:image/{shown_as(data)};base64,{base64.b64encode(data).decode()}"

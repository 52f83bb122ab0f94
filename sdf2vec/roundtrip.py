"""Round trips: exports re-rendered on real engines and compared with the torch render."""

from __future__ import annotations

import base64
import math
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, partial
from typing import Any
from urllib.parse import unquote_to_bytes

import numpy as np
import torch

from .arrays import Float32Array
from .engines import ENGINES
from .errors import Sdf2vecError
from .export.exported import Exported
from .export.options import SVG_PROFILES, Options
from .export.table_text import DATA_WIDTH
from .exports import Exports
from .fit.views import planes
from .image import Picture, fitted_size, premultiply
from .metrics import psnr
from .render.draw import draw, draw_fast, is_large
from .render.reference import render
from .scene import Scene
from .scene_file import dumps

Pixels = Float32Array  # [height, width, 4] premultiplied RGBA
Size = tuple[int, int]

SAME = 0.25  # largest error, in 8-bit levels, of an export that is the same picture
CLOSE = 40.0  # dB
NEARLY = 6.0  # dB below what a size can show at which a drawing is still close: twice the error
SMALL, SMALL_LIMIT = (
    b'fill="currentColor"',
    36.0,
)  # of a small SVG, in dB: it is near the picture, not the render
FINER = 4  # times across: a canvas whose means stand for what covers each pixel
LARGEST_FITTED = 512  # shortest side at which the fitted size is checked
QUICK_WORK = 2e7  # shapes times pixels of a shader that is drawn right after an export


@dataclass(frozen=True)
class Check:
    """One export on one engine at one size, or `missing`: why it could not be checked.

    Errors are in 8-bit levels over all pixels and RGBA; `mean_error` is signed. `limit` is what a drawing of so few
    pixels can show, in dB: how near the render, whose edges are soft by a pixel, comes to what covers each pixel.
    `near`: how near the export is to the picture that was fitted, in dB, where that is known and of this size.
    """

    target: str
    engine: str
    width: int = 0
    height: int = 0
    psnr: float = math.nan
    largest_error: float = math.nan
    mean_error: float = math.nan
    missing: str = ""
    limit: float = math.inf
    near: float = math.nan

    @property
    def verdict(self) -> str:
        if self.missing:
            return "not checked"
        if self.largest_error <= SAME:
            return "same"
        return "close" if self.psnr >= min(CLOSE, self.limit - NEARLY) else "differs"


def legend() -> str:
    """What the verdicts mean."""
    small = SMALL_LIMIT - NEARLY
    return f"""same: off by at most {SAME:g} of 255 levels anywhere
close: at least {CLOSE:g} dB, of a small SVG {small:g}; in few pixels, at most {NEARLY:g} dB below what they can show
differs: neither; errors are in levels, the mean is signed"""


@dataclass(frozen=True)
class RoundTrip:
    """How a target is drawn: on which engine, a key of ENGINES, and with what around the export.

    A shader fills a canvas of any shape; a drawing (`any_shape=False`) ends at the edges of its picture. `profile`:
    that of the SVG, where there is one.
    """

    target: str
    engine: str
    how: Callable[[RoundTrip, Exported, Scene, int, int], Pixels]
    any_shape: bool = True
    profile: str | None = None

    @property
    def name(self) -> str:
        return self.target if self.profile in (None, SVG_PROFILES[0]) else f"{self.target} {self.profile}"

    @property
    def options(self) -> Options:
        return Options(svg_profile=self.profile or SVG_PROFILES[0])

    def draw(self, made: Exported, scene: Scene, width: int, height: int) -> Pixels:
        """The export, premultiplied."""
        return self.how(self, made, scene, width, height)

    def drawn(self, content: Any, width: int, height: int, **more: Any) -> Pixels:
        """What the engine draws of it."""
        pixels: Pixels = ENGINES[self.engine].render(content, width, height, **more)
        return pixels


def check(
    scene: Scene,
    targets: Iterable[str] | None = None,
    sizes: Sequence[Size] | None = None,
    written: Mapping[str, Exported] | None = None,
    begin: Callable[[str], None] = lambda name: None,
) -> list[Check]:
    """Re-renders the exports on every engine that is present. Sizes are (width, height) in pixels.

    Without sizes: the fitted one (at most 512 on the shortest side), a larger one of another shape, a tiny one.
    `written` are exports that have been made before, by target: only they are drawn. `begin` is told what is drawn.
    Raises Sdf2vecError when no engine can draw any of the targets.
    """
    chosen = set(written or ROUND_TRIPS if targets is None else targets)
    trips = [trip for name, several in ROUND_TRIPS.items() if name in chosen for trip in several]
    if written is not None:
        trips = [trip for trip in trips if trip.profile in (None, _profile(written[trip.target]))]
    if not trips:
        raise Sdf2vecError(f"nothing to check: engines draw {', '.join(ROUND_TRIPS)}")
    export, expected = cache(Exports(scene).export), cache(partial(_expected, scene))
    limit = cache(partial(_limit, scene))

    def check_trip(trip: RoundTrip) -> list[Check]:
        engine = ENGINES[trip.engine]
        reason = engine.missing()
        if reason:
            return [Check(trip.name, engine.name, missing=reason)]
        begin(f"{trip.name} on {engine.name}")
        try:
            made = written[trip.target] if written else export(trip.target, trip.options)
        except Sdf2vecError as error:
            return [Check(trip.name, engine.name, missing=str(error))]
        if b" = scenePoint(" in made.raw:  # the render goes on beyond its frame, this does not
            trip = replace(trip, any_shape=False)
        drawn_at = sizes or default_sizes(scene, trip)
        found = [compare(trip, made, scene, size, expected(*size)) for size in drawn_at]
        if trip.any_shape:
            return found
        if SMALL in made.raw:
            found = [replace(c, limit=SMALL_LIMIT) for c in found]
        return [
            replace(c, limit=min(c.limit, limit(c.width, c.height))) if c.psnr < CLOSE else c for c in found
        ]

    return [result for trip in trips for result in check_trip(trip)]


def default_sizes(scene: Scene, trip: RoundTrip) -> list[Size]:
    """The fitted size, a larger one (of another shape, where that makes sense), a tiny one."""
    shortest = min(LARGEST_FITTED, scene.width, scene.height)
    width, height = fitted_size(scene.width, scene.height, shortest)
    if trip.any_shape:
        return [(width, height), (width * 5 // 4 + 1, height * 11 // 10 + 2), (19, 13)]
    return [(width, height), (2 * width, 2 * height), _small(width, height)]


def _within(pixels: float, width: int, height: int) -> Size:
    """A canvas of this shape and at most about so many pixels."""
    share = min(1.0, math.sqrt(pixels / (width * height)))
    return fitted_size(width, height, max(1, int(min(width, height) * share)))


def _small(width: int, height: int) -> Size:
    """A small canvas of exactly the same shape."""
    common = math.gcd(width, height)
    times = -(-24 * common // min(width, height))
    return width // common * min(times, common), height // common * min(times, common)


def _expected(scene: Scene, width: int, height: int) -> torch.Tensor:
    """The reference in float64; for large jobs, which would take it minutes, the fused renderer."""
    if is_large(scene, width, height):
        return draw(scene, width, height)
    return render(scene, width, height, dtype=torch.float64)


def _profile(made: Exported) -> str:
    """The profile of a drawing that has been written: without filters every renderer is its judge."""
    with_filters, portable, _ = SVG_PROFILES
    return with_filters if b"filter" in made.raw else portable


def _limit(scene: Scene, width: int, height: int) -> float:
    """How near a render comes to one whose pixels are means of finer ones, in dB."""
    fine = draw_fast(scene, FINER * width, FINER * height)
    means = torch.nn.functional.avg_pool2d(fine[None], FINER)[0]
    return float(psnr(means, _expected(scene, width, height).float()))


def figure(
    scene: Scene, target: str, made: Exported, options: Options, picture: Picture | None = None
) -> Check | None:
    """An export at the fitted size (a shader of many shapes: smaller) on the first quick engine; None where none is.

    None too for one that shows something else than the render: a moving picture, or a part of it.
    """
    if options.animate or options.framing == "cover":
        return None
    for trip in ROUND_TRIPS.get(target, ()):
        engine, suits = ENGINES[trip.engine], trip.profile in (None, options.svg_profile)
        if suits and engine.is_quick and not engine.missing():
            size = default_sizes(scene, trip)[0]
            if trip.profile is None:
                size = _within(QUICK_WORK / max(1, scene.shape_count), *size)
            return compare(trip, made, scene, size, draw_fast(scene, *size), picture)
    return None


def compare(
    trip: RoundTrip,
    made: Exported,
    scene: Scene,
    size: Size,
    expected: torch.Tensor | None = None,
    picture: Picture | None = None,
) -> Check:
    """One export drawn at one size, against a render [4, H, W], by default `_expected`, and the picture."""
    width, height = size
    drawn = trip.draw(made, scene, width, height)
    if expected is None:
        expected = _expected(scene, width, height)
    shown = planes(drawn).double()
    difference = 255.0 * (shown - expected)
    return Check(
        trip.name,
        ENGINES[trip.engine].name,
        width,
        height,
        psnr=float(psnr(shown, expected.double())),
        largest_error=float(difference.abs().max()),
        mean_error=float(difference.mean()),
        near=_near(drawn, picture) if picture and size == (picture.width, picture.height) else math.nan,
    )


def _near(drawn: Pixels, picture: Picture) -> float:
    """How near a drawing is to a picture, both premultiplied, in dB."""
    target = picture.premultiplied
    return float(psnr(planes(drawn[..., : target.shape[2]]).double(), planes(target)))


# --- drawing -----------------------------------------------------------------------------------------------


def _data(made: Exported) -> Pixels | None:
    """The data beside a shader, [rows, DATA_WIDTH, 4]."""
    raw = [data for name, data in made.beside.items() if name.endswith(".bin")]
    return np.frombuffer(raw[0], "<f4").reshape(-1, DATA_WIDTH, 4) if raw else None


def _shader(trip: RoundTrip, made: Exported, scene: Scene, width: int, height: int) -> Pixels:
    """A shader that is told the canvas."""
    return trip.drawn(made.data, width, height, uniforms={"resolution": (width, height)}, texture=_data(made))


def _shadertoy(trip: RoundTrip, made: Exported, scene: Scene, width: int, height: int) -> Pixels:
    first, *rest = str(made.data).split(IMAGE_TAB)
    uniforms = {"iResolution": (width, height, 1.0), "iFrame": 0}
    pixels = trip.drawn(f"{SHADERTOY_HEAD}{first}{SHADERTOY_TAIL}", width, height, uniforms=uniforms)
    for tab in rest:  # which reads what was drawn, from below
        text = f"{SHADERTOY_HEAD}{tab}{SHADERTOY_TAIL}"
        pixels = trip.drawn(text, width, height, uniforms=uniforms, texture=pixels[::-1])
    return pixels


def _pasted(trip: RoundTrip, made: Exported, scene: Scene, width: int, height: int) -> Pixels:
    """By a client that puts around it what Shadertoy does; of two tabs the first, which has the whole picture."""
    return trip.drawn(str(made.data).partition(IMAGE_TAB)[0], width, height)


def _godot(trip: RoundTrip, made: Exported, scene: Scene, width: int, height: int) -> Pixels:
    """As plain GLSL: Godot's own compiler can't be had."""
    text = GODOT_HEAD + GODOT_MODES.sub("", str(made.data))
    return trip.drawn(text, width, height, uniforms={"resolution": (width, height)})


def _whole(trip: RoundTrip, made: Exported, scene: Scene, width: int, height: int) -> Pixels:
    """What the engine takes as it is, and draws with straight alpha."""
    return premultiply(trip.drawn(made.data, width, height))


def _element(trip: RoundTrip, made: Exported, scene: Scene, width: int, height: int) -> Pixels:
    return premultiply(trip.drawn(made.data, width, height, scene=dumps(scene)))


def _in_element(trip: RoundTrip, made: Exported, scene: Scene, width: int, height: int) -> Pixels:
    """A compact scene, or its address, in the element that shows such."""
    data = base64.b64decode(made.data.partition(",")[2]) if isinstance(made.data, str) else made.data
    element = Exports(scene).export("component").data
    return premultiply(trip.drawn(element, width, height, scene=data))


def _decoded(trip: RoundTrip, made: Exported, scene: Scene, width: int, height: int) -> Pixels:
    """The drawing that an address holds."""
    head, _, rest = str(made.data).partition(",")
    text = base64.b64decode(rest) if head.endswith(";base64") else unquote_to_bytes(rest)
    return premultiply(trip.drawn(text.decode(), width, height))


def _svg(target: str, profile: str, *engines: str) -> tuple[RoundTrip, ...]:
    return tuple(RoundTrip(target, engine, _whole, False, profile) for engine in engines)


IMAGE_TAB = "// --- Image ---"  # where the second tab of a text begins

# What Shadertoy puts around a pasted text.
SHADERTOY_HEAD = """#version 300 es
precision highp float;
precision highp int;
uniform vec3 iResolution;
uniform float iTime;
uniform int iFrame;
uniform vec4 iMouse;
uniform highp sampler2D iChannel0;
out vec4 shadertoy_out_color;
"""
SHADERTOY_TAIL = """
void main() { mainImage(shadertoy_out_color, gl_FragCoord.xy); }
"""

# What stands for Godot's names.
GODOT_HEAD = """#version 330
uniform vec2 resolution;
out vec4 fragColor;
#define UV vec2(gl_FragCoord.x / resolution.x, 1.0 - gl_FragCoord.y / resolution.y)
#define COLOR fragColor
#define fragment main
"""
GODOT_MODES = re.compile(r"^(shader_type|render_mode) .*;\n", re.MULTILINE)

# CairoSVG sees neither filters nor blend modes, so it is no judge of the profile that has them.
ROUND_TRIPS: dict[str, tuple[RoundTrip, ...]] = {
    "glsl": (RoundTrip("glsl", "opengl", _shader),),
    "shadertoy": (
        RoundTrip("shadertoy", "opengl", _shadertoy),
        RoundTrip("shadertoy", "shadertoy", _pasted),
    ),
    "wgsl": (RoundTrip("wgsl", "webgpu", _shader),),
    "three": (RoundTrip("three", "three", _whole, False),),
    "godot": (RoundTrip("godot", "opengl", _godot, False),),
    "svg": (
        *_svg("svg", "filters", "resvg", "librsvg", "chromium", "firefox"),
        *_svg("svg", "portable", "resvg", "librsvg", "chromium", "firefox", "cairosvg"),
        *_svg("svg", "inkscape", "resvg", "inkscape"),
    ),
    "data-uri": (
        RoundTrip("data-uri", "resvg", _decoded, False, "filters"),
        *_svg("data-uri", "filters", "image"),
    ),
    "pdf": (RoundTrip("pdf", "pdfium", _whole, False),),
    "html": (RoundTrip("html", "page", _whole, False),),
    "component": (RoundTrip("component", "element", _element, False),),
    "sdf": (RoundTrip("sdf", "element", _in_element, False),),
    "sdf-uri": (RoundTrip("sdf-uri", "element", _in_element, False),),
}

"""Round trips: exports re-rendered on real engines and compared with the torch render."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from .engines import ENGINES, EngineError
from .errors import Sdf2vecError
from .export import export
from .export.options import SVG_PROFILES, Options
from .export.shader import TARGETS, shader
from .image import fitted_size, premultiply
from .scene import Scene

if TYPE_CHECKING:
    from torch import Tensor

Pixels = NDArray[np.float32]  # [height, width, 4] premultiplied RGBA
Size = tuple[int, int]

SAME = 0.25  # largest error, in 8-bit levels, of an export that is the same picture
CLOSE = 40.0  # dB
LARGEST_FITTED = 512  # shortest side at which the fitted size is checked


@dataclass(frozen=True)
class Check:
    """One export on one engine at one size, or `missing`: why it could not be checked.

    Errors are in 8-bit levels over all pixels and RGBA; `mean_error` is signed.
    """

    target: str
    engine: str
    width: int = 0
    height: int = 0
    psnr: float = math.nan
    largest_error: float = math.nan
    mean_error: float = math.nan
    missing: str = ""

    @property
    def verdict(self) -> str:
        if self.missing:
            return "not checked"
        if self.largest_error <= SAME:
            return "same"
        return "close" if self.psnr >= CLOSE else "differs"


@dataclass(frozen=True)
class RoundTrip:
    """How a target is drawn: on which engine, with what around the text, exported with which options.

    A shader fills a canvas of any shape; a drawing (`any_shape=False`) ends at the edges of its picture.
    `note` tells apart what one engine draws of one target.
    """

    target: str
    engine: str
    draw: Callable[[str, int, int, Pixels | None], Pixels]
    any_shape: bool = True
    options: Options = field(default_factory=Options)
    note: str = ""

    @property
    def name(self) -> str:
        return f"{self.target} {self.note}".strip()


def check(
    scene: Scene,
    targets: Iterable[str] | None = None,
    sizes: Sequence[Size] | None = None,
) -> list[Check]:
    """Re-renders the exports on every engine that is present. Sizes are (width, height) in pixels.

    Without sizes: the fitted one (at most 512 on the shortest side), a larger one of another shape, a tiny one.
    Raises Sdf2vecError when no engine can draw any of the targets.
    """
    chosen = set(ROUND_TRIPS) if targets is None else set(targets)
    trips = [trip for name, several in ROUND_TRIPS.items() if name in chosen for trip in several]
    if not trips:
        raise Sdf2vecError(f"nothing to check: engines draw {', '.join(ROUND_TRIPS)}")
    return [
        result for trip in trips for result in _check_trip(scene, trip, sizes or default_sizes(scene, trip))
    ]


def default_sizes(scene: Scene, trip: RoundTrip) -> list[Size]:
    """The fitted size, a larger one (of another shape, where that makes sense), a tiny one."""
    shortest = min(LARGEST_FITTED, scene.width, scene.height)
    width, height = fitted_size(scene.width, scene.height, shortest)
    if trip.any_shape:
        return [(width, height), (width * 5 // 4 + 1, height * 11 // 10 + 2), (19, 13)]
    return [(width, height), (2 * width, 2 * height), _small(width, height)]


def _small(width: int, height: int) -> Size:
    """A small canvas of exactly the same shape."""
    common = math.gcd(width, height)
    times = -(-24 * common // min(width, height))
    return width // common * min(times, common), height // common * min(times, common)


@lru_cache(maxsize=4)
def _expected(scene: Scene, width: int, height: int) -> Tensor:
    """The reference in float64; for large jobs, which would take it minutes, the fused renderer."""
    import torch

    from .render.draw import draw, is_large
    from .render.reference import render

    if is_large(scene, width, height):
        return draw(scene, width, height)
    return render(scene, width, height, dtype=torch.float64)


def _check_trip(scene: Scene, trip: RoundTrip, sizes: Sequence[Size]) -> list[Check]:
    reason = ENGINES[trip.engine].missing()
    if reason:
        return [Check(trip.name, trip.engine, missing=reason)]
    try:
        text, data = _exported(scene, trip.target, trip.options)
        return [compare(trip, text, scene, size, data) for size in sizes]
    except EngineError:
        raise
    except Sdf2vecError as error:
        return [Check(trip.name, trip.engine, missing=str(error))]


def figure(scene: Scene, target: str, data: str | bytes, options: Options) -> Check | None:
    """An export at the fitted size on the first engine that draws it; None where none is here.

    None too for one that shows something else than the render: a moving or a cropped picture.
    """
    if options.animate or options.framing != "fit" or not isinstance(data, str):
        return None
    for trip in ROUND_TRIPS.get(target, ()):
        suits = trip.target != "svg" or trip.options.svg_profile == options.svg_profile
        if suits and not ENGINES[trip.engine].missing():
            beside = _exported(scene, target, options)[1] if target in TARGETS else None
            width, height = default_sizes(scene, trip)[0]
            from .render.draw import draw_fast

            expected = draw_fast(scene, width, height)
            return compare(trip, data, scene, (width, height), beside, expected)
    return None


def _exported(scene: Scene, target: str, options: Options) -> tuple[str, Pixels | None]:
    """An export's text, and the data beside it."""
    if target in TARGETS:
        made = shader(scene, target, options)
        return made.text, made.data
    text = export(scene, target, options)
    assert isinstance(text, str)
    return text, None


def compare(
    trip: RoundTrip,
    text: str,
    scene: Scene,
    size: Size,
    data: Pixels | None = None,
    expected: Tensor | None = None,
) -> Check:
    """One export (and the data beside it) drawn at one size, against a render [4, H, W], by default `_expected`."""
    width, height = size
    drawn = trip.draw(text, width, height, data)
    if expected is None:
        expected = _expected(scene, width, height)
    difference = 255.0 * (drawn.astype(np.float64) - expected.permute(1, 2, 0).double().numpy())
    error = float(np.mean(difference**2))
    return Check(
        trip.name,
        trip.engine,
        width,
        height,
        psnr=10.0 * math.log10(255.0**2 / error) if error > 0 else math.inf,
        largest_error=float(np.abs(difference).max()),
        mean_error=float(difference.mean()),
    )


# --- drawing -----------------------------------------------------------------------------------------------


def _draw_glsl(text: str, width: int, height: int, data: Pixels | None) -> Pixels:
    uniforms = {"resolution": (width, height)}
    return ENGINES["opengl"].render(text, width, height, uniforms=uniforms, texture=data)


def _draw_shadertoy(text: str, width: int, height: int, data: Pixels | None) -> Pixels:
    whole = SHADERTOY_HEAD + text + SHADERTOY_TAIL
    return ENGINES["opengl"].render(whole, width, height, uniforms={"iResolution": (width, height, 1.0)})


def _draw_wgsl(text: str, width: int, height: int, data: Pixels | None) -> Pixels:
    uniforms = {"resolution": (width, height)}
    return ENGINES["webgpu"].render(text, width, height, uniforms=uniforms, texture=data)


def _drawing(engine: str, profile: str) -> RoundTrip:
    """An SVG of one profile on one engine."""

    def draw(text: str, width: int, height: int, data: Pixels | None) -> Pixels:
        return premultiply(ENGINES[engine].render(text, width, height))

    note = profile if profile != SVG_PROFILES[0] else ""
    return RoundTrip("svg", engine, draw, False, Options(svg_profile=profile), note)


# What Shadertoy puts around a pasted text.
SHADERTOY_HEAD = """#version 300 es
precision highp float;
precision highp int;
uniform vec3 iResolution;
uniform float iTime;
out vec4 shadertoy_out_color;
"""
SHADERTOY_TAIL = """
void main() { mainImage(shadertoy_out_color, gl_FragCoord.xy); }
"""

# CairoSVG sees neither filters nor blend modes, so it is no judge of the profile that has them.
ROUND_TRIPS: dict[str, tuple[RoundTrip, ...]] = {
    "glsl": (RoundTrip("glsl", "opengl", _draw_glsl),),
    "shadertoy": (RoundTrip("shadertoy", "opengl", _draw_shadertoy),),
    "wgsl": (RoundTrip("wgsl", "webgpu", _draw_wgsl),),
    "svg": (
        *(_drawing(engine, "filters") for engine in ("resvg", "librsvg", "chromium", "firefox")),
        *(_drawing(engine, "portable") for engine in ("resvg", "librsvg", "chromium", "firefox", "cairosvg")),
    ),
}

"""Shader exports where they are used: a Shadertoy client, WebGL 2 and WebGPU in Chromium, three.js, Godot."""

from functools import cache

import numpy as np
import pytest

import sdf2vec
from sdf2vec import roundtrip
from sdf2vec.engines import chromium, glslang_validate, opengl, webgl, webgpu
from sdf2vec.export import packing
from sdf2vec.export.options import Options
from sdf2vec.export.shader import shader
from sdf2vec.exports import Exports
from sdf2vec.render import reference
from sdf2vec.render.draw import draw_fast
from sdf2vec.roundtrip import (
    GODOT_HEAD,
    GODOT_MODES,
    ROUND_TRIPS,
    SHADERTOY_HEAD,
    SHADERTOY_TAIL,
    compare,
)
from tests.scenes import random_scene

SCENE = random_scene(("triangle", "box"), layers=9, seed=12, width=90, height=60, paints=("flat", "linear"))
SIZES = [(180, 120), (203, 90), (24, 16)]


@pytest.fixture(autouse=True)
def _quick_packing(monkeypatch):
    monkeypatch.setattr(packing, "SAMPLE", 1 << 17)


@cache
def rendered(scene, width, height):
    """Premultiplied RGBA, [H, W, 4], rendered once for all that draw it."""
    return reference.render(scene, width, height).permute(1, 2, 0).numpy()


def levels(drawn, wanted):
    return float(255 * np.abs(drawn - wanted).max())


expected = cache(roundtrip._expected)  # rendered once for all targets


def trip_of(target, engine):
    """How a target is drawn on an engine."""
    (trip,) = (trip for trip in ROUND_TRIPS[target] if trip.engine == engine)
    return trip


@pytest.mark.parametrize("compositing", ["over", "additive"])
@pytest.mark.parametrize(
    ("target", "engine", "layouts"),
    [
        ("shadertoy", "shadertoy", ("readable", "packed")),
        ("three", "three", ("readable", "data")),
        ("html", "page", ("auto",)),
        ("component", "element", ("auto",)),
        ("godot", "opengl", ("auto",)),
    ],
)
def test_hosts_draw_it(target, engine, layouts, compositing, require_engine):
    """On no ground: 8 bits, which a transparent picture loses another half level by. On a ground others are drawn."""
    require_engine(engine)
    scene = random_scene(compositing=compositing, layers=9, seed=12, width=90, height=60, transparent=True)
    for layout in layouts:
        made = Exports(scene).export(target, Options(layout=layout))
        for size in ((180, 120), (24, 16)) if layout == layouts[0] else ((24, 16),):
            result = compare(trip_of(target, engine), made, scene, size)
            assert result.largest_error <= made.error + 1.1, (layout, result)


@pytest.mark.parametrize("layout", ["readable", "table", "tiled", "packed"])
def test_chromium_draws_what_shadertoy_wraps(layout, require_engine):
    require_engine("chromium")
    made = shader(SCENE, "shadertoy", Options(layout=layout, framing="fit"))
    for width, height in SIZES:
        uniforms = {"iResolution": (float(width), float(height), 1.0)}
        drawn = webgl.render(SHADERTOY_HEAD + made.text + SHADERTOY_TAIL, width, height, uniforms)
        assert levels(drawn, rendered(SCENE, width, height)) <= made.error + 0.1


@pytest.mark.parametrize("layout", ["readable", "data"])
def test_chromium_draws_glsl(layout, require_engine):
    require_engine("chromium")
    made = shader(SCENE, "glsl", Options(layout=layout))
    for width, height in SIZES:
        drawn = webgl.render(made.text, width, height, {"resolution": (width, height)}, made.data)
        assert levels(drawn, rendered(SCENE, width, height)) <= 0.1


@pytest.mark.parametrize("compositing", ["over", "additive"])
def test_godot_text_is_glsl_but_for_its_names(compositing, require_engine):
    require_engine("glslang")
    scene = random_scene(compositing=compositing, layers=12, seed=3, width=90, height=60)
    text = shader(scene, "godot", Options()).text
    modes = ["shader_type canvas_item;", "render_mode unshaded, blend_premul_alpha;"]
    assert text.splitlines()[2:4] == modes
    assert glslang_validate(GODOT_HEAD + GODOT_MODES.sub("", text)) is None


TINT = """async (code) => {
  const adapter = await navigator.gpu.requestAdapter();
  const device = await adapter.requestDevice();
  const module = device.createShaderModule({ code });
  return (await module.getCompilationInfo()).messages.map((message) => message.message);
}"""


@pytest.mark.parametrize("compositing", ["over", "additive"])
def test_tint_accepts_wgsl(compositing, require_engine):
    """Chromium's WGSL compiler; naga, wgpu's, compiles the same texts wherever they are drawn."""
    require_engine("chromium")
    scene = random_scene(compositing=compositing, layers=12, seed=3)
    with chromium.opened({"index.html": "<p></p>"}, 64, 64) as page:
        assert page.evaluate(TINT, "fn f() -> i32 { return 1.5; }")
        for layout in ("readable", "data"):
            assert page.evaluate(TINT, shader(scene, "wgsl", Options(layout=layout)).text) == []


@pytest.fixture(scope="module")
def photo():
    """A real photo in 256 shapes."""
    data = pytest.importorskip("skimage.data")
    return sdf2vec.fit(data.coffee()[::4, ::4], 256, preset="fast", seed=1)


def test_a_fitted_photo_in_a_browser(photo, require_engine):
    """256 shapes, at three sizes, from 8 bits: at least 55 dB, and neither darker nor brighter."""
    require_engine("chromium")
    scene = photo
    for target, layout in (("glsl", "data"), ("shadertoy", "tiled")):
        made = shader(scene, target, Options(layout=layout, framing="fit"))
        text = SHADERTOY_HEAD + made.text + SHADERTOY_TAIL if target == "shadertoy" else made.text
        for width, height in ((150, 100), (107, 60), (64, 64)):
            uniforms = {"resolution": (width, height), "iResolution": (width, height, 1.0)}
            assert_alike(webgl.render(text, width, height, uniforms, made.data), scene)


def assert_alike(drawn, scene):
    """At least 55 dB from 8 bits, neither darker nor brighter."""
    height, width, channels = drawn.shape
    difference = np.round(255 * drawn) - 255 * rendered(scene, width, height)[..., :channels]
    assert 10 * np.log10(255**2 / np.mean(difference**2)) >= 55
    assert abs(difference.mean()) <= 0.1


def test_a_fitted_photo_by_webgpu(photo, require_engine):
    require_engine("webgpu")
    for layout in ("readable", "data"):
        made = shader(photo, "wgsl", Options(layout=layout))
        for width, height in ((150, 100), (107, 60), (64, 64)):
            uniforms = {"resolution": (width, height)}
            assert_alike(webgpu.render(made.text, width, height, uniforms=uniforms, texture=made.data), photo)


@pytest.mark.parametrize(
    ("target", "engine"), [("html", "page"), ("component", "element"), ("three", "three")]
)
def test_a_fitted_photo_on_a_page(target, engine, photo, require_engine):
    require_engine(engine)
    made = Exports(photo).export(target)
    for size in ((150, 100), (75, 50)):
        result = compare(trip_of(target, engine), made, photo, size, expected(photo, *size))
        assert result.psnr >= 55
        assert abs(result.mean_error) <= 0.1


def test_the_default_shadertoy_of_256_shapes(photo, require_engine):
    """Readable, within the 64 KiB that hosts take, and what is drawn is the render."""
    require_engine("opengl")
    made = shader(photo, "shadertoy", Options(title="coffee", framing="fit"))
    assert made.choice.layout == "readable"
    assert len(made.text.encode()) <= 65_536
    assert made.text.count("// 255 triangle") == 1
    assert levels(shown(made, 240, 135), rendered(photo, 240, 135)) <= 0.1


def test_the_packed_shadertoy_of_256_shapes(photo, require_engine):
    """At most 60 bytes a triangle, and within a level of the render on a full HD canvas (a part is looked at here)."""
    require_engine("opengl")
    made = shader(photo, "shadertoy", Options(title="coffee", framing="fit", layout="packed"))
    assert len(made.text.encode()) <= 60 * 256
    wanted = draw_fast(photo, 480, 270).permute(1, 2, 0).numpy()
    assert levels(shown(made, 480, 270), wanted) <= 1.0


def shown(made, width, height):
    uniforms = {"iResolution": (float(width), float(height), 1.0)}
    return opengl.render(SHADERTOY_HEAD + made.text + SHADERTOY_TAIL, width, height, uniforms)

"""Shader exports where they are used: a Shadertoy client, WebGL 2 and WebGPU in Chromium, three.js, Godot."""

import numpy as np
import pytest

import sdf2vec
from sdf2vec.engines import chromium, glslang_validate, opengl, shadertoy, threejs, webgl, webgpu
from sdf2vec.export import export, packing
from sdf2vec.export.options import Options
from sdf2vec.export.shader import shader
from sdf2vec.render import reference
from sdf2vec.roundtrip import SHADERTOY_HEAD, SHADERTOY_TAIL

from .scenes import random_scene

SCENE = random_scene(("triangle", "box"), layers=9, seed=12, width=90, height=60)
SIZES = [(180, 120), (203, 90), (24, 16)]


@pytest.fixture(autouse=True)
def _quick_packing(monkeypatch):
    monkeypatch.setattr(packing, "SAMPLE", 1 << 17)


def rendered(scene, width, height):
    """Premultiplied RGBA, [H, W, 4]."""
    return reference.render(scene, width, height).permute(1, 2, 0).numpy()


def levels(drawn, expected):
    return float(255 * np.abs(drawn - expected).max())


@pytest.mark.parametrize("layout", ["readable", "packed"])
def test_a_shadertoy_client_draws_it(layout, require_engine):
    require_engine("shadertoy")
    made = shader(SCENE, "shadertoy", Options(layout=layout))
    drawn = shadertoy.render(made.text, 120, 80)
    assert levels(drawn, rendered(SCENE, 120, 80)) <= made.error + 0.6  # it gives 8 bits


@pytest.mark.parametrize("layout", ["readable", "table", "tiled", "packed"])
def test_chromium_draws_what_shadertoy_wraps(layout, require_engine):
    require_engine("chromium")
    made = shader(SCENE, "shadertoy", Options(layout=layout))
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


THREE_PAGE = """<!DOCTYPE html><style>*{{margin:0}}canvas{{display:block}}</style><script type="module">
import * as THREE from "./three.module.min.js";
import {{ createMaterial, aspect }} from "./material.js";
const renderer = new THREE.WebGLRenderer({{ antialias: false }});
renderer.setSize({width}, {height});
document.body.append(renderer.domElement);
const scene = new THREE.Scene();
scene.add(new THREE.Mesh(new THREE.PlaneGeometry(aspect, 1), createMaterial(THREE)));
renderer.render(scene, new THREE.OrthographicCamera(-aspect / 2, aspect / 2, 0.5, -0.5, -1, 1));
document.title = "drawn";
</script>"""


@pytest.mark.parametrize("layout", ["readable", "data"])
def test_three_js_draws_it(layout, require_engine):
    require_engine("chromium")
    require_engine("three")
    module = shader(SCENE, "three", Options(layout=layout)).text
    width, height = 240, 160
    page = THREE_PAGE.format(width=width, height=height)
    with chromium.opened(
        {"index.html": page, "material.js": module, **threejs.files()}, width, height
    ) as shown:
        shown.wait_for_function("document.title === 'drawn'")
        shown.wait_for_timeout(300)
        assert levels(chromium.screenshot(shown, "canvas"), rendered(SCENE, width, height)) <= 1.0


# Godot's names in plain GLSL; its own compiler can't be had here.
GODOT_AS_GLSL = """#version 330
uniform vec2 resolution;
out vec4 fragColor;
#define UV vec2(gl_FragCoord.x / resolution.x, 1.0 - gl_FragCoord.y / resolution.y)
#define COLOR fragColor
#define fragment main
"""


@pytest.mark.parametrize("compositing", ["over", "additive"])
def test_godot_text_is_glsl_but_for_its_names(compositing, require_engine):
    require_engine("glslang")
    require_engine("opengl")
    scene = random_scene(compositing=compositing, layers=12, seed=3, width=90, height=60)
    text = shader(scene, "godot", Options()).text
    lines = text.splitlines()
    assert lines[2:4] == ["shader_type canvas_item;", "render_mode unshaded, blend_premul_alpha;"]
    plain = GODOT_AS_GLSL + "\n".join([*lines[:2], *lines[4:]])
    assert glslang_validate(plain) is None
    drawn = opengl.render(plain, 180, 120, {"resolution": (180.0, 120.0)})
    assert levels(drawn, rendered(scene, 180, 120)) <= 0.1


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
        made = shader(scene, target, Options(layout=layout))
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


def test_a_fitted_photo_on_a_page(photo, require_engine):
    require_engine("chromium")
    text = export(photo, "html", Options())
    for window in ((332, 400), (232, 200), (110, 600)):
        with chromium.opened({"index.html": text}, *window) as page:
            page.wait_for_function("document.querySelector('canvas').width > 1")
            page.wait_for_timeout(300)
            size = "[document.querySelector('canvas').width, document.querySelector('canvas').height]"
            width, height = page.evaluate(size)
            assert_alike(chromium.screenshot(page, "canvas")[:height, :width, :3], photo)


def test_the_default_shadertoy_of_256_shapes(photo, require_engine):
    """Small, and within a level of the render on a full HD canvas (a part of which is looked at here)."""
    require_engine("opengl")
    scene = photo
    made = shader(scene, "shadertoy", Options(title="coffee"))
    assert made.choice.layout == "packed"
    assert len(made.text.encode()) <= 15_000
    uniforms = {"iResolution": (960.0, 540.0, 1.0)}
    drawn = opengl.render(SHADERTOY_HEAD + made.text + SHADERTOY_TAIL, 960, 540, uniforms)
    assert levels(drawn, rendered(scene, 960, 540)) <= 1.0

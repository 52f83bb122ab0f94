"""Every engine draws known pixels: where they lie, what they are worth, and what is refused."""

import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from sdf2vec.engines import ENGINES, EngineError, chromium, engine, glslang_validate, opengl, webgpu
from tests import conftest

SIZES = [(5, 3), (3, 7), (1, 1), (64, 1), (65, 33)]
GLSL_VERSIONS = ["300 es", "330"]

GLSL_POSITION = "void main() { color = vec4(gl_FragCoord.xy, -gl_FragCoord.y, 1000.25); }\n"

GLSL_UNIFORMS = (
    "uniform float one;\nuniform vec2 resolution;\nuniform vec3 unused;\n"
    "void main() { color = vec4(resolution, one, 1.0); }\n"
)

GLSL_TEXTURE = (
    "uniform sampler2D data;\nvoid main() { color = texelFetch(data, ivec2(gl_FragCoord.xy), 0); }\n"
)

WGSL_POSITION = """
@fragment
fn fragment_main(@builtin(position) position: vec4f) -> @location(0) vec4f {
    return vec4f(position.xy, -position.y, 1000.25);
}
"""

WGSL_RESOURCES = """
// @vertex @group(0) @binding(7) var<uniform> only_a_comment: f32;
@group(0) @binding(0) var<uniform> resolution: vec2f;
@group(0) @binding(1) var<storage, read> data: array<vec4f>;
@group(0) @binding(2) var<uniform> offset: vec3f;
@group(0) @binding(3) var<uniform> declared_but_never_read: f32;

@fragment
fn fragment_main(@builtin(position) position: vec4f) -> @location(0) vec4f {
    let cell = vec2u(position.xy);
    return data[cell.y * u32(resolution.x) + cell.x] + vec4f(offset, 0.0);
}
"""

SVG_HALF_RED = """<svg xmlns="http://www.w3.org/2000/svg" width="8" height="4" viewBox="0 0 8 4">
<rect width="4" height="4" fill="#f00" fill-opacity="0.5"/></svg>"""


def _glsl(version, body):
    header = "precision highp float;\nprecision highp sampler2D;\nout vec4 color;\n"
    return f"#version {version}\n{header}{body}"


def _positions(width, height):
    y, x = np.mgrid[:height, :width].astype(np.float32) + np.float32(0.5)
    return x, y


def _noise(width, height):
    values = np.random.default_rng(0).normal(0, 100, (height, width, 4))
    return values.astype(np.float32)


def _growth(render):
    """Mebibytes by which this process grows through 40 renders of 4 MiB each, after a first one."""
    pages = Path("/proc/self/statm")
    if not pages.exists():
        pytest.skip("only Linux tells the size of a process in /proc")
    render()
    before = int(pages.read_text().split()[1])
    for _ in range(40):
        render()
    return (int(pages.read_text().split()[1]) - before) * os.sysconf("SC_PAGE_SIZE") / 2**20


@pytest.fixture
def gl(require_engine):
    require_engine("opengl")


@pytest.fixture
def gpu(require_engine):
    require_engine("webgpu")


@pytest.fixture
def svg_engine(request, require_engine):
    require_engine(request.param)
    return ENGINES[request.param]


@pytest.mark.usefixtures("gl")
class TestOpenGL:
    @pytest.mark.parametrize("version", GLSL_VERSIONS)
    @pytest.mark.parametrize(("width", "height"), SIZES)
    def test_pixel_centres_rows_and_unclamped_values(self, version, width, height):
        pixels = opengl.render(_glsl(version, GLSL_POSITION), width, height)
        x, y = _positions(width, height)
        from_below = height - y
        expected = np.stack([x, from_below, -from_below, np.full_like(x, 1000.25)], axis=-1)
        assert pixels.dtype == np.float32
        np.testing.assert_array_equal(pixels, expected)

    @pytest.mark.parametrize("version", GLSL_VERSIONS)
    def test_uniforms_used_unused_and_unknown(self, version):
        values: engine.Uniforms = {
            "one": 0.1,
            "resolution": (3.0, 2.0),
            "unused": (1.0, 2.0, 3.0),
            "unknown": 4.0,
        }
        pixels = opengl.render(_glsl(version, GLSL_UNIFORMS), 3, 2, uniforms=values)
        np.testing.assert_array_equal(pixels[1, 2], np.array([3, 2, 0.1, 1], np.float32))

    @pytest.mark.parametrize("version", GLSL_VERSIONS)
    def test_texture_column_and_row(self, version):
        texture = _noise(5, 3)
        pixels = opengl.render(_glsl(version, GLSL_TEXTURE), 5, 3, texture=texture)
        np.testing.assert_array_equal(pixels, texture[::-1])  # gl_FragCoord counts rows from below

    def test_one_render_leaves_nothing_for_the_next(self):
        shader = _glsl("330", GLSL_TEXTURE)
        opengl.render(shader, 4, 4, texture=_noise(4, 4))
        assert not opengl.render(_glsl("330", GLSL_UNIFORMS), 4, 4)[..., :3].any()

    def test_memory_is_given_back(self):
        shader = _glsl("330", GLSL_POSITION)
        assert _growth(lambda: opengl.render(shader, 512, 512)) < 80

    def test_comment_before_the_version_line(self):
        opengl.render("// a comment\n" + _glsl("330", GLSL_POSITION), 2, 2)

    @pytest.mark.parametrize("version", GLSL_VERSIONS)
    def test_refused_shader_names_the_line(self, version):
        broken = _glsl(version, "void main() { color = vec4(nonsense); }\n")
        with pytest.raises(EngineError, match=r"line 5: .*nonsense") as caught:
            opengl.render(broken, 2, 2)
        assert "\n" not in str(caught.value)
        assert "nonsense" in caught.value.log

    def test_refused_by_the_linker(self):
        broken = _glsl("330", "float f();\nvoid main() { color = vec4(f()); }\n")
        with pytest.raises(EngineError, match=r"^OpenGL refuses: GLSL Linker failed .*`f'") as caught:
            opengl.render(broken, 2, 2)
        assert "\n" not in str(caught.value)

    def test_version_line_is_demanded(self):
        with pytest.raises(EngineError, match="#version"):
            opengl.render("void main() {}", 2, 2)


@pytest.mark.parametrize(
    ("line", "number", "text"),
    [
        ("0:2(31): error: `foo' undeclared", 2, "`foo' undeclared"),
        ("0(12) : error C1503: undefined variable", 12, "C1503: undefined variable"),
        ("ERROR: 0:7: 'foo' : undeclared identifier", 7, "'foo' : undeclared identifier"),
    ],
)
def test_line_number_in_every_drivers_wording(line, number, text):
    assert opengl._summary(f"GLSL Compiler failed\n\n{line}\n") == (
        f"OpenGL refuses the shader at line {number}: {text}"
    )


@pytest.mark.usefixtures("gpu")
class TestWebGPU:
    @pytest.mark.parametrize(("width", "height"), SIZES)
    def test_pixel_centres_rows_and_unclamped_values(self, width, height):
        pixels = webgpu.render(WGSL_POSITION, width, height)
        x, y = _positions(width, height)
        expected = np.stack([x, y, -y, np.full_like(x, 1000.25)], axis=-1)
        assert pixels.dtype == np.float32
        np.testing.assert_array_equal(pixels, expected)

    def test_uniforms_and_storage(self):
        texture = _noise(5, 3)
        values: engine.Uniforms = {
            "resolution": (5.0, 3.0),
            "offset": (1.0, 2.0, 3.0),
            "declared_but_never_read": 1.0,
            "unknown": 2.0,
        }
        pixels = webgpu.render(WGSL_RESOURCES, 5, 3, uniforms=values, texture=texture)
        np.testing.assert_allclose(pixels, texture + np.array([1, 2, 3, 0], np.float32), rtol=1e-6)

    def test_declared_resource_without_a_value(self):
        with pytest.raises(EngineError, match=r"var<uniform> resolution"):
            webgpu.render(WGSL_RESOURCES, 5, 3, texture=_noise(5, 3))

    def test_module_with_its_own_vertex_stage(self):
        right_half = webgpu.VERTEX_SHADER.replace("- 1.0", "- vec2f(0.0, 1.0)")
        pixels = webgpu.render(right_half + WGSL_POSITION, 4, 2)
        assert not pixels[:, :2].any()
        assert pixels[:, 2:].all()

    def test_entry_point_by_name(self):
        second = WGSL_POSITION.replace("fragment_main", "other").replace("1000.25", "2.0")
        pixels = webgpu.render(WGSL_POSITION + second, 1, 1, entry="other")
        assert pixels[0, 0, 3] == 2
        with pytest.raises(EngineError):
            webgpu.render(WGSL_POSITION, 1, 1, entry="absent")

    @pytest.mark.parametrize(
        ("broken", "said"),
        [
            ("return vec4f(nonsense)", r"line 4: .*nonsense"),
            ("var three = array<f32, 3>(); return vec4f(three[5])", r"line 4: .*out of"),
        ],
    )
    def test_refused_module_names_the_line(self, broken, said):
        code = WGSL_POSITION.replace("return vec4f(position.xy, -position.y, 1000.25)", broken)
        with pytest.raises(EngineError, match=said) as caught:
            webgpu.render(code, 2, 2)
        assert "\n" not in str(caught.value)
        assert "Caused by" in caught.value.log

    def test_memory_is_given_back(self):
        assert _growth(lambda: webgpu.render(WGSL_POSITION, 512, 512)) < 80

    def test_nothing_on_stderr(self):
        program = f"from sdf2vec.engines import webgpu; webgpu.render({WGSL_POSITION!r}, 2, 2)"
        environment = {name: value for name, value in os.environ.items() if name != "XDG_RUNTIME_DIR"}
        done = subprocess.run(
            [sys.executable, "-c", program], env=environment, capture_output=True, check=True
        )
        assert done.stderr == b""


SVG_ENGINES = ["resvg", "librsvg", "cairosvg", "chromium", "firefox"]


@pytest.mark.parametrize("svg_engine", SVG_ENGINES, indirect=True)
class TestSvg:
    def test_straight_alpha(self, svg_engine):
        pixels = svg_engine.render(SVG_HALF_RED, 8, 4)
        expected = np.zeros((4, 8, 4), np.float32)
        expected[:, :4] = (1, 0, 0, 128 / 255)
        assert pixels.dtype == np.float32
        np.testing.assert_allclose(pixels, expected, atol=1.001 / 128)  # some keep 8 premultiplied bits

    @pytest.mark.parametrize("svg", [SVG_HALF_RED, SVG_HALF_RED.replace(' viewBox="0 0 8 4"', "")])
    def test_scales_to_the_size_asked_for(self, svg_engine, svg):
        pixels = svg_engine.render(svg, 24, 12)
        assert pixels.shape == (12, 24, 4)
        assert (pixels[:, :12, 3] > 0.49).all()
        assert not pixels[:, 12:].any()

    def test_other_proportions_are_centred(self, svg_engine):
        pixels = svg_engine.render(SVG_HALF_RED, 8, 8)
        assert pixels.shape == (8, 8, 4)
        assert not pixels[[0, 1, 6, 7]].any()
        assert pixels[2:6, :4, 0].all()

    def test_a_large_and_a_small_canvas(self, svg_engine):
        assert svg_engine.render(SVG_HALF_RED, 1, 1).shape == (1, 1, 4)
        large = svg_engine.render(SVG_HALF_RED, 1500, 900)
        assert large.shape == (900, 1500, 4)
        assert (large[80:-80, :740, 0] == 1).all()

    @pytest.mark.parametrize("svg", ["", "<svg", "<p/>"])
    def test_refused_svg(self, svg_engine, svg):
        with pytest.raises(EngineError) as caught:
            svg_engine.render(svg, 4, 4)
        assert "\n" not in str(caught.value)


BLURRED = """<svg xmlns="http://www.w3.org/2000/svg" width="32" height="32" viewBox="0 0 32 32">
<filter id="b"><feGaussianBlur stdDeviation="3"/></filter>
<rect width="16" height="32" fill="#fff" filter="url(#b)"/></svg>"""


@pytest.mark.parametrize("name", SVG_ENGINES)
def test_which_engines_see_a_blur(require_engine, name):
    """CairoSVG draws the sharp shape and says nothing: it can't judge what has filters."""
    require_engine(name)
    pixels = ENGINES[name].render(BLURRED, 32, 32)
    plain = ENGINES[name].render(BLURRED.replace(' filter="url(#b)"', ""), 32, 32)
    assert (np.abs(pixels - plain).max() > 0.4) == (name != "cairosvg")


class TestChromiumPages:
    def test_files_are_found_and_nothing_else(self, require_engine):
        require_engine("chromium")
        files = {"index.html": "<!DOCTYPE html><p id=a>hello", "data/numbers.json": "[1, 2, 3]"}
        with chromium.opened(files, 40, 30) as page:
            assert page.evaluate("document.getElementById('a').textContent") == "hello"
            assert page.evaluate("fetch('data/numbers.json').then(r => r.json())") == [1, 2, 3]
            assert page.evaluate("fetch('other.json').then(() => true, () => false)") is False
            assert page.evaluate("fetch('http://192.0.2.1/').then(() => true, () => false)") is False
            assert page.evaluate("[innerWidth, innerHeight, devicePixelRatio]") == [40, 30, 1]

    def test_screenshots_of_a_page_and_of_an_element(self, require_engine):
        require_engine("chromium")
        page_text = (
            "<!DOCTYPE html><style>*{margin:0}</style><div id=d style='width:5px;height:3px;background:#f80'>"
        )
        with chromium.opened({"index.html": page_text}, 40, 30) as page:
            whole, element = chromium.screenshot(page), chromium.screenshot(page, "#d")
        assert (whole.shape, element.shape) == ((30, 40, 4), (3, 5, 4))
        np.testing.assert_allclose(element, np.broadcast_to((1, 136 / 255, 0, 1), (3, 5, 4)), atol=1e-6)
        assert not whole[3:].any()

    def test_webgl2_and_webgpu_are_there(self, require_engine):
        require_engine("chromium")
        with chromium.opened({"index.html": "<!DOCTYPE html><canvas>"}, 40, 30) as page:
            assert page.evaluate("!!document.querySelector('canvas').getContext('webgl2')")
            assert page.evaluate("navigator.gpu.requestAdapter().then(a => a !== null)")

    def test_pages_do_not_need_each_other(self, require_engine):
        require_engine("chromium")
        with (
            chromium.opened({"index.html": "a"}, 4, 3) as first,
            chromium.opened({"index.html": "b"}, 5, 6) as b,
        ):
            assert first.evaluate("document.body.textContent") == "a"
            assert b.evaluate("document.body.textContent") == "b"


def test_glslang_judges(require_engine):
    require_engine("glslang")
    assert glslang_validate(_glsl("300 es", GLSL_POSITION)) is None
    said = glslang_validate(_glsl("300 es", GLSL_POSITION).replace("1000.25", "nonsense"))
    assert said is not None
    assert said.startswith("ERROR: 0:5: 'nonsense'")


@pytest.mark.parametrize("name", ENGINES)
@pytest.mark.parametrize("size", [(0, 1), (1, -1), (100_000, 1), (16_000, 16_000)])
def test_absurd_sizes(name, size):
    with pytest.raises(EngineError, match="cannot draw"):
        ENGINES[name].render("", *size)


def test_reason_is_one_line_with_advice():
    def no_package():
        raise ModuleNotFoundError("No module named 'wgpu'", name="wgpu")

    def no_driver():
        raise OSError("cannot open\nlibEGL.so")

    assert engine.reason_missing(lambda: None, "advice") is None
    assert engine.reason_missing(no_package, "advice") == (
        "the Python package wgpu is not installed: pip install 'sdf2vec[check]'"
    )
    assert engine.reason_missing(no_driver, "do this") == "cannot open libEGL.so; do this"


def test_render_on_a_missing_engine():
    def probe():
        raise OSError("no driver")

    with pytest.raises(EngineError, match="no driver"):
        replace(ENGINES["opengl"], probe=probe).render(_glsl("330", GLSL_POSITION), 2, 2)


PDF_HALF_RED = b"""%PDF-1.4
1 0 obj <</Type/Catalog/Pages 2 0 R>> endobj
2 0 obj <</Type/Pages/Kids[3 0 R]/Count 1>> endobj
3 0 obj <</Type/Page/Parent 2 0 R/MediaBox[0 0 8 4]/Contents 4 0 R
/Resources<</ExtGState<</A <</ca 0.5>>>>>>>> endobj
4 0 obj <</Length 28>> stream
/A gs 1 0 0 rg 0 0 4 2 re f
endstream endobj
trailer <</Root 1 0 R>>
%%EOF"""


class TestPdf:
    def test_straight_alpha_and_rows(self, require_engine):
        require_engine("pdfium")
        pixels = ENGINES["pdfium"].render(PDF_HALF_RED, 16, 8)
        expected = np.zeros((8, 16, 4), np.float32)
        expected[4:, :8] = (1, 0, 0, 0.5)
        assert pixels.dtype == np.float32
        np.testing.assert_allclose(pixels, expected, atol=1 / 128)

    def test_refused(self, require_engine):
        require_engine("pdfium")
        with pytest.raises(EngineError, match="PDFium refuses"):
            ENGINES["pdfium"].render(b"", 4, 4)


@pytest.mark.parametrize(
    ("ci", "outcome"),
    [("", pytest.skip.Exception), ("0", pytest.skip.Exception), ("true", pytest.fail.Exception)],
)
def test_missing_engine_skips_for_a_user_and_fails_in_ci(monkeypatch, require_engine, ci, outcome):
    monkeypatch.setenv("CI", ci)
    monkeypatch.setitem(conftest.MISSING, "opengl", lambda: "no driver")
    with pytest.raises(outcome, match="opengl: no driver"):
        require_engine("opengl")


def test_engines_come_without_torch_and_packages():
    packages = {"torch", "moderngl", "wgpu", "resvg_py", "cairosvg", "playwright"}
    program = f"import sys, sdf2vec.engines; print({packages} & set(sys.modules))"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "set()"

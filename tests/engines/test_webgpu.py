"""WebGPU draws known pixels: where they lie, what they are worth, and what is refused."""

import os
import subprocess
import sys

import numpy as np
import pytest

from sdf2vec.engines import EngineError, engine, webgpu
from tests.engines.known_pixels import (
    SIZES,
    growth,
    noise,
    positions,
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


@pytest.fixture
def gpu(require_engine):
    require_engine("webgpu")


@pytest.mark.usefixtures("gpu")
class TestWebGPU:
    @pytest.mark.parametrize(("width", "height"), SIZES)
    def test_pixel_centres_rows_and_unclamped_values(self, width, height):
        pixels = webgpu.render(WGSL_POSITION, width, height)
        x, y = positions(width, height)
        expected = np.stack([x, y, -y, np.full_like(x, 1000.25)], axis=-1)
        assert pixels.dtype == np.float32
        np.testing.assert_array_equal(pixels, expected)

    def test_uniforms_and_storage(self):
        texture = noise(5, 3)
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
            webgpu.render(WGSL_RESOURCES, 5, 3, texture=noise(5, 3))

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
        assert growth(lambda: webgpu.render(WGSL_POSITION, 512, 512)) < 80

    def test_nothing_on_stderr(self):
        program = f"from sdf2vec.engines import webgpu; webgpu.render({WGSL_POSITION!r}, 2, 2)"
        environment = {name: value for name, value in os.environ.items() if name != "XDG_RUNTIME_DIR"}
        done = subprocess.run(
            [sys.executable, "-c", program], env=environment, capture_output=True, check=True
        )
        assert done.stderr == b""

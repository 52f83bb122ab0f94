"""OpenGL draws known pixels: where they lie, what they are worth, and what is refused."""

import numpy as np
import pytest

from sdf2vec.engines import EngineError, engine, opengl
from tests.engines.known_pixels import (
    GLSL_POSITION,
    GLSL_TEXTURE,
    GLSL_UNIFORMS,
    GLSL_VERSIONS,
    SIZES,
    glsl,
    growth,
    noise,
    positions,
)


@pytest.fixture
def gl(require_engine):
    require_engine("opengl")


@pytest.mark.usefixtures("gl")
class TestOpenGL:
    @pytest.mark.parametrize("version", GLSL_VERSIONS)
    @pytest.mark.parametrize(("width", "height"), SIZES)
    def test_pixel_centres_rows_and_unclamped_values(self, version, width, height):
        pixels = opengl.render(glsl(version, GLSL_POSITION), width, height)
        x, y = positions(width, height)
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
        pixels = opengl.render(glsl(version, GLSL_UNIFORMS), 3, 2, uniforms=values)
        np.testing.assert_array_equal(pixels[1, 2], np.array([3, 2, 0.1, 1], np.float32))

    @pytest.mark.parametrize("version", GLSL_VERSIONS)
    def test_texture_column_and_row(self, version):
        texture = noise(5, 3)
        pixels = opengl.render(glsl(version, GLSL_TEXTURE), 5, 3, texture=texture)
        np.testing.assert_array_equal(pixels, texture[::-1])  # gl_FragCoord counts rows from below

    def test_one_render_leaves_nothing_for_the_next(self):
        shader = glsl("330", GLSL_TEXTURE)
        opengl.render(shader, 4, 4, texture=noise(4, 4))
        assert not opengl.render(glsl("330", GLSL_UNIFORMS), 4, 4)[..., :3].any()

    def test_memory_is_given_back(self):
        shader = glsl("330", GLSL_POSITION)
        assert growth(lambda: opengl.render(shader, 512, 512)) < 80

    def test_comment_before_the_version_line(self):
        opengl.render("// a comment\n" + glsl("330", GLSL_POSITION), 2, 2)

    @pytest.mark.parametrize("version", GLSL_VERSIONS)
    def test_refused_shader_names_the_line(self, version):
        broken = glsl(version, "void main() { color = vec4(nonsense); }\n")
        with pytest.raises(EngineError, match=r"line 5: .*nonsense") as caught:
            opengl.render(broken, 2, 2)
        assert "\n" not in str(caught.value)
        assert "nonsense" in caught.value.log

    def test_refused_by_the_linker(self):
        broken = glsl("330", "float f();\nvoid main() { color = vec4(f()); }\n")
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

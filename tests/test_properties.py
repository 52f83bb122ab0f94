"""Whatever scene is valid: it renders finite, is read as written, and a shader of it draws the same."""

from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import sdf2vec
from sdf2vec.render.reference import render
from sdf2vec.roundtrip import check
from tests.fuzz import domain

SCENES = st.builds(
    domain.scene,
    st.integers(0, 2**32 - 1),
    layers=st.integers(0, 3),
    longest=st.integers(1, 2),
    compositing=st.sampled_from(["over", "additive"]),
)
KEPT: dict[str, Any] = {
    "deadline": None,
    "derandomize": True,
    "database": None,
    "suppress_health_check": list(HealthCheck),
}


@settings(max_examples=25, **KEPT)
@given(SCENES)
def test_scenes_render_finite_and_are_read_as_written(scene):
    assert sdf2vec.loads(sdf2vec.dumps(scene)) == scene
    assert bool(render(scene, 24, 16).isfinite().all())


@settings(max_examples=6, **KEPT)
@given(SCENES)
def draws_the_same(scene):
    for result in check(scene, ["glsl"], [(24, 16)]):
        assert result.verdict != "differs", (result.largest_error, result.psnr)


def test_shaders_draw_the_same(require_engine):
    require_engine("opengl")
    draws_the_same()


@pytest.mark.parametrize("target", ["glsl", "wgsl", "shadertoy", "json"])
def test_scenes_are_exported(target):
    @settings(max_examples=5, **KEPT)
    @given(SCENES)
    def exported(scene):
        assert sdf2vec.export(scene, target)

    exported()

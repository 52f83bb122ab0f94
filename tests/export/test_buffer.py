"""A Shadertoy of two tabs, drawn as Shadertoy draws it: Buffer A reads what it has drawn, Image what is there."""

import numpy as np
import pytest

import sdf2vec
from sdf2vec.engines import glslang_validate, opengl
from sdf2vec.render import reference
from sdf2vec.roundtrip import IMAGE_TAB, ROUND_TRIPS, SHADERTOY_HEAD, SHADERTOY_TAIL, compare
from tests.scenes import random_scene

SIZE = (60, 40)
SAME = 0.1 / 255


def tabs_of(scene, **options):
    text = sdf2vec.export(scene, "shadertoy", layout="buffer", framing="fit", **options)
    assert isinstance(text, str)
    assert text.startswith("// --- Buffer A ---\n")
    buffer, image = text.split(IMAGE_TAB)
    return buffer, image


def drawn(tab, before, frame, size=SIZE):
    """One frame of a tab, [H, W, 4] from below, as its successor reads it."""
    uniforms = {"iResolution": (*map(float, size), 1.0), "iFrame": frame}
    pixels = opengl.render(SHADERTOY_HEAD + tab + SHADERTOY_TAIL, size[0], size[1], uniforms, before)
    return pixels[::-1]


def assert_shows(image, scene, size=SIZE):
    expected = reference.render(scene, *size).permute(1, 2, 0).numpy()[::-1]
    np.testing.assert_allclose(image, expected, atol=SAME)


@pytest.mark.parametrize("transparent", [False, True])
def test_it_is_drawn_once_for_every_size(transparent, require_engine):
    require_engine("opengl")
    scene = random_scene(("circle", "box"), layers=6, seed=3, width=60, height=40, transparent=transparent)
    buffer, image = tabs_of(scene)
    nothing = np.zeros((40, 60, 4), np.float32)
    first = drawn(buffer, nothing, 0)
    assert_shows(drawn(image, first, 0), scene)
    np.testing.assert_array_equal(drawn(buffer, first, 1), first)
    painted = first * [0.0, 0.0, 0.0, 1.0]
    assert (
        drawn(buffer, painted.astype(np.float32), 2)[..., :3].max() == 0.0
    )  # what is there is not drawn again
    assert_shows(drawn(image, drawn(buffer, painted.astype(np.float32), 0), 0), scene)
    larger = drawn(buffer, np.zeros((80, 90, 4), np.float32), 3, (90, 80))
    assert_shows(drawn(image, larger, 3, (90, 80)), scene, (90, 80))


def test_both_tabs_are_valid_and_check_draws_them(require_engine):
    for engine in ("opengl", "glslang"):
        require_engine(engine)
    scene = random_scene(("triangle",), layers=5, seed=2)
    for tab in tabs_of(scene):
        assert glslang_validate(SHADERTOY_HEAD + tab + SHADERTOY_TAIL) is None
    made = sdf2vec.exported(scene, "shadertoy", layout="buffer", framing="fit")
    assert "in Buffer A" in made.notes[0]
    assert compare(ROUND_TRIPS["shadertoy"][0], made, scene, (90, 50)).largest_error < 0.25


def test_what_has_no_buffers_or_moves_is_refused():
    scene = random_scene(("triangle",), layers=2)
    with pytest.raises(sdf2vec.Sdf2vecError, match="layout buffer is not possible here"):
        sdf2vec.export(scene, "glsl", layout="buffer")
    with pytest.raises(sdf2vec.Sdf2vecError, match="leave out --layout buffer, or --animate"):
        sdf2vec.export(scene, "shadertoy", layout="buffer", animate=True)


def test_a_limit_leaves_the_tabs_apart():
    scene = random_scene(("triangle",), layers=2)
    text = sdf2vec.exported(scene, "shadertoy", layout="buffer", max_bytes=100_000).data
    assert str(text).count("// ---") == 2

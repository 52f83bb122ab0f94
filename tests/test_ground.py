"""A ground with an alpha of its own: in scene files, in renders, in every export."""

import io
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

import sdf2vec
from sdf2vec import Layer, Scene, Shape
from sdf2vec.export.options import Options
from sdf2vec.exports import Exports
from sdf2vec.roundtrip import ROUND_TRIPS, compare
from sdf2vec.scene import SceneError
from tests.scenes import random_scene

SHEER = (0.8, 0.3, 0.1, 0.4)
DISC = Layer((Shape.of("circle", (0.0, 0.0, 1.0), center=(0, 0), radius=0.25),), 0.02, 0.5)


def test_a_scene_file_says_it():
    scene = Scene(8, 8, (DISC,), SHEER)
    assert '"background": [0.8, 0.3, 0.1, 0.4]' in sdf2vec.dumps(scene)
    assert sdf2vec.loads(sdf2vec.dumps(scene)) == scene
    assert scene.ground == pytest.approx((0.32, 0.12, 0.04, 0.4))
    assert not scene.opaque


def test_there_is_one_way_to_say_opaque_and_transparent():
    assert Scene(8, 8, (), (0.8, 0.3, 0.1, 1.0)).background == (0.8, 0.3, 0.1)
    assert Scene(8, 8, (), (0.8, 0.3, 0.1, 0.000001)).background is None
    assert Scene(8, 8, (), (0.8, 0.3, 0.1)).ground == (0.8, 0.3, 0.1, 1.0)
    assert Scene(8, 8, (), None).ground == (0.0, 0.0, 0.0, 0.0)


@pytest.mark.parametrize(
    "ground", [(0, 0, 0, -0.1), (0, 0, 0, 1.1), (2, 0, 0, 0.5), (0, 0), (0,) * 5, (0, 0, 0, "x")]
)
def test_what_is_no_ground_is_refused(ground):
    with pytest.raises(SceneError, match=r"^background"):
        Scene(8, 8, (), ground)


def test_a_render_lies_on_it():
    """By hand: blue at one half over 0.4 of a colour; beyond the disc the ground, straight."""
    drawn = sdf2vec.render(Scene(40, 40, (DISC,), SHEER))
    alpha = 0.5 + 0.5 * 0.4
    middle = [0.5 * 0.4 * c / alpha for c in (0.8, 0.3)] + [(0.5 + 0.5 * 0.4 * 0.1) / alpha, alpha]
    np.testing.assert_allclose(drawn[20, 20], middle, atol=1e-4)
    np.testing.assert_allclose(drawn[0, 0], SHEER, atol=1e-6)


@pytest.mark.parametrize("compositing", ["over", "additive"])
@pytest.mark.parametrize("target", ["glsl", "shadertoy", "wgsl", "godot"])
def test_shaders_draw_it(target, compositing, require_engine):
    trip = ROUND_TRIPS[target][0]
    require_engine(trip.engine)
    scene = replace(random_scene(compositing=compositing, layers=6, seed=2), background=SHEER)
    made = (
        sdf2vec.exported(scene, target)
        if target == "godot"
        else sdf2vec.exported(scene, target, framing="fit")
    )
    assert compare(trip, made, scene, (60, 40)).largest_error < 0.25


@pytest.mark.parametrize(
    ("target", "engine", "options"),
    [
        ("svg", "resvg", {}),
        ("svg", "resvg", {"max_bytes": 3000}),
        ("svg", "cairosvg", {"svg_profile": "portable"}),
        ("pdf", "pdfium", {}),
    ],
)
def test_drawings_show_it(target, engine, options, require_engine):
    trip = next(trip for trip in ROUND_TRIPS[target] if trip.engine == engine)
    require_engine(engine)
    scene = Scene(60, 40, (DISC,), SHEER)
    made = Exports(scene).export(target, Options(**options))
    assert compare(trip, made, scene, (60, 40)).psnr > 40.0


def test_pictures_keep_it_and_jpeg_lies_on_white():
    scene = Scene(8, 8, (), SHEER)
    for target in ("png", "webp"):
        shown = np.asarray(Image.open(io.BytesIO(sdf2vec.exported(scene, target).raw)))
        assert np.abs(shown[4, 4] / 255 - SHEER).max() < 0.01
    white = np.asarray(Image.open(io.BytesIO(sdf2vec.exported(scene, "jpg").raw)))[4, 4] / 255
    assert np.abs(white - [0.6 + 0.4 * c for c in SHEER[:3]]).max() < 0.02

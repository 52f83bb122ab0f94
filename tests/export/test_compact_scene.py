"""The compact scene: how near it comes to the render, in how many bytes, and what the command line makes of it."""

import random
from dataclasses import replace

import numpy as np
import pytest

import sdf2vec
from sdf2vec import Layer, Scene, Shape
from sdf2vec.export import compact_scene
from sdf2vec.export.options import Options
from sdf2vec.fit import settling
from sdf2vec.fit.conversion import picture_of
from sdf2vec.fit.settling import settled, views_of
from sdf2vec.image import load
from sdf2vec.quality import psnr_of
from tests.scenes import random_scene


@pytest.fixture(autouse=True)
def quick(monkeypatch):
    monkeypatch.setattr(settling, "PHASES", [replace(phase, steps=30) for phase in settling.PHASES])


def triangles(count, side):
    """Small soft triangles on each other."""
    r = random.Random(3)
    layers = []
    for _ in range(count):
        x, y = r.uniform(-0.5, 0.5), r.uniform(-0.5, 0.5)
        corners = tuple(v + r.gauss(0, 0.15) for v in (x, y) * 3)
        color = (r.random(), r.random(), r.random())
        layers.append(Layer((Shape("triangle", corners, color),), r.uniform(0.02, 0.2), r.uniform(0.3, 1.0)))
    return Scene(side, side, tuple(layers), (0.4, 0.5, 0.6))


def nearness(scene, made):
    found = sdf2vec.loads(made.raw)
    assert [layer.structure for layer in found.layers] == [layer.structure for layer in scene.layers]
    one, other = (sdf2vec.render(s, 3 * scene.width) for s in (scene, found))
    return -10 * np.log10(np.mean(np.square(one - other)))


def test_as_near_to_the_render_as_is_usual():
    scene = triangles(16, 24)
    made = sdf2vec.exported(scene, "sdf")
    assert nearness(scene, made) > 42.0
    assert len(made.raw) < 16 * 112 / 8 + 40


def test_what_hardly_shows_beside_the_picture_is_left_out():
    """A picture that the scene is 20 dB from: fewer bytes, and hardly any of the picture lost."""
    scene = triangles(16, 24)
    noise = np.random.default_rng(0).normal(0, 0.1, (24, 24, 3))
    picture = load(np.clip(sdf2vec.render(scene) + noise, 0, 1).astype(np.float32))
    made = sdf2vec.exported(scene, "sdf", picture=picture)
    assert psnr_of(sdf2vec.loads(made.raw), picture) > psnr_of(scene, picture) - 0.16
    assert len(made.raw) < 0.8 * len(sdf2vec.exported(scene, "sdf").raw)


def test_what_is_fitted_again_is_nearer_in_the_same_bits():
    scene = triangles(16, 24)
    rounded = compact_scene.sdf_rounding(scene, Options())(28.0)
    plain, said = rounded.write(scene)
    again, said_again = rounded.write(settled(scene, rounded.steps_of, views_of(picture_of(scene))))
    assert 26.0 < psnr_of(said, picture_of(scene)) < psnr_of(said_again, picture_of(scene)) - 0.5
    assert len(again.raw) < 1.04 * len(plain.raw)


def test_a_size_limit_is_kept_to():
    scene = triangles(16, 24)
    sizes = [len(sdf2vec.exported(scene, "sdf", max_bytes=limit).raw) for limit in (180, 140)]
    assert 140 < sizes[0] <= 180
    assert 110 < sizes[1] <= 140
    assert not sdf2vec.exported(scene, "sdf", max_bytes=30).met


@pytest.mark.parametrize("scene", [Scene(4, 3, (), (0.2, 0.4, 0.6)), Scene(4, 3, (), None)])
def test_no_layers(scene):
    found = sdf2vec.loads(sdf2vec.exported(scene, "sdf").raw)
    assert found.layers == ()
    assert found.ground == pytest.approx(scene.ground, abs=1e-3)


def test_every_kind_and_join_of_an_additive_scene_on_no_ground():
    scene = random_scene(layers=7, seed=3, compositing="additive", transparent=True)
    made = sdf2vec.exported(scene, "sdf")
    one, other = (sdf2vec.render(s, 60) for s in (scene, sdf2vec.loads(made.raw)))
    assert np.mean(np.square(one - other)) < 1e-3


def test_the_same_scene_gives_the_same_bytes():
    scene = triangles(6, 24)
    assert sdf2vec.exported(scene, "sdf").raw == sdf2vec.exported(scene, "sdf").raw

"""The compact scene: how near it comes to the render, in how many bytes, and what the command line makes of it."""

import random

import numpy as np
import pytest

import sdf2vec
from sdf2vec import Layer, Scene, Shape
from sdf2vec.compact_file import Steps, written
from sdf2vec.export import compact_refit, compact_scene
from tests.scenes import random_scene


@pytest.fixture(autouse=True)
def quick(monkeypatch):
    monkeypatch.setattr(compact_refit, "ROUNDS", 2)


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


@pytest.mark.parametrize("aim", [None, 20.0, 40.0])
def test_as_near_as_the_picture_wants(aim):
    """A quarter of a dB lost where the fit is `near`; what is coarser takes fewer bytes."""
    scene = triangles(16, 24)
    made = sdf2vec.exported(scene, "sdf", near=aim)
    wanted = (compact_scene.USUAL if aim is None else aim + compact_scene.BELOW) - compact_scene.SHORT
    assert nearness(scene, made) > wanted - 1.0
    assert len(made.raw) < 16 * {None: 112, 20.0: 88, 40.0: 140}[aim] / 8 + 40


def test_what_is_fitted_again_is_nearer_in_the_same_bits(monkeypatch):
    scene = triangles(16, 24)
    sizer = compact_scene._Sizer(scene)
    monkeypatch.setattr(compact_refit, "ROUNDS", 12)
    bits = sizer.bits(30.0)
    plain = written(scene, bits)
    scales = Steps.of(scene, bits).scales
    again = written(compact_scene.refitted(scene, scales), bits)
    assert sizer.near(plain) > 28.0
    assert sizer.near(again) > sizer.near(plain) + 0.8
    assert len(again) < 1.03 * len(plain)


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

"""The compact scene: how near it comes to the render, in how many bytes, and what the command line makes of it."""

import random

import numpy as np
import pytest

import sdf2vec
from sdf2vec import Layer, Scene, Shape
from sdf2vec.export import compact_scene
from sdf2vec.metrics import psnr
from tests.cli.command import SHORT, assert_refused
from tests.scenes import random_scene

# The command line in a folder of its own.
from tests.cli.conftest import folder, run  # noqa: F401  # isort: skip


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
    scene = triangles(24, 32)
    made = sdf2vec.exported(scene, "sdf", near=aim)
    wanted = (compact_scene.USUAL if aim is None else aim + compact_scene.BELOW) - compact_scene.SHORT
    assert nearness(scene, made) > wanted - 1.0
    assert len(made.raw) < 24 * {None: 112, 20.0: 88, 40.0: 140}[aim] / 8


def test_what_is_fitted_again_is_nearer_in_the_same_bits():
    scene = triangles(24, 32)
    sizer = compact_scene._Sizer(scene)
    bits = sizer.bits(36.0)
    plain = compact_scene.written(scene, bits)
    scales = compact_scene.Steps.of(scene, bits).scales
    again = compact_scene.written(compact_scene.refitted(scene, scales), bits)
    assert sizer.near(plain) > 35.0
    assert sizer.near(again) > sizer.near(plain) + 1.0
    assert len(again) < 1.03 * len(plain)


def test_a_size_limit_is_kept_to():
    scene = triangles(24, 32)
    sizes = [len(sdf2vec.exported(scene, "sdf", max_bytes=limit).raw) for limit in (10_000, 200, 150)]
    assert 200 < sizes[0]
    assert 170 < sizes[1] <= 200
    assert 120 < sizes[2] <= 150
    assert not sdf2vec.exported(scene, "sdf", max_bytes=30).met


@pytest.mark.parametrize("scene", [Scene(4, 3, (), (0.2, 0.4, 0.6)), Scene(4, 3, (), None)])
def test_no_layers(scene):
    found = sdf2vec.loads(sdf2vec.exported(scene, "sdf").raw)
    assert found.layers == ()
    assert found.ground == pytest.approx(scene.ground, abs=1e-3)


def test_every_kind_and_join_of_an_additive_scene_on_no_ground():
    scene = random_scene(layers=14, seed=3, compositing="additive", transparent=True)
    made = sdf2vec.exported(scene, "sdf")
    one, other = (sdf2vec.render.__globals__["_render"](s, 60, 40) for s in (scene, sdf2vec.loads(made.raw)))
    assert np.mean(np.square(one - other)) < 1e-3


def test_the_same_scene_gives_the_same_bytes():
    scene = triangles(6, 24)
    assert sdf2vec.exported(scene, "sdf").raw == sdf2vec.exported(scene, "sdf").raw


def test_the_command_line_writes_it_and_takes_it_for_a_scene(folder, run):  # noqa: F811
    assert run("photo.jpg", *SHORT, "--emit", "sdf,json").code == 0
    assert (folder / "photo.sdf").stat().st_size < 140
    assert run("render", "photo.sdf", "-o", "out.png").code == 0
    assert run("export", "photo.sdf", "--emit", "glsl", "-o", "a.glsl").code == 0
    scene = sdf2vec.load(folder / "photo.sdf")
    assert (folder / "a.glsl").read_text() == sdf2vec.export(scene, "glsl", title="photo")
    assert run("photo.jpg", *SHORT, "--emit", "sdf").code == 0  # its own file is replaced
    (folder / "foreign.sdf").write_bytes(b"something else")
    assert_refused(run("photo.jpg", *SHORT, "-o", "foreign.sdf"), "foreign.sdf", "not made by sdf2vec")
    assert_refused(run("photo.sdf", *SHORT, "--emit", "svg"), "is a scene, not a picture")
    (folder / "short.sdf").write_bytes((folder / "photo.sdf").read_bytes()[:-20])
    assert_refused(run("render", "short.sdf"), "short.sdf", "ends too early")

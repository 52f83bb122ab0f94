"""Packed texts of scenes that are fitted to the few bits that they have."""

from dataclasses import replace

import numpy as np
import pytest

import sdf2vec
from sdf2vec import Layer, Scene, Shape
from sdf2vec.export.options import Options
from sdf2vec.exports import share_of_limit
from sdf2vec.fit import settling
from sdf2vec.image import load
from sdf2vec.roundtrip import ROUND_TRIPS
from tests.export.test_compact_scene import triangles


@pytest.fixture(autouse=True)
def quick(monkeypatch):
    monkeypatch.setattr(settling, "PHASES", [replace(phase, steps=20) for phase in settling.PHASES])


def noisy(scene):
    """A picture that a scene is 20 dB from."""
    noise = np.random.default_rng(0).normal(0, 0.1, (scene.height, scene.width, 3))
    return load(np.clip(sdf2vec.render(scene) + noise, 0, 1).astype(np.float32))


def nearness(made, scene, picture):
    """In dB to the picture, as an engine draws it."""
    drawn = ROUND_TRIPS["shadertoy"][0].draw(made, scene, scene.width, scene.height)
    return -10 * np.log10(np.mean(np.square(drawn[..., :3] - picture.pixels)))


def test_hardly_anything_of_the_picture_is_lost(require_engine):
    require_engine("opengl")
    scene = triangles(16, 24)
    picture = noisy(scene)
    near = -10 * np.log10(np.mean(np.square(sdf2vec.render(scene) - picture.pixels)))
    made = sdf2vec.exported(scene, "shadertoy", layout="packed", picture=picture)
    assert nearness(made, scene, picture) > near - 0.2
    assert len(made.raw) < 0.7 * len(sdf2vec.exported(scene, "shadertoy", layout="packed").raw)


def test_a_limit_is_kept_to_by_coarser_numbers(require_engine):
    """Where the finest text is too large; and it is as near as that allows, also where edges have left their cells."""
    require_engine("opengl")
    scene = triangles(16, 24)
    picture = noisy(scene)
    sizes, near = [], []
    for limit in (2700, 2550):
        made = sdf2vec.exported(scene, "shadertoy", picture=picture, max_bytes=limit)
        assert made.met
        sizes.append(len(made.raw))
        near.append(nearness(made, scene, picture))
    assert 2550 < sizes[0] <= 2700
    assert 2400 < sizes[1] <= 2550
    assert near[0] > near[1] > 15.0


@pytest.mark.parametrize("opacity", [0.02, 1.0])
def test_what_is_very_soft_needs_few_bits_but_some(opacity, require_engine):
    """The softer and the fainter all layers are, the coarser their places may be."""
    require_engine("opengl")
    disc = Shape.of("circle", (0.9, 0.2, 0.1), center=(0.1, -0.1), radius=0.3)
    scene = Scene(60, 40, (Layer((disc,), 1.5, opacity),), (0.2, 0.4, 0.6))
    picture = load(sdf2vec.render(scene))
    made = sdf2vec.exported(scene, "shadertoy", picture=picture, max_bytes=1200)
    assert nearness(made, scene, picture) > 30.0
    assert share_of_limit(["shadertoy"], Options(max_bytes=4000))(scene) < 1.0

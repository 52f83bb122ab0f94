"""Packed texts of scenes that are fitted to the few bits that they have."""

from dataclasses import replace

import numpy as np
import pytest

import sdf2vec
from sdf2vec import Layer, Scene, Shape
from sdf2vec.export import packing as words
from sdf2vec.export import shader
from sdf2vec.export.options import Options
from sdf2vec.export.packed_rounding import SmallestPacked
from sdf2vec.exports import share_of_limit
from sdf2vec.fit import settling
from sdf2vec.image import load
from sdf2vec.roundtrip import ROUND_TRIPS, compare
from tests.export.test_compact_scene import triangles
from tests.scenes import random_scene


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
    for limit in (1480, 1330):
        made = sdf2vec.exported(scene, "shadertoy", picture=picture, max_bytes=limit)
        assert made.met
        sizes.append(len(made.raw))
        near.append(nearness(made, scene, picture))
    assert 1330 < sizes[0] <= 1480
    assert 1180 < sizes[1] <= 1330
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


def smallest(scene, limit=4000):
    options = Options(framing="fit", layout="packed", max_bytes=limit)
    found = shader.rounding(scene, options, "shadertoy", ".glsl")
    assert isinstance(found, SmallestPacked)
    return found


def packings(scene):
    """The two ways to say where shapes are: within a box of cells of their own, and within one for all."""
    return smallest(scene).ways


SIZES = [(60, 40), (97, 143)]


@pytest.mark.parametrize(
    "options",
    [
        {"kinds": ("triangle",), "paints": ("flat",), "joins": ()},
        {"kinds": ("box",), "paints": ("flat",), "joins": (), "compositing": "additive"},
        {"kinds": ("circle", "triangle", "ellipse"), "joins": ()},
        {"kinds": ("circle", "box"), "compositing": "over"},
        {"kinds": ("circle",), "paints": ("linear",), "joins": (), "transparent": True},
    ],
)
@pytest.mark.parametrize("short", [0, 1 << 20])
def test_what_is_drawn_is_what_is_read_back(options, short, require_engine, monkeypatch):
    """With a window on the words, and without."""
    require_engine("opengl")
    monkeypatch.setattr(words, "SHORT", short)
    scene = random_scene(layers=9, seed=5, **options)
    for packing in packings(scene):
        made, found = packing(45.0).write(scene)
        for size in SIZES:
            check = compare(ROUND_TRIPS["shadertoy"][0], made, found, size)
            assert check.largest_error < 0.5
            assert abs(check.mean_error) < 0.05
            assert compare(ROUND_TRIPS["shadertoy"][0], made, scene, size).psnr > 25.0


def test_one_box_for_all_takes_fewer_bytes_where_shapes_are_large():
    large = triangles(12, 24)
    own, shared = (packing(40.0).write(large)[0].raw for packing in packings(large))
    assert len(shared) < len(own) - 200
    assert smallest(large)(40.0).write(large)[0].raw == shared
    assert smallest(large, limit=None)(40.0).write(large)[0].raw == own  # some GPUs are slower with it


def test_a_thousand_bytes_hold_thirty_circles(require_engine):
    """What is around them takes little more than half."""
    require_engine("opengl")
    scene = random_scene(layers=30, seed=3, kinds=("circle",), paints=("flat",), joins=())
    made, found = smallest(scene, limit=1000)(24.0).write(scene)
    assert len(made.raw) <= 1000
    check = compare(ROUND_TRIPS["shadertoy"][0], made, found, (97, 61))
    assert check.largest_error < 0.5
    assert compare(ROUND_TRIPS["shadertoy"][0], made, scene, (97, 61)).psnr > 18.0


def test_a_grey_is_one_number(require_engine):
    """Not where one shape has a colour."""
    require_engine("opengl")
    colored = triangles(40, 24)
    layers = [
        replace(layer, shapes=tuple(replace(shape, color=(shape.color[0],) * 3) for shape in layer.shapes))
        for layer in colored.layers
    ]
    grey = replace(colored, layers=tuple(layers))
    nearly = replace(colored, layers=(*layers[:-1], colored.layers[-1]))
    for packing, other in zip(packings(grey), packings(nearly), strict=True):
        made, found = packing(40.0).write(grey)
        assert all(len(set(shape.color)) == 1 for layer in found.layers for shape in layer.shapes)
        assert compare(ROUND_TRIPS["shadertoy"][0], made, found, (97, 61)).largest_error < 0.5
        # two of three numbers of at least four bits each, of which a character says three
        assert len(made.raw) < len(other(40.0).write(nearly)[0].raw) - 40 * 2 * 4 / 3.01
        assert len({*other(40.0).write(nearly)[1].layers[-1].shapes[0].color}) > 1

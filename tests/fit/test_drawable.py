"""Scenes whose numbers a small drawing can say."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from sdf2vec import Joint, Layer, Scene, Shape, fit
from sdf2vec.blend import EDGE_DEVIATION
from sdf2vec.fit import settling
from sdf2vec.fit.drawable import drawable, rounded, softnesses
from sdf2vec.fit.settling import views_of
from sdf2vec.grain import DENSE, GRAINS, USUAL, Grain, is_drawable
from sdf2vec.image import Picture, load
from sdf2vec.quality import psnr_of
from sdf2vec.render.draw import pixels_of
from tests.scenes import random_scene

GRAIN = Grain(64, 2, 15, 5, 0.2)
KINDS = ("triangle", "box", "circle")
PALE = (0.9, 0.7, 0.2)
SHAPES, HOLES = (
    (
        Shape("circle", (0.0, 0.0, size), PALE),
        Shape("ellipse", (0.0, 0.0, size, 0.7 * size, 0.3), PALE),
        Shape("box", (0.0, 0.0, size, 0.7 * size, 0.2, 0.0), PALE),
        Shape("triangle", (-size, 0.7 * size, size, 0.8 * size, 0.0, -0.9 * size), PALE),
    )
    for size in (0.09, 0.04)
)


def test_softnesses_are_those_that_renderers_draw():
    found = softnesses(np.array([0.1, 0.44, 0.5, 0.7, 0.8, 1.2, 1.4, 1.75, 1.9, 4.0, 4.2, 4.1]), 2)
    assert found[:8].tolist() == pytest.approx([0.0, 0.0, 0.62, 0.62, 0.85, 1.1, 1.5, 1.5])
    assert found[8] == pytest.approx(2.15)
    assert found[9:] == pytest.approx([(4.0 * 4.1 * 4.2) ** (1 / 3)] * 3)  # k-means of logarithms


def of_kinds(**size):
    """Layers of one shape each, of all kinds that can be drawn small."""
    layers = [
        layer
        for seed, kind in enumerate(KINDS)
        for layer in random_scene((kind,), layers=4, seed=seed, paints=("flat",), joins=()).layers
    ]
    return Scene(layers=tuple(layers), background=(0.5, 0.5, 0.5), **size)


def moved(shape, across, down):
    """To a place of its own, of four by five."""
    points = 6 if shape.kind == "triangle" else 2
    to = np.tile((0.3 * across - 0.45, 0.19 * down - 0.38), points // 2)
    return replace(shape, parameters=(*(shape.parameters[:points] + to).tolist(), *shape.parameters[points:]))


def is_whole(values, steps):
    values = np.asarray(values) * steps
    return np.abs(values - np.round(values)).max() < 1e-3


@pytest.mark.parametrize("descended", [False, True])
def test_all_numbers_can_be_said(descended):
    """On a canvas that is not square: corners and centres, the radius at which coverage is one half, colours."""
    scene = of_kinds(width=96, height=64)
    picture = load(np.random.default_rng(0).random((64, 96, 3)))
    found = (drawable(scene, views_of(picture), GRAIN) if descended else rounded(scene, GRAIN)).scene
    half = np.array([0.75, 0.5])
    for layer in found.layers:
        (shape,) = layer.shapes
        values: dict[str, Any] = shape.named()
        if shape.kind == "triangle":
            assert all(is_whole(np.array(values[name]) + half, 64) for name in "abc")
        elif shape.kind == "circle":
            assert is_whole(np.array(values["center"]) + half, 64)
            assert is_whole(values["radius"] + 0.5 * layer.falloff, 64)
        assert is_whole(shape.color, 15)
        assert is_whole(layer.opacity, 5)
        assert layer.opacity > 0
    assert len({layer.falloff for layer in found.layers}) <= GRAIN.softnesses + 5


def test_what_rounding_loses_is_made_up_for():
    """A fit of a ramp of colours: to a coarse grid, it comes nearer than by rounding, and ends near where it began."""
    x, y = np.meshgrid(np.linspace(0, 1, 72), np.linspace(0, 1, 48))
    picture = load(np.stack([x, y, 0.5 + 0.4 * np.sin(9 * x * y)], axis=2).astype(np.float32))
    scene = fit(picture.pixels, 12, preset="fast", kind="triangle")
    near = psnr_of(scene, picture)
    plain, fitted = (
        psnr_of(found.scene, picture)
        for found in (rounded(scene, GRAIN), drawable(scene, views_of(picture), GRAIN))
    )
    assert fitted > plain + 2.0
    coarser = drawable(scene, views_of(picture), USUAL[0]).scene
    finer = drawable(scene, views_of(picture), GRAINS[0], coarser).scene
    assert near - psnr_of(finer, picture) < min(0.5, near - psnr_of(coarser, picture))


def test_many_sorts_of_layers_are_made_up_for_too(monkeypatch):
    """Ten: four kinds, by themselves or with one of them cut out; as where they are too many for least squares.

    What is near already is not farther than by rounding.
    """
    monkeypatch.setattr(settling, "SOLVED", 0)
    layers = [
        Layer((moved(shape, across, down), *holes), 0.02, 0.9, (Joint("subtraction"),) * len(holes))
        for across, shape in enumerate(SHAPES)
        for down, hole in enumerate((None, *HOLES))
        if (across + down) % 2 == 0
        for holes in ([moved(hole, across, down)] if hole else [],)
    ]
    scene = Scene(96, 72, tuple(layers), (0.2, 0.4, 0.6))
    picture = load(pixels_of(scene))
    for grain, gained in ((GRAIN, 1.5), (USUAL[0], 0.0)):
        plain, fitted = (
            psnr_of(found.scene, picture)
            for found in (rounded(scene, grain), drawable(scene, views_of(picture), grain))
        )
        assert fitted >= plain + gained


def test_triangles_without_an_area_are_unfolded():
    """Of a level line renderers draw no blur, of a sharp one nothing."""
    level = Shape.of("triangle", (1, 0, 0), a=(-0.3, 0.1), b=(0.3, 0.1), c=(0.2, 0.1))
    slanted = Shape.of("triangle", (1, 0, 0), a=(-0.3, -0.3), b=(0.3, 0.3), c=(0.0, 0.0))
    scene = Scene(64, 64, (Layer((level,), 0.3), Layer((slanted,), 0.0), Layer((slanted,), 0.3)))
    corners = [
        np.array(layer.shapes[0].parameters).reshape(3, 2) for layer in rounded(scene, GRAIN).scene.layers
    ]
    _, (sharp_ab, sharp_ac), (soft_ab, soft_ac) = ((c[1] - c[0], c[2] - c[0]) for c in corners)
    assert np.ptp(corners[0][:, 1]) == pytest.approx(1 / 64, abs=1e-5)
    assert abs(sharp_ab[0] * sharp_ac[1] - sharp_ab[1] * sharp_ac[0]) > 1e-4
    assert abs(soft_ab[0] * soft_ac[1] - soft_ab[1] * soft_ac[0]) < 1e-6


def test_in_a_run_edges_stay_where_coverage_is_one_half():
    """Sharp, a shape is larger by half of its falloff."""
    disc = Shape.of("circle", (1, 0, 0), center=(0, 0), radius=0.2)
    found = rounded(Scene(64, 64, (Layer((disc,), 0.1),)), DENSE)
    (layer,) = found.scene.layers
    assert layer.falloff == 0.0
    assert layer.shapes[0].named()["radius"] == pytest.approx(0.25, abs=0.51 / DENSE.units)
    assert found.runs[0].deviation == pytest.approx(0.1 * EDGE_DEVIATION)


def test_what_can_not_be_drawn_small():
    circle = Shape.of("circle", (1, 0, 0), center=(0, 0), radius=0.2)
    assert is_drawable(Scene(8, 8, (Layer((circle,), 0.1), Layer.union((circle, circle), 0.1, 0.1))))
    assert not is_drawable(Scene(8, 8, (Layer((circle,), 0.1),), compositing="additive"))
    assert not is_drawable(random_scene(("gaussian",), layers=1, seed=0, width=8, height=8))


def test_no_layers():
    scene = Scene(8, 8, (), (0.5, 0.5, 0.5))
    assert rounded(scene, GRAIN) == (scene, ())
    assert rounded(scene, DENSE) == (scene, ())


def test_what_is_thinner_than_two_pixels_stays_so():
    """Half a width may be less than a pixel: no small drawing makes lines bolder."""
    box = Shape("box", (0.0, 0.0, 0.4, 0.7 / 64, 0.3, 0.0), PALE)
    scene = Scene(64, 64, (Layer((box,)),), (0.2, 0.2, 0.3))
    for found in (rounded(scene, USUAL[0]), drawable(scene, views_of(Picture(pixels_of(scene))), USUAL[0])):
        assert 64 * found.scene.layers[0].shapes[0].parameters[3] == pytest.approx(0.7, rel=0.1)

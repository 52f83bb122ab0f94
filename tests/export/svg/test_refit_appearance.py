"""Colours and opacities solved again against the coverage that is drawn."""

import math
import random
from dataclasses import replace

import numpy as np
import pytest

from sdf2vec import Layer, Scene, Shape
from sdf2vec.export.svg.refit_appearance import Difference, refitted
from sdf2vec.export.svg.sampling import SampleGrid, covers, extent, grid_over
from sdf2vec.export.svg.visibility import layers_at
from sdf2vec.render.reference import render
from tests.export.svg.drawings import BLURRING, Parameters, decibels, off_in, text_of


def refitted_at(scene, *arguments):
    return refitted(scene, layers_at(scene), *arguments).scene


def disc(opacity=0.5, color=(0.2, 0.4, 0.6)):
    return Layer((Shape.of("circle", color, center=(0, 0), radius=0.3),), 0.2, opacity)


def test_an_opacity_makes_up_for_coverage_that_is_too_little():
    """Nine tenths of the coverage want ten ninths of the opacity, and the same colour."""
    scene = Scene(120, 80, (disc(),), None)
    grid = grid_over(extent(scene.layers[0]), 0.004)
    missing = {0: Difference(grid, -0.1 * covers(scene.layers[0], grid, 1 / 80))}
    (layer,) = refitted_at(scene, missing).layers
    assert layer.opacity == pytest.approx(0.5 / 0.9, abs=2e-3)
    assert layer.shapes[0].color == pytest.approx((0.2, 0.4, 0.6), abs=2e-3)


@pytest.mark.parametrize("shape", [(90, 90), (1, 96), (131, 2), (64, 64), (255, 7)])
def test_a_difference_in_few_numbers(shape):
    """A straight slope keeps its values at the places that are kept, however thin the grid is."""
    rows, columns = shape
    grid = SampleGrid(np.arange(columns) * 0.5 + 3.0, np.arange(rows) * 0.5 - 1.0, 0.5)
    slope = grid.x[None, :] + 2.0 * grid.y[:, None]
    kept, off = Difference(grid, slope).coarse()
    assert off.shape == (len(kept.y), len(kept.x))
    assert 1 <= min(off.shape) <= max(off.shape) <= 64
    wanted = kept.x[None, :] + 2.0 * kept.y[:, None]
    block = round(kept.step / grid.step)
    inner = np.ix_(range(rows // block), range(columns // block))
    assert np.allclose(off[inner], wanted[inner], atol=1e-4)


def test_what_is_drawn_exactly_stays():
    scene = Scene(120, 80, (disc(), disc(0.3)), (0.1, 0.2, 0.3))
    assert refitted_at(scene, {}) == scene
    grid = grid_over(extent(scene.layers[0]), 0.01)
    nothing = Difference(grid, np.zeros((len(grid.y), len(grid.x))))
    for before, after in zip(scene.layers, refitted_at(scene, {0: nothing, 1: nothing}).layers, strict=True):
        assert after.opacity == pytest.approx(before.opacity, abs=1e-4)
        assert after.shapes[0].color == pytest.approx(before.shapes[0].color, abs=1e-4)


def test_an_opacity_makes_up_for_what_8_bits_cut_off():
    """A tenth of 255 is 25.5 levels, of which 25 are left: it has to be 2 % more."""
    whole = Shape.of("circle", (0.2, 0.4, 0.6), center=(0, 0), radius=3.0)
    scene = Scene(120, 80, (Layer((whole,), 0.0, 0.1),), None)
    (layer,) = refitted_at(scene, {}, [0]).layers
    assert layer.opacity == pytest.approx(0.1 * 25.5 / 25, abs=1e-5)


@pytest.mark.parametrize("profile", ["filters", "portable"])
@pytest.mark.parametrize("engine", ["resvg", "librsvg", "chromium", "firefox"])
def test_faint_layers_add_up(engine, profile, require_engine):
    """Of a layer with an opacity of 0.05, 8 bits lose most of the edge: of a hundred that is much."""
    require_engine(engine)
    r = random.Random(6)
    layers = []
    for _ in range(100):
        look: Parameters = {
            "center": (r.uniform(-0.1, 0.1), r.uniform(-0.1, 0.1)),
            "radius": r.uniform(0.15, 0.25),
            "amplitude": 0.02,
            "frequency": (r.uniform(9.0, 20.0), r.uniform(9.0, 20.0)),
        }
        layers.append(Layer((Shape.of("displaced", (0.9, 0.6, 0.3), **look),), r.uniform(0.2, 0.4), 0.05))
    scene = Scene(96, 96, tuple(layers), None)
    for size in (None, (144, 144), (120, 96)):
        off = off_in(engine, scene, size, svg_profile=profile)
        assert decibels(off) >= (36 if profile == "filters" else 31.5)
        assert abs(off[..., 3].mean()) <= 3.0 / 255


def test_colours_in_steps_make_up_for_each_other():
    """Fifteen steps chosen together are nearer to the picture than each colour's nearest step."""
    r = random.Random(3)
    layers = []
    for _ in range(60):
        color = (r.random(), r.random(), r.random())
        place = (r.uniform(-0.6, 0.6), r.uniform(-0.4, 0.4))
        layers.append(Layer((Shape.of("circle", color, center=place, radius=r.uniform(0.1, 0.3)),), 0.1, 0.5))
    scene = Scene(120, 80, tuple(layers), (0.5, 0.5, 0.5))
    chosen = refitted_at(scene, {}, (), 15, 10)
    steps = np.array([layer.shapes[0].color for layer in chosen.layers]) * 15
    assert np.allclose(steps, np.round(steps), atol=1e-3)
    nearest = replace(scene, layers=tuple(in_steps(layer, 15) for layer in scene.layers))
    wanted = render(scene)
    errors = [float((render(other) - wanted).square().mean()) for other in (chosen, nearest)]
    assert errors[0] < 0.5 * errors[1]


def test_grey_stays_grey():
    """Channels that differ by less than half a level would be rounded apart, and the rest would make up for it."""
    r = random.Random(4)
    layers = []
    for _ in range(80):
        grey, place = r.uniform(0, 0.99), (r.uniform(-0.6, 0.6), r.uniform(-0.4, 0.4))
        color = (grey, grey + r.uniform(0, 1.8e-3), grey + r.uniform(0, 1.8e-3))
        shape = Shape.of("circle", color, center=place, radius=r.uniform(0.1, 0.3))
        layers.append(Layer((shape,), 0.1, r.uniform(0.2, 1.0)))
    chosen = refitted_at(Scene(120, 80, tuple(layers), (0.5, 0.5, 0.5)), {}, (), 15, 10)
    assert all(len(set(layer.shapes[0].color)) == 1 for layer in chosen.layers)


def in_steps(layer, count):
    color = tuple(round(count * channel) / count for channel in layer.shapes[0].color)
    return replace(layer, shapes=(replace(layer.shapes[0], color=color),))


@pytest.mark.parametrize("engine", BLURRING)
def test_many_soft_edges_on_each_other(engine, require_engine):
    """Where blurs lie on each other on no ground, all are off in one direction: the hard case for a soft cut-out."""
    require_engine(engine)
    r = random.Random(1)
    layers = []
    for _ in range(48):
        angle, color = r.uniform(0, 7), (r.uniform(0.2, 0.9), r.uniform(0.2, 0.9), r.uniform(0.2, 0.9))
        place = (0.25 * math.cos(angle), 0.25 * math.sin(angle))
        box = Shape.of(
            "box", color, center=place, half_size=(0.12, 0.06), angle=angle + 1.57, corner_radius=0.02
        )
        layers.append(Layer((box,), r.uniform(0.05, 0.12), r.uniform(0.5, 1.0)))
    scene = Scene(240, 240, tuple(layers), None)
    assert "feGaussianBlur" in text_of(scene)
    for size in (None, (480, 480), (360, 250)):
        off = off_in(engine, scene, size)
        assert decibels(off) >= {"resvg": 45, "librsvg": 43.5}.get(engine, 42)  # 3 less without compensation
        assert abs(off[..., :3].mean()) <= 0.5 / 255

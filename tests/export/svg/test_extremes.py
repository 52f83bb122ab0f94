"""Valid scenes that constructions were once not made for: each export is whole SVG text, made in bounded work."""

import math
import random
from xml.etree import ElementTree

import numpy as np
import pytest

import sdf2vec
from sdf2vec import Layer, Scene, Shape
from sdf2vec.export.svg.blur import steepness
from sdf2vec.export.svg.canvas import Canvas
from sdf2vec.export.svg.isobands import WORK, trace_grid
from sdf2vec.export.svg.visibility import LONG, layers_at

PROFILES = [{}, {"svg_profile": "portable"}, {"max_bytes": 3000}]


def disc(x, color, radius=0.2):
    return Shape.of("circle", color, center=(x, 0.0), radius=radius)


RED, BLUE = disc(-0.1, (1, 0, 0)), disc(0.1, (0, 0, 1))


@pytest.mark.parametrize("options", PROFILES, ids=str)
@pytest.mark.parametrize("opacity", [0.0, 0.0005, 0.001, 0.002])
def test_unions_of_colours_that_can_hardly_be_seen(options, opacity):
    scene = Scene(60, 40, (Layer.union((RED, BLUE), 0.05, 0.1, opacity),))
    ElementTree.fromstring(sdf2vec.export(scene, "svg", **options))


@pytest.mark.parametrize("options", PROFILES, ids=str)
def test_unions_that_are_very_long(options):
    far = (disc(-50.0, (1, 0, 0), 0.01), disc(50.0, (0, 0, 1), 0.01))
    scene = Scene(60, 40, (Layer.union(far, 0.01, 0.1),))
    ElementTree.fromstring(sdf2vec.export(scene, "svg", **options))


@pytest.mark.parametrize("shape", [(1, 9), (9, 1), (1, 1), (9, 9)])
def test_how_steep_a_field_is(shape):
    y, x = np.mgrid[: shape[0], : shape[1]] * 0.5
    wanted = math.hypot(3.0 * (shape[1] > 1), 4.0 * (shape[0] > 1))
    assert np.allclose(steepness(3.0 * x + 4.0 * y, 0.5), wanted)


def test_work_is_bounded_by_shapes_times_points():
    r = random.Random(0)
    shapes = [disc(r.uniform(-0.5, 0.5), (r.random(),) * 3) for _ in range(128)]
    scene = Scene(60, 40, (Layer.union(shapes, 0.05, 0.001),))
    grid = trace_grid(scene.layers[0], Canvas.of(scene))
    assert grid is not None
    assert len(grid.x) * len(grid.y) * 128 < 1.1 * WORK


def test_very_long_canvases_are_sampled_at_as_many_points():
    samples = layers_at(Scene(65536, 60, (Layer((RED,), 0.1),)))
    assert samples.width * samples.height <= LONG
    assert samples.width / samples.height == pytest.approx(65536 / 60, rel=0.1)

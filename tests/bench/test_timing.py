"""What the figures of speed are divided by, by hand."""

import math

import pytest

from sdf2vec import Layer, Scene, Shape
from sdf2vec.bench.timing import covered_pixels, operations
from sdf2vec.render.tensors import from_scene
from sdf2vec.shapes import KINDS


def test_covered_pixels_are_those_of_the_disc():
    """A sharp disc of radius ¼ on 64 pixels, and the pixel around it that its edge is soft by."""
    disc = Shape.of("circle", (1, 0, 0), center=(0, 0), radius=0.25)
    inner, outer = (math.pi * radius**2 for radius in (16, 17.5))
    assert inner < covered_pixels(from_scene(Scene(64, 64, (Layer((disc,), 0.0),))), 64) < outer


@pytest.mark.parametrize("kind", KINDS)
def test_a_step_draws_twice_and_goes_back(kind):
    """A circle is the cheapest of the kinds with an edge; none takes a thousand operations a pixel."""
    assert 50 < operations(kind) < 1000
    assert KINDS[kind].patch or operations(kind) >= operations("circle")

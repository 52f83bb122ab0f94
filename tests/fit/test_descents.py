"""Edges that are made sharp, where the picture's are."""

import numpy as np
import pytest
import torch

from sdf2vec.api import render
from sdf2vec.fit.descents import Sizes, _sharpened, sharper
from sdf2vec.fit.pruning import FLOOR
from sdf2vec.render.tensors import from_scene, to_scene
from sdf2vec.scene import Joint, Layer, Scene
from tests.fit.drawn import BLUE, SIDE, disc, painted, search_of, sharp_disc, view_of


def soft(layer: Layer, pixels: float, smaller: float = 0.0) -> Layer:
    """With a falloff in pixels, and a radius that is less by so many."""
    (shape,) = layer.shapes
    x, y, radius = shape.parameters
    shapes = (type(shape)(shape.kind, (x, y, radius - smaller / SIDE), shape.color),)
    return Layer(shapes, pixels / SIDE, layer.opacity)


def after(layers: list[Layer], pixels: np.ndarray) -> tuple[Layer, ...]:
    view = view_of(pixels)
    scene = from_scene(Scene(SIDE, SIDE, tuple(layers), (1.0, 1.0, 1.0)))
    return to_scene(sharper(scene, Sizes(view, view, view), search_of(), FLOOR), SIDE, SIDE).layers


DISCS = [sharp_disc(BLUE, 30, 30, 20), sharp_disc(BLUE, 70, 65, 18)]


def test_what_is_nearly_sharp_becomes_so_and_covers_as_much():
    """As antialiasing makes it look: softer than it is, and smaller by half of that."""
    pixels = painted((disc(30, 30, 20), BLUE, 1.0), (disc(70, 65, 18), BLUE, 1.0))
    found = after([soft(each, 1.6, 0.8) for each in DISCS], pixels)
    assert [layer.falloff for layer in found] == [0.0, 0.0]
    radii = [layer.shapes[0].parameters[2] * SIDE for layer in found]
    assert radii == pytest.approx([20, 18], abs=0.05)


def test_where_coverage_is_one_half_an_edge_stays():
    """Also that of what is cut out, which is sharper then: it grows by less."""
    ring = Layer((DISCS[0].shapes[0], DISCS[1].shapes[0]), 2.0 / SIDE, joints=(Joint("subtraction", 0.0),))
    scene = from_scene(Scene(SIDE, SIDE, (ring,), (1.0, 1.0, 1.0)))
    (layer,) = to_scene(_sharpened(scene, [0], 1.0), SIDE, SIDE).layers
    assert layer.falloff == 0.0
    assert [shape.parameters[2] * SIDE for shape in layer.shapes] == pytest.approx([21.0, 17.0], abs=1e-3)


def test_what_is_soft_stays_so_beside_what_is_sharp():
    scene = Scene(SIDE, SIDE, (DISCS[0], soft(DISCS[1], 2.4)), (1.0, 1.0, 1.0))
    first, second = after([soft(DISCS[0], 1.6, 0.8), soft(DISCS[1], 2.3)], render(scene))
    assert first.falloff == 0.0
    assert second.falloff * SIDE == pytest.approx(2.4, abs=0.2)


def test_sharp_scenes_and_soft_ones_are_left(monkeypatch):
    pixels = painted((disc(30, 30, 20), BLUE, 1.0))
    scene = from_scene(Scene(SIDE, SIDE, (DISCS[0], soft(DISCS[1], 4.0)), (1.0, 1.0, 1.0)))
    sizes = Sizes(*(view_of(pixels),) * 3)
    assert sharper(scene, sizes, search_of(), FLOOR) is scene
    assert torch.equal(scene.groups[0].falloff.flatten() > 0, torch.tensor([False, True]))

"""Layers in other orders, and without some, against the dense renderer."""

import random

import pytest
import torch
from torch.nn.functional import avg_pool2d

from sdf2vec.fit import stacking
from sdf2vec.fit.stacking import Stack
from sdf2vec.fit.surroundings import View
from sdf2vec.render.reference import composite
from sdf2vec.render.tensors import from_scene
from sdf2vec.scene import Scene
from tests.scenes import random_layer

WIDTH, HEIGHT = 61, 45
ORDERS = [[0, 1, 2, 3, 4], [4, 2, 0, 1, 3], [1, 3], [2], []]


def scene_of(compositing, channels):
    r = random.Random(7)
    kinds = [["circle"], ["box"], ["triangle", "circle"], ["box"], ["arc"]]
    layers = tuple(random_layer(kind, r, compositing, "flat", ("subtraction",)) for kind in kinds)
    ground = (0.4, 0.5, 0.6) if channels == 3 or compositing == "additive" else None
    return Scene(WIDTH, HEIGHT, layers, ground, compositing)


def noise(*channels):
    return torch.rand(*channels, HEIGHT, WIDTH, generator=torch.Generator().manual_seed(1))


def error_of(scene, order, view, channels):
    """That of the dense render of such layers only."""
    chosen = Scene(WIDTH, HEIGHT, tuple(scene.layers[i] for i in order), scene.background, scene.compositing)
    drawn = composite(from_scene(chosen), view.samples * WIDTH, view.samples * HEIGHT)[:channels]
    wrong = (avg_pool2d(drawn, view.samples) - view.target) * (1 if view.weights is None else view.weights)
    return float(wrong.square().mean())


@pytest.mark.parametrize("kept", [2**25, 5 * 4 * 256, 1])
@pytest.mark.parametrize(("samples", "is_weighted"), [(1, True), (2, False)])
@pytest.mark.parametrize("channels", [3, 4])
@pytest.mark.parametrize("compositing", ["over", "additive"])
def test_errors_are_those_of_such_scenes(compositing, channels, samples, is_weighted, kept, monkeypatch):
    """All at once, one block of pixels at a time, one picture at a time."""
    monkeypatch.setattr(stacking, "KEPT", kept)
    monkeypatch.setattr(stacking, "AT_ONCE", kept)
    weights = noise() if is_weighted else None
    scene, view = scene_of(compositing, channels), View(noise(channels), weights, samples)
    found = Stack(from_scene(scene), view).errors(ORDERS)
    assert found == pytest.approx([error_of(scene, order, view, channels) for order in ORDERS], rel=1e-4)
    if compositing == "over":
        assert len(set(found)) == len(ORDERS)


def test_errors_without_each_layer():
    scene, view = scene_of("over", 3), View(noise(3), None)
    orders = [[other for other in range(5) if other != order] for order in range(5)]
    wanted = [error_of(scene, order, view, 3) for order in orders]
    assert Stack(from_scene(scene), view).errors_without_each() == pytest.approx(wanted, rel=1e-4)


def test_of_no_layers():
    view = View(noise(3), None)
    bare = Stack(from_scene(Scene(WIDTH, HEIGHT, (), (0.4, 0.5, 0.6))), view)
    assert bare.errors_without_each() == []
    assert bare.errors([[]]) == pytest.approx([error_of(scene_of("over", 3), [], view, 3)], rel=1e-5)

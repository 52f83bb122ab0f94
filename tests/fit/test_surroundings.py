"""One layer among the others, against the dense renderer."""

import pytest
import torch

from sdf2vec.fit.surroundings import Surroundings, View, layer_at
from sdf2vec.render.reference import composite
from sdf2vec.render.tensors import from_scene
from sdf2vec.scene import Layer, Scene, Shape

WIDTH, HEIGHT = 61, 50
BELOW = Layer((Shape("circle", (-0.1, 0.0, 0.3), (0.9, 0.2, 0.1)),), 0.1, 0.8)
OWN = Layer((Shape("box", (0.05, 0.0, 0.2, 0.1, 0.4, 0.0), (0.2, 0.3, 0.9)),), 0.02, 0.7)
ABOVE = Layer((Shape("circle", (0.2, 0.1, 0.25), (0.1, 0.5, 0.7)),), 0.05, 0.6)


@pytest.mark.parametrize("compositing", ["over", "additive"])
@pytest.mark.parametrize("channels", [3, 4])
@pytest.mark.parametrize("order", [0, 1, 2])
def test_a_layer_in_its_own_place_is_as_wrong_as_the_scene(compositing, channels, order):
    layers = BELOW, OWN, ABOVE
    ground = (0.4, 0.5, 0.6) if channels == 3 or compositing == "additive" else None
    scene = from_scene(Scene(WIDTH, HEIGHT, layers, ground, compositing))
    draw = torch.Generator().manual_seed(order)
    target, weights = (torch.rand(*each, HEIGHT, WIDTH, generator=draw) for each in ((channels,), ()))
    view = View(target, weights)
    wrong = (composite(scene, WIDTH, HEIGHT)[:channels] - target) * weights
    around, layer = Surroundings.of(scene, order, view), layer_at(scene, order)
    assert around.wrong(layer.structure, layer.rows())[0].numpy() == pytest.approx(
        wrong.flatten(1).numpy(), abs=2e-5
    )
    assert around.error(layer) == pytest.approx(float(wrong.square().mean()), rel=1e-4)


@pytest.mark.parametrize("order", [0, 1, 2])
def test_what_is_missing_without_a_layer(order):
    layers = [BELOW, OWN, ABOVE]
    scene = from_scene(Scene(WIDTH, HEIGHT, tuple(layers), (0.4, 0.5, 0.6)))
    view = View(torch.rand(3, HEIGHT, WIDTH, generator=torch.Generator().manual_seed(1)), None)
    around = Surroundings.of(scene, order, view)
    del layers[order]
    rest = from_scene(Scene(WIDTH, HEIGHT, tuple(layers), (0.4, 0.5, 0.6)))
    missing = view.target - composite(rest, WIDTH, HEIGHT)[:3]
    assert around.residual.numpy() == pytest.approx(missing.numpy(), abs=2e-5)

"""How much each layer shows, by hand."""

import random

import numpy as np
import pytest
import torch

from sdf2vec import Layer, Scene, Shape
from sdf2vec.blend import JOINS
from sdf2vec.export.svg.visibility import contrasts, layers_at, steps_over
from sdf2vec.render import reference
from sdf2vec.render.tensors import from_scene
from sdf2vec.shapes import KINDS
from tests.scenes import SOFT, random_layer


def test_steps_are_from_what_lies_below():
    """White at one half on black is grey: to red from there is +½, −½, −½; on no ground alpha grows, too."""
    alphas, colors = np.array([[0.5], [1.0]]), np.array([[[1.0]] * 3, [[1.0], [0.0], [0.0]]])
    first, second = steps_over(alphas, colors, np.array([0, 0, 0, 1.0]))
    assert first[:, 0].tolist() == [1, 1, 1, 0]
    assert second[:, 0].tolist() == [0.5, -0.5, -0.5, 0]
    first, second = steps_over(alphas, colors, np.zeros(4))
    assert first[:, 0].tolist() == [1, 1, 1, 1]
    assert second[:, 0].tolist() == [0.5, -0.5, -0.5, 0.5]


@pytest.mark.parametrize("paint", ["flat", "linear"])
@pytest.mark.parametrize("size", [(90, 41), (300, 500)])
def test_layers_are_those_of_the_dense_render(paint, size):
    """Every kind alone, and some joined; however little of the canvas a layer is looked at on."""
    r = random.Random(5)
    alone = [random_layer((kind,), r, "over", paint) for kind in KINDS]
    joined = [random_layer(SOFT[:3], r, "over", paint, tuple(JOINS)) for _ in range(4)]
    scene = Scene(size[0], size[1], (*alone, *joined))
    covers, colors, width, height = layers_at(scene)
    tensors = from_scene(scene)
    x, y, _ = reference.canvas(tensors, width, height)
    wanted, painted = reference.layers_at(tensors, x, y, torch.tensor(1.0 / min(size)))
    assert np.abs(covers - wanted.numpy()).max() < 1e-4
    assert np.abs((colors - painted.numpy()) * (covers > 0)[:, None]).max() < 1e-4
    assert 0.05 < (covers > 0).mean() < 0.5


def test_what_is_hidden_costs_nothing():
    def disc(radius, color, opacity=1.0):
        return Layer((Shape.of("circle", color, center=(0, 0), radius=radius),), 0.05, opacity)

    scene = Scene(64, 64, (disc(0.1, (1, 1, 1)), disc(0.4, (0, 0, 0)), disc(0.2, (1, 1, 1), 0.5)), (1, 1, 1))
    hidden, black, grey = contrasts(scene, layers_at(scene))
    assert hidden < 1e-4
    assert black == pytest.approx(1.0, abs=0.05)
    assert grey == pytest.approx(0.25, abs=0.02)

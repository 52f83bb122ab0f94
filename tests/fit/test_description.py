"""How long a description is, by hand."""

from __future__ import annotations

import pytest
import torch

from sdf2vec.fit.description import BITS, description_length
from sdf2vec.fit.surroundings import View
from sdf2vec.render.tensors import from_scene
from sdf2vec.scene import Layer, Scene, Shape


def test_what_is_right_costs_nothing_and_what_is_wrong_its_class_and_its_bits():
    """A ground that is off at a quarter of the values: 0.811 bits for each of them; and where it is, the difference."""
    scene = from_scene(Scene(8, 8, (), (0.2, 0.2, 0.2)))
    target = torch.full((3, 8, 8), 0.2)
    assert description_length(scene, View(target, None)) == 0.0
    target[:, :2] += 1 / 255
    assert description_length(scene, View(target, None)) == pytest.approx(192 * 0.811278 + 48 * 1, rel=1e-4)
    target[:, :2] -= 5 / 255
    assert description_length(scene, View(target, None)) == pytest.approx(192 * 0.811278 + 48 * 3, rel=1e-4)


def test_a_circle_takes_its_eight_numbers():
    """Two of its middle, a radius, three of colour, opacity, falloff; where it is hidden nothing else."""
    circle = Layer((Shape("circle", (0.0, 0.0, 0.1), (0.2, 0.2, 0.2)),))
    scene = from_scene(Scene(8, 8, (circle,), (0.2, 0.2, 0.2)))
    assert description_length(scene, View(torch.full((3, 8, 8), 0.2), None)) == 8 * BITS

"""How long a description is, by hand."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from sdf2vec.fit.description import BITS, description_length
from sdf2vec.fit.surroundings import View, residual_of
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


def test_a_chessboard_is_shorter_told_by_its_squares_than_by_nothing():
    """By entropy alone black and white by turns are a bit each."""
    row, column = np.mgrid[:128, :128] // 16
    white = ((row + column) % 2).astype(np.float32)
    squares = tuple(
        Layer(
            (
                Shape.of(
                    "box",
                    (1.0, 1.0, 1.0),
                    center=(x, y),
                    half_size=(1 / 16, 1 / 16),
                    angle=0.0,
                    corner_radius=0.0,
                ),
            )
        )
        for i in range(8)
        for j in range(8)
        if (i + j) % 2
        for x, y in [((2 * j + 1) / 16 - 0.5, (2 * i + 1) / 16 - 0.5)]
    )
    view = View(torch.from_numpy(np.stack([white] * 3)), None)
    black, told = (from_scene(Scene(128, 128, layers, (0.0, 0.0, 0.0))) for layers in ((), squares))
    assert residual_of(told, view).square().mean() < 1e-3
    assert description_length(told, view) < description_length(black, view)

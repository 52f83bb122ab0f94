"""Which shapes could be joined to a layer: least squares, regions and masks, on pictures drawn by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest
import torch

from sdf2vec.fit import levenberg, surroundings
from sdf2vec.fit.laying import Laid
from sdf2vec.fit.levenberg import Dense, Numbers, descend
from sdf2vec.fit.regions import ellipses, strokes
from sdf2vec.fit.surroundings import GLANCE, MOST_COMPILED, Surroundings, View
from sdf2vec.layer import Part, row_width
from sdf2vec.render.tensors import from_scene
from sdf2vec.scene import Layer, Scene, Shape


def test_a_line_is_found_in_one_undamped_step_or_a_few_damped_ones():
    """Two lines a·x + b through points, each with another a and b."""
    x = torch.linspace(-1.0, 1.0, 7)
    wanted = torch.tensor([[2.0, -1.0], [0.5, 3.0]])
    heights = wanted[:, :1] * x + wanted[:, 1:]
    problem = Dense(lambda rows: (rows[:, 0] * x + rows[:, 1] - heights)[:, None], len(x))
    free = Numbers.where([True, True], torch.tensor([9.0, 9.0]), lambda rows: None)
    rows, errors = descend(torch.zeros(2, 2), problem, free, 12, lambda error: None)
    assert rows.numpy() == pytest.approx(wanted.numpy(), abs=1e-3)
    assert float(errors.max()) < 1e-6


def test_a_number_that_is_not_free_stays():
    x = torch.linspace(-1.0, 1.0, 7)
    problem = Dense(lambda rows: (rows[:, 0] * x + rows[:, 1] - 1.0)[:, None], len(x))
    free = Numbers.where([False, True], torch.tensor([9.0, 0.1]), lambda rows: None)
    rows, _ = descend(torch.tensor([[0.25, 0.0]]), problem, free, 3, lambda error: None)
    assert rows[0].tolist() == pytest.approx([0.25, 0.3])  # a tenth in each step


def test_two_numbers_that_do_the_same_are_damped_until_they_can_be_told_apart(monkeypatch):
    """Undamped there is no solution."""
    monkeypatch.setattr(levenberg, "FIRST_DAMPING", 0.0)
    slopes = 1000.0 * torch.linspace(1.0, 2.0, 5)
    problem = Dense(lambda rows: ((rows[:, 0] + rows[:, 1] - 1.0) * slopes)[:, None], len(slopes))
    free = Numbers.where([True, True], torch.ones(2), lambda rows: None)
    rows, errors = descend(torch.zeros(1, 2), problem, free, 12, lambda error: None)
    assert float(errors) < 1e-3
    assert float(rows.sum()) == pytest.approx(1.0, abs=1e-4)


def test_a_bar_gives_an_ellipse_along_it():
    gain = np.zeros((40, 60), np.float32)
    gain[10:14, 20:40] = 1.0
    ((x, y, long, short, turn),) = ellipses(gain)
    assert (x, y) == (30.0, 12.0)
    assert long == pytest.approx(10.0, abs=0.5)
    assert short == pytest.approx(2.0, abs=0.5)
    assert math.sin(turn) == pytest.approx(0.0, abs=1e-6)


def test_two_squares_give_also_one_ellipse_through_both_that_ends_with_them():
    gain = np.zeros((40, 40), np.float32)
    gain[4:8, 18:22] = gain[32:36, 18:22] = 1.0
    *single, (x, y, long, short, turn) = ellipses(gain)
    assert len(single) == 2
    assert (x, y) == (20.0, 20.0)
    assert long == pytest.approx(16.0, abs=0.5)
    assert short == pytest.approx(2.0, abs=0.5)
    assert abs(math.sin(turn)) == pytest.approx(1.0)


def test_an_angle_gives_its_two_strokes():
    region = np.zeros((40, 40), bool)
    region[5:35, 5:9] = region[31:35, 5:30] = True
    upright, level = strokes(region)
    assert (int(upright.sum()), int(level.sum())) == (30 * 4, 25 * 4)
    assert upright[5:35, 5:9].all()
    assert level[31:35, 5:30].all()


def test_a_bar_and_a_square_have_no_strokes():
    for rows, columns in ((slice(10, 14), slice(5, 35)), (slice(5, 35), slice(5, 35))):
        region = np.zeros((40, 40), bool)
        region[rows, columns] = True
        assert strokes(region) == []


def test_where_nothing_is_wanted_there_is_no_ellipse():
    assert ellipses(np.full((8, 8), -1.0, np.float32)) == []


STRUCTURES = [
    (Part("circle"),),
    (Part("triangle", "linear"),),
    (Part("displaced"),),
    (Part("ellipse"), Part("box", join="subtraction")),
]


@pytest.mark.parametrize("parts", [MOST_COMPILED, MOST_COMPILED + 1])
@pytest.mark.parametrize("side", [40, 56])
def test_kernels_are_compiled_but_for_a_glance_at_many_shapes(parts, side):
    scene = from_scene(Scene(side, side, (Layer((Shape("circle", (0, 0, 0.3), (1, 0, 0)),), 0.1),)))
    around = Surroundings.of(scene, 0, View(torch.zeros(3, side, side), None))
    structure = (Part("circle"), *[Part("box", join="subtraction")] * (parts - 1))
    is_glance = side * side < GLANCE and parts > MOST_COMPILED
    assert isinstance(around.problem(structure), Dense if is_glance else Laid)


@pytest.mark.parametrize("structure", STRUCTURES, ids=lambda parts: "-".join(part.kind for part in parts))
@pytest.mark.parametrize("channels", [3, 4])
@pytest.mark.parametrize("counted", [False, True])
def test_normal_equations_of_kernels_are_those_of_autograd(structure, channels, counted, monkeypatch):
    """Among other layers, at a size that fills no block of pixels."""
    draw = torch.Generator().manual_seed(3)
    below = Layer((Shape("circle", (-0.1, 0.0, 0.3), (0.9, 0.2, 0.1)),), 0.1, 0.8)
    above = Layer((Shape("circle", (0.2, 0.1, 0.25), (0.1, 0.5, 0.7)),), 0.05, 0.6)
    scene = from_scene(Scene(61, 50, (below, below, above), (0.4, 0.5, 0.6)))
    view = View(torch.rand(channels, 50, 61, generator=draw), torch.rand(50, 61, generator=draw))
    around = Surroundings.of(scene, 1, view)
    rows = 0.05 + 0.3 * torch.rand(5, row_width(structure), generator=draw)
    counts = torch.rand(5, 50 * 61, generator=draw) if counted else None
    free = np.array([number for number in range(rows.shape[1]) if number != 2])
    kernels = around.problem(structure, counts)
    monkeypatch.setattr(surroundings, "MOST_COMPILED", 0)
    monkeypatch.setattr(surroundings, "GLANCE", 10**6)
    autograd = around.problem(structure, counts)
    assert (type(kernels), type(autograd)) == (Laid, Dense)
    assert kernels.errors(rows) == pytest.approx(autograd.errors(rows), rel=1e-5)
    for found, wanted in zip(kernels.normal(rows, free), autograd.normal(rows, free), strict=True):
        assert found == pytest.approx(wanted, rel=1e-3, abs=1e-5 * np.abs(wanted).max())

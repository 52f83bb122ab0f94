"""Which shapes could be joined to a layer: least squares, regions and masks, on pictures drawn by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest
import torch

from sdf2vec.fit.levenberg import Numbers, Problem, descend
from sdf2vec.fit.regions import ellipses


def test_a_line_is_found_in_one_undamped_step_or_a_few_damped_ones():
    """Two lines a·x + b through points, each with another a and b."""
    x = torch.linspace(-1.0, 1.0, 7)
    wanted = torch.tensor([[2.0, -1.0], [0.5, 3.0]])
    heights = wanted[:, :1] * x + wanted[:, 1:]
    problem = Problem(lambda rows: (rows[:, 0] * x + rows[:, 1] - heights)[:, None], len(x))
    free = Numbers(torch.tensor([0, 1]), torch.tensor([9.0, 9.0]), lambda rows: None)
    rows, errors = descend(torch.zeros(2, 2), problem, free, 12, lambda error: None)
    assert rows.numpy() == pytest.approx(wanted.numpy(), abs=1e-3)
    assert float(errors.max()) < 1e-6


def test_a_number_that_is_not_free_stays():
    x = torch.linspace(-1.0, 1.0, 7)
    problem = Problem(lambda rows: (rows[:, 0] * x + rows[:, 1] - 1.0)[:, None], len(x))
    free = Numbers(torch.tensor([1]), torch.tensor([0.1]), lambda rows: None)
    rows, _ = descend(torch.tensor([[0.25, 0.0]]), problem, free, 3, lambda error: None)
    assert rows[0].tolist() == pytest.approx([0.25, 0.3])  # a tenth in each step


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


def test_where_nothing_is_wanted_there_is_no_ellipse():
    assert ellipses(np.full((8, 8), -1.0, np.float32)) == []

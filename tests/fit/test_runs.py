"""Where layers are cut into runs."""

from itertools import combinations

import numpy as np
import pytest
import torch

from sdf2vec.fit.runs import LEAST, Softening, cut


def off(values, counts):
    return sum(np.square(run - run.mean()).sum() for run in np.split(values, np.cumsum(counts)[:-1]))


@pytest.mark.parametrize("most", [1, 2, 3, 4])
def test_no_other_cut_is_nearer(most):
    values = np.random.default_rng(most).normal(size=9)
    counts = cut(values, most)
    assert sum(counts) == 9
    assert len(counts) == most
    every = [np.diff([0, *ends, 9]).tolist() for ends in combinations(range(1, 9), most - 1)]
    assert off(values, counts) == pytest.approx(min(off(values, each) for each in every))


def test_as_many_runs_as_values_at_most():
    assert cut(np.array([1.0, 2.0]), 5) == [1, 1]
    assert cut(np.array([]), 3) == []


def test_runs_of_about_the_same_blur_are_joined():
    """And what is narrow becomes what browsers draw alike, or stays where they draw it about sharp, or is sharp."""
    softening = Softening([3, 2, 4, 1, 2], [0.10, 0.11, 0.004, 0.001, 0.003], pixel=0.005)
    softening.settle()
    assert softening.counts == [5, 4, 1, 2]
    assert not softening.is_free
    deviations = torch.tensor([run.deviation for run in softening.ended])
    assert deviations.tolist() == pytest.approx([0.1**0.6 * 0.11**0.4, 0.005 * LEAST, 0.0, 0.003], rel=1e-5)

"""Which of the shapes that regions would gain from are taken at once."""

from unittest.mock import Mock

import torch

from sdf2vec.blend import SUBTRACTION
from sdf2vec.fit.offers import Offer, choices
from sdf2vec.layer import Part

PLAIN = (Part("circle"),)
HOLED = (Part("circle"), Part("box", join=SUBTRACTION))


def offer(structure, gain, left, points):
    """One for no region, that covers some of eight points."""
    cover = torch.zeros(8)
    cover[points] = 1.0
    return Offer(structure, torch.rand(1, 9), Mock(), 1, cover, gain, gain, left, 0.0)


def test_what_has_a_hole_waits_and_is_tried_alone():
    holed, plain = offer(HOLED, 1.0, 0.01, [0, 1, 2]), offer(PLAIN, 0.8, 0.02, [4, 5, 6])
    assert [*choices([holed, plain])] == [[plain], [holed]]


def test_the_best_is_tried_where_another_of_its_kind_is_cleaner():
    best, cleaner = offer(PLAIN, 1.0, 0.5, [0, 1, 2]), offer(PLAIN, 0.8, 0.02, [1, 2, 3])
    assert [*choices([best, cleaner])] == [[cleaner], [best]]


def test_what_does_not_overlap_is_taken_at_once():
    first, on_it, apart = (offer(PLAIN, 1.0, 0.01, points) for points in ([0, 1, 2], [1, 2, 3], [5, 6]))
    assert [*choices([first, on_it, apart])] == [[first, apart], [first]]


def test_the_best_is_not_tried_twice():
    only = offer(PLAIN, 1.0, 0.01, [0, 1])
    assert [*choices([only])] == [[only]]
    assert [*choices([])] == []

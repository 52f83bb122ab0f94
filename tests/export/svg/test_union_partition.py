"""The parts of a union: their shares add up, and laid on each other they are the union's coverage."""

import numpy as np

from sdf2vec import Layer, Shape
from sdf2vec.export.svg.sampling import Box, covers, grid_over
from sdf2vec.export.svg.union_partition import alphas, shares

PLACES = ((-0.3, 0.0), (0.0, 0.1), (0.3, 0.0), (0.0, -0.3))
UNION = Layer.union(
    [
        Shape.of("circle", (i / 3, 0.0, 1 - i / 3), center=place, radius=0.15)
        for i, place in enumerate(PLACES)
    ],
    0.08,
    0.1,
    0.7,
)
GRID = grid_over(Box(-0.6, -0.6, 0.6, 0.6), 0.02)


def test_shares_add_up_and_each_shape_has_most_of_its_own_middle():
    found = shares(UNION, GRID)
    assert np.allclose(sum(found), 1.0)
    for share, (x, y) in zip(found, PLACES, strict=True):
        assert share[np.abs(GRID.y - y).argmin(), np.abs(GRID.x - x).argmin()] > 0.8


def test_parts_laid_on_each_other_are_the_union():
    shown, rest = covers(UNION, GRID, 0.005), np.ones((len(GRID.y), len(GRID.x)))
    for alpha, share in list(zip(alphas(UNION, GRID, 0.005), shares(UNION, GRID), strict=True))[::-1]:
        assert np.allclose(rest * alpha, shown * share, atol=1e-5)
        rest = rest * (1.0 - alpha)
    assert np.allclose(1.0 - rest, shown, atol=1e-5)

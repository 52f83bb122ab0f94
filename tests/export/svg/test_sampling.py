"""Distance, coverage and colour at points, by hand."""

import math

import numpy as np
import pytest

from sdf2vec import Layer, Shape
from sdf2vec.export.svg.sampling import (
    Box,
    cover_at,
    covers,
    distances,
    edge_profile,
    edge_range,
    extent,
    frame_of,
    grid_over,
)

DISC = Layer((Shape.of("circle", (1, 0, 0), center=(0.5, 0), radius=0.25),), 0.1, 0.5)


def test_boxes():
    box = Box(0.0, 0.0, 2.0, 1.0)
    assert box.longest == 2.0
    assert box.grown(0.5) == Box(-0.5, -0.5, 2.5, 1.5)
    assert box.clipped(Box(1.0, -1.0, 3.0, 0.5)) == Box(1.0, 0.0, 2.0, 0.5)
    assert box.clipped(Box(3.0, 0.0, 4.0, 1.0)).empty


def test_a_grid_has_the_middles_of_its_cells():
    grid = grid_over(Box(0.0, -1.0, 1.0, -0.5), 0.25)
    assert grid.x.tolist() == [0.125, 0.375, 0.625, 0.875]
    assert grid.y.tolist() == [-0.875, -0.625]


def test_the_edge_goes_from_all_to_nothing():
    assert edge_range() == pytest.approx((0.5 - 0.1 * math.log(511), 0.5 + 0.1 * math.log(511)))
    assert edge_profile(np.array([*edge_range(), 0.5])) == pytest.approx([1.0, 0.0, 0.5])


def test_a_disc():
    grid = grid_over(Box(0.0, -0.5, 1.0, 0.5), 0.1)
    want = np.hypot(grid.x[None, :] - 0.5, grid.y[:, None]) - 0.25
    assert np.allclose(distances(DISC, grid), want)
    assert np.allclose(covers(DISC, grid, 1e-6), edge_profile(want / 0.1))
    assert cover_at(DISC, np.array([[0.5, 0.0], [0.8, 0.0], [2.0, 0.0]]), 1e-6) == pytest.approx([1, 0.5, 0])
    far = 0.25 + 0.1 * edge_range()[1]
    assert extent(DISC) == pytest.approx((0.5 - far, -far, 0.5 + far, far))


def test_the_frame_of_a_box_is_turned_with_it():
    shape = Shape.of("box", (1, 0, 0), center=(0.1, 0.2), half_size=(0.3, 0.2), angle=0.5, corner_radius=0.0)
    frame = frame_of(shape)
    assert frame.origin == pytest.approx([0.1, 0.2])
    assert np.abs(frame.axis) == pytest.approx([math.cos(0.5), math.sin(0.5)])
    assert frame.half == pytest.approx([0.3, 0.2])

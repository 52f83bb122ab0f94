"""Smooth edges in place of steps: against what is drawn with 256 samples a pixel; and nothing else changes."""

import numpy as np
import pytest

from sdf2vec.fit.drawings import UNSURE
from sdf2vec.fit.jagged import is_jagged, smoothed

SIDE, SAMPLES = 96, 16
SHAPES = {
    "disc": lambda x, y: (x - 43.3) ** 2 + (y - 50.1) ** 2 < 28.7**2,
    "flat slope": lambda x, y: y - 30.2 > 0.3 * x,
    "steep slope": lambda x, y: y + 60.4 > 2.3 * x,
    "triangle": lambda x, y: (y - 19.3 >= 0.35 * (x - 9.7)) & (x + 0.4 * y < 86.1) & (x > 14.3 + 0.1 * y),
}


def inside(shape, samples):
    """The share of each pixel that a shape covers, by so many samples a side."""
    y, x = (np.mgrid[: SIDE * samples, : SIDE * samples] + 0.5) / samples
    return shape(x, y).reshape(SIDE, samples, SIDE, samples).mean((1, 3)).astype(np.float32)


def painted(cover):
    """A picture of a shape in one colour on a ground."""
    under, over = np.array([0.9, 0.8, 0.1], np.float32), np.array([0.1, 0.2, 0.6], np.float32)
    return under + cover[..., None] * (over - under)


@pytest.mark.parametrize("shape", SHAPES.values(), ids=SHAPES)
def test_steps_become_the_edge_that_they_were(shape):
    """What is left of their mean squared error is no more than `UNSURE` of what has changed, and in no direction."""
    jagged, wanted = (painted(inside(shape, samples)) for samples in (1, SAMPLES))
    made = smoothed(jagged)
    assert is_jagged(jagged)
    assert not is_jagged(wanted)
    assert np.mean((made - wanted) ** 2) < UNSURE * np.mean((made - jagged) ** 2)
    assert abs(np.mean(made - wanted)) < 1e-3


@pytest.mark.parametrize("turns", range(4))
def test_one_step_in_the_middle_is_a_slope_over_both_halves(turns):
    """By hand: from the middle of one stretch of 4 pixels to that of the next the edge rises by a pixel."""
    picture = np.zeros((4, 8, 1), np.float32)
    picture[2:] = 1.0
    picture[1, 4:] = 1.0
    wanted = picture.copy()
    wanted[1, 2:4, 0] = 1 / 8, 3 / 8
    wanted[1, 4:6, 0] = 5 / 8, 7 / 8
    assert np.allclose(smoothed(np.rot90(picture, turns)), np.rot90(wanted, turns), atol=1e-6)


def test_corners_and_lines_a_pixel_wide_stay():
    picture = np.zeros((40, 40, 3), np.float32)
    picture[10:20, 5:30] = 1.0
    picture[25, 3:20] = 0.5
    picture[3:38, 35] = 0.7
    assert np.array_equal(smoothed(picture), picture)


@pytest.mark.parametrize("shape", [(1, 1, 3), (1, 30, 4), (30, 1, 3), (2, 2, 4)])
def test_the_smallest_pictures(shape):
    pixels = np.random.default_rng(0).random(shape, dtype=np.float32)
    assert smoothed(pixels).shape == shape
    assert np.array_equal(smoothed(np.ones(shape, np.float32)), np.ones(shape, np.float32))
    assert not is_jagged(np.ones(shape, np.float32))


@pytest.mark.parametrize("size", [1, 4])
def test_what_has_more_corners_than_steps_is_not_jagged(size):
    """Such as the squares of a QR code."""
    squares = np.random.default_rng(0).random((24, 24)) > 0.5
    assert not is_jagged(np.kron(squares, np.ones((size, size)))[..., None].astype(np.float32))


def test_upright_boxes_are_not_jagged():
    picture = np.ones((40, 40, 3), np.float32)
    picture[10:20, 5:30] = picture[22:36, 8:12] = 0.0
    assert not is_jagged(picture)


def test_what_is_antialiased_beside_it_stays():
    jagged, smooth = (painted(inside(SHAPES["disc"], samples)) for samples in (1, SAMPLES))
    both = np.hstack([jagged, smooth])
    assert is_jagged(both)
    made = smoothed(both)
    assert np.array_equal(made[:, :SIDE], smoothed(jagged))
    assert np.mean((made[:, SIDE:] - smooth) ** 2) < 0.1 * np.mean((made[:, :SIDE] - jagged) ** 2)


def test_straight_sides_between_round_corners_stay():
    """A side of 20 pixels; its last 4 on both sides, as many as there are beyond the step, lie on the slope."""
    picture = np.zeros((12, 40, 1), np.float32)
    picture[4:, 6:34] = picture[3, 10:30] = 1.0
    made = smoothed(picture)
    assert np.array_equal(made[3, 14:26], picture[3, 14:26])
    assert np.allclose(made[3, 10:14, 0], 1 - np.array([7, 5, 3, 1]) / 16)

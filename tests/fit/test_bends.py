"""Linear gradients of three colours told from pictures, which are drawn in numpy by their formula."""

from __future__ import annotations

import numpy as np
import pytest

from sdf2vec.fit.bends import Line
from sdf2vec.fit.color_stops import Samples
from tests.fit.drawn import everywhere, shown

COLORS = np.array([[0.9, 0.7, 0.3], [0.8, 0.2, 0.5], [0.3, 0.3, 0.8]])
SIZE = 80, 120


def picture(angle, stops=(10.0, 60.0, 110.0), size=SIZE):
    """Pixels [H, W, 3] in 8 bits whose colours change along a direction, at so many pixels from the corner."""
    y, x = np.mgrid[: size[0], : size[1]] + 0.5
    along = x * np.cos(angle) + y * np.sin(angle)
    shown = np.stack([np.interp(along, stops, channel) for channel in COLORS.T], axis=2)
    return (np.rint(shown * 255) / 255).astype(np.float32)


def line_of(inside, pixels):
    return Line(Samples.of(inside, pixels))


@pytest.mark.parametrize("angle", [0.0, 0.5, 1.2])
@pytest.mark.parametrize("stop", [35.0, 60.0, 90.0])
def test_its_direction_its_stops_and_its_colours(angle, stop):
    pixels = picture(angle, (10.0, stop, 110.0))
    bend = line_of(everywhere(pixels), pixels).bend()
    assert bend is not None
    across, down = bend.direction / (120, 80)  # for each pixel
    length = np.hypot(across, down)
    turn = np.arctan2(down, across) - angle
    assert np.sin(turn) == pytest.approx(0.0, abs=0.01)
    where = (bend.stops.values if np.cos(turn) > 0 else -bend.stops.values[::-1]) / length
    assert where[1] == pytest.approx(stop, abs=1.0)
    assert np.abs(shown(bend, pixels) - pixels).max() < 0.008


def test_of_a_part_of_a_picture():
    """What is outside has no part in it, and nothing is known of what is beyond."""
    pixels = picture(0.0)
    inside = everywhere(pixels)
    inside[:, :30] = inside[:12] = False
    elsewhere = np.where(inside[..., None], pixels, np.float32(0.5))
    bend = line_of(inside, elsewhere).bend()
    assert bend is not None
    assert np.abs(shown(bend, pixels) - pixels)[inside].max() < 0.008
    assert np.abs(shown(bend, pixels)[:, :29] - pixels[:, 30:31]).max() < 0.02


@pytest.mark.parametrize("off", [-0.07, 0.05])
def test_the_direction_across_which_colours_are_even(off):
    pixels = picture(0.5)
    line = line_of(everywhere(pixels), pixels)
    assert line.evenest(0.5 + off) == pytest.approx(0.5, abs=0.003)


def test_of_many_colours():
    """Five, along an odd direction: with fewer it is off by much."""
    y, x = np.mgrid[: SIZE[0], : SIZE[1]] + 0.5
    along, stops = x * np.cos(0.4) + y * np.sin(0.4), (5.0, 30.0, 62.0, 90.0, 130.0)
    levels = [(0.9, 0.8, 0.1, 0.2, 0.9), (0.1, 0.9, 0.7, 0.1, 0.3), (0.2, 0.1, 0.8, 0.9, 0.5)]
    shades = np.stack([np.interp(along, stops, channel) for channel in levels], axis=2)
    pixels = (np.rint(shades * 255) / 255).astype(np.float32)
    off = {
        len(bend.stops.values): np.abs(shown(bend, pixels) - pixels).max()
        for bend in line_of(everywhere(pixels), pixels).long_bends()
    }
    assert off[5] < 0.02
    assert off[4] > 0.1


def test_what_ends_softly_is_none():
    """Most of it is of one colour."""
    pixels = picture(0.3, (-9.0, -6.0, 16.0))
    assert line_of(everywhere(pixels), pixels).bend() is None


def test_a_few_pixels_tell_none():
    pixels = picture(0.0)
    inside = np.zeros(pixels.shape[:2], bool)
    inside[:10, :10] = True
    assert line_of(inside, pixels).bend() is None

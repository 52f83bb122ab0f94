"""Gradients taken out of pictures, which are drawn in numpy; and what is no gradient."""

from __future__ import annotations

import numpy as np
import pytest

from sdf2vec.bench.known_scenes import known_scene
from sdf2vec.fit.bends import BentShade
from sdf2vec.fit.rings import RadialShade
from sdf2vec.fit.shades import Shade
from sdf2vec.fit.shading import Shading
from tests.fit.drawn import (
    BLUE,
    GREEN,
    HALF,
    RISE,
    SIDE,
    THREE,
    WHITE,
    bent,
    box,
    disc,
    painted,
    points,
    ramp,
    rings,
    shading_of,
    three_rings,
)


def flattened(pixels):
    return shading_of(pixels).flattened.pixels


def test_a_shape_with_a_gradient_gets_one_colour_to_its_edge():
    mask = disc(50, 44, 30)
    flat = flattened(painted((mask, ramp(), 1.0)))
    color = flat[44, 50]
    assert color == pytest.approx(HALF + RISE * 2 / SIDE, abs=0.01)
    assert (flat[30:58, 36:64] == color).all()
    assert np.abs(flat - painted((mask, color, 1.0))).max() < 0.02


def test_so_does_one_with_a_radial_gradient():
    mask = disc(50, 44, 30)
    shading = shading_of(painted((mask, rings(), 1.0)))
    (number,) = shading.graded
    shade = shading.shades[number - 1]
    assert isinstance(shade, RadialShade)
    assert shade.place * SIDE == pytest.approx([40.0, 30.0], abs=0.5)
    color = shading.flattened.pixels[44, 50]
    assert np.abs(shading.flattened.pixels - painted((mask, color, 1.0))).max() < 0.02


@pytest.mark.parametrize(
    ("colors", "told"),
    [(bent, BentShade), (three_rings, RadialShade)],
    ids=["along a line", "around a point"],
)
def test_so_does_one_of_three_colours(colors, told):
    mask = disc(50, 44, 30)
    shading = shading_of(painted((mask, colors(), 1.0)))
    (number,) = shading.graded
    shade = shading.shades[number - 1]
    assert isinstance(shade, told)
    np.testing.assert_allclose(shade.stops.colors[1], THREE[1], atol=0.02)
    color = shading.flattened.pixels[44, 50]
    assert np.abs(shading.flattened.pixels - painted((mask, color, 1.0))).max() < 0.03  # at its ends


def test_a_gradient_that_bends_sharply_is_one_region():
    """So much that the picture is not even there."""
    ring = disc(48, 48, 44) & ~disc(48, 48, 28)
    shading = shading_of(painted((ring, bent(0.5), 1.0)))
    assert len(shading.graded) == 1
    flat = shading.flattened.pixels
    assert np.abs(flat - painted((ring, flat[48, 12], 1.0))).max() < 0.03


def test_two_gradients_that_meet_get_no_third_colour_there():
    """As one of five colours does."""
    x = np.minimum((np.arange(4 * SIDE) + 0.5) / SIDE, 3.999)
    colors = np.array([[0.9, 0.1, 0.1], [0.9, 0.9, 0.1], [0.1, 0.7, 0.1], [0.1, 0.7, 0.9], [0.3, 0.1, 0.9]])
    row = np.stack([np.interp(x, np.arange(5), channel) for channel in colors.T], axis=1)
    shading = shading_of(np.rint(np.broadcast_to(row, (SIDE, *row.shape)) * 255) / 255)
    assert len(shading.graded) == 2
    flat = shading.flattened.pixels
    far = np.linalg.norm(flat[:, :, None] - shading.flats[[number - 1 for number in shading.graded]], axis=3)
    between = far.min(axis=2) > 0.02
    assert between.mean() < 0.02
    ends = np.linalg.norm(np.diff(shading.flats[[number - 1 for number in shading.graded]], axis=0))
    assert far[between].sum(axis=1) == pytest.approx(ends, abs=0.05)


def test_a_gradient_that_ends_in_the_colour_of_the_ground_is_none_of_that():
    """There is no edge where it does."""
    x, _ = points()
    fade = WHITE + (1.0 - x / 80).clip(0.0)[..., None] * (BLUE - WHITE)
    shading = shading_of(painted((box(16, 24, 80, 72), fade, 1.0)))
    (number,) = shading.graded
    inside = shading.labels == number
    assert inside[30:66, 20:72].all()
    assert not inside[:22].any()
    assert not inside[:, 82:].any()
    flat = shading.flattened.pixels
    assert np.abs(flat[30:66, 20:72] - flat[48, 40]).max() == 0.0
    assert np.abs(flat[48, 40] - WHITE).max() > 0.1
    assert np.abs(flat[:22] - 1.0).max() == 0.0


def test_a_gradient_with_a_thin_rim():
    """Of another colour, two pixels wide: the next region begins beyond it."""
    shading = shading_of(painted((disc(48, 44, 32), GREEN, 1.0), (disc(48, 44, 30), ramp(), 1.0)))
    assert len(shading.graded) == 1


def test_where_two_gradients_meet_that_are_not_one_each_pixel_is_of_one():
    """The two sides of a roof: one rises to the right, one downwards, so steeply that the ridge is on neither."""
    rise = 0.5 + 0.9 * (np.minimum(*points()) - 48)[..., None] / 24 * (1.0, 0.5, -1.0)
    shading = shading_of(painted((box(36, 36, 60, 60), rise, 1.0)))
    assert len(shading.graded) == 2
    ends = shading.flats[[number - 1 for number in shading.graded]]
    flat = shading.flattened.pixels[38:58, 38:58]
    one, other = (np.linalg.norm(flat - end, axis=2) for end in ends)
    assert (one + other).max() <= np.linalg.norm(ends[0] - ends[1]) + 0.02


def test_too_small_a_share_of_the_picture_is_none():
    pixels = painted((box(10, 10, 60, 60), ramp(), 1.0)).astype(np.float32)
    pixels[:, 64:] = np.random.default_rng(1).random((SIDE, SIDE - 64, 3))
    assert Shading.of(pixels) is not None
    assert Shading.of(pixels, 0.5) is not None
    assert Shading.of(pixels, 0.7) is None


def test_a_plane_is_no_radial_gradient():
    shading = shading_of(painted((box(0, 0, SIDE, SIDE), ramp(), 1.0)))
    (number,) = shading.graded
    assert isinstance(shading.shades[number - 1], Shade)


def test_what_lies_on_a_gradient_stays():
    shapes = (disc(30, 30, 10), WHITE, 1.0), (box(50, 20, 70, 80), GREEN, 1.0)
    ground = (box(0, 0, SIDE, SIDE), ramp(), 1.0)
    flat = flattened(painted(ground, *shapes))
    assert np.abs(flat - painted(*shapes, ground=flat[90, 90])).max() < 0.02


def test_what_has_the_colour_of_a_gradient_s_middle_at_its_end_is_still_seen():
    spot = (disc(80, 40, 10), HALF, 1.0)
    pixels = painted((box(0, 0, SIDE, SIDE), ramp(), 1.0), spot)
    flat = flattened(pixels)
    there, left = (np.linalg.norm(image[40, 80] - image[40, 66]) for image in (pixels, flat))
    assert left > 0.65 * there


def test_neither_do_thin_lines_vanish():
    """Five pixels across there is no other region, but its colour is seen."""
    line = (box(20, 40, 80, 42), WHITE, 1.0)
    flat = flattened(painted((box(0, 0, SIDE, SIDE), ramp(), 1.0), line))
    assert np.abs(flat - painted(line, ground=flat[90, 90])).max() < 0.02


def test_two_parts_of_one_gradient_are_one_region_and_another_is_another():
    parts = box(5, 10, 40, 50) | box(56, 10, 90, 50)
    shading = shading_of(painted((parts, ramp(), 1.0), (box(5, 60, 90, 90), ramp(-RISE), 1.0)))
    assert len(shading.graded) == 2
    assert shading.labels[30, 20] == shading.labels[30, 70] != shading.labels[75, 50]


def test_a_gradient_on_nothing():
    pixels = painted((disc(50, 44, 30), ramp(), 1.0))
    alpha = painted((disc(50, 44, 30), np.zeros(3), 1.0))[..., :1]
    flat = flattened(np.concatenate([pixels, 1.0 - alpha], axis=2))
    assert np.ptp(flat[30:58, 36:64], axis=(0, 1)).max() == 0.0
    assert flat[..., 3:] == pytest.approx(1.0 - alpha, abs=0.02)


def test_a_large_picture_is_flattened_at_its_own_size():
    mask = disc(50, 44, 30)
    flat = flattened(painted((mask, ramp(), 1.0), finer=1))
    assert flat.shape == (4 * SIDE, 4 * SIDE, 3)
    assert np.abs(flat - painted((mask, flat[176, 200], 1.0), finer=1)).max() < 0.02


def soft():
    x, y = np.meshgrid(*(np.arange(SIDE) + 0.5,) * 2)
    share = 1 / (1 + np.exp((np.maximum(abs(x - 48), abs(y - 44)) - 20) / 4))
    return WHITE + share[..., None] * (GREEN - WHITE)


def soft_gradient():
    x, y = np.meshgrid(*(np.arange(SIDE) + 0.5,) * 2)
    share = 1 / (1 + np.exp(np.hypot(x - 48, y - 44) - 30))
    return WHITE + share[..., None] * (HALF + (x / SIDE - 0.5)[..., None] * RISE - WHITE)


def conic_gradient():
    x, y = np.meshgrid(*(np.arange(SIDE) - 47.5,) * 2)
    share = np.abs(np.arctan2(y, x)) / np.pi
    return np.where(np.hypot(x, y)[..., None] < 36, GREEN + share[..., None] * RISE, WHITE)


def both_ways():
    """Red rises from the left to the right, blue from the top to the bottom: no two colours run into each other so."""
    y, x = np.mgrid[0:SIDE, 0:SIDE] / SIDE
    return np.where((np.abs(x - 0.5) < 0.4)[..., None], np.stack([x, 0.3 + 0 * x, y], axis=2), WHITE)


def fading():
    """Green that is opaque on the left, and less to the right."""
    alpha = np.broadcast_to(np.linspace(1.0, 0.4, SIDE)[None, :, None], (SIDE, SIDE, 1))
    return np.concatenate([np.broadcast_to(GREEN, (SIDE, SIDE, 3)), alpha], axis=2)


@pytest.mark.parametrize(
    "pixels",
    [
        painted((disc(40, 40, 20), GREEN, 1.0)),
        soft(),
        soft_gradient(),
        conic_gradient(),
        both_ways(),
        fading(),
        np.random.default_rng(0).random((SIDE, SIDE, 3)),
        np.zeros((1, 300, 3)),
        np.zeros((2, 2, 3)),
    ],
    ids=[
        "one colour",
        "a soft edge",
        "a gradient with one",
        "a conic one",
        "one for each of two channels",
        "fading",
        "noise",
        "one row",
        "four pixels",
    ],
)
def test_what_has_no_gradient(pixels):
    assert shading_of(np.rint(pixels * 255) / 255) is None


@pytest.mark.parametrize("mode", ["apart", "overlap"])
def test_soft_edges_and_translucent_shapes_are_no_gradients(mode):
    for count, seed in ((2, 1), (4, 3), (4, 7), (8, 5), (16, 7), (32, 9)):
        pixels = np.asarray(known_scene(count, mode, bool(seed % 2), seed).pixels, np.float32)
        assert Shading.of(pixels) is None

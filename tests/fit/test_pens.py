"""Boxes that become strokes of one pen, where the picture has such."""

import numpy as np
import pytest
import torch

from sdf2vec.fit.constraints import ALMOST
from sdf2vec.fit.pens import in_one_width, lined, strokes_of
from sdf2vec.render.tensors import from_scene, to_scene
from sdf2vec.scene import Layer, Scene, Shape
from tests.fit.drawn import BLUE, SIDE, box, disc, painted, rgb, search_of, view_of


def bar(y, half, corner, length=25.0):
    """Across the middle at a height; pixels."""
    shape = Shape.of(
        "box",
        rgb(BLUE),
        center=(0.0, y / SIDE - 0.5),
        half_size=(length / SIDE, half / SIDE),
        angle=0.0,
        corner_radius=corner / SIDE,
    )
    return Layer((shape,))


def rounded(y, half, length=25):
    """The same as a mask, its ends half discs."""
    ends = [disc(SIDE / 2 + side * (length - half), y, half) for side in (-1, 1)]
    return box(SIDE / 2 - length + half, y - half, SIDE / 2 + length - half, y + half) | ends[0] | ends[1]


def after(layers, pixels, worst=0.0):
    scene = from_scene(Scene(SIDE, SIDE, tuple(layers), (1.0, 1.0, 1.0)))
    made = lined(scene, view_of(pixels), search_of(), worst)
    return [layer.shapes[0].parameters for layer in to_scene(made, SIDE, SIDE).layers]


def test_what_nearly_ends_in_half_discs_does_and_widths_become_one():
    pixels = painted((rounded(25, 5) | rounded(70, 5), BLUE, 1.0))
    first, second = after([bar(25, 5.05, 4.6), bar(70, 4.96, 4.7)], pixels)
    for _, _, _, half, _, corner in (first, second):
        assert half * SIDE == pytest.approx(5.0, abs=0.08)
        assert corner == pytest.approx(ALMOST * half, rel=1e-3)
    assert first[3] == second[3]


def test_square_ends_and_unlike_widths_stay():
    square = painted((box(23, 20, 73, 30), BLUE, 1.0), (rounded(60, 5) | rounded(85, 7), BLUE, 1.0))
    found = after([bar(25, 5, 0), bar(60, 5, 4.99), bar(85, 7, 6.99)], square)
    assert found[0][5] == 0.0
    assert [row[3] * SIDE for row in found] == pytest.approx([5, 5, 7], abs=0.1)


def test_what_ends_unseen_under_others_stays_a_box_unless_there_is_a_pen_of_its_width():
    ends = [disc(x, 25, 9) for x in (23, 73)]
    pixels = painted((box(23, 20, 73, 30), BLUE, 1.0), (ends[0] | ends[1], (0.0, 0.0, 0.0), 1.0))
    over = [
        Layer(
            (Shape.of("circle", (0.0, 0.0, 0.0), center=(x / SIDE - 0.5, 25 / SIDE - 0.5), radius=9 / SIDE),)
        )
        for x in (23, 73)
    ]
    assert after([bar(25, 5, 0), *over], pixels)[0][5] == 0.0
    pixels = painted(
        (box(23, 20, 73, 30) | rounded(60, 5), BLUE, 1.0), (ends[0] | ends[1], (0.0, 0.0, 0.0), 1.0)
    )
    pen, other = after([bar(25, 5, 0), *over, bar(60, 5, 4.9)], pixels)[:: len(over) + 1]
    assert pen[3] == other[3]
    assert pen[5] == other[5] > 0.0


def test_what_is_hardly_longer_than_wide_is_no_stroke():
    scene = Scene(SIDE, SIDE, (bar(25, 5, 5, length=7), bar(60, 5, 5), bar(80, 5, 3)), (1, 1, 1))
    (group,) = from_scene(scene).groups
    assert strokes_of(group).tolist() == [False, True, False]


def test_only_what_was_of_one_width_before_becomes_so():
    widths = [5.0, 5.0, 5.2]
    before = from_scene(
        Scene(SIDE, SIDE, tuple(bar(20 * i + 20, w, w) for i, w in enumerate(widths)), (1, 1, 1))
    )
    after = from_scene(
        Scene(SIDE, SIDE, tuple(bar(20 * i + 20, w, w) for i, w in enumerate([4.9, 5.1, 5.2])), (1, 1, 1))
    )
    in_one_width(after.groups[0], before.groups[0])
    made = after.groups[0].of("half_size", 0)[:, 1] * SIDE
    assert made.numpy() == pytest.approx(np.array([4.9, 4.9, 5.2]), abs=1e-4)
    assert torch.allclose(after.groups[0].of("corner_radius", 0)[:, 0] * SIDE, ALMOST * made)

"""Boxes that become strokes of one pen, where the picture has such."""

import numpy as np
import pytest

from sdf2vec.fit.pens import in_one_width, lined
from sdf2vec.render.tensors import from_scene, to_scene
from sdf2vec.scene import Layer, Scene, Shape
from tests.fit.drawn import BLUE, SIDE, box, disc, painted, rgb, search_of, view_of


def bar(y, half, corner, length=25.0, angle=0.0):
    """Across the middle at a height; pixels."""
    sides = (length, half) if not angle else (half, length)
    shape = Shape.of(
        "box",
        rgb(BLUE),
        center=(0.0, y / SIDE - 0.5),
        half_size=(sides[0] / SIDE, sides[1] / SIDE),
        angle=angle,
        corner_radius=corner / SIDE,
    )
    return Layer((shape,))


def line(y, half):
    """The same as a stroke."""
    a, b = ((x / SIDE, y / SIDE - 0.5) for x in (-20.0, 20.0))
    return Layer((Shape.of("arc", rgb(BLUE), a=a, b=b, sagitta=0.0, half_width=half / SIDE),))


def rounded(y, half, length=25):
    """The same as a mask, its ends half discs."""
    ends = [disc(SIDE / 2 + side * (length - half), y, half) for side in (-1, 1)]
    return box(SIDE / 2 - length + half, y - half, SIDE / 2 + length - half, y + half) | ends[0] | ends[1]


def after(layers, pixels, worst=0.0):
    scene = from_scene(Scene(SIDE, SIDE, tuple(layers), (1.0, 1.0, 1.0)))
    made = lined(scene, view_of(pixels), search_of(), worst)
    return [layer.shapes[0] for layer in to_scene(made, SIDE, SIDE).layers]


@pytest.mark.parametrize("angle", [0.0, np.pi / 2])
def test_what_nearly_ends_in_half_discs_does_and_widths_become_one(angle):
    pixels = painted((rounded(25, 5) | rounded(70, 5), BLUE, 1.0))
    made = after([bar(25, 5.05, 4.6, angle=angle), bar(70, 4.96, 4.7, angle=angle)], pixels)
    assert [shape.kind for shape in made] == ["arc", "arc"]
    for shape, y in zip(made, (25, 70), strict=True):
        *ends, sagitta, half = shape.parameters
        assert half * SIDE == pytest.approx(5.0, abs=0.08)
        assert sagitta == 0.0
        x = sorted((np.array(ends[::2]) + 0.5) * SIDE)
        assert x == pytest.approx([SIDE / 2 - 20, SIDE / 2 + 20], abs=0.3)
        assert (np.array(ends[1::2]) + 0.5) * SIDE == pytest.approx([y, y], abs=0.2)
    assert made[0].parameters[5] == made[1].parameters[5]


def test_square_ends_and_unlike_widths_stay():
    square = painted((box(23, 20, 73, 30), BLUE, 1.0), (rounded(60, 5) | rounded(85, 7), BLUE, 1.0))
    found = after([bar(25, 5, 0), bar(60, 5, 4.99), bar(85, 7, 6.99)], square)
    assert [shape.kind for shape in found] == ["box", "arc", "arc"]
    assert found[0].parameters[5] == 0.0
    assert [shape.parameters[5] * SIDE for shape in found[1:]] == pytest.approx([5, 7], abs=0.1)


def test_what_ends_unseen_under_others_stays_a_box_unless_there_is_a_pen_of_its_width():
    ends = [disc(x, 25, 9) for x in (23, 73)]
    pixels = painted((box(23, 20, 73, 30), BLUE, 1.0), (ends[0] | ends[1], (0.0, 0.0, 0.0), 1.0))
    over = [
        Layer(
            (Shape.of("circle", (0.0, 0.0, 0.0), center=(x / SIDE - 0.5, 25 / SIDE - 0.5), radius=9 / SIDE),)
        )
        for x in (23, 73)
    ]
    assert after([bar(25, 5, 0), *over], pixels)[0].kind == "box"
    pixels = painted(
        (box(23, 20, 73, 30) | rounded(60, 5), BLUE, 1.0), (ends[0] | ends[1], (0.0, 0.0, 0.0), 1.0)
    )
    pen, other = after([bar(25, 5, 0), *over, bar(60, 5, 4.9)], pixels)[:: len(over) + 1]
    assert pen.kind == other.kind == "arc"
    assert pen.parameters[5] == other.parameters[5]


def test_what_is_hardly_longer_than_wide_stays_a_box():
    pixels = painted((rounded(25, 5, 7), BLUE, 1.0))
    assert after([bar(25, 5, 4.99, length=7)], pixels)[0].kind == "box"


def test_only_what_was_of_one_width_before_becomes_so():
    before, now = (
        from_scene(
            Scene(SIDE, SIDE, tuple(line(20 * i + 20, w) for i, w in enumerate(widths)), (1, 1, 1))
        ).groups
        for widths in ([5.0, 5.0, 5.2], [4.9, 5.1, 5.2])
    )
    in_one_width(now, before)
    assert now[0].of("half_width", 0)[:, 0].numpy() * SIDE == pytest.approx([4.9, 4.9, 5.2], abs=1e-4)

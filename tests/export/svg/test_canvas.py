"""User units, by hand."""

import numpy as np
import pytest

from sdf2vec import Layer, Scene, Shape
from sdf2vec.export.svg.canvas import Canvas, pairs


def test_the_middle_of_a_scene_is_that_of_its_canvas():
    canvas = Canvas.of(Scene(300, 200, (), None))
    assert canvas.place((0.0, 0.0)) == (150.0, 100.0)
    assert canvas.place((-0.75, 0.5)) == (0.0, 200.0)
    assert pairs(canvas.from_places(np.array([[0.0, 200.0], [150.0, 100.0]]))) == ((-0.75, 0.5), (0.0, 0.0))


@pytest.mark.parametrize(
    ("side", "coarser", "digits"), [(512, 0, 1), (64, 0, 2), (1, 0, 4), (64, 1, 1), (512, 3, 0)]
)
def test_decimals_follow_the_size(side, coarser, digits):
    canvas = Canvas.of(Scene(2 * side, side, (), None), coarser)
    assert canvas.digits == digits
    assert canvas.rounded(np.array([[1 / 3, 2 / 3]])).tolist() == [
        [round(1 / 3, digits), round(2 / 3, digits)]
    ]


@pytest.mark.parametrize(("falloff", "count", "digits"), [(0.0, 32, 2), (0.0, 33, 1), (0.01, 1, 1)])
def test_few_sharp_layers_have_one_decimal_more(falloff, count, digits):
    disc = Shape.of("circle", (1, 0, 0), center=(0, 0), radius=0.2)
    assert Canvas.of(Scene(512, 512, (Layer((disc,), falloff),) * count, None)).digits == digits


def test_whole_numbers_of_units():
    assert Canvas.whole(Scene(300, 200, (), None), 100) == Canvas(150.0, 100.0, 100.0, 0, 2.0)

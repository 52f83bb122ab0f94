"""Regions that several shapes cover together: the bars within them, and layers made of parts."""

import numpy as np
import pytest
import torch

from sdf2vec import Joint, Layer, Scene, Shape, render
from sdf2vec.fit.covering import Bar, parted, widest
from sdf2vec.render.tensors import from_scene

y, x = np.mgrid[:40, :60]


def turned(middle, half, degrees):
    """The pixels of a turned bar."""
    turn = np.radians(degrees)
    along = np.cos(turn) * (x - middle[0]) + np.sin(turn) * (y - middle[1])
    across = np.cos(turn) * (y - middle[1]) - np.sin(turn) * (x - middle[0])
    return (abs(along) <= half[0]) & (abs(across) <= half[1])


def found(wanted, allowed) -> Bar:
    bar = widest(wanted, allowed)
    assert bar is not None
    return bar


@pytest.mark.parametrize("degrees", [0, 45, 90, 150])
def test_a_bar_is_found_within_a_region_that_is_one(degrees):
    region = turned((30, 20), (17.4, 4.4), degrees)
    bar = found(region, region)
    assert bar.middle == pytest.approx((30, 20), abs=1.0)
    assert max(bar.half) == pytest.approx(17, abs=1.0)
    assert min(bar.half) == pytest.approx(4, abs=1.0)
    assert bar.gain >= 0.8 * region.sum()  # of few pixels across, those of the rim count


def test_the_longer_of_two_crossed_bars_comes_first_and_then_the_other_through_it():
    long, short = turned((30, 20), (28.4, 3.4), 0), turned((20, 20), (15.4, 3.4), 90)
    region = long | short
    first = found(region, region)
    assert first.turn == 0.0
    assert max(first.half) == pytest.approx(28, abs=0.5)
    second = found(region & ~long, region)
    assert second.middle == pytest.approx((20, 20), abs=0.5)
    assert second.gain == (region & ~long).sum()


def test_a_bar_may_lie_under_what_is_not_known():
    """Its middle line may: a strip on either side of what hides it is one bar."""
    whole, hidden = turned((30, 20), (28.4, 8.4), 0), turned((30, 20), (30, 4.4), 0)
    bar = found(whole & ~hidden, whole | hidden)
    assert bar.middle == pytest.approx((30, 20), abs=0.5)
    assert bar.gain == (whole & ~hidden).sum()


@pytest.mark.parametrize("size", [(1, 1), (1, 9), (5, 5)])
def test_nothing_has_no_bar_and_everything_one(size):
    nothing, everything = np.zeros(size, bool), np.ones(size, bool)
    assert widest(nothing, everything) is None
    assert found(everything, everything).gain == everything.sum()


def test_parts_of_a_sharp_union_draw_the_same_as_layers():
    shapes = (
        Shape.of("circle", (0.9, 0.4, 0.1), center=(-0.1, 0.0), radius=0.3),
        Shape.of(
            "box", (0.9, 0.4, 0.1), center=(0.2, 0.1), half_size=(0.2, 0.1), angle=0.4, corner_radius=0.0
        ),
    )
    joined = Layer(shapes, 0.0, 1.0, (Joint("union", 0.0),))
    scene = Scene(64, 48, (joined,), (0.1, 0.2, 0.3))
    (group,) = from_scene(scene).groups
    apart = Scene(64, 48, tuple(Layer((shape,), 0.0, 1.0) for shape in shapes), (0.1, 0.2, 0.3))
    rows = [layer.rows() for layer in parted(group)]
    expected = [layer.rows() for layer in from_scene(apart).groups]
    assert all(torch.equal(one, other) for one, other in zip(rows, expected, strict=True))
    assert np.abs(render(scene) - render(apart)).max() < 0.3  # where both have edges
    assert np.abs(render(scene) - render(apart)).mean() < 1e-3

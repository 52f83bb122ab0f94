"""Layers that are not needed: from scenes that have some, on pictures drawn in numpy."""

from dataclasses import replace

import pytest

from sdf2vec.fit import pruning
from sdf2vec.fit.descents import Sizes
from sdf2vec.fit.pruning import BRIEF, FLOOR, USUAL
from sdf2vec.fit.surroundings import error_of
from sdf2vec.render.tensors import from_scene, to_scene
from sdf2vec.scene import Scene
from tests.fit.drawn import (
    BLUE,
    GREEN,
    RED,
    SIDE,
    WHITE,
    box,
    disc,
    painted,
    rgb,
    search_of,
    sharp_box,
    sharp_disc,
    view_of,
)


def test_a_disc_that_is_there_twice_is_put_on_top_instead():
    """Below a translucent box on which it lies, and once more, small, where it would be seen through that."""
    pixels = painted((box(48, 10, 90, 70), BLUE, 0.5), (disc(50, 40, 18), RED, 1.0))
    over = replace(sharp_box(BLUE, 48, 10, 90, 70), opacity=0.5)
    scene = from_scene(
        Scene(SIDE, SIDE, (sharp_disc(RED, 50, 40, 18), over, sharp_disc(RED, 57, 40, 11)), rgb(WHITE))
    )
    view = view_of(pixels)
    left = pruning.pruned(scene, Sizes(view, view, view), search_of())
    kinds = [layer.shapes[0].kind for layer in to_scene(left, SIDE, SIDE).layers]
    assert kinds == ["box", "circle"]
    assert error_of(left, view) < FLOOR


@pytest.mark.parametrize(("hope", "count"), [(USUAL, 1), (BRIEF, 2)])
def test_what_is_told_more_shortly_stays(hope, count):
    """A dot of three pixels may be missing in a picture that is as near as it needs to be; but all that is
    wrong without it takes more bits than it does.
    """
    pixels = painted((disc(40, 40, 20), BLUE, 1.0), (disc(70.5, 70.5, 3), GREEN, 1.0))
    layers = sharp_disc(BLUE, 40, 40, 20), sharp_disc(GREEN, 70.5, 70.5, 3)
    scene, view = from_scene(Scene(SIDE, SIDE, layers, rgb(WHITE))), view_of(pixels)
    worst = 2.0 * error_of(from_scene(Scene(SIDE, SIDE, layers[:1], rgb(WHITE))), view)
    left = pruning.pruned(scene, Sizes(view, view, view), search_of(), worst, hope)
    assert left.layer_count == count

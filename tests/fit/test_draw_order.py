"""Layers moved within the draw order."""

import pytest

from sdf2vec.fit.draw_order import moved, ordered, reordered
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
    sharp_box,
    sharp_disc,
    view_of,
)

FIRST, SECOND, THIRD = sharp_disc(RED, 40, 40), sharp_box(BLUE, 30, 30, 60, 60), sharp_disc(GREEN, 50, 50)


def colors_of(tensors):
    """Of the layers in draw order, each as the place of the largest channel."""
    layers = to_scene(tensors, SIDE, SIDE).layers
    return "".join("rgb"[max(range(3), key=layer.shapes[0].color.__getitem__)] for layer in layers)


@pytest.mark.parametrize(
    ("order", "place", "found"), [(0, 2, "bgr"), (2, 0, "grb"), (1, 1, "rbg"), (0, 1, "brg"), (1, 2, "rgb")]
)
def test_a_layer_is_moved_and_the_others_stay_in_order(order, place, found):
    """Two of them are of one structure, the third, between them, is not."""
    scene = from_scene(Scene(SIDE, SIDE, (FIRST, SECOND, THIRD), rgb(WHITE)))
    assert colors_of(ordered(scene, moved(range(scene.layer_count), order, place))) == found
    assert colors_of(scene) == "rbg"


def test_each_is_put_where_the_picture_has_it():
    pixels = painted(
        (disc(50, 50, 20), GREEN, 1.0), (box(30, 30, 60, 60), BLUE, 1.0), (disc(40, 40, 20), RED, 1.0)
    )
    scene = from_scene(Scene(SIDE, SIDE, (FIRST, SECOND, THIRD), rgb(WHITE)))
    assert colors_of(reordered(scene, view_of(pixels))) == "gbr"

"""Layers that are not needed: from scenes that have some, on pictures drawn in numpy."""

from dataclasses import replace

import pytest
from scipy import ndimage

from sdf2vec.fit import pruning
from sdf2vec.fit.descents import LAST, Sizes, descended, softened
from sdf2vec.fit.draw_order import without
from sdf2vec.fit.pruning import BRIEF, FLOOR, THOROUGH, USUAL
from sdf2vec.fit.surroundings import error_of
from sdf2vec.render.tensors import from_scene, to_scene
from sdf2vec.scene import Scene
from tests.fit.drawn import (
    BLUE,
    FINER,
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


def test_what_would_be_seen_stays_though_little_is_wrong_without_it():
    """A square with a shadow of nearly its own colour: a soft square alone is near to both by the mean."""
    soft = ndimage.gaussian_filter(box(40, 42, 60, 62).astype(float), 2 * FINER)
    pixels = painted((soft, 0.75 * WHITE, 1.0), (box(40, 40, 60, 60), 0.87 * WHITE, 1.0))
    shadow = replace(sharp_box(0.75 * WHITE, 42, 44, 58, 60), falloff=6 / SIDE)
    layers = shadow, sharp_box(0.87 * WHITE, 40, 40, 60, 60)
    view = view_of(pixels)
    sizes, search = Sizes(view, view, view), search_of()
    scene = descended(from_scene(Scene(SIDE, SIDE, layers, rgb(WHITE))), view, search, LAST)
    assert error_of(scene, view) < FLOOR / 2
    alone = descended(softened(without(scene, 0), THOROUGH.softness, view), view, search, LAST)
    assert error_of(alone, view) < FLOOR
    assert pruning.pruned(scene, sizes, search, FLOOR, THOROUGH).layer_count == 2

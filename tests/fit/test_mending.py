"""Layers thought of again: from scenes with mistakes in them, on pictures drawn in numpy."""

from dataclasses import replace

import numpy as np
import pytest

from sdf2vec.fit import mending
from sdf2vec.fit.descents import Sizes
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
    sharp_triangle,
    view_of,
)

FLOOR = 10**-4.4


def mended(layers, way, pixels, more):
    """The layers of a scene after one of the ways, which takes one thing more; and its error before and after."""
    view = view_of(pixels)
    scene = from_scene(Scene(SIDE, SIDE, layers, rgb(WHITE)))
    made = way(scene, Sizes(view, view, view), search_of(), more)
    return to_scene(made, SIDE, SIDE).layers, error_of(scene, view), error_of(made, view)


def test_a_layer_is_found_anew_where_another_hid_what_it_is():
    """A box of which a triangle was made, far off; the discs over and beside it are as they should be."""
    pixels = painted(
        (box(20, 30, 70, 62), BLUE, 1.0), (disc(70, 30, 14), RED, 1.0), (disc(24, 78, 12), GREEN, 1.0)
    )
    wrong = sharp_triangle(BLUE, (20, 30), (70, 62), (20, 62))
    layers = wrong, sharp_disc(RED, 70, 30, 14), sharp_disc(GREEN, 24, 78, 12)
    found, before, after = mended(layers, mending.replaced, pixels, FLOOR)
    assert (len(found), found[0].shapes[0].kind) == (3, "box")
    x, y, half_width, half_height = found[0].shapes[0].parameters[:4]
    assert ((x + 0.5) * SIDE, (y + 0.5) * SIDE) == pytest.approx((45, 46), abs=0.3)
    assert (half_width * SIDE, half_height * SIDE) == pytest.approx((25, 16), abs=0.3)
    assert after < 0.01 * before


def test_nothing_is_found_anew_where_nothing_is_missing():
    pixels = painted((disc(40, 40, 20), BLUE, 1.0), (disc(70, 70, 14), RED, 1.0))
    layers = sharp_disc(BLUE, 40, 40, 20), sharp_disc(RED, 70, 70, 14)
    found, before, after = mended(layers, mending.replaced, pixels, FLOOR)
    assert before < FLOOR
    assert [layer.shapes[0] for layer in found] == [layer.shapes[0] for layer in layers]
    assert after == before


def test_shapes_are_exchanged_where_little_is_wrong_too():
    """A small box that is a disc: a tenth of what is wrong in a disc that is too large."""
    pixels = painted((disc(40, 40, 30), BLUE, 1.0), (disc(80, 80, 6), RED, 1.0))
    layers = sharp_disc(BLUE, 40, 40, 33), sharp_box(RED, 74.5, 74.5, 85.5, 85.5)
    kept, *_ = mended(layers, mending.exchanged, pixels, mending.WORST)
    found, before, after = mended(layers, mending.exchanged, pixels, mending.SLIGHTLY)
    assert kept[1].shapes[0].kind == "box"
    assert found[1].shapes[0].kind in ("circle", "ellipse")
    assert after < 0.05 * before


def test_several_layers_that_make_up_a_soft_disc_become_it():
    """Two discs and a triangle, all of its colour."""
    x, y = np.meshgrid(*(np.arange(SIDE) + 0.5,) * 2)
    soft = 1 / (1 + np.exp((np.hypot(x - 44, y - 50) - 20) / 0.8))
    pixels = WHITE + soft[..., None] * (BLUE - WHITE)
    parts = sharp_disc(BLUE, 44, 50, 17), sharp_disc(BLUE, 44, 50, 19)
    corner = sharp_triangle(BLUE, (30, 62), (44, 74), (36, 70))
    layers = tuple(replace(part, falloff=0.02) for part in (*parts, corner))
    found, before, after = mended(layers, mending.merged, pixels, FLOOR)
    assert len(found) == 1
    assert after < FLOOR < before


@pytest.mark.parametrize("rise", [mending.RISE, 1e9])
def test_discs_of_one_colour_in_two_places_stay_two(rise, monkeypatch):
    monkeypatch.setattr(mending, "RISE", rise)
    pixels = painted((disc(30, 40, 16), BLUE, 1.0), (disc(68, 56, 14), BLUE, 1.0))
    layers = sharp_disc(BLUE, 30, 40, 16), sharp_disc(BLUE, 68, 56, 14)
    found, *_ = mended(layers, mending.merged, pixels, FLOOR)
    assert [layer.shapes[0] for layer in found] == [layer.shapes[0] for layer in layers]


def test_a_scene_that_is_near_enough_stays_so_however_shortly_another_tells_the_picture(monkeypatch):
    monkeypatch.setattr(mending, "RISE", 1e9)
    monkeypatch.setattr(
        mending, "is_longer", lambda scene, other, view: scene.layer_count > other.layer_count
    )
    pixels = painted((disc(30, 40, 16), BLUE, 1.0), (disc(68, 56, 14), BLUE, 1.0))
    layers = sharp_disc(BLUE, 30, 40, 16), sharp_disc(BLUE, 68, 56, 14)
    assert len(mended(layers, mending.merged, pixels, FLOOR)[0]) == 2


@pytest.mark.parametrize("way", [mending.merged, mending.exchanged, mending.replaced])
def test_nothing_comes_of_no_layers(way):
    assert mended((), way, painted((disc(30, 40, 16), BLUE, 1.0)), FLOOR)[0] == ()


def test_a_layer_alone_is_not_merged():
    found, *_ = mended((sharp_disc(BLUE, 44, 50),), mending.merged, painted(), FLOOR)
    assert len(found) == 1

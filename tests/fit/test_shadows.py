"""Shadows, glows and slopes, drawn in numpy and blurred by SciPy: what casts them is told by its sharp edge."""

from __future__ import annotations

import numpy as np
import pytest
import torch
from scipy import ndimage

from sdf2vec import fit
from sdf2vec.fit.areas import Outlined
from sdf2vec.fit.descents import Sizes
from sdf2vec.fit.peeling import Outlines
from sdf2vec.fit.region_graph import Regions
from sdf2vec.fit.shadows import with_shadows
from sdf2vec.fit.slopes import Slopes, even, steps
from sdf2vec.fit.surroundings import Surroundings, error_of
from sdf2vec.image import Picture
from sdf2vec.quality import psnr_of
from sdf2vec.render.tensors import from_scene, to_scene
from sdf2vec.scene import Scene
from tests.fit.drawn import (
    BLUE,
    FINER,
    RED,
    SIDE,
    WHITE,
    bare,
    box,
    disc,
    painted,
    ramp,
    rgb,
    search_of,
    sharp_box,
    view_of,
)

BLACK = np.zeros(3)


def blurred(mask, deviation):
    """A mask as a Gaussian of so many pixels blurs it."""
    return ndimage.gaussian_filter(mask.astype(float), deviation * FINER)


def card(color=BLACK):
    """A red box and its shadow."""
    mask = box(30, 30, 66, 60)
    shadow = blurred(np.roll(mask, 3 * FINER, axis=0), 4)
    return painted((shadow, color, 0.4), (mask, RED, 1.0))


def told(pixels) -> list[Outlined]:
    """What is on top of a picture."""
    view = view_of(pixels)
    outlines = Outlines(bare(), [Surroundings.of(bare(), 0, view)], search_of())
    return outlines.topmost(Regions.of(pixels))


# --- pictures -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("color", [BLACK, BLUE])
def test_a_box_with_a_shadow_is_two_boxes(color):
    pixels = card(color=color)
    scene = fit(Picture(pixels.astype(np.float32)), seed=0)
    assert scene.shape_count == 2
    under, over = scene.layers
    assert under.falloff > 0.05 > over.falloff
    assert under.opacity < 0.6 < over.opacity
    assert psnr_of(scene, Picture(pixels.astype(np.float32))) > 42


def test_there_are_no_more_shapes_than_are_allowed():
    picture = Picture(card().astype(np.float32))
    assert fit(picture, 1, seed=0).shape_count == 1
    assert fit(picture, max_shapes=1, seed=0).shape_count == 1


def test_each_of_four_keeps_its_own_and_none_is_left_out():
    """One has hardly another colour than its shadow: without it all would still be near by the mean."""
    places = (12, 12, RED), (56, 12, BLUE), (12, 56, 0.75 * WHITE), (56, 56, BLACK)
    masks = [box(x, y, x + 26, y + 26) for x, y, _ in places]
    shadow = sum(blurred(np.roll(mask, 2 * FINER, axis=0), 3) for mask in masks)
    pixels = painted((shadow, BLACK, 0.3), *((m, c, 1.0) for m, (*_, c) in zip(masks, places, strict=True)))
    scene = fit(Picture(pixels.astype(np.float32)), seed=0)
    soft = [layer for layer in scene.layers if layer.falloff > 0.03]
    assert (len(soft), scene.shape_count) == (4, 8)


def test_a_disc_keeps_its_edge_within_its_glow():
    mask = disc(48, 48, 18)
    pixels = painted((blurred(mask, 6), 0.9 * WHITE, 0.8), (mask, WHITE, 1.0), ground=BLUE)
    scene = fit(Picture(pixels.astype(np.float32)), seed=0)
    assert [layer.shapes[0].kind for layer in scene.layers] == ["circle", "circle"]
    assert scene.layers[1].falloff < 0.02
    assert scene.layers[1].shapes[0].parameters[2] == pytest.approx(18 / SIDE, abs=0.5 / SIDE)


def test_on_a_gradient_what_has_an_edge_is_told_by_that():
    """A disc with two spots and a glow, on a ramp."""
    mask = disc(48, 44, 20)
    spots = (disc(42, 38, 4), 0.85 * WHITE, 1.0), (disc(55, 50, 5), 0.85 * WHITE, 1.0)
    glow = (blurred(mask, 5), WHITE, 0.6)
    pixels = painted((box(0, 0, SIDE, SIDE), ramp(), 1.0), glow, (mask, WHITE, 1.0), *spots)
    scene = fit(Picture(pixels.astype(np.float32)), seed=0)
    assert [layer.shapes[0].kind for layer in scene.layers] == ["box", *["circle"] * 4]
    assert psnr_of(scene, Picture(pixels.astype(np.float32))) > 40


# --- shadows ------------------------------------------------------------------------------------------------


def shadowed(pixels, *layers):
    view = view_of(pixels)
    scene = from_scene(Scene(SIDE, SIDE, layers, rgb(WHITE)))
    made = with_shadows(scene, Sizes(view, view, view), search_of(), 8)
    return to_scene(made, SIDE, SIDE), error_of(made, view)


def test_a_shadow_lies_on_what_it_falls_on():
    mask = box(30, 30, 66, 60)
    soft = blurred(np.roll(mask, 3 * FINER, axis=0), 4)
    pixels = painted((box(8, 8, 88, 88), BLUE, 1.0), (soft, BLACK, 0.5), (mask, RED, 1.0))
    scene, error = shadowed(pixels, sharp_box(BLUE, 8, 8, 88, 88), sharp_box(RED, 30, 30, 66, 60))
    assert [layer.falloff > 0.05 for layer in scene.layers] == [False, True, False]
    assert error < 10**-4


def test_a_shadow_lies_below_what_hides_it():
    """That of the lower box does not fall on the upper one, which is of the same thing."""
    lower, upper = box(24, 50, 72, 76), box(24, 30, 72, 50)
    soft = blurred(np.roll(lower | upper, 3 * FINER, axis=0), 4)
    pixels = painted((soft, BLACK, 0.5), (upper, BLUE, 1.0), (lower, RED, 1.0))
    scene, error = shadowed(pixels, sharp_box(BLUE, 24, 30, 72, 50), sharp_box(RED, 24, 50, 72, 76))
    assert scene.layers[0].falloff > 0.05
    assert max(layer.falloff for layer in scene.layers[-2:]) < 0.02
    assert error < 2 * 10**-4


def test_a_shadow_on_nothing_has_the_opacity_that_is_left():
    mask = box(30, 30, 66, 60)
    alpha = painted((blurred(mask, 4), WHITE, 0.4), (mask, WHITE, 1.0), ground=BLACK)[..., :1]
    color = painted((mask, RED, 1.0), ground=BLACK)
    view = view_of(np.concatenate([color, alpha], axis=2))
    scene = from_scene(Scene(SIDE, SIDE, (sharp_box(RED, 30, 30, 66, 60),), None))
    made = to_scene(with_shadows(scene, Sizes(view, view, view), search_of(), 8), SIDE, SIDE)
    assert len(made.layers) == 2
    assert made.layers[0].shapes[0].color == pytest.approx((0.0, 0.0, 0.0), abs=0.05)
    assert made.layers[0].opacity < 0.5


@pytest.mark.parametrize("layer", [sharp_box(RED, 30, 30, 66, 60), sharp_box(RED, 10, 30, 40, 60)])
def test_there_is_none_where_all_is_told_or_too_much_is_missing(layer):
    """A picture without a shadow, of which the layer is all; or another one."""
    scene, _ = shadowed(painted((box(30, 30, 66, 60), RED, 1.0)), layer)
    assert len(scene.layers) == 1


# --- slopes -------------------------------------------------------------------------------------------------


def test_a_slope_ends_at_a_sharp_edge_but_goes_over_into_the_ground():
    pixels = card()
    cores = np.where(np.abs(pixels - RED).max(axis=2) < 0.01, 1, 0)
    cores[np.abs(pixels - WHITE).max(axis=2) < 0.005] = 2
    slopes = Slopes.of(pixels, cores)
    assert slopes.ends[62:66, 40:56].all()  # the shadow below the box
    assert not slopes.ends[cores > 0].any()
    away = ndimage.distance_transform_edt(cores != 2)
    assert slopes.go_over.any()
    assert (away[slopes.go_over] <= 2.3).all()


def test_a_box_is_told_by_the_shadow_around_it():
    (found,) = told(card())
    assert [part.kind for part in found.layer.structure] == ["box"]
    assert found.is_good
    assert not found.soft
    x, y, half_x, half_y = (float(v) for v in torch.cat(found.layer.shape(0)[:4]))
    assert (x, y, half_x, half_y) == pytest.approx((0.0, -3 / SIDE, 18 / SIDE, 15 / SIDE), abs=0.5 / SIDE)


def test_what_is_soft_itself_is_told_to_be():
    """Its middle is flat, and nothing ends at an edge."""
    (found,) = told(painted((blurred(disc(48, 48, 26), 3), RED, 1.0)))
    assert found.soft


def test_steps_of_a_gradient_are_no_regions_but_flat_stripes_are():
    stripes = painted(*((box(0, y, SIDE, y + 8), (0.2 + y / 200) * WHITE, 1.0) for y in range(0, SIDE, 8)))
    shallow = painted(
        (box(0, 0, SIDE, SIDE), ramp(np.array([0.2, 0.0, 0.0])), 1.0)
    )  # of one level in two pixels
    for pixels, expected in ((stripes, False), (shallow, True)):
        cores = np.rint(pixels[..., 0] * 255).astype(np.int64)
        numbers = np.unique(cores)
        found = steps(pixels, np.searchsorted(numbers, cores) + 1)
        assert len(found) == len(numbers)
        assert (found[1:-1] == expected).all()


def test_an_edge_jumps_and_a_soft_one_does_not():
    sharp, soft = (
        painted((box(0, 0, 48, SIDE), RED, 1.0)),
        painted((blurred(box(0, 0, 48, SIDE), 3), RED, 1.0)),
    )
    nothing = np.zeros((SIDE, SIDE), np.int64)
    assert Slopes.of(sharp, nothing).jumps[20:70, 46:50].all()
    assert not Slopes.of(soft, nothing).jumps[20:70, 42:46].any()


def test_what_is_even_is_smooth_in_all_directions():
    pixels = painted((box(0, 0, SIDE, SIDE), ramp(), 1.0), (disc(48, 48, 20), BLUE, 1.0))
    calm = even(pixels)
    assert calm[3:-3, 3:20].all()
    assert calm[40:56, 40:56].all()
    assert not calm[48, 66:70].all()
    assert not calm[0].any()

"""Drawings taken apart: their regions, what a translucent layer is told by, outlines; on pictures drawn in numpy."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import torch
from PIL import Image

from sdf2vec.api import render
from sdf2vec.fit import descents, peeling, pruning, sparse
from sdf2vec.fit.drawings import Drawn
from sdf2vec.fit.finding import Drawing
from sdf2vec.fit.outlining import best_outlined
from sdf2vec.fit.peeling import peeled
from sdf2vec.fit.region_graph import Regions
from sdf2vec.fit.settings import settings_of
from sdf2vec.fit.surroundings import Surroundings, View, error_of
from sdf2vec.fit.transparency import Overlay, bared, overlays
from sdf2vec.fit.views import scaled
from sdf2vec.image import Picture
from sdf2vec.render.tensors import from_scene, to_scene
from sdf2vec.scene import Joint, Layer, Scene
from tests.fit.drawn import (
    BLUE,
    FINER,
    GREEN,
    RED,
    SIDE,
    WHITE,
    bare,
    box,
    disc,
    painted,
    points,
    search_of,
    sharp_box,
    sharp_disc,
    sharp_triangle,
    view_of,
)


def apart(pixels, *sides):
    """The layers that are told by their outlines, from the bottom up; where the picture is seen at these sizes, too."""
    small = [View(scaled(pixels.astype(np.float32), side), None) for side in sides]
    return to_scene(peeled(bare(), [*small, view_of(pixels)], search_of()), SIDE, SIDE).layers


# --- regions ------------------------------------------------------------------------------------------------


def test_regions_are_flat_and_share_out_what_is_between_them():
    regions = Regions.of(painted((disc(48, 48, 20), BLUE, 1.0)))
    assert len(regions.colors) == 2
    assert regions.areas.sum() == SIDE * SIDE
    assert regions.areas.min() == pytest.approx(np.pi * 20**2, rel=0.01)
    assert regions.colors[1] == pytest.approx(BLUE, abs=1 / 255)
    assert regions.beside.tolist() == [[False, True], [True, False]]


def test_pixels_of_one_colour_that_do_not_touch_are_two_regions():
    regions = Regions.of(painted((box(10, 10, 30, 30), BLUE, 1.0), (box(50, 50, 80, 80), BLUE, 1.0)))
    assert len(regions.colors) == 3
    assert not regions.beside[1, 2]


def test_what_is_thin_is_surely_not_of_the_region_around_it():
    regions = Regions.of(painted((box(20, 48, 80, 49), BLUE, 1.0)))
    assert len(regions.colors) == 1
    assert (~regions.sure).sum() == 60


def test_a_gradient_is_no_region():
    pixels = painted()
    pixels[20:60, 20:80] = np.linspace(0, 1, 60)[None, :, None]
    regions = Regions.of(pixels)
    assert len(regions.colors) == 1
    assert not regions.labels[40, 50]


@pytest.mark.parametrize(
    "layers", [((disc(48, 48, 30), BLUE),), ((box(20, 15, 76, 81), GREEN), (disc(48, 48, 15), WHITE))]
)
def test_what_was_made_smaller_has_the_regions_that_it_had(layers):
    """By Pillow, whose filter rings beside edges, by some levels."""
    large = painted(*((mask, color, 1.0) for mask, color in layers), finer=1)
    side = (2 * SIDE, 2 * SIDE)
    small = Image.fromarray(np.uint8(large * 255)).resize(side, Image.Resampling.LANCZOS)
    given = Drawn.of(Picture((np.asarray(small, np.float32) / 255).astype(np.float32))).pixels.astype(
        np.float64
    )
    found = Regions.of(given)
    assert (found.labels > 0).all()
    wanted = Regions.of(painted(*((mask, color, 1.0) for mask, color in layers)))
    assert found.areas == pytest.approx(4 * wanted.areas, rel=0.02)
    assert found.colors == pytest.approx(wanted.colors, abs=2 / 255)


@pytest.mark.parametrize(("columns", "regions"), [(5, 1), (12, 0)])
def test_what_is_shaded_is_no_region_but_for_a_little_at_its_edge(columns, regions):
    """By a level more from one column to the next, up to five, at the right; of 96 columns 3 or 10 by more than two."""
    pixels = painted(ground=BLUE)
    pixels[:, -columns:] += np.arange(1, columns + 1).clip(max=5)[:, None] / 255
    assert len(Regions.of(pixels).colors) == regions


def test_neighbours_of_one_colour_become_one_region():
    regions = Regions.of(painted((box(0, 0, 48, 96), BLUE, 1.0)))
    one = regions.recolored(np.array([True, False]), regions.colors[1], regions.doubts[:1])
    assert len(one.colors) == 1
    assert one.areas.tolist() == [SIDE * SIDE]


def test_what_is_hidden_is_not_known():
    regions = Regions.of(painted((box(20, 20, 50, 60), BLUE, 1.0), (disc(70, 70, 15), RED, 1.0)))
    hidden = regions.hidden(np.array([False, True, False]))
    assert len(hidden.colors) == 2
    assert (hidden.labels[22:58, 22:48] == 0).all()
    assert hidden.colors[hidden.labels[70, 70] - 1] == pytest.approx(RED, abs=1 / 255)


@pytest.mark.parametrize("shape", [(1, 1, 3), (1, 300, 3), (300, 2, 4)])
def test_the_smallest_pictures_have_regions_or_none(shape):
    assert len(Regions.of(np.zeros(shape)).colors) == (shape[1] == 2)


# --- translucent layers -------------------------------------------------------------------------------------

OVER_TWO = (box(0, 0, 48, 96), BLUE, 1.0), (box(20, 30, 76, 66), RED, 0.4)


def test_a_translucent_layer_over_two_colours_is_told_with_its_opacity_and_colour():
    regions = Regions.of(painted(*OVER_TWO))
    (overlay,) = overlays(regions)
    assert overlay.opacity == pytest.approx(0.4, abs=0.01)
    assert overlay.color == pytest.approx(RED, abs=0.02)
    assert regions.mask(overlay.inside, np.s_[:, :]).sum() == 56 * 36


def test_without_it_the_two_colours_are_left():
    regions = Regions.of(painted(*OVER_TWO))
    left = bared(regions, overlays(regions)[0])
    assert left.areas.tolist() == [SIDE * SIDE / 2] * 2
    assert sorted(left.colors.tolist()) == pytest.approx(np.array([BLUE, WHITE]), abs=0.01)


@pytest.mark.parametrize("other", [GREEN, 0.6 * WHITE + 0.4 * RED + np.array([0.05, 0.0, 0.0])])
def test_what_does_not_keep_the_difference_of_two_colours_is_not_translucent(other):
    shown = (box(20, 30, 48, 66), 0.6 * BLUE + 0.4 * RED, 1.0), (box(48, 30, 76, 66), other, 1.0)
    assert not overlays(Regions.of(painted(OVER_TWO[0], *shown)))


# --- outlines -----------------------------------------------------------------------------------------------


def test_what_is_partly_hidden_is_found_whole_and_below():
    under, over = apart(painted((disc(40, 44, 22), BLUE, 1.0), (box(44, 40, 84, 70), RED, 1.0)))
    assert (under.shapes[0].kind, over.shapes[0].kind) == ("circle", "box")
    x, y, radius = (number * SIDE for number in under.shapes[0].parameters)
    assert (x + 48, y + 48, radius) == pytest.approx((40, 44, 22), abs=0.3)
    assert under.shapes[0].color == pytest.approx(BLUE, abs=0.01)


def test_translucent_shapes_that_overlap_are_one_layer_each():
    layers = apart(
        painted(
            (box(12, 20, 60, 56), BLUE, 1.0),
            (disc(60, 60, 24), GREEN, 0.5),
            (box(36, 40, 88, 88), RED, 0.6),
        )
    )
    assert [layer.shapes[0].kind for layer in layers] == ["box", "circle", "box"]
    assert [layer.opacity for layer in layers] == pytest.approx([1.0, 0.5, 0.6], abs=0.02)


def test_a_ring_is_one_layer_and_what_bites_into_a_disc_is_another():
    ring = disc(30, 30, 22) & ~disc(30, 30, 14)
    layers = apart(
        painted((ring, BLUE, 1.0), (disc(66, 60, 20), RED, 1.0), (box(60, 50, 92, 92), GREEN, 1.0))
    )
    assert sorted(tuple(s.kind for s in layer.shapes) for layer in layers) == [
        ("box",),
        ("circle",),
        ("circle", "circle"),
    ]


def test_what_has_many_holes_is_whole_and_each_hole_is_a_shape_in_the_ground_s_colour():
    bars = (box(20, 60, 30, 75), box(42, 40, 52, 75), box(64, 20, 74, 75))
    layers = apart(painted((box(10, 10, 86, 86), BLUE, 1.0), *((bar, WHITE, 1.0) for bar in bars)))
    below, *holes = layers
    assert [layer.seen[0].color for layer in layers] == [
        pytest.approx(c, abs=0.01) for c in (BLUE, *[WHITE] * 3)
    ]
    assert all([shape.kind for shape in layer.shapes] == ["box"] for layer in layers)
    assert below.shapes[0].named()["half_size"] == pytest.approx((38 / 96,) * 2, abs=0.003)
    across = sorted(layer.shapes[0].named()["center"][0] for layer in holes)
    assert across == pytest.approx([(x - 48) / 96 for x in (25, 47, 69)], abs=0.003)


def test_what_reaches_the_edge_of_the_picture_is_no_hole():
    masks = (box(0, 30, 96, 60), box(40, 0, 50, 96), box(60, 40, 70, 50))
    pixels = painted(*((mask, color, 1.0) for mask, color in zip(masks, (BLUE, RED, WHITE), strict=True)))
    (hole,) = peeling.holes(regions := Regions.of(pixels), WHITE)
    assert regions.areas[hole.inside] == pytest.approx([100], rel=0.01)
    assert [*peeling.holes(regions.hidden(~hole.inside), WHITE)] == []  # of what is gone there is none


def rounded(radius):
    """All of the picture but its corners, which are so round."""
    x, y = points()
    beyond = [np.maximum(abs(each - SIDE / 2) - (SIDE / 2 - radius), 0) for each in (x, y)]
    return np.hypot(*beyond) < radius


def peeled_off(pixels, ground=BLUE):
    """What a picture is told as, where its ground is said to be of a colour."""
    scene = replace(bare(), background=torch.tensor([*ground, 1.0]).float())
    return to_scene(peeled(scene, [view_of(pixels)], search_of()), SIDE, SIDE)


def test_a_plate_from_side_to_side_is_a_shape_on_the_colour_of_the_corners():
    pixels = painted(
        (rounded(16), BLUE, 1.0), (disc(40, 50, 12), WHITE, 1.0), (box(60, 20, 80, 70), RED, 1.0)
    )
    scene = peeled_off(pixels)
    assert scene.background == pytest.approx(WHITE, abs=0.005)
    (plate,), *others = (layer.shapes for layer in scene.layers)
    assert plate.kind == "box"
    assert plate.color == pytest.approx(BLUE, abs=0.005)
    assert sorted(shape.kind for (shape,) in others) == ["box", "circle"]
    error = render(scene, SIDE, SIDE)[..., :3] - pixels
    assert abs(error[:20, :20]).mean() < 0.02  # without the plate 0.21·16²/20² of about 0.63: 0.09


def test_what_lies_on_a_plate_ends_at_its_round_corners():
    stripe = rounded(16) & box(0, 0, 96, 30)
    pixels = painted((rounded(16), BLUE, 1.0), (stripe, RED, 1.0))
    scene = peeled_off(pixels)
    assert scene.background == pytest.approx(WHITE, abs=0.005)
    assert len(scene.layers) == 2
    error = render(scene, SIDE, SIDE)[..., :3] - pixels
    assert abs(error[:20, :20]).mean() < 0.04  # red all over: 0.09


def test_between_corners_of_two_colours_there_is_no_plate():
    pixels = painted((box(0, 0, 48, 96), RED, 1.0), (rounded(16), BLUE, 1.0))
    assert peeled_off(pixels).background == pytest.approx(BLUE, abs=0.005)


def test_a_plate_of_no_shape_is_the_ground():
    notched = ~(box(0, 0, 30, 10) | box(66, 0, 96, 20) | box(0, 76, 9, 96) | box(80, 80, 96, 96))
    pixels = painted((notched, BLUE, 1.0))
    made = peeled_off(pixels)
    assert made.background == pytest.approx(BLUE, abs=0.005)
    assert [layer.shapes[0].color for layer in made.layers] == [pytest.approx(WHITE, abs=0.005)] * 4


def test_what_no_few_shapes_have_the_outline_of_is_left():
    x, y = points()
    flower = np.hypot(x - 48, y - 48) < 30 + 6 * np.sin(9 * np.arctan2(y - 48, x - 48))
    assert not apart(painted((flower, BLUE, 1.0)))


def test_a_letter_is_its_bars():
    """Two that meet; and the same where a disc hides where they do."""
    letter = box(20, 20, 36, 80) | box(20, 64, 70, 80)
    for on_top in ((), ((disc(30, 70, 9), RED, 1.0),)):
        under = apart(painted((letter, BLUE, 1.0), *on_top))[: 2 if on_top else None]
        assert [layer.shapes[0].kind for layer in under] == ["box", "box"]
        assert all(layer.shapes[0].color == pytest.approx(BLUE, abs=0.01) for layer in under)
        covered = reference(under) > 0.5
        assert np.abs(covered.astype(float) - letter[::FINER, ::FINER]).mean() < 0.01


def reference(layers):
    """How much layers cover together, [SIDE, SIDE]: white on black."""
    white = [replace(one, shapes=(replace(one.shapes[0], color=(1, 1, 1)),)) for one in layers]
    return render(Scene(SIDE, SIDE, tuple(white), (0, 0, 0)))[..., 0]


def test_a_cross_on_a_cross_is_four_bars():
    """To the picture's ends, as on flags; of the lower one is seen what is around the other."""
    wide, narrow = (box(32 - w, -9, 32 + w, 105) | box(-9, 48 - w, 105, 48 + w) for w in (12, 6))
    layers = apart(painted((wide, RED, 1.0), (narrow, BLUE, 1.0)), 56)
    assert [layer.shapes[0].kind for layer in layers] == ["box"] * 4
    halves = sorted(round(min(layer.shapes[0].parameters[2:4]) * SIDE, 1) for layer in layers)
    assert halves == pytest.approx([6, 6, 12, 12], abs=0.2)


def test_two_discs_of_one_colour_are_two_circles():
    """Also where a bar through both covers most of them at first."""
    both = disc(34, 54, 15) | disc(62, 44, 19)
    layers = apart(painted((both, BLUE, 1.0)))
    assert [layer.shapes[0].kind for layer in layers] == ["circle"] * 2
    assert np.abs(reference(layers) - mean_of(both)).mean() < 0.002


def mean_of(mask):
    """How much of each pixel is in a mask, [SIDE, SIDE]."""
    return mask.reshape(SIDE, FINER, SIDE, FINER).mean(axis=(1, 3))


def test_a_hole_of_another_shape_is_seen_where_the_picture_is_large():
    """A disc with a cross cut out of it: where it is small, a turned box comes near to that."""
    x, y = points()
    hole = (np.minimum(abs(x - 48), abs(y - 48)) < 8) & (np.maximum(abs(x - 48), abs(y - 48)) < 22)
    picture = Picture(painted((disc(48, 48, 38) & ~hole, GREEN, 1.0)).astype(np.float32))
    sizes = [View(scaled(picture.premultiplied, side), None) for side in (28, SIDE)]
    assert peeled(bare(), sizes[:1], search_of()).layer_count == 1
    assert peeled(bare(), sizes, search_of()).layer_count == 0


def test_a_hole_of_another_shape_makes_a_plate_unlikely():
    """A box cut out for a diamond is off by little of all the edge, but not of the hole's."""
    x, y = points()
    diamond = abs(x - 48) / 13 + abs(y - 44) / 17 < 1
    for hole, is_one, kind in ((diamond, False, "box"), (disc(48, 44, 14), True, "circle")):
        pixels = painted((box(6, 4, 90, 92), BLUE, 1.0), (hole, GREEN, 1.0))
        regions, around = Regions.of(pixels), Surroundings.of(bare(), 0, view_of(pixels))
        plate = next(peeling.opaque(regions, WHITE, True))
        told = peeling.Outlines(bare(), [around], search_of()).told(plate, regions)
        assert told is not None
        assert [part.kind for part in told.layer.structure] == ["box", kind]
        assert told.is_good
        assert told.is_unlikely is not is_one


def sector(first, last, radius, hole=0):
    """Part of a disc or of a ring in the middle, between two directions in degrees."""
    x, y = points()
    turn = np.degrees(np.arctan2(y - 48, x - 48)) % 360
    return disc(48, 48, radius) & ~disc(48, 48, hole) & (turn >= first) & (turn < last)


@pytest.mark.parametrize(
    ("mask", "kinds"),
    [
        (sector(200, 270, 42), ["circle", "triangle"]),
        (sector(180, 360, 42), ["circle", "box"]),
        (sector(120, 210, 42, 22), ["circle", "circle", None]),
        (sector(40, 320, 42, 26), ["circle", "circle", None]),
    ],
    ids=["slice", "half", "part of a ring", "ring with a gap"],
)
def test_what_is_left_of_a_circle_is_one_layer(mask, kinds):
    """Which shape leaves a part of a narrow ring is not seen."""
    pixels = painted((mask, BLUE, 1.0))
    (layer,) = apart(pixels, 48)
    found = [shape.kind for shape in layer.shapes]
    assert len(found) == len(kinds)
    assert all(want in (None, have) for want, have in zip(kinds, found, strict=True))
    scene = Scene(SIDE, SIDE, (layer,), (1.0, 1.0, 1.0))
    assert -10 * np.log10(np.mean((render(scene) - pixels) ** 2)) > 30


def test_a_pie_is_a_layer_for_each_of_its_slices():
    slices = [
        (sector(*ends, 40), color, 1.0)
        for ends, color in (((0, 130), RED), ((130, 230), GREEN), ((230, 360), BLUE))
    ]
    layers = apart(painted(*slices), 48)
    assert len(layers) == 3
    assert all(layer.shapes[0].kind == "circle" for layer in layers)


def goes_on(pixels, color, *shapes):
    """Whether what leaves a part of a shape has edges beyond it, in the region of a colour."""
    regions, scene = Regions.of(pixels), bare()
    inside = np.abs(regions.colors - color).max(axis=1) < 0.02
    outlines = peeling.Outlines(scene, [Surroundings.of(scene, 0, view_of(pixels))], search_of())
    _, fine = outlines._areas(regions.extent(inside), Overlay(1.0, color, inside, ~inside), regions)
    layer = Layer(shapes, joints=(Joint("intersection"),))
    (group,) = from_scene(Scene(SIDE, SIDE, (layer,), (1.0, 1.0, 1.0))).groups
    return peeling._goes_on(group, fine, regions, np.abs(regions.colors - WHITE).max(axis=1) < 0.02)


def test_where_two_shapes_overlap_edges_go_on_and_at_a_slice_of_a_pie_they_do_not():
    one, other = disc(38, 48, 24), disc(62, 48, 22)
    overlap = painted((one, BLUE, 1.0), (other, RED, 1.0), (one & other, GREEN, 1.0))
    circles = (sharp_disc(GREEN, 38, 48, 24).shapes[0], sharp_disc(GREEN, 62, 48, 22).shapes[0])
    assert goes_on(overlap, GREEN, *circles)
    pie = painted((disc(48, 48, 40), BLUE, 1.0), (sector(0, 90, 40), GREEN, 1.0))
    slice_of = sharp_triangle(GREEN, (48, 48), (144, 48), (48, 144)).shapes[0]
    assert not goes_on(pie, GREEN, sharp_disc(GREEN, 48, 48, 40).shapes[0], slice_of)


def test_edges_at_which_many_shapes_end_may_go_on():
    """A bar that goes across a disc ends where the disc does."""
    mask = disc(48, 48, 40)
    striped = painted((mask, BLUE, 1.0), (mask & box(36, 0, 60, 96), GREEN, 1.0))
    shapes = (sharp_box(GREEN, 36, 0, 60, 96).shapes[0], sharp_disc(GREEN, 48, 48, 40).shapes[0])
    assert not goes_on(striped, GREEN, *shapes)


def test_a_flag_in_a_disc_is_its_fields_cut_by_the_disc():
    """The bar across it looks like a box where it is small; each field beside it like a whole disc."""
    mask = disc(48, 48, 40)
    pixels = painted(
        (mask, BLUE, 1.0), (mask & box(0, 0, 36, 96), GREEN, 1.0), (mask & box(36, 0, 60, 96), RED, 1.0)
    )
    layers = apart(pixels)
    assert len(layers) == 3
    scene = Scene(SIDE, SIDE, tuple(layers), (1.0, 1.0, 1.0))
    assert -10 * np.log10(np.mean((render(scene) - pixels) ** 2)) > 28


def test_what_has_corners_is_triangles_between_them():
    """A slanted bar, to which two boxes come near, and a star of five tips, which three triangles are."""
    x, y = points()
    slanted = (y > 30) & (y < 62) & (x + 0.6 * y > 50) & (x + 0.6 * y < 76)
    found = apart(painted((slanted, BLUE, 1.0)), 48)
    assert [layer.shapes[0].kind for layer in found] == ["triangle"] * 2
    turns = np.radians(np.arange(5) * 72 - 90)
    within = [np.cos(turn) * (x - 48) + np.sin(turn) * (y - 48) < 13 for turn in turns + np.pi]
    star = np.sum(within, axis=0) >= 4  # of the sides of the pentagon within, at most one is between
    found = apart(painted((star, RED, 1.0)), 48)
    assert [layer.shapes[0].kind for layer in found] == ["triangle"] * 3
    scene = Scene(SIDE, SIDE, found, (1.0, 1.0, 1.0))
    assert -10 * np.log10(np.mean((render(scene) - painted((star, RED, 1.0))) ** 2)) > 28


def dots(across, down, radius):
    """Middles and a mask of so many dots all over the picture."""
    middles = [
        ((i + 0.5) * SIDE / across, (j + 0.5) * SIDE / down) for i in range(across) for j in range(down)
    ]
    return middles, np.any([disc(x, y, radius) for x, y in middles], axis=0)


def test_thirty_dots_are_thirty_circles():
    middles, mask = dots(6, 5, 3.2)
    layers = apart(painted((mask, BLUE, 1.0)))
    found = np.array([layer.shapes[0].parameters for layer in layers])
    assert [layer.shapes[0].kind for layer in layers] == ["circle"] * 30
    away = np.abs(found[:, None, :2] - (np.array(middles) / SIDE - 0.5)).max(axis=2)
    assert sorted(away.argmin(axis=1)) == list(range(30))
    assert away.min(axis=1).max() < 0.3 / SIDE
    assert found[:, 2] == pytest.approx(3.2 / SIDE, abs=0.3 / SIDE)


def test_what_was_told_once_is_not_looked_for_again(monkeypatch):
    """Three frames, which wait until the discs between them are taken off."""
    looked_for = []

    def counted(area, fine, search):
        looked_for.append(area)
        return best_outlined(area, fine, search)

    monkeypatch.setattr(peeling, "best_outlined", counted)
    places = (20, 48, 76)
    frames = [(box(x - 11, 30, x + 11, 52) & ~box(x - 4, 37, x + 4, 45), BLUE, 1.0) for x in places]
    layers = apart(painted(*frames, *((disc(x, 58, 4), RED, 1.0) for x in places)))
    assert sorted(len(layer.shapes) for layer in layers) == [1, 1, 1, 2, 2, 2]
    assert len(looked_for) == 6


def test_where_hardly_any_region_is_a_shape_the_rest_is_left(monkeypatch):
    """Of a photograph in few colours each would be looked at in vain, for minutes."""
    tried = []
    monkeypatch.setattr(peeling, "best_outlined", lambda *arguments: tried.append(arguments))
    assert not apart(painted((dots(10, 9, 3.2)[1], BLUE, 1.0)))
    assert len(tried) == peeling.FAILED + 1


def test_a_field_lies_under_what_little_is_on_it():
    """Its outline is surer than that of a lozenge of some pixels, which it would hide if it were taken off first."""
    x, y = points()
    mask = abs(x - 66) + abs(y - 58) < 3.7
    under, *over = apart(painted((box(10, 10, 86, 86), BLUE, 1.0), (mask, RED, 1.0)))
    assert under.shapes[0].color == pytest.approx(BLUE, abs=0.01)
    assert [layer.shapes[0].color for layer in over] == [pytest.approx(RED, abs=0.01)]


def test_stripes_from_side_to_side_are_boxes():
    """Where the picture is small, wide ellipses come as near."""
    stripes = np.any([box(-1, top, SIDE + 1, top + 16) for top in (7, 38, 70)], axis=0)
    layers = apart(painted((stripes, BLUE, 1.0)), 24)
    assert [layer.shapes[0].kind for layer in layers] == ["box"] * 3


def test_layers_that_are_worth_little_each_are_not_all_taken_out():
    """A large part of the picture is missing, so that one dot of 36 hardly matters."""
    middles, mask = dots(6, 6, 3.0)
    view = view_of(painted((box(0, 0, 30, SIDE), RED, 1.0), (mask, BLUE, 1.0)))
    layers = tuple(sharp_disc(BLUE, x, y, 3) for x, y in middles)
    scene = from_scene(Scene(SIDE, SIDE, layers, (1.0, 1.0, 1.0)))
    sizes = descents.Sizes(view, view, view)
    left = pruning.pruned(scene, sizes, search_of())
    assert error_of(left, view) <= 1.06 * error_of(scene, view)


def test_what_is_hardly_flat_anywhere_is_left():
    """A disc on a flat ground that ends in noise: what regions a photograph has are no drawing."""
    noise = np.rint(np.random.default_rng(0).random((SIDE, SIDE, 3)) * 255) / 255
    pixels = painted((disc(30, 30, 14), RED, 1.0))
    ground = box(0, 0, 60, 60)[::FINER, ::FINER, None]
    assert len(Regions.of(np.where(ground, pixels, noise)).colors) == 2
    assert apart(np.where(ground, pixels, noise)) == ()
    assert len(apart(np.where(ground, pixels, WHITE))) == 1


def test_a_soft_disc_is_left_to_be_found_by_its_colours():
    x, y = np.meshgrid(*(np.arange(SIDE) + 0.5,) * 2)
    soft = 1 / (1 + np.exp((np.hypot(x - 40, y - 44) - 20) / 3))
    pixels = WHITE + soft[..., None] * (BLUE - WHITE)
    assert not apart(np.rint(pixels * 255) / 255)


def test_edges_become_as_soft_as_the_picture_has_them():
    """One disc with an edge over 3 pixels, and one that is sharp, from two that are sharp: float64 in numpy."""
    x, y = np.meshgrid(*(np.arange(SIDE) + 0.5,) * 2)
    pixels = painted((disc(66, 64, 20), RED, 1.0))
    soft = 1 / (1 + np.exp(10 * np.hypot(x - 30, y - 30) / 3 - 5 - 10 * 20 / 3))
    pixels += soft[..., None] * (BLUE - pixels)
    search, view = search_of(), view_of(pixels)
    sharp = from_scene(
        Scene(SIDE, SIDE, (sharp_disc(BLUE, 30, 30), sharp_disc(RED, 66, 64)), (1.0, 1.0, 1.0))
    )
    still = descents.descended(sharp, view, search, descents.AFTER)
    made = descents.softer(sharp, view, search)
    first, second = to_scene(made, SIDE, SIDE).layers
    assert to_scene(still, SIDE, SIDE).layers[0].falloff * SIDE < 1.6
    assert first.falloff * SIDE == pytest.approx(3, rel=0.05)
    assert second.falloff * SIDE < 1.7  # what the sharpest edge of a pixel is
    assert error_of(made, view) < 0.2 * error_of(still, view)


def test_edges_stay_sharp_where_much_is_missing():
    """One disc has an edge over 8 pixels, but a small one is not there: more than 0.1 % is wrong in any case."""
    x, y = np.meshgrid(*(np.arange(SIDE) + 0.5,) * 2)
    pixels = painted((disc(76, 76, 6), RED, 1.0))
    soft = 1 / (1 + np.exp(10 * np.hypot(x - 30, y - 30) / 8 - 5 - 10 * 20 / 8))
    view = view_of(pixels + soft[..., None] * (BLUE - pixels))
    sharp = from_scene(Scene(SIDE, SIDE, (sharp_disc(BLUE, 30, 30),), (1.0, 1.0, 1.0)))
    made = descents.descended(
        descents.softened(sharp, descents.SOFT, view), view, search_of(), descents.AFTER
    )
    assert error_of(made, view) < 0.6 * error_of(sharp, view)
    assert descents.softer(sharp, view, search_of()) is sharp


@pytest.mark.parametrize(("most", "layers"), [(2, 2), (1, 0)])
def test_no_more_layers_are_taken_than_are_allowed(most, layers):
    pixels = painted((disc(30, 30, 20), BLUE, 1.0), (disc(66, 64, 20), RED, 1.0)).astype(np.float32)
    drawing = Drawing(Drawn.of(Picture(pixels)), settings_of(), lambda progress: False)
    found = sparse.taken_apart(drawing.scene, drawing.sizes, drawing.search, most)
    assert found.layer_count == layers

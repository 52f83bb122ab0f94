"""Gradients put into layers: what comes out is the picture, which was drawn in numpy; what has none stays."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import torch

from sdf2vec.fit.repainting import ground_shade, repainted
from sdf2vec.render import reference
from sdf2vec.scene import Joint, Layer, Scene, Shape
from tests.fit.drawn import (
    GREEN,
    HALF,
    RED,
    RISE,
    SIDE,
    THREE,
    WHITE,
    bent,
    box,
    disc,
    painted,
    points,
    ramp,
    rings,
    shading_of,
    three_rings,
)

WHERE: dict[str, Any] = {"center": ((50 - 48) / SIDE, (44 - 48) / SIDE)}  # that disc in scene units
BOX: dict[str, Any] = {"half_size": (30 / SIDE, 20 / SIDE), "corner_radius": 0.0, "angle": 0.4}


def shown(scene):
    return reference.render(scene, SIDE, SIDE)[:3].permute(1, 2, 0).numpy()


def middle_color(shading, x=50, y=44):
    """Of the flattened picture."""
    return tuple(shading.flattened.pixels[y, x].tolist())


def turned_box(x, y, half, angle):
    across, down = points()
    along = np.cos(angle) * (across - x) + np.sin(angle) * (down - y)
    beside = np.cos(angle) * (down - y) - np.sin(angle) * (across - x)
    return (np.abs(along) < half[0]) & (np.abs(beside) < half[1])


def down_and_across():
    """Colours [n, n, 3] of all samples, of another strength in each channel."""
    x, y = points()
    return HALF + ((0.8 * x + 0.6 * y) / SIDE - 0.5)[..., None] * RISE


@pytest.mark.parametrize(
    ("colors", "paint"),
    [(down_and_across, "linear"), (rings, "radial"), (bent, "linear3"), (three_rings, "radial3")],
    ids=["linear", "radial", "bent", "three rings"],
)
@pytest.mark.parametrize(
    ("mask", "kind", "numbers"),
    [
        (disc(50, 44, 30), "circle", {"radius": 30 / SIDE}),
        (turned_box(50, 44, (30, 20), 0.4), "box", BOX),
    ],
)
def test_a_shape_gets_the_gradient_of_its_region(mask, kind, numbers, colors, paint):
    """Also around a point that is not its middle; a turned box has a frame of its own."""
    pixels = painted((mask, colors(), 1.0))
    shading = shading_of(pixels)
    flat = Scene(
        SIDE, SIDE, (Layer((Shape.of(kind, middle_color(shading), **WHERE, **numbers),)),), (1, 1, 1)
    )
    assert np.abs(shown(flat) - pixels).max() > 0.1
    made = repainted(flat, shading, None)
    (layer,) = made.layers
    assert layer.shapes[0].paint == paint
    assert np.abs(shown(made) - pixels)[36:52, 40:60].max() < 0.01
    assert np.abs(shown(made) - pixels).mean() < 0.003


def test_a_small_shape_gets_the_colour_of_the_ring_there():
    shading = shading_of(painted((disc(50, 44, 30), rings(), 1.0)))
    dot = Shape.of("circle", middle_color(shading), center=(20 / SIDE, 0.0), radius=1 / SIDE)
    (layer,) = repainted(Scene(SIDE, SIDE, (Layer((dot,)),), (1, 1, 1)), shading, None).layers
    assert layer.shapes[0].paint == "flat"
    away = np.hypot(68 - 40, 48 - 30) / 60
    assert layer.shapes[0].color == pytest.approx(HALF + (away - 0.5) * RISE, abs=0.008)


def test_a_channel_that_hardly_changes_does_not_end_a_gradient():
    """Pure red runs to yellow: the red would be more than there is, by less than one level."""
    rise = np.array([0.003, 0.8, 0.0])
    pixels = painted((box(8, 20, 88, 76), ramp(rise) + np.array([0.5, 0.1, -0.5]), 1.0))
    shading = shading_of(pixels)
    place: dict[str, Any] = {"center": (0.0, 0.0), "half_size": (40 / SIDE, 28 / SIDE)}
    shape = Shape.of("box", middle_color(shading, 48, 48), **place, angle=0.0, corner_radius=0.0)
    made = repainted(Scene(SIDE, SIDE, (Layer((shape,)),), (1, 1, 1)), shading, None)
    assert np.abs(shown(made) - pixels)[24:72, 12:84].max() < 0.01


def test_a_gradient_ends_on_one_side_where_there_are_no_more_colours():
    """Of a box that goes on below another one: so its middle is not that of the gradient."""
    rise = np.array([1.2, 0.0, 0.0])
    pixels = painted(
        (box(8, 20, 90, 76), ramp(rise), 1.0),
        (box(56, 10, 96, 86), GREEN, 1.0),
        ground=np.array([0.0, 0.0, 1.0]),
    )
    shading = shading_of(pixels)
    place: dict[str, Any] = {"center": (4 / SIDE, 0.0), "half_size": (44 / SIDE, 28 / SIDE)}
    shape = Shape.of("box", middle_color(shading, 30, 48), **place, angle=0.0, corner_radius=0.0)
    (layer,) = repainted(Scene(SIDE, SIDE, (Layer((shape,)),), (0, 0, 1)), shading, None).layers
    assert layer.shapes[0].paint == "linear"
    alone = shown(Scene(SIDE, SIDE, (layer,), (0, 0, 1)))
    assert np.abs(alone - pixels)[24:72, 12:52].max() < 0.01


def test_a_small_shape_gets_the_colour_of_three_that_is_there():
    shading = shading_of(painted((disc(50, 44, 30), bent(), 1.0)))
    dot = Shape.of("circle", middle_color(shading), center=(0.0, 0.2), radius=0.5 / SIDE)
    (layer,) = repainted(Scene(SIDE, SIDE, (Layer((dot,)),), (1, 1, 1)), shading, None).layers
    assert layer.shapes[0].paint == "flat"
    assert layer.shapes[0].color == pytest.approx(THREE[1] + 0.5 * (THREE[2] - THREE[1]), abs=0.01)


@pytest.mark.parametrize(
    ("color", "opacity", "center"),
    [(RED, 1.0, (0.02, -0.04)), (None, 0.5, (0.02, -0.04)), (None, 1.0, (-0.4, -0.4))],
    ids=["another colour", "translucent", "elsewhere"],
)
def test_other_layers_keep_their_colour(color, opacity, center):
    shading = shading_of(painted((disc(50, 44, 30), ramp(), 1.0)))
    own = middle_color(shading) if color is None else tuple(color)
    layer = Layer((Shape.of("circle", own, center=center, radius=0.08),), opacity=opacity)
    scene = Scene(SIDE, SIDE, (layer,), (1, 1, 1))
    assert repainted(scene, shading, None) == scene


def test_a_small_shape_gets_the_colour_that_is_there():
    shading = shading_of(painted((disc(50, 44, 30), ramp(), 1.0)))
    dot = Shape.of("circle", middle_color(shading), center=(20 / SIDE, 0.0), radius=2 / SIDE)
    (layer,) = repainted(Scene(SIDE, SIDE, (Layer((dot,)),), (1, 1, 1)), shading, None).layers
    assert layer.shapes[0].paint == "flat"
    assert layer.shapes[0].color == pytest.approx(HALF + RISE * 20 / SIDE, abs=0.005)


def test_what_is_hidden_has_no_part_in_it():
    """A circle most of which lies under a white box, where it is drawn alone at its left."""
    shading = shading_of(painted((disc(50, 44, 30), ramp(), 1.0), (box(30, 0, 96, 96), WHITE, 1.0)))
    circle = Shape.of("circle", middle_color(shading, 26), **WHERE, radius=30 / SIDE)
    cover = Shape.of("box", (1, 1, 1), center=(0.3125, 0), half_size=(0.5, 0.6), angle=0, corner_radius=0)
    made = repainted(Scene(SIDE, SIDE, (Layer((circle,)), Layer((cover,))), (1, 1, 1)), shading, None)
    assert [layer.shapes[0].paint for layer in made.layers] == ["linear", "flat"]


def test_what_is_cut_out_stays_cut_out():
    ring = disc(50, 44, 30) & ~disc(50, 44, 14)
    shading = shading_of(painted((ring, ramp(), 1.0)))
    outer, inner = (Shape.of("circle", middle_color(shading, 28), **WHERE, radius=r / SIDE) for r in (30, 14))
    scene = Scene(SIDE, SIDE, (Layer((outer, inner), joints=(Joint("subtraction", 0.0),)),), (1, 1, 1))
    (layer,) = repainted(scene, shading, None).layers
    assert [shape.paint for shape in layer.shapes] == ["linear", "flat"]
    assert layer.joints == scene.layers[0].joints


def test_a_ground_with_a_gradient_is_a_box_under_all():
    pixels = painted((box(0, 0, SIDE, SIDE), ramp(), 1.0), (disc(30, 30, 16), WHITE, 1.0))
    shading = shading_of(pixels)
    color = shading.flats[shading.graded[0] - 1]
    ground = ground_shade(torch.tensor([*color, 1.0]), shading)
    circle = Shape.of("circle", (1, 1, 1), center=(-18 / SIDE, -18 / SIDE), radius=16 / SIDE)
    made = repainted(Scene(SIDE, SIDE, (Layer((circle,)),), tuple(color.tolist())), shading, ground)
    assert [layer.shapes[0].kind for layer in made.layers] == ["box", "circle"]
    assert np.abs(shown(made) - pixels).mean() < 0.003
    assert ground_shade(torch.tensor([1.0, 1.0, 1.0, 1.0]), shading) is None


def test_no_layer_at_all():
    shading = shading_of(painted((disc(50, 44, 30), ramp(), 1.0)))
    assert repainted(Scene(SIDE, SIDE, (), (1, 1, 1)), shading, None).layers == ()

"""Drawings with gradients, drawn by resvg: what a shape runs through is its paint, no pile of shapes."""

from __future__ import annotations

from importlib import import_module

import pytest

from sdf2vec import fit, fitted
from sdf2vec.quality import quality

SIDE = 128
GRADIENT = (
    '<linearGradient id="g" x1="0" y1="0" x2="1" y2="1"><stop stop-color="#f06"/>'
    '<stop offset="1" stop-color="#06f"/></linearGradient>'
)
WHITE = '<rect width="100%" height="100%" fill="white"/>'
BADGE = (
    '<rect x="20" y="24" width="88" height="80" fill="url(#g)"/><circle cx="70" cy="60" r="22" fill="#fff"/>'
)
GROUND = '<rect width="100%" height="100%" fill="url(#g)"/>'
DISCS = '<circle cx="40" cy="46" r="20" fill="#fff"/><circle cx="88" cy="80" r="24" fill="#fd0"/>'


@pytest.fixture
def shaded(drawn):
    """The picture of elements that may be filled with the gradient."""
    return lambda shapes: drawn(GRADIENT + shapes, SIDE, SIDE)


def paints_of(scene):
    return [layer.shapes[0].paint for layer in scene.layers]


@pytest.mark.parametrize("ground", [WHITE, ""], ids=["on white", "on nothing"])
def test_a_badge_is_a_box_with_a_gradient_and_a_disc(ground, shaded):
    picture = shaded(ground + BADGE)
    found = fitted(picture)
    assert sorted(shape.kind for layer in found.scene.layers for shape in layer.shapes) == ["box", "circle"]
    assert paints_of(found.scene)[0] == "linear"
    assert quality(found.scene, picture).psnr >= 40
    assert found.reason.startswith("2 shapes")


def test_a_ball_is_a_circle_with_a_radial_gradient(drawn):
    light = (
        '<radialGradient id="g" cx=".35" cy=".3" r=".75"><stop stop-color="#ffe0a0"/>'
        '<stop offset="1" stop-color="#d04000"/></radialGradient>'
    )
    picture = drawn(f'{light}{WHITE}<circle cx="64" cy="64" r="50" fill="url(#g)"/>', SIDE, SIDE)
    found = fitted(picture)
    (layer,) = found.scene.layers
    assert [(shape.kind, shape.paint) for shape in layer.shapes] == [("circle", "radial")]
    assert quality(found.scene, picture).psnr >= 44


THREE = '<stop stop-color="#fdc468"/><stop offset=".45" stop-color="#df4996"/><stop offset="1" stop-color="#5b51d8"/>'


@pytest.mark.parametrize(
    ("gradient", "shape", "told"),
    [
        (
            'linearGradient id="g" x1="0" y1="1" x2="1" y2="0"',
            '<rect x="14" y="20" width="100" height="90"',
            "box",
        ),
        ('radialGradient id="g" cx=".4" cy=".35" r=".7"', '<circle cx="64" cy="64" r="50"', "circle"),
    ],
    ids=["linear3", "radial3"],
)
def test_a_shape_of_three_colours_is_one(gradient, shape, told, drawn, request):
    name = gradient.split()[0]
    picture = drawn(f'<{gradient}>{THREE}</{name}>{WHITE}{shape} fill="url(#g)"/>', SIDE, SIDE)
    found = fitted(picture)
    (layer,) = found.scene.layers
    assert [(part.kind, part.paint) for part in layer.shapes] == [(told, request.node.callspec.id)]
    assert quality(found.scene, picture).psnr >= 44


def test_a_shape_that_fades_away_is_one(drawn):
    """Into the ground: without an edge where it ends."""
    fade = '<linearGradient id="g"><stop stop-color="#25e"/><stop offset="1" stop-color="#25e" stop-opacity="0"/>'
    bar = '<rect x="16" y="36" width="96" height="56" rx="10" fill="url(#g)"/>'
    picture = drawn(f"{fade}</linearGradient>{WHITE}{bar}", SIDE, SIDE)
    found = fitted(picture)
    (layer,) = found.scene.layers
    assert [(shape.kind, shape.paint) for shape in layer.shapes] == [("box", "linear")]
    assert quality(found.scene, picture).psnr >= 46


def test_what_is_not_near_once_gradients_are_put_in_is_gone_on_with(shaded, monkeypatch):
    """As where none is put in at all."""
    monkeypatch.setattr(import_module("sdf2vec.fit.auto"), "repainted", lambda scene, shading, ground: scene)
    picture = shaded(WHITE + BADGE)
    found = fitted(picture, max_shapes=24)
    assert found.scene.shape_count > 2
    assert quality(found.scene, picture).psnr >= 24


def test_a_steep_ground_of_four_colours_is_no_photograph(drawn):
    """Nowhere two pixels beside each other are of one colour."""
    stops = zip((0, 33, 66, 100), ("#009fff", "#ec2f4b", "#ffe259", "#11998e"), strict=True)
    told = "".join(f'<stop offset="{share}%" stop-color="{color}"/>' for share, color in stops)
    cross = '<path d="M30 52h70v12h-29v40h-12v-40h-29z" fill="#fff"/>'
    picture = drawn(f'<linearGradient id="g">{told}</linearGradient>{GROUND}{cross}', SIDE, SIDE)
    found = fitted(picture)
    assert found.scene.shape_count <= 5
    assert quality(found.scene, picture).psnr >= 40


@pytest.mark.parametrize("shapes", ["auto", 3, 6])
def test_the_gradient_of_a_ground_counts_as_a_shape(shapes, shaded):
    picture = shaded(GROUND + DISCS)
    scene = fit(picture, shapes)
    assert scene.shape_count == (3 if shapes == "auto" else shapes)
    assert paints_of(scene)[0] == "linear"
    assert quality(scene, picture).psnr >= 38


def test_stripes_are_no_gradient(drawn):
    """A steep one between two stripes would have their colours."""
    stripes = (
        '<rect width="128" height="128" fill="#0057a8"/><rect x="30" width="98" height="128" fill="#f4f100"/>'
    )
    discs = "".join(
        f'<circle cx="{x}" cy="{y}" r="9" fill="#199a00"/>' for x, y in ((52, 50), (77, 50), (64, 70))
    )
    picture = drawn(f'{stripes}<rect x="98" width="30" height="128" fill="#199a00"/>{discs}', SIDE, SIDE)
    scene = fit(picture)
    assert set(paints_of(scene)) == {"flat"}
    assert (
        sorted(shape.kind for layer in scene.layers for shape in layer.shapes) == ["box"] * 2 + ["circle"] * 3
    )
    assert quality(scene, picture).psnr >= 40


def test_what_a_user_does_not_allow_has_no_part_in_it(shaded):
    scene = fit(shaded(GROUND + DISCS), kind="circle", max_shapes=8)
    assert {shape.kind for layer in scene.layers for shape in layer.shapes} <= {"circle"}
    assert scene.shape_count <= 8


def test_a_target_is_measured_on_the_picture_itself(shaded):
    picture = shaded(GROUND + DISCS)
    found = fitted(picture, target_psnr=36)
    assert found.met
    assert quality(found.scene, picture).psnr >= 36
    assert found.reason.startswith("3 shapes")
    assert "36 dB is reached" in found.reason

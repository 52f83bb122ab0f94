"""No more shapes than a picture needs: of pictures that resvg draws, whose shapes are known; and what is reported."""

import math
from dataclasses import replace
from importlib import import_module

import numpy as np
import pytest
import torch
from PIL import Image, ImageDraw
from skimage import data

from sdf2vec import Scene, Sdf2vecError, fit, fitted, render
from sdf2vec.bench.known_scenes import known_scene
from sdf2vec.fit import auto
from sdf2vec.fit.drawings import Drawn
from sdf2vec.fit.finding import GOOD, Drawing
from sdf2vec.fit.initialization import Layers
from sdf2vec.fit.joining import Search
from sdf2vec.fit.one_more import gain_of_one_more
from sdf2vec.fit.ramps import ground_of
from sdf2vec.fit.settings import settings_of
from sdf2vec.fit.surroundings import View
from sdf2vec.image import Picture, load
from sdf2vec.quality import quality
from sdf2vec.scene import Layer, Shape
from tests.fit.drawn import hidden, noise
from tests.fit.fitting import remember

WHITE = '<rect width="100%" height="100%" fill="white"/>'
DISC = '<circle cx="44" cy="50" r="24" fill="#d02040"/>'
UNDER = '<circle cx="40" cy="40" r="22" fill="#2040d0"/>'
OVER = '<rect x="38" y="44" width="40" height="30" fill="#10a050"/>'
PLAY = '<path d="M30 26L70 48L30 70z" fill="#d02040" stroke="#d02040" stroke-width="14" stroke-linejoin="round"/>'
TRIANGLE = '<polygon points="70,8 90,34 60,30" fill="#e0a010"/>'


def kinds_of(scene):
    return sorted(shape.kind for layer in scene.layers for shape in layer.shapes)


@pytest.mark.parametrize(
    ("shapes", "kinds"),
    [
        ("", []),
        (WHITE, []),
        (WHITE + DISC, ["circle"]),
        (WHITE + PLAY, ["rounded_triangle"]),
        (WHITE + TRIANGLE, ["triangle"]),
        (DISC + OVER, ["box", "circle"]),
    ],
    ids=["nothing", "a ground", "a disc", "a play button", "a triangle", "on nothing, one partly hidden"],
)
def test_the_shapes_of_a_drawing_are_found(drawn, shapes, kinds):
    picture = drawn(shapes)
    found = fitted(picture)
    assert kinds_of(found.scene) == kinds
    assert quality(found.scene, picture).psnr >= 40
    assert found.reason.startswith(f"{len(kinds)} shape")
    assert found.met


def test_a_small_picture_is_told_where_nothing_but_edges_is_off(drawn):
    """Two bars on a tile: 39 dB by the coverage of soft edges, which more shapes would mend."""
    tile = '<rect y="8" width="64" height="48" rx="8" fill="#1c3d5a"/>'
    bars = "".join(f'<rect x="{x}" y="20" width="10" height="24" rx="5" fill="white"/>' for x in (20, 34))
    picture = drawn(WHITE + tile + bars, 64, 64)
    found = fitted(picture)
    assert found.scene.shape_count == 3
    assert 38 < quality(found.scene, picture).psnr < 42
    fine = render(found.scene, 8 * 64, 8 * 64).reshape(64, 8, 64, 8, 3).mean(axis=(1, 3))
    assert -10 * np.log10(np.mean((fine - picture.pixels) ** 2)) > 46  # their edges are where they were drawn


def test_what_is_found_is_as_simple_as_drawn(drawn):
    """A sharp, opaque, upright box says so in its numbers, which `svg` writes as a plain rectangle."""
    scene = fit(drawn(WHITE + OVER))
    (layer,) = scene.layers
    (shape,) = layer.shapes
    assert (layer.opacity, layer.falloff) == (1.0, 0.0)
    assert shape.kind == "box"
    x, y, half_width, half_height, angle, rounding = shape.parameters
    assert (angle, rounding) == (0.0, 0.0)
    assert np.allclose((x * 96 + 48, y * 96 + 48), (58, 59), atol=0.3)
    assert np.allclose((half_width * 96, half_height * 96), (20, 15), atol=0.3)
    assert np.allclose(shape.color, (0x10 / 255, 0xA0 / 255, 0x50 / 255), atol=0.01)


def test_bars_beside_each_other_are_found_one_by_one(drawn):
    """Not one box over all of them with gaps cut out."""
    bars = "".join(
        f'<rect x="16" y="{14 + 17 * i}" width="64" height="14" fill="#d1c4e9"/>' for i in range(4)
    )
    assert kinds_of(fit(drawn(WHITE + bars))) == ["box"] * 4


def test_a_ring_is_one_layer(drawn):
    """A disc with a disc cut out of it, not one upon another in the colour of the ground."""
    picture = drawn(WHITE + '<circle cx="46" cy="50" r="26" fill="none" stroke="#205080" stroke-width="14"/>')
    scene = fit(picture, kind="circle")
    (layer,) = scene.layers
    assert [shape.kind for shape in layer.shapes] == ["circle", "circle"]
    assert layer.joints[0].join == "subtraction"
    assert [round(96 * shape.parameters[-1]) for shape in layer.shapes] == [33, 19]
    assert quality(scene, picture).psnr >= 38


def test_a_hole_through_two_layers_is_cut_out_of_both(drawn):
    """Nothing that could be laid on them would be transparent."""
    mask = '<mask id="m"><rect width="96" height="96" fill="white"/><circle cx="48" cy="44" r="16"/></mask>'
    layers = '<path d="M8 8H88V60H8Z" fill="#d02040"/><path d="M8 40H88V88H8Z" fill="#2040d0"/>'
    picture = drawn(f'{mask}<g mask="url(#m)">{layers}</g>')
    scene = fit(picture)
    assert quality(scene, picture).psnr >= 38
    assert [len(layer.shapes) for layer in scene.layers] == [2, 2]
    assert all(layer.joints[0].join == "subtraction" for layer in scene.layers)


@pytest.mark.parametrize("axis", [0, 1])
def test_a_ramp_a_pixel_high_or_wide_is_one_box(axis):
    """On a canvas three hundred times as wide as high a colour changes little across a scene unit."""
    pixels = np.repeat(np.expand_dims(np.linspace(0, 1, 300, dtype=np.float32), (axis, 2)), 3, axis=2)
    scene = fit(Picture(pixels))
    assert kinds_of(scene) == ["box"]
    assert quality(scene, Picture(pixels)).psnr >= 50


def test_a_search_that_has_nothing_to_try_ends(drawn, monkeypatch):
    """No shape would help, and there is none that could be changed."""
    monkeypatch.setattr(import_module("sdf2vec.fit.sparse"), "choices", lambda best: iter(()))
    assert fit(drawn(WHITE + DISC), max_shapes=4, preset="fast").shape_count <= 4


def test_only_kinds_that_the_user_allows_are_found(drawn):
    assert kinds_of(fit(drawn(WHITE + DISC), kind="ellipse")) == ["ellipse"]


@pytest.mark.usefixtures("few_steps")
@pytest.mark.parametrize("option", [{"paint": "linear"}, {"min_area": 0.05}])
def test_what_a_search_can_not_heed_is_painted(drawn, option):
    """Gradients and a least area are for shapes that are descended."""
    scene = fit(drawn(WHITE + DISC), 2, preset="fast", **option)
    assert {shape.kind for layer in scene.layers for shape in layer.shapes} == {"triangle"}
    assert {shape.paint for layer in scene.layers for shape in layer.shapes} == {option.get("paint", "flat")}


def test_a_device_that_is_not_here_is_refused_for_drawings_too(drawn, monkeypatch):
    monkeypatch.setattr(torch.cuda, "is_available", lambda: False)
    with pytest.raises(Sdf2vecError, match="no cuda device here"):
        fit(drawn(WHITE + DISC), device="cuda")


def test_a_search_says_when_kernels_are_compiled(drawn, monkeypatch):
    monkeypatch.setattr(import_module("sdf2vec.render.kernels"), "is_compiled", lambda *arguments: False)
    said = []

    def stop(progress):
        said.append(progress.phase)
        return True

    fit(drawn(WHITE + DISC), callback=stop)
    assert said == ["compiling kernels (once)"]


def gain(scene, pixels):
    """What one more circle would gain."""
    search = Search(Layers(("circle",), "over"), (0.0, 1.0), torch.Generator(), lambda loss: None, 1 / 16)
    return gain_of_one_more(scene, View(torch.from_numpy(pixels.transpose(2, 0, 1).copy()), None), search)


def test_what_one_more_shape_would_gain_is_told():
    """Nothing where nothing is missing; much where one colour is missing everywhere."""
    pixels = np.full((16, 16, 3), 0.5, np.float32)
    assert gain(Scene(16, 16, (), (0.5, 0.5, 0.5)), pixels) == 0.0
    assert gain(Scene(16, 16, (), (0.4, 0.5, 0.5)), pixels) > 1.0


def test_what_one_more_shape_would_gain_is_what_it_gains(drawn):
    """A disc that is missing comes back whole: the gain is that of a circle, not of a blurred disc."""
    picture = drawn(WHITE + DISC, 64, 64)
    assert gain(Scene(64, 64, (), (1.0, 1.0, 1.0)), picture.pixels) > 20


@pytest.mark.parametrize("seed", range(2))
def test_one_circle_finds_a_disc(drawn, seed):
    picture = drawn(WHITE + DISC)
    scene = fit(picture, 1, kind="circle", preset="fast", seed=seed)
    assert kinds_of(scene) == ["circle"]
    assert quality(scene, picture).psnr >= 40


@pytest.mark.usefixtures("few_steps")
def test_few_shapes_are_exactly_as_many_as_told(drawn):
    scene = fit(drawn(WHITE + DISC), 3, preset="fast")
    assert scene.shape_count == 3


DISCS = WHITE + "".join(
    f'<circle cx="{x}" cy="{y}" r="{r}" fill="{fill}"/>'
    for x, y, r, fill in (
        (30, 30, 18, "#0080e0"),
        (66, 30, 18, "#e05020"),
        (48, 48, 16, "#303030"),
    )
)


@pytest.mark.usefixtures("few_steps")
@pytest.mark.parametrize("count", [3, 40])
def test_a_drawing_is_searched_for_as_many_shapes_as_told(count, drawn):
    """Triangles on the discs that there are, where more are wanted."""
    picture = drawn(DISCS)
    scene = fit(picture, count)
    kinds = kinds_of(scene)
    assert kinds == ["circle"] * 3 + ["triangle"] * (count - 3)
    assert quality(scene, picture).psnr >= 36


@pytest.mark.usefixtures("few_steps")
def test_told_how_many_shapes_only_kinds_that_the_user_allows_are_found(drawn):
    assert kinds_of(fit(drawn(DISCS), 5, kind="box")) == ["box"] * 5


@pytest.mark.usefixtures("few_steps")
def test_a_painting_is_not_searched_for_as_many_shapes_as_told(monkeypatch):
    monkeypatch.setattr(Drawing, "found", lambda self: pytest.fail("it is no drawing"))
    assert fit(noise(), 8).shape_count == 8


@pytest.mark.usefixtures("few_steps")
def test_the_fast_preset_does_not_search_for_as_many_shapes_as_told(drawn, monkeypatch):
    monkeypatch.setattr(Drawing, "found", lambda self: pytest.fail("it is to be fast"))
    assert fit(drawn(DISCS), 8, preset="fast").shape_count == 8


def test_an_enlarged_photograph_is_not_searched_for_as_many_shapes_as_told():
    """Its pixels are like their neighbours, but not where it is small."""
    large = Image.fromarray(data.astronaut()[:256, 100:356]).resize((1700, 1700), Image.Resampling.BICUBIC)
    picture = Picture((np.asarray(large) / 255).astype(np.float32))
    assert Drawn.of(picture).flat
    assert auto._few(picture, settings_of(8), lambda progress: False) is None


@pytest.mark.parametrize(("error", "begun"), [(GOOD / 2, [1]), (GOOD * 2, [1, 0])])
def test_what_is_found_far_from_a_drawing_is_fitted_from_nothing_too(error, begun, drawn, monkeypatch):
    """The nearer is kept: here what begins with nothing, as what begins with all black ends so."""
    picture, blank = drawn(DISCS), Scene(96, 96, (), (0.0, 0.0, 0.0))
    black = replace(
        blank, layers=(Layer((Shape.of("circle", (0.0, 0.0, 0.0), center=(0.0, 0.0), radius=1.0),)),)
    )
    starts = []

    def found(drawing):
        drawing.error = error
        return black

    def fitted_from(picture, settings, callback):
        starts.append(len(settings.start.layers) if settings.start else 0)
        return black if settings.start else replace(blank, background=(1.0, 1.0, 1.0))

    monkeypatch.setattr(Drawing, "found", found)
    monkeypatch.setattr(auto, "fit_concisely", fitted_from)
    made = fit(picture, 8)
    assert starts == begun
    assert len(made.layers) == begun[-1]


@pytest.mark.usefixtures("few_steps")
def test_what_is_no_drawing_gets_as_many_shapes_as_are_allowed():
    found = fitted(noise(), max_shapes=12, preset="fast")
    assert found.scene.shape_count == 12
    assert "--max-shapes" in found.reason
    assert found.scene == fit(noise(), 12, preset="fast")


@pytest.mark.usefixtures("few_steps")
def test_a_target_is_met_by_fewer_shapes():
    picture = noise()
    all_shapes = quality(fit(picture, 64, preset="fast"), picture).psnr
    found = fitted(picture, max_shapes=64, preset="fast", target_psnr=all_shapes - 4)
    assert found.met
    assert quality(found.scene, picture).psnr >= all_shapes - 4
    assert found.scene.shape_count < 60
    assert "PSNR" in found.reason


def test_a_flip_is_met_by_the_shapes_of_a_drawing(drawn):
    """Not by those of a painting; and by no more than it takes: what is all but hidden is left out."""
    picture = drawn(WHITE + UNDER + OVER + TRIANGLE)
    near, far = (fitted(picture, target_flip=wanted) for wanted in (0.02, 0.2))
    assert near.met
    assert far.met
    assert "FLIP" in near.reason
    assert far.scene.shape_count < near.scene.shape_count == 3
    assert quality(near.scene, picture).flip <= 0.02
    assert 0.02 < quality(far.scene, picture).flip <= 0.2


def test_a_target_that_gradients_do_not_reach_is_gone_on_for():
    """A box whose colour rises and bends: by three colours it is told to no more than some dB."""
    x, y = (np.arange(side, dtype=np.float32) / side - 0.5 for side in (96, 72))
    shade = np.array([0.5, 0.5, 0.5]) + x[:, None] * (0.5, 0.3, -0.5) + (x[:, None] ** 2) * (0, -0.2, 0)
    inside = (np.abs(x)[None] < 0.3) & (np.abs(y)[:, None] < 0.3)
    picture = Picture(np.where(inside[..., None], shade[None], 1.0).astype(np.float32))
    without = fitted(picture)
    assert [layer.shapes[0].paint for layer in without.scene.layers] == ["linear3"]
    psnr = quality(without.scene, picture).psnr
    found = fitted(picture, target_psnr=psnr + 1, max_shapes=32, preset="fast")
    assert found.met
    assert found.scene.shape_count > 1


@pytest.mark.usefixtures("few_steps")
@pytest.mark.parametrize("target", [{"target_psnr": 90.0}, {"target_flip": 0.001}])
def test_a_target_out_of_reach_is_said(target):
    found = fitted(noise(), max_shapes=8, preset="fast", **target)
    assert not found.met
    assert found.scene.shape_count == 8
    assert "not reached" in found.reason


def test_a_number_and_a_target_are_refused():
    with pytest.raises(Sdf2vecError, match="--shapes auto"):
        settings_of(8, target_psnr=30)


@pytest.mark.parametrize("shapes", ["few", 0, -1, 2.5])
def test_other_numbers_are_refused(shapes):
    with pytest.raises(Sdf2vecError, match="must be auto or a whole number"):
        settings_of(shapes)


def test_the_search_ends_when_told_and_keeps_what_it_has(drawn):
    picture = drawn(WHITE + UNDER + OVER + TRIANGLE)
    seen: list[object] = []
    scene = fit(picture, callback=lambda progress: remember(seen)(progress) or len(seen) == 3)
    assert len(seen) == 3
    assert scene.shape_count == 0


def test_the_same_seed_finds_the_same(drawn):
    picture = drawn(WHITE + DISC)
    assert fit(picture, kind="ellipse", seed=1) == fit(picture, kind="ellipse", seed=1)


def test_the_ground_is_the_colour_that_dominates():
    """Not the mean, which would have to be painted over everywhere."""
    target = np.full((3, 20, 20), 0.9, np.float32)
    target[:, :8] = 0.1
    assert np.allclose(ground_of(torch.from_numpy(target))[:3], 0.9, atol=1e-6)
    tiles = np.full((3, 20, 20), 0.9, np.float32)
    tiles[:, ::5], tiles[:, :, ::5], tiles[:, -1], tiles[:, :, -1] = 0.1, 0.1, 0.1, 0.1
    assert np.allclose(ground_of(torch.from_numpy(tiles))[:3], 0.1, atol=1e-6)  # less of it, but around all
    assert ground_of(torch.zeros(4, 5, 5)).tolist() == [0.0] * 4
    corner = torch.ones(4, 5, 5)
    corner[:, 0, 0] = 0.0
    assert ground_of(corner).tolist() == [0.0] * 4  # nothing that is laid on a ground makes a hole in it
    shades = torch.linspace(0, 1, 300).reshape(1, 15, 20).repeat(3, 1, 1)
    assert math.isclose(float(ground_of(shades)[0]), 0.5, abs_tol=0.01)


def test_a_soft_picture_takes_few_shapes():
    """A disc that is nearly all edge, under no formula of ours."""
    y, x = np.mgrid[0:32, 0:48].astype(np.float32)
    disc = np.clip((20 - np.hypot(x - 22, y - 15)) / 16, 0, 1)[..., None]
    picture = Picture((np.float32(0.9) - disc * np.array([0.2, 0.6, 0.7], np.float32)).astype(np.float32))
    found = fitted(picture, kind="circle")
    assert not Drawn.of(picture).flat
    assert found.scene.shape_count <= 8  # its edge is straight, ours a sigmoid
    assert quality(found.scene, picture).psnr >= 35


@pytest.mark.parametrize(
    ("count", "scene", "kinds", "seed"), [(1, 3, ["box"], 3), (2, 9, ["box", "circle"], 0)]
)
def test_a_soft_edge_is_no_shape_of_its_own(count, scene, kinds, seed):
    """Its colours are found one by one, as a sharp core, a halo and bars; in the end none but one shape is needed."""
    known = known_scene(count, "apart", soft=True, seed=scene)
    found = fitted(known.pixels, seed=seed)
    assert kinds_of(found.scene) == kinds
    assert quality(found.scene, load(known.pixels)).psnr > 55


JAGGED = {
    "disc": (lambda pen, k: pen.ellipse([20 * k, 25 * k, 70 * k, 75 * k], fill="#d02040"), 1),
    "triangle": (
        lambda pen, k: pen.polygon([(20 * k, 80 * k), (50 * k, 15 * k), (85 * k, 70 * k)], fill="#2060c0"),
        1,
    ),
    "ring": (
        lambda pen, k: pen.ellipse([20 * k] * 2 + [80 * k] * 2, outline="#204080", width=round(12 * k)),
        2,
    ),
}


@pytest.mark.parametrize("side", [64, 96, 200])
@pytest.mark.parametrize(("draw", "shapes"), JAGGED.values(), ids=JAGGED)
def test_what_is_drawn_without_antialiasing_is_the_shape_and_not_its_steps(draw, shapes, side):
    """Of 64 and 96 pixels squared they were four to eight shapes."""
    image = Image.new("RGB", (side, side), "white")
    draw(ImageDraw.Draw(image), side / 100)
    scene = fitted(np.asarray(image), "auto").scene
    assert scene.shape_count <= shapes
    assert quality(scene, load(np.asarray(image))).psnr > 27


@pytest.mark.usefixtures("few_steps")
@pytest.mark.parametrize(("target", "most"), [(33, 1), (36, 256)])
def test_a_target_is_met_by_the_picture_with_its_steps(target, most):
    """Not by one that is smooth: the disc alone is 34 dB near, which is enough for the first."""
    image = Image.new("RGB", (96, 96), "white")
    ImageDraw.Draw(image).ellipse([19, 24, 67, 72], fill="#d02040")
    found = fitted(np.asarray(image), "auto", target_psnr=target)
    assert found.met
    assert quality(found.scene, load(np.asarray(image))).psnr >= target
    assert found.scene.shape_count <= most


def test_a_drawing_of_other_things_takes_more_shapes_while_its_description_gets_shorter(monkeypatch):
    """Of 2 shapes found: 4 bring it to within a level, so that 8 can't pay for themselves."""
    asked = []

    def fitted_with(picture, settings, callback):
        asked.append(settings.shapes)
        return hidden(settings.shapes, 0.5 - 1 / 255)

    monkeypatch.setattr(auto, "fit_concisely", fitted_with)
    picture = Picture(np.full((64, 64, 3), 0.5, np.float32))
    picture.pixels[:, :32] += 1 / 255
    view = View(torch.from_numpy(picture.pixels).permute(2, 0, 1), None)
    found = hidden(2, 0.3)
    found = replace(found, background=(0.3, 0.5, 0.5))
    enough = auto._enough(picture, settings_of(), found, view, lambda progress: False)
    assert asked == [4, 8]
    assert enough.shape_count == 4


@pytest.mark.parametrize(
    ("found", "off", "tried", "wanted"),
    [
        (2, 0.1, [4, 8, 24, 48], 24),
        (2, 0.02, [4], 2),
        (0, 0.1, [4, 12, 48], 12),
        (0, 0.02, [4], 0),
        (3, 0.1, [6, 12, 36, 48], 6),
    ],
)
def test_what_is_far_from_a_drawing_tries_all_numbers(found, off, tried, wanted, monkeypatch):
    """Also where the next shapes alone do not pay for themselves, as those of a glyph; what is near does not.

    Twice as many shapes that shorten the description by a fiftieth are not worth it.
    """
    bits = {found: 100.0, 4: 120.0, 6: 56.0, 8: 130.0, 12: 55.0, 24: 50.0, 36: 54.5, 48: 60.0}
    monkeypatch.setattr(auto, "description_length", lambda scene, view: bits[scene.layer_count])
    asked = []

    def fitted_with(picture, settings, callback):
        asked.append(settings.shapes)
        return hidden(settings.shapes, 0.5 - off)

    monkeypatch.setattr(auto, "fit_concisely", fitted_with)
    picture = Picture(np.full((64, 64, 3), 0.5, np.float32))
    view = View(torch.from_numpy(picture.pixels).permute(2, 0, 1), None)
    scene = hidden(found, 0.5 - off)
    enough = auto._enough(picture, settings_of(max_shapes=48), scene, view, lambda progress: False)
    assert asked == tried
    assert enough.shape_count == wanted


def test_what_does_not_show_a_drawing_gives_way_to_what_does(monkeypatch):
    """Also where its description is the shortest, as of a plot of thin curves on white."""
    levels = {2: 0.4, 4: 0.42, 8: 0.46, 24: 0.47, 48: 0.48}
    monkeypatch.setattr(auto, "description_length", lambda scene, view: 100.0 + scene.layer_count)
    monkeypatch.setattr(
        auto,
        "fit_concisely",
        lambda picture, settings, callback: hidden(settings.shapes, levels[settings.shapes]),
    )
    picture = Picture(np.full((64, 64, 3), 0.5, np.float32))
    view = View(torch.from_numpy(picture.pixels).permute(2, 0, 1), None)
    enough = auto._enough(picture, settings_of(max_shapes=48), hidden(2, 0.4), view, lambda progress: False)
    assert enough.shape_count == 8


@pytest.mark.parametrize("size", [(160, 120), (136, 136), (180, 100)])
def test_what_is_hardly_larger_than_it_is_looked_at_is_not_scaled(size):
    """Scaled by so little, edges were softer than any of a shape: a ring took two layers and half a minute."""
    width, height = size
    y, x = np.mgrid[0:height, 0:width] + 0.5
    away = np.hypot(x - width / 2, y - height / 2)
    cover = np.clip(45.5 - away, 0, 1) * np.clip(away - 29.5, 0, 1)
    picture = Picture((1 - cover[..., None] * np.array([0.2, 0.8, 0.9])).astype(np.float32))
    scene = fit(picture)
    assert len(scene.layers) == 1
    assert {shape.kind for shape in scene.layers[0].shapes} == {"circle"}
    assert quality(scene, picture).psnr > 44


def test_edges_of_a_large_drawing_are_sharp(drawn):
    """However much smaller it is looked at: half a pixel's softness there is more than one of this picture."""
    shapes = f'<svg width="1000" height="750" viewBox="0 0 96 72">{DISC}</svg>'
    picture = drawn(WHITE + shapes, 1000, 750)
    scene = fit(picture)
    assert kinds_of(scene) == ["circle"]
    assert scene.layers[0].falloff < 2.5 * scene.pixel
    assert quality(scene, picture).psnr > 50

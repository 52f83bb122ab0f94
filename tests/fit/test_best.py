"""A fit returns the best state seen, is no worse than a ground alone, and its ground may have an alpha."""

from dataclasses import replace

import numpy as np
import pytest
import torch

import sdf2vec
from sdf2vec import Layer, Scene, Shape
from sdf2vec.fit import loop
from sdf2vec.fit.best import Best, faded, nearest_of_its_own
from sdf2vec.fit.constraints import project
from sdf2vec.fit.initialization import background_of
from sdf2vec.image import Picture, load
from sdf2vec.quality import psnr_of
from sdf2vec.render.draw import draw
from sdf2vec.render.tensors import from_scene, to_scene
from tests.fit.fitting import fitted, picture

RED_DISC = Layer((Shape.of("circle", (1.0, 0.0, 0.0), center=(0, 0), radius=0.3),), 0.05, 0.8)
GREY = (0.5, 0.5, 0.5)


def test_a_half_transparent_picture_is_its_ground():
    """The example of a flat picture of 1 × 500: 11 to 16 dB, when shapes alone had to make up its alpha."""
    pixels = np.full((500, 1, 4), 128, np.uint8)
    scene = sdf2vec.fit(pixels, 5, preset="fast")
    assert psnr_of(scene, load(pixels)) > 60
    assert scene.ground == pytest.approx((128 / 255 * 128 / 255,) * 3 + (128 / 255,), abs=1e-3)


@pytest.mark.usefixtures("few_steps")
@pytest.mark.parametrize("level", [0, 3, 128, 255])
def test_one_pixel_of_any_alpha(level):
    """Where shapes could not be fainter than their least opacity."""
    pixels = np.array([[[200, 100, 50, level]]], np.uint8)
    assert psnr_of(sdf2vec.fit(pixels, 5, preset="fast"), load(pixels)) > 60


def test_a_picture_with_holes_has_no_ground():
    """What is laid over a ground could not take its alpha away."""
    holes = torch.ones(4, 10, 10)
    assert background_of(holes).tolist() == [1, 1, 1, 1]
    holes[:, :4] = 0.0
    assert background_of(holes).tolist() == [0, 0, 0, 0]


def test_the_alpha_of_a_ground_is_fitted():
    """From that of the start, 0.5, to the picture's 0.6."""
    pixels = np.full((32, 48, 4), 0.6, np.float32)
    start = Scene(48, 32, (RED_DISC,), (*GREY, 0.5))
    scene = fitted(Picture(pixels), 1, start=start)
    assert scene.ground[3] == pytest.approx(0.6, abs=0.02)


def test_the_best_state_is_gone_back_to():
    scene = from_scene(Scene(8, 8, (RED_DISC,), GREY))
    best = Best(scene)
    best.see(2.0)
    scene.background.fill_(1.0)
    best.see(1.0)
    scene.groups[0].opacity.fill_(0.1)
    best.see(1.5)
    best.restore(0.5)
    assert float(scene.groups[0].opacity) == pytest.approx(0.1)
    best.restore(1.25)
    assert float(scene.groups[0].opacity) == pytest.approx(0.8)
    assert scene.background.tolist() == [1.0] * 4


@pytest.mark.usefixtures("few_steps")
def test_a_fit_that_runs_away_ends_where_it_was_best(monkeypatch):
    usual = fitted(picture())
    step = loop.Fit._step

    def thrown(fit, stage, rate, moves, best):
        loss = step(fit, stage, rate, moves, best)
        if fit.done == fit.steps - 1:  # the last one
            fit.tensors.groups[0].opacity.detach().fill_(0.02)
        return loss

    monkeypatch.setattr(loop.Fit, "_step", thrown)
    assert psnr_of(fitted(picture()), picture()) > psnr_of(usual, picture()) - 0.5


def squared_error(target):
    return lambda scene: (float((draw(to_scene(scene, 8, 8))[:3] - target).square().mean()),)


@pytest.mark.parametrize(
    ("shown", "layers"),
    [(0.8, 1), (0.5, 1), (-0.5, 0)],
    ids=["what helps stays", "what is too much fades", "what only harms goes"],
)
def test_shapes_that_do_harm_fade(shown, layers):
    """A disc where the picture is as red, half so, or the opposite."""
    disc = draw(Scene(8, 8, (replace(RED_DISC, opacity=1.0),), GREY))[:3] - 0.5
    target = 0.5 + (shown * 0.5 if shown == 0.5 else shown) * disc
    tensors = from_scene(Scene(8, 8, (RED_DISC,), GREY))
    wrong = squared_error(target)
    found = faded(tensors, torch.tensor([0.5, 0.5, 0.5, 1.0]), wrong)
    assert found.layer_count == layers
    assert wrong(found)[0] <= wrong(replace(tensors, groups=[]))[0]
    assert (found is tensors) == (shown == 0.8)


def test_what_nobody_sees_does_not_count():
    tensors = from_scene(Scene(8, 8, (RED_DISC,), GREY))
    assert faded(tensors, tensors.background, lambda scene: (9e-7 if scene.groups else 0.0,)) is tensors


def test_a_ground_of_few_colors_is_one_of_them():
    green = replace(RED_DISC, shapes=(Shape.of("circle", (0, 1, 0), center=(0, 0), radius=0.1),))
    tensors = from_scene(Scene(8, 8, (RED_DISC, green), GREY))
    assert nearest_of_its_own(tensors, torch.tensor([0.4, 0.1, 0.1, 0.5])).tolist() == [0.5, 0, 0, 0.5]


def test_a_ground_stays_premultiplied():
    tensors = from_scene(Scene(8, 8, (RED_DISC,), (*GREY, 0.4)))
    tensors.background[:3] = torch.tensor([0.9, 0.3, -0.1])
    project(tensors, 0.1)
    assert tensors.background.tolist() == pytest.approx([0.4, 0.3, 0.0, 0.4])

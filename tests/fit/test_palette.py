"""Fits in given colours, or in so many."""

import numpy as np
import pytest
import torch

from sdf2vec import Layer, Scene, Shape
from sdf2vec.fit import loop, palette
from sdf2vec.image import Picture
from sdf2vec.render.tensors import from_scene
from tests.fit.fitting import AS_NUMBERS, BLUE, PALETTE, RED, colors_of, error, fitted, picture

pytestmark = pytest.mark.usefixtures("short_fits")


@pytest.mark.parametrize("alpha", [False, True])
@pytest.mark.parametrize("stop", [None, 7, 75])
def test_a_palette_is_kept_even_when_stopped(alpha, stop):
    scene = fitted(picture(alpha=alpha), palette=PALETTE, callback=lambda progress: progress.step == stop)
    assert colors_of(scene) <= {tuple(round(v, 3) for v in color) for color in AS_NUMBERS}
    assert len(colors_of(scene)) > 1


def test_refitting_helps_a_palette(monkeypatch):
    pic = picture()
    refitted = fitted(pic, palette=PALETTE)
    monkeypatch.setattr(loop, "REFIT_STEPS", 0)
    assert error(refitted, pic) < error(fitted(pic, palette=PALETTE), pic)


@pytest.mark.parametrize("count", [1, 2, 4])
@pytest.mark.parametrize("stop", [None, 5])
def test_so_many_colors(count, stop, recwarn):
    scene = fitted(colors=count, union=2, callback=lambda progress: progress.step == stop)
    assert 1 <= len(colors_of(scene)) <= count
    assert not recwarn.list


def test_more_colors_than_there_are(recwarn):
    grey = Picture(np.full((16, 24, 3), 0.5, dtype=np.float32))
    assert 1 <= len(colors_of(fitted(grey, colors=200))) <= 9
    assert not recwarn.list


def test_found_colors_are_those_that_cover_most():
    """Exactly the scene's where there are no more; of three for two, the rarer two near each other are one."""
    colors = (RED, RED, (0.0, 0.0, 0.9), BLUE)
    layers = tuple(Layer((Shape("circle", (0, 0, 0.2), color),), 0.1) for color in colors)
    tensors = from_scene(Scene(48, 32, layers, None))
    generator = torch.Generator().manual_seed(0)
    cover = [torch.tensor([1.0, 1.0, 1.0, 0.0])]
    assert sorted(palette.found(tensors, cover, 2, generator)) == [(0.0, 0.0, 0.9), RED]
    red, blue = sorted(palette.found(tensors, [torch.ones(4)], 2, generator), reverse=True)
    assert red == RED
    assert 0.9 < blue[2] < 1.0
    assert len(palette.found(tensors, [torch.ones(4)], 9, generator)) == 3


def test_snapping_takes_what_looks_nearest():
    layers = tuple(
        Layer((Shape("circle", (0, 0, 0.2), color),), 0.1) for color in ((0.9, 0.1, 0.1), (0.2, 0.2, 0.9))
    )
    tensors = from_scene(Scene(48, 32, layers, (0.9, 0.9, 0.8)))
    palette.snap(tensors, [RED, BLUE, (1.0, 1.0, 1.0)])
    assert tensors.groups[0].colors[0].tolist() == [list(RED), list(BLUE)]
    assert tensors.background.tolist() == [1.0, 1.0, 1.0, 1.0]

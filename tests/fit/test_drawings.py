"""Drawings are told from photographs, and what was drawn from what a file made of it."""

import numpy as np
import pytest
from skimage import data

from sdf2vec.bench.known_drawing import compressed
from sdf2vec.fit import drawings
from sdf2vec.fit.drawings import (
    FLAT,
    SMOOTH,
    UNSURE,
    Drawn,
    flatness,
    is_photograph,
    smoothness,
)
from sdf2vec.image import Picture, load
from tests.fit.drawn import BLUE, GREEN, RED, disc, noise, painted


@pytest.mark.parametrize("name", ["rocket", "camera", "brick"])
def test_a_photograph_is_no_drawing_however_smooth(name):
    """Pixels differ from their neighbours by a few levels, hardly by none: no shapes are searched."""
    picture = load(getattr(data, name)())
    assert flatness(picture.premultiplied) > FLAT
    assert not Drawn.of(picture).flat
    assert is_photograph(Drawn.of(picture))


def test_a_soft_drawing_is_none_even_if_it_is_rough():
    """As lossy formats leave it; of what is smooth discs may leave more."""
    y, x = np.mgrid[0:96, 0:128].astype(np.float32)
    disc = np.exp(-((x - 50) ** 2 + (y - 40) ** 2) / 900)[..., None] * np.array([0.2, 0.6, 0.7], np.float32)
    rough = disc + np.random.default_rng(0).normal(0, 0.01, disc.shape).astype(np.float32)
    for pixels in (disc, rough):
        picture = Picture(np.clip(0.1 + pixels, 0, 1).astype(np.float32))
        assert not is_photograph(Drawn.of(picture))
    assert smoothness(disc) == 1.0
    assert smoothness(rough) < SMOOTH


def test_drawings_are_told_from_photographs():
    flat = np.full((32, 48, 3), 0.5, np.float32)
    flat[8:20, 10:30] = RED
    assert Drawn.of(Picture(flat)).flat
    assert not Drawn.of(noise()).flat
    assert Drawn.of(Picture(np.zeros((1, 1, 3), np.float32))).flat


def scene_drawn():
    """A disc on another, and a translucent one."""
    shapes = (disc(40, 40, 30), BLUE, 1.0), (disc(46, 48, 12), RED, 1.0), (disc(70, 66, 18), GREEN, 0.6)
    return painted(*shapes).astype(np.float32)


@pytest.mark.parametrize("quality", [40, 75, 95])
def test_a_compressed_drawing_is_one(quality):
    """However little of it is still flat; what was drawn is nearer to the drawing than the file is."""
    picture = scene_drawn()
    given = compressed(picture, quality=quality)
    drawn = Drawn.of(Picture(given))
    assert drawn.flat
    assert not is_photograph(drawn)
    assert drawn.off == pytest.approx(float(np.mean((drawn.pixels - given) ** 2)))
    assert np.mean((drawn.pixels - picture) ** 2) < UNSURE * np.mean((given - picture) ** 2)


def test_ringing_is_not_looked_for_in_photographs(monkeypatch):
    """It takes long where they are large; a large drawing is flat enough for it to be worth that."""
    monkeypatch.setattr(drawings, "has_ringing", lambda pixels: pytest.fail("looked for"))
    photograph = load(data.coffee())
    assert photograph.width * photograph.height > drawings.QUICK**2
    assert not Drawn.of(photograph).flat
    large = np.kron(scene_drawn(), np.ones((4, 4, 1), np.float32))
    with pytest.raises(pytest.fail.Exception):
        Drawn.of(Picture(compressed(large, quality=75)))


def test_a_target_that_the_noise_leaves_room_for_counts_against_the_file():
    """What the file is off takes its part; where that is all the noise is looked for."""
    drawn = Drawn.of(Picture(compressed(scene_drawn(), quality=75)))
    pixels, allowed = drawn.wanted(None)
    assert pixels is drawn.pixels
    assert allowed == pytest.approx(0.2 * drawn.off)
    near = -10 * np.log10(drawn.off)
    pixels, allowed = drawn.wanted(near - 1.0)
    assert pixels is drawn.pixels
    assert allowed == pytest.approx((10**0.1 - 1.0) * drawn.off)
    pixels, allowed = drawn.wanted(near + 1.0)
    assert pixels is drawn.picture.premultiplied
    assert allowed == pytest.approx(10**-0.1 * drawn.off)


@pytest.mark.parametrize("name", ["astronaut", "coffee", "chelsea", "rocket", "camera"])
def test_a_photograph_is_none_without_its_noise(name):
    picture = load(getattr(data, name)())
    assert is_photograph(Drawn.of(picture))

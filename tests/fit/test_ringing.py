"""Drawings without what compression made of them: against what was compressed; and nothing else changes."""

import numpy as np
import pytest
from skimage import data

from sdf2vec.bench.known_drawing import compressed
from sdf2vec.bench.known_scenes import known_scene
from sdf2vec.fit.ringing import has_ringing, restored
from sdf2vec.image import load

SCENES = [(count, mode, seed) for count in (1, 4, 8) for mode in ("apart", "overlap") for seed in (0, 1)]
MOST_LEFT = 1.5  # of the mean squared error, of any scene: colours in whole steps are off


def error(pixels, wanted):
    return float(np.mean((pixels - wanted) ** 2))


@pytest.mark.parametrize(
    ("quality", "subsampling", "half"), [(50, 2, 0.45), (75, 2, 0.35), (90, 2, 0.3), (75, 0, 0.55)]
)
def test_a_drawing_comes_nearer_to_what_it_was(quality, subsampling, half, require_engine):
    """Sharp and soft; with colour at half the resolution (2) and at all of it (0). So much is left of half of them."""
    require_engine("resvg")
    left = []
    for count, mode, seed in SCENES:
        picture = np.asarray(known_scene(count, mode, bool(seed), seed).pixels, np.float32)
        given = compressed(picture, quality=quality, subsampling=subsampling)
        made = restored(given)
        assert has_ringing(given)
        assert not has_ringing(picture)
        left.append(error(made, picture) / error(given, picture))
        assert abs(np.mean(made - given)) < 1e-3
    assert max(left) < MOST_LEFT
    assert np.median(left) < half


def test_other_files_too(require_engine):
    """WebP keeps colour at half the resolution, too."""
    require_engine("resvg")
    picture = np.asarray(known_scene(4, "apart", False, 0).pixels, np.float32)
    given = compressed(picture, "WEBP", quality=75)
    assert has_ringing(given)
    assert error(restored(given), picture) < 0.5 * error(given, picture)


def test_colour_that_runs_over_an_edge_of_lightness_goes_back():
    """By hand: two colours, of which the pixels at the edge have the mean of their chroma."""
    one, other = np.array([0.9, 0.2, 0.2]), np.array([0.1, 0.3, 0.5])
    picture = np.tile(np.where(np.arange(32)[None, :, None] < 15, one, other), (24, 1, 1))
    weights = np.array([0.299, 0.587, 0.114])
    light = picture @ weights
    run = (picture - light[..., None]).copy()
    run[:, 14:16] = run[:, 14:16].mean(axis=1, keepdims=True)
    given = (light[..., None] + run).astype(np.float32)
    made = restored(given)
    assert np.allclose(made @ weights, light, atol=1e-5)
    assert error(made, picture) < 0.25 * error(given, picture)


def test_what_goes_up_and_down_beside_an_edge_is_evened():
    """By hand, in grey: four levels to both sides of an edge of 150."""
    picture = np.where(np.arange(32)[None, :, None] < 16, 200.0, 50.0) / 255 * np.ones((24, 1, 3))
    waves = np.where(np.arange(32) % 2, 4.0, -4.0) / 255 * (np.abs(np.arange(32) - 15.5) < 4)
    given = (picture + waves[None, :, None]).astype(np.float32)
    assert has_ringing(given)
    assert np.abs(restored(given) - picture).max() < 1.5 / 255


def test_what_differs_little_from_what_is_beside_it_stays_where_nothing_else_is():
    """Two levels: no noise, as there is no edge that it could come from."""
    picture = np.full((30, 30, 3), 0.5, np.float32)
    picture[10:20, 10:20] += 2 / 255
    assert np.allclose(restored(picture), picture, atol=1e-5)


def test_a_ramp_stays():
    x = np.linspace(0, 1, 200, dtype=np.float32)
    picture = np.tile((np.array([0.2, 0.9, 0.4]) + x[:, None] * np.array([0.6, -0.5, 0.1]))[None], (40, 1, 1))
    picture = picture.astype(np.float32)
    assert not has_ringing(picture)
    assert np.allclose(restored(picture)[:, 12:-12], picture[:, 12:-12], atol=1e-4)


def test_alpha_stays():
    pixels = np.random.default_rng(0).random((20, 30, 4), dtype=np.float32)
    assert np.array_equal(restored(pixels)[..., 3], pixels[..., 3])


@pytest.mark.parametrize("shape", [(1, 1, 3), (1, 30, 4), (30, 1, 3), (2, 2, 4)])
def test_the_smallest_pictures(shape):
    flat = np.full(shape, 0.5, np.float32)
    assert not has_ringing(flat)
    assert np.allclose(restored(flat), flat, atol=1e-6)
    assert restored(np.random.default_rng(0).random(shape, dtype=np.float32)).shape == shape


@pytest.mark.parametrize("name", ["astronaut", "camera", "coffee"])
def test_photographs_have_as_much(name):
    """So that by it alone nothing is told from them."""
    assert has_ringing(load(getattr(data, name)()).pixels)

"""What is done with pixels: premultiplied alpha, resizing, writing."""

import io
import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as npst
from PIL import Image
from skimage.transform import resize as skimage_resize

from sdf2vec.errors import Sdf2vecError
from sdf2vec.image import encode_png, fitted_size, load, premultiply, resize, unpremultiply

# --------------------------------------------------------------------------------------------- compositing


def test_premultiply_by_hand():
    straight = np.array([[[0.5, 1, 0.2, 0.5], [0.3, 0.6, 0.9, 0], [0.3, 0.6, 0.9, 1]]], np.float32)
    coded = np.array([[[0.25, 0.5, 0.1, 0.5], [0, 0, 0, 0], [0.3, 0.6, 0.9, 1]]], np.float32)
    assert np.allclose(premultiply(straight), coded)
    back = straight.copy()
    back[0, 1, :3] = 0
    assert np.allclose(unpremultiply(coded), back)


@given(npst.arrays(np.float32, (2, 3, 4), elements=st.floats(0.0078125, 1, width=32)))
def test_unpremultiply_undoes_premultiply(pixels):
    assert np.allclose(unpremultiply(premultiply(pixels)), pixels, atol=1e-6)


# ------------------------------------------------------------------------------------------------ resizing


def ramp(width, height):
    """Each pixel holds the position of its centre, as a fraction of width and height."""
    x, y = (np.arange(width) + 0.5) / width, (np.arange(height) + 0.5) / height
    return np.stack(np.broadcast_arrays(x[None, :], y[:, None], 0.5), axis=2).astype(np.float32)


@pytest.mark.parametrize("size", [(60, 40), (30, 20), (37, 23), (20, 40), (90, 100), (240, 160), (90, 20)])
def test_resizing_shifts_nothing(size):
    result = resize(ramp(120, 80), *size)
    # The outermost pixels lack neighbours on one side.
    inside = np.s_[size[1] // 8 : -(size[1] // 8), size[0] // 8 : -(size[0] // 8)]
    assert result.shape == (size[1], size[0], 3)
    assert np.abs(result - ramp(*size))[inside].max() < 2e-3


def test_resizing_keeps_the_centre_of_mass():
    spot = np.zeros((64, 64, 3), np.float32)
    spot[20:24, 41:44] = 1
    result = resize(spot, 16, 16)[..., 0]
    y, x = (np.arange(16) + 0.5) / 16, (np.arange(16) + 0.5) / 16
    assert (result.sum(0) * x).sum() / result.sum() == pytest.approx(42.5 / 64, abs=5e-3)
    assert (result.sum(1) * y).sum() / result.sum() == pytest.approx(22 / 64, abs=5e-3)
    assert result.mean() == pytest.approx(12 / 64**2, rel=0.05)


@pytest.mark.parametrize("size", [(16, 12), (7, 11), (33, 50), (9, 40)])
def test_resizing_a_mirrored_picture_mirrors_the_result(size):
    pixels = np.random.default_rng(3).random((24, 21, 3)).astype(np.float32)
    result = resize(pixels, *size)
    assert np.allclose(resize(pixels[:, ::-1], *size), result[:, ::-1], atol=1e-6)
    assert np.allclose(resize(pixels[::-1], *size), result[::-1], atol=1e-6)


def test_shrinking_averages_and_does_not_alias():
    checks = np.indices((96, 96)).sum(0)[..., None].repeat(3, 2).astype(np.float32) % 2
    assert np.abs(resize(checks, 24, 24) - 0.5)[2:-2, 2:-2].max() < 1e-5
    assert np.abs(resize(checks, 19, 23) - 0.5)[2:-2, 2:-2].max() < 0.02


def test_shrinking_resembles_another_librarys_area_average():
    rng = np.random.default_rng(0)
    smooth = skimage_resize(rng.random((9, 12, 3)), (90, 120), order=3).clip(0, 1).astype(np.float32)
    blocks = smooth.reshape(30, 3, 40, 3, 3).mean((1, 3))
    assert np.abs(resize(smooth, 40, 30) - blocks).max() < 0.02


@given(st.integers(1, 40), st.integers(1, 40), st.integers(1, 40), st.integers(1, 40))
@settings(max_examples=50, deadline=None)
def test_flat_pictures_stay_flat(width, height, new_width, new_height):
    flat = np.full((height, width, 4), [0.2, 0.4, 1, 0.6], np.float32)
    assert np.allclose(resize(flat, new_width, new_height), flat[0, 0], atol=1e-5)


@pytest.mark.parametrize("size", [(4, 4), (40, 40)])
def test_colours_of_invisible_pixels_do_not_bleed(size):
    pixels = np.zeros((16, 16, 4), np.float32)
    pixels[:, :8] = (1, 0, 0, 1)
    pixels[:, 8:] = (0, 1, 0, 0)
    result = resize(pixels, *size)
    visible = result[..., 3] > 1e-3
    assert np.allclose(result[visible][:, :3], (1, 0, 0), atol=1e-3)
    assert result[..., 3].mean() == pytest.approx(0.5, abs=0.02)


@pytest.mark.parametrize("channels", [3, 4])
@pytest.mark.parametrize("size", [(5, 7), (37, 41)])
def test_resized_values_stay_in_range(channels, size):
    pixels = (np.random.default_rng(1).random((20, 20, channels)) > 0.5).astype(np.float32)
    result = resize(pixels, *size)
    assert result.dtype == np.float32
    assert 0 <= result.min() <= result.max() <= 1


def test_resizing_to_the_same_size_changes_nothing():
    pixels = np.random.default_rng(2).random((9, 7, 3)).astype(np.float32)
    assert np.array_equal(resize(pixels, 7, 9), pixels)


def test_fitted_size_by_hand():
    assert fitted_size(4000, 3000, 300) == (400, 300)
    assert fitted_size(3000, 4000, 300) == (300, 400)
    assert fitted_size(1, 500, 2) == (2, 1000)
    assert fitted_size(7, 5, 3) == (4, 3)


@given(st.integers(1, 10**5), st.integers(1, 10**5), st.integers(1, 10**4))
def test_fitted_size(width, height, shortest):
    new_width, new_height = fitted_size(width, height, shortest)
    assert min(new_width, new_height) == shortest
    assert abs(new_width - width * shortest / min(width, height)) <= 0.5
    assert abs(new_height - height * shortest / min(width, height)) <= 0.5


# ------------------------------------------------------------------------------------------------- writing


@given(npst.arrays(np.uint8, st.tuples(st.integers(1, 6), st.integers(1, 6), st.sampled_from([3, 4]))))
def test_png_round_trip(values):
    decoded = np.asarray(Image.open(io.BytesIO(encode_png(values / 255))))
    assert np.array_equal(decoded, values)
    assert np.array_equal(np.rint(load(encode_png(values / 255.0)).pixels[..., :3] * 255), values[..., :3])


def test_png_rounds_to_nearest_and_clips():
    values = np.array([[[0.4 / 255, 0.6 / 255, 100.49 / 255], [-3, 7, np.inf]]])
    assert np.asarray(Image.open(io.BytesIO(encode_png(values)))).tolist() == [[[0, 1, 100], [0, 255, 255]]]


def test_png_refuses_nan():
    with pytest.raises(Sdf2vecError, match="NaN"):
        encode_png(np.array([[[0, np.nan, 0]]]))


def test_pictures_load_without_torch():
    code = "import sys, sdf2vec.image; sys.exit('torch' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0

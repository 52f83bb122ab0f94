"""Metrics against scikit-image, against sums written out in full, and against finite differences."""

import math

import numpy as np
import pytest
import torch
from skimage.metrics import peak_signal_noise_ratio, structural_similarity

from sdf2vec.metrics import mse, psnr, ssim


def pair(shape, seed=0, noise=0.2, dtype=torch.float64):
    """A smooth picture with some texture, and a noisy copy."""
    generator = torch.Generator().manual_seed(seed)
    y, x = torch.meshgrid(*(torch.linspace(0, 3, side, dtype=dtype) for side in shape[1:]), indexing="ij")
    phase = torch.arange(shape[0], dtype=dtype).view(-1, 1, 1)
    a = 0.5 + 0.4 * torch.sin(3 * x + y * y + phase)
    return a, (a + noise * torch.randn(shape, generator=generator, dtype=dtype)).clamp(0, 1)


def reference_ssim(a, b):
    return structural_similarity(
        a.numpy(),
        b.numpy(),
        gaussian_weights=True,
        sigma=1.5,
        use_sample_covariance=False,
        data_range=1,
        channel_axis=0,
    )


def written_out_ssim(a, b, length):
    """One window that covers the whole of a [length, length] picture, summed term by term."""
    offsets = [i - length // 2 for i in range(length)]
    weights = np.array([[math.exp(-(i * i + j * j) / (2 * 1.5**2)) for j in offsets] for i in offsets])
    weights /= weights.sum()
    mean_a, mean_b = (weights * a).sum(), (weights * b).sum()
    variance_a = (weights * (a - mean_a) ** 2).sum()
    variance_b = (weights * (b - mean_b) ** 2).sum()
    covariance = (weights * (a - mean_a) * (b - mean_b)).sum()
    luminance = (2 * mean_a * mean_b + 1e-4) / (mean_a**2 + mean_b**2 + 1e-4)
    return luminance * (2 * covariance + 9e-4) / (variance_a + variance_b + 9e-4)


def test_mse_and_psnr_by_hand():
    a, b = torch.zeros(3, 2, 2), torch.full((3, 2, 2), 0.1)
    assert mse(a, b).item() == pytest.approx(0.01)
    assert psnr(a, b).item() == pytest.approx(20)
    assert psnr(a, a + 1).item() == pytest.approx(0)
    assert psnr(b, b).item() == math.inf


def test_psnr_matches_scikit_image():
    a, b = pair((3, 17, 30))
    expected = peak_signal_noise_ratio(a.numpy(), b.numpy(), data_range=1)
    assert psnr(a, b).item() == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("shape", [(3, 40, 31), (1, 11, 11), (3, 12, 64), (4, 25, 25)])
@pytest.mark.parametrize("noise", [0.01, 0.3])
def test_ssim_matches_scikit_image(shape, noise):
    a, b = pair(shape, noise=noise)
    assert ssim(a, b).item() == pytest.approx(reference_ssim(a, b), abs=1e-9)


def test_ssim_in_float32_matches_float64():
    a, b = pair((3, 40, 31), dtype=torch.float32)
    assert ssim(a, b).dtype == torch.float32
    assert ssim(a, b).item() == pytest.approx(reference_ssim(a.double(), b.double()), abs=1e-5)


@pytest.mark.parametrize("side", range(1, 12))
def test_ssim_shrinks_its_window_to_small_pictures(side):
    length = side if side % 2 else side - 1
    a, b = pair((1, side, side), seed=side)
    corners = [(i, j) for i in range(side - length + 1) for j in range(side - length + 1)]
    windows = [np.s_[0, i : i + length, j : j + length] for i, j in corners]
    expected = np.mean([written_out_ssim(a.numpy()[w], b.numpy()[w], length) for w in windows])
    assert ssim(a, b).item() == pytest.approx(expected, abs=1e-12)


def test_ssim_shrinks_each_side_by_itself():
    a, b = pair((1, 1, 40))
    assert -1 <= ssim(a, b).item() < 1
    assert ssim(a, b).item() == pytest.approx(ssim(a.mT, b.mT).item(), abs=1e-12)
    # A picture that repeats its one row has the same moments along x and none along y.
    tall_a, tall_b = a.expand(1, 11, 40), b.expand(1, 11, 40)
    assert ssim(a, b).item() == pytest.approx(ssim(tall_a, tall_b).item(), abs=1e-12)


def test_ssim_window_is_a_choice():
    a, b = pair((1, 5, 5))
    assert ssim(a, b, window=5).item() == pytest.approx(written_out_ssim(a.numpy()[0], b.numpy()[0], 5))
    assert ssim(a, b, window=3).item() != pytest.approx(ssim(a, b, window=5).item(), abs=1e-4)


def test_ssim_of_flat_pictures_by_hand():
    a, b = (
        torch.full((3, 16, 16), 0.5, dtype=torch.float64),
        torch.full((3, 16, 16), 0.7, dtype=torch.float64),
    )
    assert ssim(a, b).item() == pytest.approx((2 * 0.35 + 1e-4) / (0.25 + 0.49 + 1e-4))


def test_ssim_of_equal_and_of_inverted_pictures():
    a, _ = pair((3, 20, 20))
    assert ssim(a, a).item() == pytest.approx(1, abs=1e-12)
    stripes = (torch.arange(20, dtype=torch.float64) % 2).expand(1, 20, 20)
    assert ssim(stripes, 1 - stripes).item() < -0.9


@pytest.mark.parametrize("metric", [mse, psnr, ssim])
def test_gradients_match_finite_differences(metric):
    a, b = pair((2, 13, 12), noise=0.1)
    a, b = a.requires_grad_(), b.requires_grad_()
    assert torch.autograd.gradcheck(metric, (a, b), fast_mode=True)


def test_ssim_gradient_on_a_small_picture():
    a, b = pair((2, 4, 3), noise=0.1)
    assert torch.autograd.gradcheck(ssim, (a.requires_grad_(), b.requires_grad_()), fast_mode=True)


def test_ssim_gradient_is_finite_on_equal_flat_pictures():
    a = torch.zeros(3, 12, 12, requires_grad=True)
    ssim(a, torch.zeros(3, 12, 12)).backward()
    assert a.grad is not None
    assert a.grad.isfinite().all()


@pytest.mark.parametrize("metric", [mse, psnr, ssim])
@pytest.mark.parametrize("dtype", [torch.float16, torch.bfloat16])
def test_half_precision_is_computed_in_float32(metric, dtype):
    a, b = (t.to(dtype) for t in pair((3, 24, 24), dtype=torch.float32))
    assert metric(a, b).item() == pytest.approx(metric(a.double(), b.double()).item(), rel=1e-4)


@pytest.mark.parametrize("metric", [mse, psnr, ssim])
@pytest.mark.parametrize("shapes", [((3, 8, 8), (1, 8, 8)), ((8, 8), (8, 8)), ((3, 0, 8), (3, 0, 8))])
def test_shapes_that_do_not_match_are_refused(metric, shapes):
    with pytest.raises(ValueError, match="one shape"):
        metric(*map(torch.zeros, shapes))


@pytest.mark.parametrize("window", [0, 10, -3])
def test_an_even_window_is_refused(window):
    with pytest.raises(ValueError, match="odd"):
        ssim(torch.zeros(1, 8, 8), torch.zeros(1, 8, 8), window=window)

"""How far two pictures are apart. All take [C, H, W], sRGB-coded 0..1, and return a 0-dimensional tensor.

Half precision is computed in float32 and stays there, for its rounding would drown what is measured.
FLIP, which is longer, is in `flip`.
"""

from __future__ import annotations

from functools import lru_cache

import torch
import torch.nn.functional as F  # noqa: N812
from torch import Tensor

_K1, _K2 = 0.01, 0.03
_SIGMA = 1.5  # pixels


def mse(a: Tensor, b: Tensor) -> Tensor:
    """Mean squared error over all values. Raises ValueError unless both are [C, H, W] alike."""
    a, b = comparable(a, b)
    return (a - b).square().mean()


def psnr(a: Tensor, b: Tensor) -> Tensor:
    """Peak signal-to-noise ratio in dB for a peak of 1; infinite for equal pictures.

    10 log10(1 / MSE). There is no gradient at equality. Raises ValueError unless both are [C, H, W] alike.
    """
    return -10 * torch.log10(mse(a, b))


def ssim(a: Tensor, b: Tensor, window: int = 11) -> Tensor:
    """Mean structural similarity, -1..1, 1 for equal pictures; differentiable.

    Z. Wang, A. C. Bovik, H. R. Sheikh, E. P. Simoncelli, "Image quality assessment: from error visibility to
    structural similarity", IEEE Transactions on Image Processing 13(4), 2004, equation 13 with K1 = 0.01,
    K2 = 0.03, peak 1, and a Gaussian window of standard deviation 1.5 pixels. Averaged over the channels and
    over the pixels around which the window lies wholly inside the picture. Along a side shorter than `window`
    pixels the window shrinks to the largest odd length that fits.

    Raises ValueError unless both are [C, H, W] alike, with at least one pixel, and `window` is odd.
    """
    if window < 1 or window % 2 == 0:
        raise ValueError(f"window must be odd and positive, got {window}")
    a, b = comparable(a, b)
    moments = _local_means(torch.stack([a, b, a * a, b * b, a * b]), window)  # [5, C, H', W']
    mean_a, mean_b, square_a, square_b, product = moments
    variance_a, variance_b = square_a - mean_a * mean_a, square_b - mean_b * mean_b
    covariance = product - mean_a * mean_b
    c1, c2 = _K1**2, _K2**2
    luminance = (2 * mean_a * mean_b + c1) / (mean_a * mean_a + mean_b * mean_b + c1)
    structure = (2 * covariance + c2) / (variance_a + variance_b + c2)
    similarity: Tensor = luminance * structure
    return similarity.mean()


def comparable(a: Tensor, b: Tensor) -> tuple[Tensor, Tensor]:
    """Both in one floating type, float32 at least. Raises ValueError unless both are [C, H, W] alike, not empty."""
    if a.shape != b.shape or a.ndim != 3 or a.numel() == 0:
        raise ValueError(f"need two [C, H, W] of one shape, got {tuple(a.shape)} and {tuple(b.shape)}")
    dtype = torch.promote_types(torch.promote_types(a.dtype, b.dtype), torch.float32)
    return a.to(dtype), b.to(dtype)


def _local_means(stack: Tensor, window: int) -> Tensor:
    """Gaussian-weighted means of [N, C, H, W] over every window that lies inside."""
    n, c, height, width = stack.shape
    down, across = (_window_on(stack.device, stack.dtype, side, window) for side in (height, width))
    planes = stack.reshape(n * c, 1, height, width)
    means = F.conv2d(F.conv2d(planes, down.view(1, 1, -1, 1)), across.view(1, 1, 1, -1))
    return means.view(n, c, *means.shape[2:])


@lru_cache(maxsize=16)
def _window_on(device: torch.device, dtype: torch.dtype, side: int, window: int) -> Tensor:
    return gaussian_window(side, window).to(device, dtype)


def gaussian_window(side: int, window: int = 11) -> Tensor:
    """Weights that sum to 1, float64, for a picture of `side` pixels: as many as fit, an odd number."""
    length = min(window, side - 1 + side % 2)
    offset = torch.arange(length, dtype=torch.float64) - length // 2
    weights = torch.exp(-0.5 * (offset / _SIGMA).square())
    return weights / weights.sum()

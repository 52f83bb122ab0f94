"""Structural similarity with its derivative, in loops that vectorise.

Rows are long and contiguous: every pass adds shifted rows, weighted by the window.
"""

import numpy as np

from ..kernel_cache import inlined, kernel
from ..lower.numba_math import TWO, f32

C1, C2 = f32(0.01**2), f32(0.03**2)


@inlined
def smooth(source, across, down, rows, out):
    """out = source filtered by both windows, where they fit; `rows` is scratch."""
    for y in range(source.shape[0]):
        rows[y, :] = f32(0)
        for k in range(across.size):
            for x in range(rows.shape[1]):
                rows[y, x] += across[k] * source[y, x + k]
    for y in range(out.shape[0]):
        out[y, :] = f32(0)
        for k in range(down.size):
            for x in range(out.shape[1]):
                out[y, x] += down[k] * rows[y + k, x]


@inlined
def spread(source, across, down, rows, out):
    """The transpose of `smooth`: out = what every pixel gave to source."""
    rows[:] = f32(0)
    for y in range(source.shape[0]):
        for k in range(down.size):
            for x in range(source.shape[1]):
                rows[y + k, x] += down[k] * source[y, x]
    for y in range(out.shape[0]):
        out[y, :] = f32(0)
        for k in range(across.size):
            for x in range(rows.shape[1]):
                out[y, x + k] += across[k] * rows[y, x]


@kernel
def local_means(source, across, down):
    """The means of one channel over all places of the window."""
    rows = np.empty((source.shape[0], source.shape[1] - across.size + 1), f32)
    out = np.empty((source.shape[0] - down.size + 1, rows.shape[1]), f32)
    smooth(source, across, down, rows, out)
    return out


@kernel
def similarity(a, b, mean_b, square_b, across, down, grad):
    """Σ SSIM of one channel over all places of the window; `grad` becomes its derivative by a."""
    height, width = a.shape
    rows = np.empty((height, width - across.size + 1), f32)
    mean, square, product = np.empty_like(mean_b), np.empty_like(mean_b), np.empty_like(mean_b)
    work = np.empty_like(a)
    smooth(a, across, down, rows, mean)
    work[:] = a * a
    smooth(work, across, down, rows, square)
    work[:] = a * b
    smooth(work, across, down, rows, product)
    total = 0.0
    for y in range(mean.shape[0]):
        line = f32(0)
        for x in range(mean.shape[1]):
            m, n = mean[y, x], mean_b[y, x]
            a1, a2 = TWO * m * n + C1, TWO * (product[y, x] - m * n) + C2
            b1, b2 = m * m + n * n + C1, (square[y, x] - m * m) + (square_b[y, x] - n * n) + C2
            share = f32(1) / (b1 * b2)
            s = a1 * a2 * share
            line += s
            mean[y, x] = TWO * (n * (a2 - a1) * share - s * m / b1 + s * m / b2)
            square[y, x] = -s / b2
            product[y, x] = TWO * a1 * share
        total += line
    spread(mean, across, down, rows, grad)
    spread(square, across, down, rows, work)
    grad += TWO * a * work
    spread(product, across, down, rows, work)
    grad += b * work
    return total

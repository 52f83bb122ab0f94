"""Structural similarity with its derivative, in loops that vectorise.

Rows are long and contiguous: every pass adds shifted rows, weighted by the window.
"""

from ..kernel_cache import kernel
from ..lower.loops import F32, F64, ONE, TWO, ZERO, f32, inlined

C1, C2 = f32(0.01**2), f32(0.03**2)


@inlined
def smooth(source, across, down, rows, out):
    """out = source filtered by both windows, where they fit; `rows` is scratch."""
    for y in range(source.shape[0]):
        rows[y, :] = ZERO
        for k in range(across.size):
            for x in range(rows.shape[1]):
                rows[y, x] += across[k] * source[y, x + k]
    for y in range(out.shape[0]):
        out[y, :] = ZERO
        for k in range(down.size):
            for x in range(out.shape[1]):
                out[y, x] += down[k] * rows[y + k, x]


@inlined
def spread(source, across, down, rows, out):
    """The transpose of `smooth`: out = what every pixel gave to source."""
    rows[:] = ZERO
    for y in range(source.shape[0]):
        for k in range(down.size):
            for x in range(source.shape[1]):
                rows[y + k, x] += down[k] * source[y, x]
    for y in range(out.shape[0]):
        out[y, :] = ZERO
        for k in range(across.size):
            for x in range(rows.shape[1]):
                out[y, x + k] += across[k] * rows[y, x]


@inlined
def multiply(a, b, out):
    """out = a · b."""
    for y in range(a.shape[0]):
        for x in range(a.shape[1]):
            out[y, x] = a[y, x] * b[y, x]


@inlined
def add_product(weight, a, b, out):
    """out += weight · a · b."""
    for y in range(a.shape[0]):
        for x in range(a.shape[1]):
            out[y, x] += weight * a[y, x] * b[y, x]


@kernel
def local_means(source: F32[2], across: F32[1], down: F32[1], rows: F32[2], out: F32[2]):
    """The means of one channel over all places of the window; `rows` is scratch."""
    smooth(source, across, down, rows, out)


@kernel
def similarity(
    a: F32[2],
    b: F32[2],
    mean_b: F32[2],
    square_b: F32[2],
    across: F32[1],
    down: F32[1],
    work: F32[2],
    rows: F32[2],
    means: F32[3],
    grad: F32[2],
) -> F64:
    """Σ SSIM of one channel over all places of the window; `grad` becomes its derivative by a.

    Scratch: `work` as large as a, `rows` as it is across, three `means` as large as the other one's.
    """
    mean, square, product = means[0], means[1], means[2]
    smooth(a, across, down, rows, mean)
    multiply(a, a, work)
    smooth(work, across, down, rows, square)
    multiply(a, b, work)
    smooth(work, across, down, rows, product)
    total = 0.0
    for y in range(mean.shape[0]):
        line = ZERO
        for x in range(mean.shape[1]):
            m, n = mean[y, x], mean_b[y, x]
            a1, a2 = TWO * m * n + C1, TWO * (product[y, x] - m * n) + C2
            b1, b2 = m * m + n * n + C1, (square[y, x] - m * m) + (square_b[y, x] - n * n) + C2
            share = ONE / (b1 * b2)
            s = a1 * a2 * share
            line += s
            mean[y, x] = TWO * (n * (a2 - a1) * share - s * m / b1 + s * m / b2)
            square[y, x] = -s / b2
            product[y, x] = TWO * a1 * share
        total += line
    spread(mean, across, down, rows, grad)
    spread(square, across, down, rows, work)
    add_product(TWO, a, work, grad)
    spread(product, across, down, rows, work)
    add_product(ONE, b, work, grad)
    return total

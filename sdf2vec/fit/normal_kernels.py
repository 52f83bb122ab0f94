"""Least squares of many candidates for a layer at once: how wrong each is, and the normal equations of a step.

The loops know no formula; what a layer makes of what is below it, and the derivatives of that, are compiled for each
structure (`laying.entries`) and called by their addresses. What is wrong in a channel is `scale` · laid − `offset`.
"""

from ..kernel_cache import kernel
from ..lower.loops import F32, F64, I64, ZERO, call, inlined
from ..render.tiling import PIXELS


@inlined
def dot(a, b):
    """Σ a·b over a block of pixels."""
    total = ZERO
    for i in range(PIXELS):
        total += a[i] * b[i]
    return total


@inlined
def scale_slopes(slopes, free, scale):
    """Those of the free numbers, times what they matter."""
    for f in range(free.size):
        for i in range(PIXELS):
            slopes[free[f], i] *= scale[i]


@kernel
def sum_squares(
    first: I64,
    step: I64,
    laid: F32[3],
    function: I64,
    rows: F32[2],
    x: F32[2],
    y: F32[2],
    below: F32[3],
    which: I64[1],
    scale: F32[4],
    offset: F32[4],
    sums: F64[1],
):
    """Σ wrong² of every step-th candidate; `laid` [step, C, pixels] is scratch."""
    for g in range(first, rows.shape[0], step):
        for block in range(x.shape[0]):
            call(function, (rows[g], 0, PIXELS, x[block], y[block], below[block], laid[first]))
            for c in range(below.shape[1]):
                total = ZERO
                for i in range(PIXELS):
                    wrong = scale[which[g], block, c, i] * laid[first, c, i] - offset[which[g], block, c, i]
                    total += wrong * wrong
                sums[g] += total


@kernel
def add_products(
    first: I64,
    step: I64,
    sloped: F32[3],
    function: I64,
    rows: F32[2],
    x: F32[2],
    y: F32[2],
    below: F32[3],
    which: I64[1],
    scale: F32[4],
    offset: F32[4],
    free: I64[1],
    normal: F64[3],
    right: F64[2],
):
    """Σ slope·slope [G, F, F], below the diagonal and on it, and Σ slope·wrong [G, F] by the free numbers.

    `sloped` [step, C · (1 + numbers), pixels] is scratch.
    """
    channels = below.shape[1]
    numbers = sloped.shape[1] // channels - 1
    for g in range(first, rows.shape[0], step):
        for block in range(x.shape[0]):
            call(function, (rows[g], 0, PIXELS, x[block], y[block], below[block], sloped[first]))
            for c in range(channels):
                slopes, wrong = sloped[first, channels + c * numbers :], sloped[first, c]
                for i in range(PIXELS):
                    wrong[i] = scale[which[g], block, c, i] * wrong[i] - offset[which[g], block, c, i]
                scale_slopes(slopes, free, scale[which[g], block, c])
                for f in range(free.size):
                    right[g, f] += dot(slopes[free[f]], wrong)
                    for e in range(f + 1):
                        normal[g, f, e] += dot(slopes[free[f]], slopes[free[e]])

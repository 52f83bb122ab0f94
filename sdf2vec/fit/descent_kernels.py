"""Least squares of candidates for a layer, each by itself from its start to its end: see `levenberg` for the method.

The loops know no formula; what a layer makes of what is below it, and the derivatives of that, are compiled for each
structure (`laying.entries`) and called by their addresses. What is wrong in a channel is `scale` · laid − `offset`.
"""

from math import floor

from ..kernel_cache import kernel
from ..lower.loops import F32, F64, I64, ZERO, call, f32, inlined
from ..render.tiling import PIXELS
from .levenberg import FAINT, FIRST_DAMPING, HARDLY, LEAST_DAMPED, LESS, MORE, MOST_DAMPED, PATIENCE, TINY
from .normal_kernels import dot

ENOUGH = 1.0 - HARDLY


@inlined
def squares(function, row, x, y, below, scale, offset, laid):
    """Σ wrong² of a candidate."""
    total = 0.0
    for block in range(x.shape[0]):
        call(function, (row, 0, PIXELS, x[block], y[block], below[block], laid))
        for c in range(below.shape[1]):
            line = ZERO
            for i in range(PIXELS):
                wrong = scale[block, c, i] * laid[c, i] - offset[block, c, i]
                line += wrong * wrong
            total += line
    return total


@inlined
def products(function, row, x, y, below, scale, offset, free, sloped, normal, right):
    """Σ slope·slope [F, F], below the diagonal and on it, and Σ slope·wrong [F] by the free numbers."""
    channels = below.shape[1]
    numbers = sloped.shape[0] // channels - 2
    normal[:] = 0.0
    right[:] = 0.0
    for block in range(x.shape[0]):
        call(function, (row, 0, PIXELS, x[block], y[block], below[block], sloped))
        for c in range(channels):
            slopes, wrong = sloped[channels + c * numbers :], sloped[c]
            for i in range(PIXELS):
                wrong[i] = scale[block, c, i] * wrong[i] - offset[block, c, i]
            for f in range(free.size):
                for i in range(PIXELS):
                    slopes[free[f], i] *= scale[block, c, i]
                right[f] += dot(slopes[free[f]], wrong)
                for e in range(f + 1):
                    normal[f, e] += dot(slopes[free[f]], slopes[free[e]])


@inlined
def factorize(normal, damping, longest, factor):
    """Damps the normal equations and finds the factors L·D·Lᵀ of them, D on the diagonal; whether there are any."""
    count, most = longest.size, 0.0
    for f in range(count):
        most = max(most, normal[f, f] * longest[f] * longest[f])
    found = 1
    for f in range(count):
        for e in range(f):
            total = normal[f, e]
            for k in range(e):
                total -= factor[f, k] * factor[e, k] * factor[k, k]
            factor[f, e] = total / factor[e, e]
        left = normal[f, f] + damping * max(normal[f, f], FAINT * most / (longest[f] * longest[f])) + TINY
        for k in range(f):
            left -= factor[f, k] * factor[f, k] * factor[k, k]
        factor[f, f] = left
        found = found if left > 0.0 else 0
    return found


@inlined
def solve(factor, right, way):
    """How far the free numbers are too large, by the factors."""
    count = right.size
    for f in range(count):
        way[f] = right[f]
        for k in range(f):
            way[f] -= factor[f, k] * way[k]
    for f in range(count):
        way[f] = way[f] / factor[f, f]
    for down in range(count):
        last = count - 1 - down
        for k in range(last + 1, count):
            way[last] -= factor[k, last] * way[k]


@inlined
def hold(row, low, high, period, rests, capped, shares):
    """Moves the numbers of a row into their ranges: see `Ranges`."""
    for u in range(low.size):
        value = row[u]
        if period[u] > ZERO:
            row[u] = value - f32(floor(value / period[u])) * period[u]
        else:
            held = min(max(value, low[u]), high[u])
            row[u] = value if rests[u] == 1 and value == ZERO else held
    for k in range(shares.size):
        least = row[capped[k, 1]]
        for other in range(capped[k, 1], capped[k, 2]):
            least = min(least, row[other])
        row[capped[k, 0]] = min(row[capped[k, 0]], shares[k] * least)


@kernel
def hold_rows(
    rows: F32[2],
    low: F32[1],
    high: F32[1],
    period: F32[1],
    rests: I64[1],
    capped: I64[2],
    shares: F32[1],
):
    """Moves the numbers of all rows into their ranges."""
    for g in range(rows.shape[0]):
        hold(rows[g], low, high, period, rests, capped, shares)


@kernel
def lay_rows(
    first: I64,
    step: I64,
    laid: F32[4],
    function: I64,
    rows: F32[2],
    x: F32[2],
    y: F32[2],
    below: F32[3],
):
    """What every step-th candidate makes of what is below it, [G, B, C, pixels]."""
    for g in range(first, rows.shape[0], step):
        for block in range(x.shape[0]):
            call(function, (rows[g], 0, PIXELS, x[block], y[block], below[block], laid[g, block]))


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
        own = which[g]
        sums[g] = squares(function, rows[g], x, y, below, scale[own], offset[own], laid[first])


@kernel
def descend_rows(
    first: I64,
    step: I64,
    sloped: F32[3],
    laid: I64,
    slopes: I64,
    rows: F32[2],
    x: F32[2],
    y: F32[2],
    below: F32[3],
    which: I64[1],
    scale: F32[4],
    offset: F32[4],
    steps: I64,
    free: I64[1],
    longest: F64[1],
    low: F32[1],
    high: F32[1],
    period: F32[1],
    rests: I64[1],
    capped: I64[2],
    shares: F32[1],
    moved: F32[2],
    normal: F64[3],
    factor: F64[3],
    right: F64[2],
    way: F64[2],
    sums: F64[1],
):
    """Every step-th candidate after so many steps down its Σ wrong²; what that is then.

    In `rows` the size of a pixel comes before the numbers, of which `free` move, by `longest` at most in a step. The
    ranges are `Ranges`. `sloped` [step, C · (2 + numbers), pixels], `moved` [step, 1 + numbers], `normal` and `factor`
    [step, F, F], `right` and `way` [step, F] are scratch.
    """
    matrix, factors, sides, ways = normal[first], factor[first], right[first], way[first]
    tried, room = moved[first], sloped[first]
    for g in range(first, rows.shape[0], step):
        row, ours, wanted = rows[g], scale[which[g]], offset[which[g]]
        best = squares(laid, row, x, y, below, ours, wanted, room)
        damping, idle, known = FIRST_DAMPING, 0, 0
        for _ in range(steps):
            if idle < PATIENCE:
                if known == 0:
                    products(slopes, row, x, y, below, ours, wanted, free, room, matrix, sides)
                solved = factorize(matrix, damping, longest, factors)
                solve(factors, sides, ways)
                tried[:] = row
                for f in range(free.size if solved == 1 else 0):
                    tried[1 + free[f]] -= min(max(ways[f], -longest[f]), longest[f])
                hold(tried[1:], low, high, period, rests, capped, shares)
                found = squares(laid, tried, x, y, below, ours, wanted, room)
                idle = 0 if found < ENOUGH * best else idle + 1
                known = 0 if found < best else 1
                damping = (
                    max(LESS * damping, LEAST_DAMPED) if known == 0 else min(MORE * damping, MOST_DAMPED)
                )
                if known == 0:
                    row[:] = tried
                    best = found
        sums[g] = best

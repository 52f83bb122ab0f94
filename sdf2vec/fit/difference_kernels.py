"""Differences from a picture with their derivatives, in loops that vectorise.

Of premultiplied RGBA they are those on black and on white: else black would be laid where nothing should be.
"""

from ..kernel_cache import kernel
from ..lower.loops import F32, F64, I64, ONE, TWO, ZERO, inlined

COLORS = 3


@inlined
def sign(value):
    return (ONE if value > ZERO else ZERO) - (ONE if value < ZERO else ZERO)


@kernel
def absolute(first: I64, last: I64, render: F32[3], target: F32[3], scale: F32, grad: F32[3]) -> F64:
    """Σ |difference| of some rows; `grad` becomes its derivative by the render there, times `scale`."""
    total = 0.0
    for y in range(first, last):
        line = ZERO
        for c in range(COLORS):
            for x in range(render.shape[2]):
                wrong = render[c, y, x] - target[c, y, x]
                line += max(wrong, -wrong)
                grad[c, y, x] = sign(wrong) * scale
        if render.shape[0] > COLORS:
            grad[COLORS, y, :] = ZERO
            for c in range(COLORS):
                for x in range(render.shape[2]):
                    clear = render[COLORS, y, x] - target[COLORS, y, x]
                    wrong = render[c, y, x] - target[c, y, x] - clear
                    line += max(wrong, -wrong)
                    slope = sign(wrong) * scale
                    grad[c, y, x] += slope
                    grad[COLORS, y, x] += -slope
        total += line
    return total


@kernel
def squared(first: I64, last: I64, render: F32[3], target: F32[3], scale: F32, grad: F32[3]) -> F64:
    """Σ difference² of some rows; `grad` becomes its derivative by the render there, times `scale`."""
    total = 0.0
    for y in range(first, last):
        line = ZERO
        for c in range(COLORS):
            for x in range(render.shape[2]):
                wrong = render[c, y, x] - target[c, y, x]
                line += wrong * wrong
                grad[c, y, x] = TWO * wrong * scale
        if render.shape[0] > COLORS:
            grad[COLORS, y, :] = ZERO
            for c in range(COLORS):
                for x in range(render.shape[2]):
                    clear = render[COLORS, y, x] - target[COLORS, y, x]
                    wrong = render[c, y, x] - target[c, y, x] - clear
                    line += wrong * wrong
                    slope = TWO * wrong * scale
                    grad[c, y, x] += slope
                    grad[COLORS, y, x] += -slope
        total += line
    return total

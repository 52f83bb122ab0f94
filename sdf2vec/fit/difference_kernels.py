"""Differences from a picture with their derivatives, in loops that vectorise."""

from ..kernel_cache import kernel
from ..lower.loops import F32, F64, I64, ONE, TWO, ZERO, inlined

COLORS = 3


@inlined
def amount(wrong, linear, square):
    return linear * max(wrong, -wrong) + square * wrong * wrong


@inlined
def slope(wrong, linear, square, scale):
    sign = (ONE if wrong > ZERO else ZERO) - (ONE if wrong < ZERO else ZERO)
    return (linear * sign + square * TWO * wrong) * scale


@kernel
def differences(
    first: I64,
    last: I64,
    render: F32[3],
    target: F32[3],
    linear: F32,
    square: F32,
    scale: F32,
    grad: F32[3],
) -> F64:
    """Σ linear · |difference| + square · difference² of some rows; `grad` becomes its derivative by the render there,
    times `scale`.

    Of premultiplied RGBA the differences are those on black and on white: else black would be laid where nothing
    should be.
    """
    total = 0.0
    for y in range(first, last):
        line = ZERO
        for c in range(COLORS):
            for x in range(render.shape[2]):
                wrong = render[c, y, x] - target[c, y, x]
                line += amount(wrong, linear, square)
                grad[c, y, x] = slope(wrong, linear, square, scale)
        if render.shape[0] > COLORS:
            grad[COLORS, y, :] = ZERO
            for c in range(COLORS):
                for x in range(render.shape[2]):
                    clear = render[COLORS, y, x] - target[COLORS, y, x]
                    wrong = render[c, y, x] - target[c, y, x] - clear
                    line += amount(wrong, linear, square)
                    more = slope(wrong, linear, square, scale)
                    grad[c, y, x] += more
                    grad[COLORS, y, x] += -more
        total += line
    return total

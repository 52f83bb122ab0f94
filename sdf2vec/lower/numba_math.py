"""The functions of a float32 that generated kernels call, in arithmetic that LLVM vectorises."""

import numpy as np

from ..kernel_cache import inlined

f32, i32 = np.float32, np.int32
ZERO, HALF, ONE, TWO = f32(0), f32(0.5), f32(1), f32(2)
QUARTER, LEAST = f32(1.5707963267948966), f32(1e-30)  # of a turn; what a logarithm takes for 0

# --- sigmoid: a rational hyperbolic tangent -----------------------------------------------------------------

SPAN = f32(7.90531110763549805)  # beyond it the tangent is 1
T0, T1, T2, T3, T4, T5, T6 = map(
    f32,
    (
        4.89352455891786e-03,
        6.37261928875436e-04,
        1.48572235717979e-05,
        5.12229709037114e-08,
        -8.60467152213735e-11,
        2.00018790482477e-13,
        -2.76076847742355e-16,
    ),
)
B0, B1, B2, B3 = map(
    f32, (4.89352518554385e-03, 2.26843463243900e-03, 1.18534705686654e-04, 1.19825839466702e-06)
)


@inlined
def fast_sigmoid(x):
    """A rational tanh of degrees 13 and 6, accurate to a few units in the last place."""
    t = HALF * x
    t = SPAN if t > SPAN else t
    t = -SPAN if t < -SPAN else t
    q = t * t
    p = t * (T0 + q * (T1 + q * (T2 + q * (T3 + q * (T4 + q * (T5 + q * T6))))))
    return HALF + HALF * p / (B0 + q * (B1 + q * (B2 + q * B3)))


# --- sine ---------------------------------------------------------------------------------------------------

TURN, TURN_HIGH, TURN_LOW = f32(0.15915494309189535), f32(6.28125), f32(0.0019353071795864769)
PI = f32(3.141592653589793)
S3, S5, S7, S9, S11 = f32(-1 / 6), f32(1 / 120), f32(-1 / 5040), f32(1 / 362880), f32(-1 / 39916800)


@inlined
def fast_sin(x):
    """Sine by reduction to half a turn and a polynomial of degree 11."""
    k = np.floor(x * TURN + HALF)
    r = (x - k * TURN_HIGH) - k * TURN_LOW
    r = PI - r if r > QUARTER else r
    r = -PI - r if r < -QUARTER else r
    q = r * r
    return r * (ONE + q * (S3 + q * (S5 + q * (S7 + q * (S9 + q * S11)))))


# --- exponential and logarithm: a float32 is m · 2ⁿ, and its bits are those of n and of m ---------------------

MANTISSA, BIAS = i32(23), i32(127)  # bits of m; what is added to n
ROOT_HALF = i32(0x3F3504F3)  # bits of √½
LN2, LOG2_E = f32(0.6931471805599453), f32(1.4426950408889634)
LOWEST, HIGHEST = f32(-87), f32(88)
E2, E3, E4, E5, E6 = f32(1 / 2), f32(1 / 6), f32(1 / 24), f32(1 / 120), f32(1 / 720)
L3, L5, L7, L9 = f32(1 / 3), f32(1 / 5), f32(1 / 7), f32(1 / 9)


@inlined
def fast_exp(x):
    """Exponential by a polynomial of degree 6 on ±ln √2 and a power of 2; constant below −87 and above 88."""
    x = LOWEST if x < LOWEST else x
    x = HIGHEST if x > HIGHEST else x
    n = np.floor(x * LOG2_E + HALF)
    r = x - n * LN2
    power = i32((i32(n) + BIAS) << MANTISSA).view(f32)
    return power * (ONE + r * (ONE + r * (E2 + r * (E3 + r * (E4 + r * (E5 + r * E6))))))


@inlined
def fast_log(x):
    """Natural logarithm by the series of the inverse hyperbolic tangent; for x below 1e-30, of that."""
    x = max(x, LEAST)
    bits = f32(x).view(i32)
    n = i32(i32(bits - ROOT_HALF) >> MANTISSA)
    m = i32(bits - i32(n << MANTISSA)).view(f32)  # in √½..√2
    s = (m - ONE) / (m + ONE)
    q = s * s
    return f32(n) * LN2 + TWO * s * (ONE + q * (L3 + q * (L5 + q * (L7 + q * L9))))

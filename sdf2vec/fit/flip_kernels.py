"""FLIP with its derivative, in loops that vectorise; compiled by `fit.flip`, which see for the constants.

Three passes over the rows, each needs all rows of the one before: filters across; filters down, error of each
pixel and its derivative by what the filters gave; the same filters backwards. Filters go by whole rows: shifted
ones are added up. Pixels go by blocks, whose values lie in one array at fixed distances, so that LLVM knows them
to be apart.
"""

import numpy as np
from llvmlite import ir
from numba import njit, types
from numba.extending import intrinsic

f32 = np.float32
SAME = {"fastmath": {"reassoc", "nsz", "arcp", "contract", "afn"}, "error_model": "numpy", "nogil": True}
# inlined, and only what is called from outside is kept on disk: see `lower.numba`
OPTIONS, ENTRY = {**SAME, "forceinline": True}, {**SAME, "cache": CACHE}  # noqa: F821 (filled in when compiled)
ZERO, HALF, ONE, TWO, THREE, FIVE = f32(0), f32(0.5), f32(1), f32(2), f32(3), f32(5)
BLOCK = 256
# Of a block's values: what the filters gave, then the target's.
L, A, B, EDGE, POINT, VALUES = 8 * BLOCK, 9 * BLOCK, 10 * BLOCK, 11 * BLOCK, 12 * BLOCK, 13 * BLOCK


@njit(**OPTIONS)
def add(weight, source, out):
    """out += weight · source."""
    for x in range(out.size):
        out[x] += weight * source[x]


# --- powers that vectorise ----------------------------------------------------------------------------------

INT = ir.IntType(32)
ROOT_HALF = INT(0x3F3504F3)  # bits of √½
LN2, LOG2_E = f32(0.6931471805599453), f32(1.4426950408889634)
L3, L5, L7, L9 = f32(1 / 3), f32(1 / 5), f32(1 / 7), f32(1 / 9)
E2, E3, E4, E5, E6 = f32(1 / 2), f32(1 / 6), f32(1 / 24), f32(1 / 120), f32(1 / 720)


@intrinsic
def exponent(context, x):
    """n of x = m · 2ⁿ with m in √½..√2, as a float."""

    def generate(context, builder, signature, arguments):
        bits = builder.bitcast(arguments[0], INT)
        return builder.sitofp(builder.ashr(builder.sub(bits, ROOT_HALF), INT(23)), ir.FloatType())

    return types.float32(types.float32), generate


@intrinsic
def mantissa(context, x):
    """m of x = m · 2ⁿ with m in √½..√2."""

    def generate(context, builder, signature, arguments):
        bits = builder.bitcast(arguments[0], INT)
        power = builder.ashr(builder.sub(bits, ROOT_HALF), INT(23))
        return builder.bitcast(builder.sub(bits, builder.shl(power, INT(23))), ir.FloatType())

    return types.float32(types.float32), generate


@intrinsic
def two_to_the(context, n):
    """2ⁿ for a whole n, given as a float."""

    def generate(context, builder, signature, arguments):
        power = builder.add(builder.fptosi(arguments[0], INT), INT(127))
        return builder.bitcast(builder.shl(power, INT(23)), ir.FloatType())

    return types.float32(types.float32), generate


@njit(**OPTIONS)
def fast_log(x):
    """Natural logarithm of x > 0, by the series of the inverse hyperbolic tangent."""
    m = mantissa(x)
    s = (m - ONE) / (m + ONE)
    q = s * s
    return exponent(x) * LN2 + TWO * s * (ONE + q * (L3 + q * (L5 + q * (L7 + q * L9))))


@njit(**OPTIONS)
def fast_exp(x):
    """Exponential, for x in ±87."""
    n = np.floor(x * LOG2_E + HALF)
    r = x - n * LN2
    return two_to_the(n) * (ONE + r * (ONE + r * (E2 + r * (E3 + r * (E4 + r * (E5 + r * E6))))))


# --- first pass ---------------------------------------------------------------------------------------------

LINEAR_UNTIL, LINEAR_SLOPE = f32(0.04045), f32(1 / 12.92)
CODE_OFFSET, CODE_SCALE, GAMMA = f32(0.055), f32(1 / 1.055), f32(2.4)


@njit(**OPTIONS)
def linearise(coded, linear, slopes):
    """Linear values of clamped sRGB-coded ones; slopes as of those not clamped."""
    for x in range(coded.size):
        v = min(max(coded[x], ZERO), ONE)
        above = (max(v, LINEAR_UNTIL) + CODE_OFFSET) * CODE_SCALE
        power = fast_exp(GAMMA * fast_log(above))
        linear[x] = power if v > LINEAR_UNTIL else v * LINEAR_SLOPE
        slopes[x] = GAMMA * CODE_SCALE * power / above if v > LINEAR_UNTIL else LINEAR_SLOPE


@njit(**ENTRY)
def filter_across(first, last, image, to_planes, across, planes, slopes):
    """What the filters give of an image along its rows; and the slopes of its linear values."""
    width = image.shape[2]
    reach = across.shape[1] // 2
    linear = np.empty((3, width + 2 * reach), f32)
    line = np.empty(width + 2 * reach, f32)
    for y in range(first, last):
        for c in range(3):
            linearise(image[c, y], linear[c, reach : reach + width], slopes[c, y])
            linear[c, :reach] = linear[c, reach]
            linear[c, reach + width :] = linear[c, reach + width - 1]
        for i in range(len(planes)):
            line[:] = ZERO
            for c in range(3):
                add(to_planes[i, c], linear[c], line)
            out = planes[i, y]
            out[:] = ZERO
            for k in range(across.shape[1]):
                add(across[i, k], line[k : k + width], out)
    return 0.0


# --- second pass --------------------------------------------------------------------------------------------


@njit(**ENTRY)
def compare(first, last, planes, down, to_rgb, to_xyz, target, numbers, seeds):
    """Σ error of these rows; `seeds` becomes its derivative by what the filters give."""
    height, width = planes.shape[1:]
    reach = down.shape[1] // 2
    values = np.empty(VALUES, f32)
    total = 0.0
    for y in range(first, last):
        for left in range(0, width, BLOCK):
            size = min(BLOCK, width - left)
            for i in range(len(planes)):
                out = values[i * BLOCK : i * BLOCK + size]
                out[:] = ZERO
                for k in range(down.shape[1]):
                    row = planes[i, min(max(y + k - reach, 0), height - 1)]
                    add(down[i, k], row[left : left + size], out)
            for i in range(5):
                values[L + i * BLOCK : L + i * BLOCK + size] = target[i, y, left : left + size]
            total += compare_pixels(np.uint64(size), values, to_rgb, to_xyz, numbers)
            for i in range(len(planes)):
                seeds[i, y, left : left + size] = values[i * BLOCK : i * BLOCK + size]
    return total


LIGHTNESS, DARKEST, ROOT_OF_HALF = f32(116), f32(16), f32(0.5**0.5)


@njit(**OPTIONS)
def clamp(x):
    return min(max(x, ZERO), ONE)


@njit(**OPTIONS)
def lab_root(x, numbers):
    """CIELAB's cube root, a line in the dark; and its slope."""
    square = numbers.lab_delta * numbers.lab_delta
    dark, slope = x <= square * numbers.lab_delta, ONE / (THREE * square)
    root = fast_exp(fast_log(max(x, square * numbers.lab_delta)) / THREE)
    return (slope * x + numbers.lab_offset if dark else root), (
        slope if dark else ONE / (THREE * root * root)
    )


@njit(**OPTIONS)
def length(a, b, softness):
    """|(a, b)| rounded at 0, and what its derivative is a multiple of."""
    root = np.sqrt(a * a + b * b + softness * softness)
    return root - softness, ONE / root


@njit(**OPTIONS)
def sign(x):
    return ONE if x > ZERO else (-ONE if x < ZERO else ZERO)


@njit(**OPTIONS)
def toe(t, exponent):
    """`flip._toe` where t of the softness is reached, and its slope by t."""
    return t * (TWO - exponent - (ONE - exponent) * t), TWO - exponent - TWO * (ONE - exponent) * t


@njit(**OPTIONS)
def soft_power(x, exponent, softness):
    """`flip._power` and its slope."""
    least = max(x, softness)
    powered = fast_exp(exponent * fast_log(least))
    bend, rise = toe(min(x / softness, ONE), exponent)
    return powered * bend, powered * rise / least


@njit(**OPTIONS)
def final_error(distance, q, numbers):
    """The error of a colour distance and q = 1 − feature error; its derivatives by both."""
    least = max(distance, numbers.color_softness)
    powered = fast_exp(numbers.color_exponent * fast_log(least))
    near = powered < numbers.turn
    slope = numbers.steep if near else numbers.flat
    color = slope * powered if near else numbers.turning_error + (powered - numbers.turn) * slope
    log_color = fast_log(color)
    base = fast_exp(q * log_color)
    t = min(distance / numbers.color_softness, ONE)
    bend, rise = toe(t, numbers.color_exponent * q)
    by_distance = base * rise * slope * powered / (color * least)
    return base * bend, by_distance, base * (log_color * bend - numbers.color_exponent * t * (ONE - t))


@njit(**OPTIONS)
def compare_pixels(size, v, to_rgb, to_xyz, numbers):
    """Σ error of a block; what the filters gave is replaced by the derivatives. See `flip.error`."""
    m, w = to_rgb, to_xyz
    total = ZERO
    for i in range(np.uint64(0), size):
        cz = v[i + 2 * BLOCK] + v[i + 3 * BLOCK]
        r = clamp(m[0, 0] * v[i] + m[0, 1] * v[i + BLOCK] + m[0, 2] * cz)
        g = clamp(m[1, 0] * v[i] + m[1, 1] * v[i + BLOCK] + m[1, 2] * cz)
        b = clamp(m[2, 0] * v[i] + m[2, 1] * v[i + BLOCK] + m[2, 2] * cz)
        x, x_slope = lab_root(w[0, 0] * r + w[0, 1] * g + w[0, 2] * b, numbers)
        y, y_slope = lab_root(w[1, 0] * r + w[1, 1] * g + w[1, 2] * b, numbers)
        z, z_slope = lab_root(w[2, 0] * r + w[2, 1] * g + w[2, 2] * b, numbers)

        light, red, yellow = LIGHTNESS * y - DARKEST, FIVE * (x - y), TWO * (y - z)
        dl, da, db = light - v[i + L], light * red - v[i + A], light * yellow - v[i + B]
        chroma, per_chroma = length(da, db, numbers.color_softness)
        edge, per_edge = length(v[i + 4 * BLOCK], v[i + 5 * BLOCK], numbers.feature_softness)
        point, per_point = length(v[i + 6 * BLOCK], v[i + 7 * BLOCK], numbers.feature_softness)
        edge, point = edge - v[i + EDGE], point - v[i + POINT]
        feature = max(abs(edge), abs(point)) * ROOT_OF_HALF
        feature, feature_slope = soft_power(feature, numbers.feature_exponent, numbers.feature_softness)
        value, by_distance, by_q = final_error(abs(dl) + chroma, ONE - feature, numbers)
        total += value

        by_l, by_a, by_b = (
            by_distance * sign(dl),
            by_distance * per_chroma * da,
            by_distance * per_chroma * db,
        )
        by_x = FIVE * light * by_a * x_slope
        by_y = LIGHTNESS * (by_l + red * by_a + yellow * by_b) + light * (TWO * by_b - FIVE * by_a)
        by_y, by_z = by_y * y_slope, -TWO * light * by_b * z_slope
        by_r = w[0, 0] * by_x + w[1, 0] * by_y + w[2, 0] * by_z
        by_g = w[0, 1] * by_x + w[1, 1] * by_y + w[2, 1] * by_z
        by_b = w[0, 2] * by_x + w[1, 2] * by_y + w[2, 2] * by_z
        v[i] = m[0, 0] * by_r + m[1, 0] * by_g + m[2, 0] * by_b
        v[i + BLOCK] = m[0, 1] * by_r + m[1, 1] * by_g + m[2, 1] * by_b
        by_cz = m[0, 2] * by_r + m[1, 2] * by_g + m[2, 2] * by_b
        v[i + 2 * BLOCK], v[i + 3 * BLOCK] = by_cz, by_cz
        by_feature = -by_q * feature_slope * ROOT_OF_HALF
        by_edge = by_feature * sign(edge) * per_edge if abs(edge) >= abs(point) else ZERO
        by_point = ZERO if abs(edge) >= abs(point) else by_feature * sign(point) * per_point
        v[i + 4 * BLOCK] *= by_edge
        v[i + 5 * BLOCK] *= by_edge
        v[i + 6 * BLOCK] *= by_point
        v[i + 7 * BLOCK] *= by_point
    return total


# --- third pass ---------------------------------------------------------------------------------------------


@njit(**ENTRY)
def carry_back(first, last, seeds, to_planes, across, down, slopes, grad):
    """The derivative by the image, of that by what the filters give."""
    height, width = seeds.shape[1:]
    reach = across.shape[1] // 2
    row, line = np.empty(width, f32), np.empty(width + 2 * reach, f32)
    linear = np.empty((3, width + 2 * reach), f32)
    for y in range(first, last):
        linear[:] = ZERO
        for i in range(len(seeds)):
            row[:] = ZERO
            for above in range(max(0, y - reach), min(height, y + reach + 1)):
                for k in range(down.shape[1]):
                    if min(max(above + k - reach, 0), height - 1) == y:
                        add(down[i, k], seeds[i, above], row)
            line[:] = ZERO
            for k in range(across.shape[1]):
                add(across[i, k], row, line[k : k + width])
            for c in range(3):
                add(to_planes[i, c], line, linear[c])
        for c in range(3):
            linear[c, reach] += linear[c, :reach].sum()
            linear[c, reach + width - 1] += linear[c, reach + width :].sum()
            grad[c, y] = linear[c, reach : reach + width] * slopes[c, y]
    return 0.0

"""FLIP with its derivative, in loops that vectorise: the filters by hand, what happens at a pixel generated.

Three passes over the rows, each needs all rows of the one before: filters across; filters down, error of each
pixel and its derivative by what the filters gave; the same filters backwards. Filters go by whole rows: shifted
ones are added up, `TAPS` at a time, since sums that go back to memory after each cost more than the products. Pixels go
by blocks, whose values lie in one array of a fixed size, so that LLVM knows them to be apart.
"""

from .. import flip
from ..graph import gradient
from ..kernel_cache import Assembly, kernel
from ..lower.block import Block
from ..lower.llvm import assembled, forward
from ..lower.loops import F32, F64, I64, ZERO, call, empty, inlined

BLOCK = 256  # pixels
TAPS = 7  # of a filter, a third of all of them
ROWS = 22  # of a block: what the filters gave, the target's look; the error, its derivatives by the former
LOOK, ERROR, BY_PLANES = 8, 13, 14


def _formulas():
    """`linearise` and `compare`: what `flip` says of a pixel, and its derivatives."""
    light = flip.linear(flip.CODED)
    error = flip.difference(flip.seen(flip.PLANES, flip.SOFTNESS[1]), flip.OTHER_LOOK, *flip.SOFTNESS)
    varying, outputs = (*flip.PLANES, *flip.OTHER_LOOK), (error, *gradient(error, flip.PLANES))
    linearise = Block("linearise", (light, *gradient(light, (flip.CODED,))), (flip.CODED,), ())
    compare = Block("compare", outputs, varying, flip.SOFTNESS)
    planes = {"coded": 1, "light": 1, "slope": 1}
    return Assembly(assembled([forward(linearise, planes, BLOCK), forward(compare, {"rows": ROWS}, BLOCK)]))


FORMULAS = _formulas()
LINEARISE, COMPARE = FORMULAS["linearise"], FORMULAS["compare"]


@inlined
def add(weight, source, out):
    """out += weight · source."""
    for x in range(out.size):
        out[x] += weight * source[x]


@inlined
def add_taps(weights, source, out):
    """out[x] += Σ weights[k] · source[x + k]"""
    many = weights.size - weights.size % TAPS
    for k in range(0, many, TAPS):
        for x in range(out.size):
            out[x] += (
                weights[k] * source[x + k]
                + weights[k + 1] * source[x + k + 1]
                + weights[k + 2] * source[x + k + 2]
                + weights[k + 3] * source[x + k + 3]
                + weights[k + 4] * source[x + k + 4]
                + weights[k + 5] * source[x + k + 5]
                + weights[k + 6] * source[x + k + 6]
            )
    for k in range(many, weights.size):
        add(weights[k], source[k : k + out.size], out)


@inlined
def within(y, height):
    """The row that stands for one that may lie outside."""
    return min(max(y, 0), height - 1)


@inlined
def add_rows(weights, plane, y, left, out):
    """out[x] += Σ weights[k] · plane[y + k, left + x], the edge repeated outside"""
    height = plane.shape[0]
    many = weights.size - weights.size % TAPS
    for k in range(0, many, TAPS):
        a, b, c = within(y + k, height), within(y + k + 1, height), within(y + k + 2, height)
        d, e, f = within(y + k + 3, height), within(y + k + 4, height), within(y + k + 5, height)
        g = within(y + k + 6, height)
        for x in range(out.size):
            out[x] += (
                weights[k] * plane[a, left + x]
                + weights[k + 1] * plane[b, left + x]
                + weights[k + 2] * plane[c, left + x]
                + weights[k + 3] * plane[d, left + x]
                + weights[k + 4] * plane[e, left + x]
                + weights[k + 5] * plane[f, left + x]
                + weights[k + 6] * plane[g, left + x]
            )
    for k in range(many, weights.size):
        add(weights[k], plane[within(y + k, height), left : left + out.size], out)


# --- first pass ---------------------------------------------------------------------------------------------


@kernel
def filter_across(
    first: I64,
    last: I64,
    linearise: I64,
    image: F32[3],
    opponents: I64[1],
    to_opponent: F32[2],
    across: F32[2],
    linear: F32[3],
    opposed: F32[3],
    planes: F32[3],
    slopes: F32[3],
):
    """What the filters give of an image along its rows; and the slopes of its linear values.

    Scratch for each row: `linear` of three channels and `opposed`, with room for the filters at both ends.
    """
    width = image.shape[2]
    reach = across.shape[1] // 2
    for y in range(first, last):
        lights, rows = linear[y], opposed[y]
        for c in range(3):
            inside = lights[c, reach : reach + width]
            call(linearise, (rows, 0, width, image[c, y], inside, slopes[c, y]))
            lights[c, :reach] = lights[c, reach]
            lights[c, reach + width :] = lights[c, reach + width - 1]
        for o in range(3):
            rows[o, :] = ZERO
            for c in range(3):
                add(to_opponent[o, c], lights[c], rows[o])
        for i in range(len(planes)):
            out = planes[i, y]
            out[:] = ZERO
            add_taps(across[i], rows[opponents[i]], out)


# --- second pass --------------------------------------------------------------------------------------------


@kernel
def compare(
    first: I64,
    last: I64,
    formula: I64,
    planes: F32[3],
    down: F32[2],
    target: F32[3],
    softness: F32[1],
    seeds: F32[3],
) -> F64:
    """Σ error of these rows; `seeds` becomes its derivative by what the filters give."""
    width = planes.shape[2]
    reach = down.shape[1] // 2
    rows = empty(ROWS, BLOCK)
    total = 0.0
    for y in range(first, last):
        for left in range(0, width, BLOCK):
            size = min(BLOCK, width - left)
            for i in range(LOOK):
                out = rows[i, :size]
                out[:] = ZERO
                add_rows(down[i], planes[i], y - reach, left, out)
            for i in range(LOOK, ERROR):
                rows[i, :size] = target[i - LOOK, y, left : left + size]
            call(formula, (softness, 0, size, rows))
            some = ZERO
            for x in range(size):
                some += rows[ERROR, x]
            total += some
            for i in range(LOOK):
                seeds[i, y, left : left + size] = rows[BY_PLANES + i, :size]
    return total


# --- third pass ---------------------------------------------------------------------------------------------


@inlined
def gather(y, down, backwards, seeds, row):
    """row = what the filter down has taken from row y, for all rows; `backwards` is that filter, turned round."""
    height, reach = seeds.shape[0], down.size // 2
    row[:] = ZERO
    if y >= reach and y + reach < height:
        add_rows(backwards, seeds, y - reach, 0, row)
    else:
        for above in range(max(0, y - reach), min(height, y + reach + 1)):
            for k in range(down.size):
                if within(above + k - reach, height) == y:
                    add(down[k], seeds[above], row)


@kernel
def carry_back(
    first: I64,
    last: I64,
    seeds: F32[3],
    opponents: I64[1],
    to_opponent: F32[2],
    across: F32[2],
    down: F32[2],
    backwards: F32[2],
    slopes: F32[3],
    linear: F32[3],
    opposed: F32[3],
    wide: F32[2],
    grad: F32[3],
):
    """The derivative by the image, of that by what the filters give.

    `backwards`: the filters down, turned round; `across` are turned round already. Scratch as in `filter_across`, and
    `wide`, rows with zeros at both ends, as many as a filter is long less one.
    """
    width = seeds.shape[2]
    reach = across.shape[1] // 2
    for y in range(first, last):
        lights, rows, padded = linear[y], opposed[y], wide[y]
        row = padded[2 * reach : 2 * reach + width]
        rows[:] = ZERO
        for i in range(len(seeds)):
            gather(y, down[i], backwards[i], seeds[i], row)
            add_taps(across[i], padded, rows[opponents[i]])
        for c in range(3):
            lights[c, :] = ZERO
            for o in range(3):
                add(to_opponent[o, c], rows[o], lights[c])
            for x in range(reach):
                lights[c, reach] += lights[c, x]
                lights[c, reach + width - 1] += lights[c, reach + width + x]
            for x in range(width):
                grad[c, y, x] = lights[c, reach + x] * slopes[c, y, x]

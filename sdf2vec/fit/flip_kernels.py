"""FLIP with its derivative, in loops that vectorise: the filters by hand, what happens at a pixel generated.

Three passes over the rows, each needs all rows of the one before: filters across; filters down, error of each
pixel and its derivative by what the filters gave; the same filters backwards. Filters go by whole rows: shifted
ones are added up. Pixels go by blocks, whose values lie in one array of a fixed size, so that LLVM knows them to be
apart.
"""

from .. import flip
from ..graph import gradient
from ..kernel_cache import Assembly, kernel
from ..lower.block import Block
from ..lower.llvm import assembled, forward
from ..lower.loops import F32, F64, I64, ZERO, call, empty, inlined

BLOCK = 256  # pixels
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


# --- first pass ---------------------------------------------------------------------------------------------


@kernel
def filter_across(
    first: I64,
    last: I64,
    linearise: I64,
    image: F32[3],
    to_planes: F32[2],
    across: F32[2],
    linear: F32[3],
    line: F32[2],
    planes: F32[3],
    slopes: F32[3],
):
    """What the filters give of an image along its rows; and the slopes of its linear values.

    Scratch for each row: `linear` of three channels and `line`, with room for the filters at both ends.
    """
    width = image.shape[2]
    reach = across.shape[1] // 2
    for y in range(first, last):
        lights, row = linear[y], line[y]
        for c in range(3):
            inside = lights[c, reach : reach + width]
            call(linearise, (row, 0, width, image[c, y], inside, slopes[c, y]))
            lights[c, :reach] = lights[c, reach]
            lights[c, reach + width :] = lights[c, reach + width - 1]
        for i in range(len(planes)):
            row[:] = ZERO
            for c in range(3):
                add(to_planes[i, c], lights[c], row)
            out = planes[i, y]
            out[:] = ZERO
            for k in range(across.shape[1]):
                add(across[i, k], row[k : k + width], out)


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
    height, width = planes.shape[1], planes.shape[2]
    reach = down.shape[1] // 2
    rows = empty(ROWS, BLOCK)
    total = 0.0
    for y in range(first, last):
        for left in range(0, width, BLOCK):
            size = min(BLOCK, width - left)
            for i in range(LOOK):
                out = rows[i, :size]
                out[:] = ZERO
                for k in range(down.shape[1]):
                    row = planes[i, min(max(y + k - reach, 0), height - 1)]
                    add(down[i, k], row[left : left + size], out)
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
def gather(y, down, seeds, row):
    """row = what the filter down has taken from row y, for all rows."""
    height, reach = seeds.shape[0], down.size // 2
    row[:] = ZERO
    for above in range(max(0, y - reach), min(height, y + reach + 1)):
        for k in range(down.size):
            if min(max(above + k - reach, 0), height - 1) == y:
                add(down[k], seeds[above], row)


@kernel
def carry_back(
    first: I64,
    last: I64,
    seeds: F32[3],
    to_planes: F32[2],
    across: F32[2],
    down: F32[2],
    slopes: F32[3],
    linear: F32[3],
    line: F32[2],
    grad: F32[3],
):
    """The derivative by the image, of that by what the filters give; scratch as in `filter_across`."""
    width = seeds.shape[2]
    reach = across.shape[1] // 2
    for y in range(first, last):
        lights, out = linear[y], line[y]
        lights[:] = ZERO
        for i in range(len(seeds)):
            row = grad[0, y]
            gather(y, down[i], seeds[i], row)
            out[:] = ZERO
            for k in range(across.shape[1]):
                add(across[i, k], row, out[k : k + width])
            for c in range(3):
                add(to_planes[i, c], out, lights[c])
        for c in range(3):
            for x in range(reach):
                lights[c, reach] += lights[c, x]
                lights[c, reach + width - 1] += lights[c, reach + width + x]
            for x in range(width):
                grad[c, y, x] = lights[c, reach + x] * slopes[c, y, x]

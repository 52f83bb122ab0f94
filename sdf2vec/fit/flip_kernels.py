"""FLIP with its derivative, in loops that vectorise: the filters by hand, what happens at a pixel generated.

Three passes over the rows, each needs all rows of the one before: filters across; filters down, error of each
pixel and its derivative by what the filters gave; the same filters backwards. Filters go by whole rows: shifted
ones are added up. Pixels go by blocks, whose values lie in one array of a fixed size, so that LLVM knows them to be
apart.
"""

import numpy as np

from .. import flip, kernel_cache
from ..graph import gradient
from ..kernel_cache import inlined, kernel
from ..lower.numba import PREAMBLE, Block, forward
from ..lower.numba_math import ZERO, f32

BLOCK = 256  # pixels


def pixels():
    """The text of `linearise` and of `compare_pixels`: what `flip` says of a pixel, and its derivatives."""
    light = flip.linear(flip.CODED)
    error = flip.difference(flip.seen(flip.PLANES, flip.SOFTNESS[1]), flip.OTHER_LOOK, *flip.SOFTNESS)
    varying, outputs = (*flip.PLANES, *flip.OTHER_LOOK), (error, *gradient(error, flip.PLANES))
    rows = ", ".join(f"rows[{i}]" for i in range(len(varying) + len(outputs)))
    return "\n\n".join(
        [
            PREAMBLE,
            forward(Block("linearise", (light, *gradient(light, (flip.CODED,))), (flip.CODED,), ())),
            forward(Block("compare_rows", outputs, varying, flip.SOFTNESS)),
            "@inlined",
            f"def compare_pixels(softness, size, rows):\n    compare_rows(softness, np.uint64(0), size, {rows})",
        ]
    )


GENERATED = kernel_cache.load(pixels())
linearise, compare_pixels = GENERATED.linearise, GENERATED.compare_pixels
ROWS = 22  # of `compare_pixels`: what the filters gave, the target's look; the error, its derivatives by the former
LOOK, ERROR, BY_PLANES = 8, 13, 14


@inlined
def add(weight, source, out):
    """out += weight · source."""
    for x in range(out.size):
        out[x] += weight * source[x]


# --- first pass ---------------------------------------------------------------------------------------------


@kernel
def filter_across(first, last, image, filters, planes, slopes):
    """What the filters give of an image along its rows; and the slopes of its linear values."""
    to_planes, across, _ = filters
    width = image.shape[2]
    reach = across.shape[1] // 2
    linear = np.empty((3, width + 2 * reach), f32)
    line = np.empty(width + 2 * reach, f32)
    for y in range(first, last):
        for c in range(3):
            inside = linear[c, reach : reach + width]
            linearise(inside, np.uint64(0), np.uint64(width), image[c, y], inside, slopes[c, y])
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


@kernel
def compare(first, last, planes, filters, target, softness, seeds):
    """Σ error of these rows; `seeds` becomes its derivative by what the filters give."""
    _, _, down = filters
    height, width = planes.shape[1:]
    reach = down.shape[1] // 2
    rows = np.empty((ROWS, BLOCK), f32)
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
            compare_pixels(softness, np.uint64(size), rows)
            total += rows[ERROR, :size].sum()
            for i in range(LOOK):
                seeds[i, y, left : left + size] = rows[BY_PLANES + i, :size]
    return total


# --- third pass ---------------------------------------------------------------------------------------------


@kernel
def carry_back(first, last, seeds, filters, slopes, grad):
    """The derivative by the image, of that by what the filters give."""
    to_planes, across, down = filters
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

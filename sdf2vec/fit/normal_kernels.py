"""Least squares: the normal equations of whole scenes.

The loops know no formula; what a layer makes of what is below it, and the derivatives of that, are compiled for each
structure (`laying.entries`) and called by their addresses.
"""

from ..kernel_cache import kernel
from ..lower.loops import F32, F64, I32, I64, ZERO, call, f32, inlined
from ..render.tiling import PIXELS, TILE

LEAST_SLOPE = f32(1e-12)  # squares in a tile: what is less changes nothing


@inlined
def dot(a, b):
    """Σ a·b over a block of pixels."""
    total = ZERO
    for i in range(PIXELS):
        total += a[i] * b[i]
    return total


@inlined
def lay_all(entries, kinds, rows, layers, x, y, below, sloped):
    """Lays the layers of a tile on each other: what is below each, then what all make; and the derivatives of each."""
    for place in range(len(layers)):
        layer, made = layers[place], sloped[place]
        call(entries[kinds[layer]], (rows[layer], 0, PIXELS, x, y, below[place], made))
        for c in range(below.shape[1]):
            for i in range(PIXELS):
                below[place + 1, c, i] = made[c, i]


@inlined
def dim_slopes(layers, widths, light, sloped):
    """Makes the derivatives of a tile's layers those of what is seen; leaves what is seen of the ground as `light`."""
    channels = light.shape[0]
    for down in range(len(layers)):
        place = len(layers) - 1 - down
        width = widths[layers[place]]
        for c in range(channels):
            for u in range(width):
                for i in range(PIXELS):
                    sloped[place, channels + c * width + u, i] *= light[c, i]
            for i in range(PIXELS):
                light[c, i] *= sloped[place, channels + channels * width + c, i]


@inlined
def changes(slopes, u, width, channels):
    """Whether a number of a layer changes anything in a tile."""
    total = ZERO
    for c in range(channels):
        plane = slopes[channels + c * width + u]
        total += dot(plane, plane)
    return total > LEAST_SLOPE


@inlined
def list_active(layers, widths, offsets, channels, sloped, active):
    """The numbers that change a tile: which they are, their layer's place, its width, which of it; how many."""
    count = 0
    for place in range(len(layers)):
        layer = layers[place]
        for u in range(widths[layer]):
            if changes(sloped[place], u, widths[layer], channels):
                active[0, count], active[1, count] = offsets[layer] + u, place
                active[2, count], active[3, count] = widths[layer], channels + u
                count += 1
    return count


@inlined
def pool(plane, samples):
    """Puts the mean of each pixel's samples in a tile in the place of the first, and nothing in those of the others."""
    share = f32(1.0) / f32(samples * samples)
    for top in range(0, TILE, samples):
        for left in range(0, TILE, samples):
            total = ZERO
            for down in range(samples):
                for right in range(samples):
                    place = (top + down) * TILE + left + right
                    total += plane[place]
                    plane[place] = ZERO
            plane[top * TILE + left] = total * share


@inlined
def pool_all(wrong, light, slopes, active, count, samples):
    """The same with what is wrong, and the derivatives by the ground and by all numbers that change a tile."""
    if samples > 1:
        for c in range(wrong.shape[0]):
            pool(wrong[c], samples)
            pool(light[c], samples)
            for f in range(count):
                pool(slopes[active[1, f], active[3, f] + c * active[2, f]], samples)


@kernel
def add_scene_products(
    first: I64,
    step: I64,
    entries: I64[1],
    kinds: I64[1],
    widths: I64[1],
    offsets: I64[1],
    rows: F32[2],
    starts: I64[1],
    layers: I32[1],
    x: F32[2],
    y: F32[2],
    target: F32[3],
    weights: F32[2],
    ground: F32[1],
    samples: I64,
    below: F32[4],
    sloped: F32[4],
    active: I64[3],
    normal: F64[3],
    right: F64[2],
):
    """Σ slope·slope [step, N, N], below the diagonal and on it, and Σ slope·wrong [step, N] of every step-th tile, by
    the numbers of all layers and, last, of the ground.

    A tile's layers, in draw order: `layers[starts[tile]:starts[tile + 1]]`. `below` [step, most + 1, C, pixels],
    `sloped` [step, most, C · (numbers + 2), pixels] and `active` [step, 4, numbers] are scratch.
    """
    channels = target.shape[1]
    last = normal.shape[1] - channels
    for tile in range(first, x.shape[0], step):
        own, mixed, slopes = layers[starts[tile] : starts[tile + 1]], below[first], sloped[first]
        light, wrong = mixed[0], mixed[max(len(own), 1)]
        for c in range(channels):
            for i in range(PIXELS):
                light[c, i] = ground[c]
        lay_all(entries, kinds, rows, own, x[tile], y[tile], mixed, slopes)
        for c in range(channels):
            for i in range(PIXELS):
                wrong[c, i] = (mixed[len(own), c, i] - target[tile, c, i]) * weights[tile, i]
                light[c, i] = weights[tile, i]
        dim_slopes(own, widths, light, slopes)
        which, places, breadths, planes = (
            active[first, 0],
            active[first, 1],
            active[first, 2],
            active[first, 3],
        )
        count = list_active(own, widths, offsets, channels, slopes, active[first])
        pool_all(wrong, light, slopes, active[first], count, samples)
        for c in range(channels):
            for f in range(count):
                slope = slopes[places[f], planes[f] + c * breadths[f]]
                right[first, which[f]] += dot(slope, wrong[c])
                normal[first, last + c, which[f]] += dot(slope, light[c])
                for e in range(f + 1):
                    other = slopes[places[e], planes[e] + c * breadths[e]]
                    row, column = max(which[f], which[e]), min(which[f], which[e])
                    normal[first, row, column] += dot(slope, other)
            right[first, last + c] += dot(light[c], wrong[c])
            normal[first, last + c, last + c] += dot(light[c], light[c])

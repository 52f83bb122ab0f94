"""Which layers touch each tile of a canvas, and how tiles are drawn: the compiled loops that know no formula.

What knows one, `kernels` compiles for each structure; it is called by its address.
"""

from math import ceil, floor

from ..kernel_cache import kernel
from ..layer import ROW_OPACITY
from ..lower.loops import F32, F64, I32, I64, ONE, ZERO, call, empty, f32, inlined

TILE = 16  # pixels along a side of a tile, the block that kernels work on
PIXELS = TILE * TILE
CHANNELS = 4  # at most
MIDDLE = f32((TILE - 1) / 2)  # pixels from the first pixel of a tile to its centre
LOW_X, LOW_Y, HIGH_X, HIGH_Y, OUTER, INNER = range(6)  # columns of bounds: `kernels.culling`
DRAW, DRAW_BACKWARD, FILL, FILL_BACKWARD = range(4)  # columns of `kernels.drawing`'s addresses
BOUNDS, DISTANCE = range(2)  # columns of `kernels.measuring`'s


@kernel
def measure_bounds(entries: I64[2], kinds: I64[1], uniforms: F32[2], bounds: F32[2]):
    """The bounds of every layer [L, 6]."""
    for layer in range(kinds.size):
        call(entries[kinds[layer], BOUNDS], (uniforms[layer], bounds[layer]))


@kernel
def find_ranges(
    bounds: F32[2], x: F32[1], y: F32[1], pixel: F32, columns: I64, rows: I64, ranges: I64[2]
) -> I64:
    """The range of tiles that every layer may touch (first and end column, then row); returns how many in all."""
    total, side = 0, TILE * pixel
    for layer in range(bounds.shape[0]):
        b = bounds[layer]
        ranges[layer, 0] = max(0, min(columns, floor((b[LOW_X] - x[0]) / side + f32(0.03))))
        ranges[layer, 1] = max(0, min(rows, floor((b[LOW_Y] - y[0]) / side + f32(0.03))))
        ranges[layer, 2] = max(
            ranges[layer, 0], min(columns, floor((b[HIGH_X] - x[0]) / side + f32(0.01)) + 1)
        )
        ranges[layer, 3] = max(ranges[layer, 1], min(rows, floor((b[HIGH_Y] - y[0]) / side + f32(0.01)) + 1))
        total += (ranges[layer, 2] - ranges[layer, 0]) * (ranges[layer, 3] - ranges[layer, 1])
    return total


@kernel
def list_candidates(
    bounds: F32[2],
    ranges: I64[2],
    x: F32[1],
    y: F32[1],
    pixel: F32,
    columns: I64,
    tiles: I32[1],
    layers: I32[1],
    spans: I32[2],
    centers: F32[2],
) -> I64:
    """Pairs of a layer and a tile in its range, in draw order: the rows of the tile that it may touch, and the tile's
    centre; returns how many."""
    count = 0
    middle = MIDDLE * pixel
    for layer in range(bounds.shape[0]):
        for row in range(ranges[layer, 1], ranges[layer, 3]):
            top = y[row * TILE]
            low = max(0, ceil((bounds[layer, LOW_Y] - top) / pixel - f32(0.01)))
            high = min(TILE, floor((bounds[layer, HIGH_Y] - top) / pixel + f32(0.01)) + 1)
            if low >= high:
                continue
            for column in range(ranges[layer, 0], ranges[layer, 2]):
                tiles[count], layers[count] = row * columns + column, layer
                spans[count, 0], spans[count, 1] = low, high
                centers[count, 0], centers[count, 1] = x[column * TILE] + middle, top + middle
                count += 1
    return count


@kernel
def measure_distances(
    entries: I64[2], kinds: I64[1], uniforms: F32[2], layers: I32[1], points: F32[2], found: F32[1]
):
    """The distance of layer layers[i] at points[i]."""
    for i in range(found.size):
        layer = layers[i]
        call(entries[kinds[layer], DISTANCE], (uniforms[layer], points[i], found[i:]))


@kernel
def keep_touching(
    count: I64, distances: F32[1], bounds: F32[2], tiles: I32[1], layers: I32[1], spans: I32[2]
) -> I64:
    """Keeps, in place, the pairs whose layer covers some of the tile, by its distance at the tile's centre; returns
    how many. Rows become (0, 0) where a layer covers all of the tile."""
    kept = 0
    for i in range(count):
        layer = layers[i]
        if distances[i] < bounds[layer, OUTER]:
            tiles[kept], layers[kept] = tiles[i], layer
            covered = distances[i] < bounds[layer, INNER]
            spans[kept, 0] = 0 if covered else spans[i, 0]
            spans[kept, 1] = 0 if covered else spans[i, 1]
            kept += 1
    return kept


@kernel
def sort_pairs(
    count: I64,
    tiles: I32[1],
    layers: I32[1],
    spans: I32[2],
    starts: I64[1],
    places: I64[1],
    sorted_layers: I32[1],
    sorted_spans: I32[2],
):
    """Groups the pairs by tile, keeping the draw order; `starts` is where each tile's begin, `places` is scratch."""
    for i in range(count):
        starts[tiles[i] + 1] += 1
    for t in range(starts.size - 1):
        starts[t + 1] += starts[t]
    places[:] = starts
    for i in range(count):
        place = places[tiles[i]]
        sorted_layers[place] = layers[i]
        sorted_spans[place, 0], sorted_spans[place, 1] = spans[i, 0], spans[i, 1]
        places[tiles[i]] += 1


@kernel
def reduce_pairs(layers: I32[1], grads: F32[2], totals: F64[2]):
    """Adds the pairs' derivatives up by layer, in a fixed order."""
    for q in range(layers.size):
        for i in range(grads.shape[1]):
            totals[layers[q], i] += grads[q, i]


@kernel
def draw_tiles(
    first: I64,
    step: I64,
    starts: I64[1],
    layers: I32[1],
    spans: I32[2],
    entries: I64[2],
    kinds: I64[1],
    uniforms: F32[2],
    background: F32[1],
    hides: I64,
    x: F32[1],
    y: F32[1],
    columns: I64,
    image: F32[3],
):
    """Draws every step-th tile into image [C, H, W]."""
    px, py, below, kept = empty(PIXELS), empty(PIXELS), empty(CHANNELS, PIXELS), empty(CHANNELS, PIXELS)
    channels = image.shape[0]
    for tile in range(first, starts.size - 1, step):
        top, left = tile // columns * TILE, tile % columns * TILE
        place_pixels(top, left, x, y, px, py)
        fill_tile(channels, background, below)
        start = lowest_visible(starts[tile], starts[tile + 1], layers, spans, uniforms, hides)
        for q in range(start, starts[tile + 1]):
            draw(entries, kinds, uniforms, layers[q], spans[q], px, py, below, kept)
        tile_to_image(top, left, below, image)


@kernel
def draw_tiles_backward(
    first: I64,
    step: I64,
    kept: F32[4],
    starts: I64[1],
    layers: I32[1],
    spans: I32[2],
    entries: I64[2],
    kinds: I64[1],
    uniforms: F32[2],
    background: F32[1],
    hides: I64,
    x: F32[1],
    y: F32[1],
    columns: I64,
    image_cotangent: F32[3],
    grads: F32[2],
    background_grads: F32[2],
):
    """Derivatives of every step-th tile: a row of `grads` per pair. `kept` [step, longest, C, pixels] is scratch."""
    channels = image_cotangent.shape[0]
    px, py, below, cotangent = empty(PIXELS), empty(PIXELS), empty(CHANNELS, PIXELS), empty(CHANNELS, PIXELS)
    for tile in range(first, starts.size - 1, step):
        top, left = tile // columns * TILE, tile % columns * TILE
        place_pixels(top, left, x, y, px, py)
        fill_tile(channels, background, below)
        start, end = starts[tile], starts[tile + 1]
        for q in range(start, end):  # what is hidden too: the derivative by what hides it needs it
            draw(entries, kinds, uniforms, layers[q], spans[q], px, py, below, kept[first, q - start])
        image_to_tile(top, left, image_cotangent, cotangent)
        lowest = lowest_visible(start, end, layers, spans, uniforms, hides)
        for behind in range(end - lowest):
            last = end - 1 - behind
            layer, span = layers[last], spans[last]
            first_pixel, end_pixel = pixels_of(span)
            entry = entries[kinds[layer], FILL_BACKWARD if span[1] == 0 else DRAW_BACKWARD]
            before = kept[first, last - start]
            call(entry, (uniforms[layer], first_pixel, end_pixel, px, py, before, cotangent, grads[last]))
        for c in range(channels):
            for i in range(PIXELS):
                background_grads[tile, c] += cotangent[c, i]


@inlined
def draw(entries, kinds, uniforms, layer, span, px, py, below, kept):
    """Lays a layer on those rows of a tile that it may touch; `kept` takes what was there before."""
    first, last = pixels_of(span)
    entry = entries[kinds[layer], FILL if span[1] == 0 else DRAW]
    call(entry, (uniforms[layer], first, last, px, py, below, kept))


@inlined
def pixels_of(span):
    """From which pixel of a tile to before which a layer may touch it; its span is (0, 0) where it covers all."""
    return span[0] * TILE, PIXELS if span[1] == 0 else span[1] * TILE


@inlined
def lowest_visible(start, end, layers, spans, uniforms, hides):
    """The first pair of a tile that is not wholly hidden by an opaque one above it."""
    if hides:
        for behind in range(end - 1 - start):
            q = end - 1 - behind
            if spans[q, 1] == 0 and uniforms[layers[q], ROW_OPACITY] == ONE:
                return q
    return start


@inlined
def place_pixels(top, left, x, y, px, py):
    """The scene's points at a tile's pixels."""
    for r in range(TILE):
        for s in range(TILE):
            px[r * TILE + s] = x[left + s]
            py[r * TILE + s] = y[top + r]


@inlined
def fill_tile(channels, background, tile):
    """One colour all over a tile [C, pixels]."""
    for c in range(channels):
        tile[c, :] = background[c]


@inlined
def copy_line(source, target, count):
    """Copies a tile's line, or the `count` pixels of it that there are; whole ones in a loop of fixed length."""
    if count >= TILE:
        for s in range(TILE):
            target[s] = source[s]
    else:
        for s in range(count):
            target[s] = source[s]


@inlined
def tile_to_image(top, left, tile, image):
    """Writes a tile [C, pixels] to its place in an image [C, H, W], as far as it reaches."""
    channels, height, width = image.shape
    for c in range(channels):
        for r in range(min(TILE, height - top)):
            copy_line(tile[c, r * TILE :], image[c, top + r, left:], width - left)


@inlined
def image_to_tile(top, left, image, tile):
    """Reads a tile [C, pixels] from its place in an image [C, H, W]; 0 beyond that."""
    channels, height, width = image.shape
    if min(height - top, width - left) < TILE:
        tile[:] = ZERO
    for c in range(channels):
        for r in range(min(TILE, height - top)):
            copy_line(image[c, top + r, left:], tile[c, r * TILE :], width - left)

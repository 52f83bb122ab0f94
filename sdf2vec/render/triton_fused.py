"""The fused renderer on the GPU: culled to tiles, one program a tile, forward and backward in generated kernels.

The same function as `reference` and `fused`, in float32. Of size layers × pixels nothing is stored but, in the
backward pass, the colours below each layer in those tiles that are being computed: `SCRATCH` bytes at most, or
one tile. Equal input gives equal output, bit by bit: no sum depends on the order in which programs run.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from types import ModuleType
from typing import Any

import torch
from torch.autograd.function import once_differentiable

from ..blend import COMPOSITING
from ..layer import ROW_OPACITY
from . import triton_kernels
from .fused import rows_of, structures_of
from .reference import canvas_axes
from .tensors import SceneTensors
from .tiling import PIXELS, TILE

SCRATCH = 1 << 29  # bytes
WARPS = 4  # of 32 threads, for the 256 pixels of a tile; with fewer, unions run out of registers


@dataclass(eq=False)
class Room:
    """For how many pairs of a tile and a layer a render takes memory, so that it need not wait for the GPU to know; the
    render sets `needed` [], how many there are: where they are more, it is wrong. Without `pairs` it waits.
    """

    pairs: int | None = None
    needed: torch.Tensor | None = None


def composite(
    tensors: SceneTensors, width: int, height: int, channels: int = 4, room: Room | None = None
) -> torch.Tensor:
    """Premultiplied RGBA (or RGB, for 3 channels) before clamping, [channels, height, width], float32.

    Differentiable in every tensor of the scene. All of these are on one GPU, or on the CPU where Triton's
    interpreter is switched on.
    """
    background = tensors.background.float()
    if not tensors.layer_count:
        return background[:channels, None, None].expand(channels, height, width)
    canvas = _canvas(tensors, width, height, channels, room or Room())
    rows = rows_of(tensors.groups, canvas.pixel).float()
    image: torch.Tensor = _Composite.apply(canvas, rows.contiguous(), background.contiguous())
    return image


@dataclass(frozen=True, eq=False)
class _Canvas:
    """What a render needs besides the numbers of the scene. Layers are group by group, not in draw order."""

    module: ModuleType
    groups: torch.Tensor  # [L] the group of each layer
    order: torch.Tensor  # [L] the place of each layer in the draw order
    channels: int
    width: int
    height: int
    x: torch.Tensor  # of the pixel centres, padded to whole tiles
    y: torch.Tensor
    pixel: float  # scene units
    hides: bool  # an opaque layer hides what is below it
    group_count: int
    room: Room

    @property
    def columns(self) -> int:
        return len(self.x) // TILE

    @property
    def lines(self) -> int:
        return len(self.y) // TILE


def _canvas(tensors: SceneTensors, width: int, height: int, channels: int, room: Room) -> _Canvas:
    x, y, pixel = _axes(tensors.size, width, height, tensors.background.device)
    orders = [group.order for group in tensors.groups]
    return _Canvas(
        module=triton_kernels.load(structures_of(tensors), tensors.compositing, channels),
        groups=torch.cat([torch.full_like(order, index) for index, order in enumerate(orders)]),
        order=torch.cat(orders),
        channels=channels,
        width=width,
        height=height,
        x=x,
        y=y,
        pixel=pixel,
        hides=COMPOSITING[tensors.compositing].hides,
        group_count=len(orders),
        room=room,
    )


@lru_cache(maxsize=8)
def _axes(
    size: tuple[float, float], width: int, height: int, device: torch.device
) -> tuple[torch.Tensor, torch.Tensor, float]:
    """The pixel centres along both axes, padded to whole tiles, and the size of a pixel."""
    x, y, pixel = canvas_axes(size, -(-width // TILE) * TILE, -(-height // TILE) * TILE, width, height)
    return torch.from_numpy(x).to(device), torch.from_numpy(y).to(device), float(pixel)


# --- which layers touch each tile ---------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class _Bins:
    """Pairs of a tile and a layer that covers some of it, sorted by tile, then draw order; all int32.

    After the last there are some of no meaning: P bounds the number of pairs.
    """

    starts: torch.Tensor  # [tiles + 1]: those of tile t are starts[t] up to starts[t + 1]
    visible: torch.Tensor  # [tiles]: the first pair that is not wholly hidden by an opaque one above it
    layers: torch.Tensor  # [P]
    kinds: (
        torch.Tensor
    )  # [P]: the group of the layer; that plus the number of groups where it covers the whole tile
    places: torch.Tensor  # [P]: where the pair is when sorted by layer
    layer_starts: torch.Tensor  # [L + 1]: the places of layer l's pairs are layer_starts[l] up to the next


def _bin(canvas: _Canvas, rows: torch.Tensor) -> _Bins:
    """Waits for the GPU once, unless there is room for so many pairs: to know how many there may be."""
    count, device, tiles = len(rows), rows.device, canvas.columns * canvas.lines
    limits = rows.new_empty(count, 2)
    ranges = torch.empty(count, 4, dtype=torch.int32, device=device)
    place = (canvas.x, canvas.y, canvas.pixel, canvas.columns, canvas.lines, limits, ranges)
    _launch(canvas.module.measure_layers, count, canvas.groups, rows, *place)
    layer_starts = torch.nn.functional.pad(ranges[:, 3].cumsum(0), (1, 0))
    canvas.room.needed = layer_starts[-1]
    most = int(layer_starts[-1]) if canvas.room.pairs is None else canvas.room.pairs
    keys = torch.full((most,), tiles * count, dtype=torch.int64, device=device)  # in no tile
    layers, full = (torch.zeros(most, dtype=torch.int32, device=device) for _ in range(2))
    pairs = (layer_starts[1:], keys, layers, full, most)
    _launch(canvas.module.find_pairs, count, canvas.groups, rows, canvas.order, *place, *pairs)
    layer_starts = layer_starts.clamp(max=most)
    keys, by_tile = keys.sort()
    layers, solid = layers[by_tile], full[by_tile].bool()
    starts = torch.searchsorted(keys, torch.arange(tiles + 1, device=device) * count)
    visible = _visible(starts, solid & (rows[layers, ROW_OPACITY] == 1.0)) if canvas.hides else starts[:-1]
    kinds = canvas.groups[layers] + solid * canvas.group_count
    return _Bins(*(part.int() for part in (starts, visible, layers, kinds, by_tile, layer_starts)))


def _visible(starts: torch.Tensor, hides: torch.Tensor) -> torch.Tensor:
    """The last pair of each tile that hides what is below it, or else the tile's first."""
    places = torch.arange(-1, len(hides), device=hides.device)
    before = torch.where(torch.nn.functional.pad(hides, (1, 0)), places, -1).cummax(0).values
    return torch.maximum(starts[:-1], before[starts[1:]])


# --- drawing ------------------------------------------------------------------------------------------------


class _Composite(torch.autograd.Function):
    """The kernels as one differentiable operation on the layers' rows [L, widest] and the background [4]."""

    @staticmethod
    def forward(ctx: Any, canvas: _Canvas, rows: torch.Tensor, background: torch.Tensor) -> torch.Tensor:
        image = rows.new_empty(canvas.channels, canvas.height, canvas.width)
        with torch.cuda.device_of(rows):
            bins = _bin(canvas, rows)
            _launch(
                canvas.module.forward_tiles,
                len(bins.visible),
                *_shared(canvas, bins, rows, background),
                image,
            )
        ctx.canvas, ctx.bins = canvas, bins
        ctx.save_for_backward(rows, background)
        return image

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, cotangent: torch.Tensor) -> tuple[torch.Tensor | None, ...]:
        rows, background = ctx.saved_tensors
        with torch.cuda.device_of(rows):
            return None, *_derivatives(ctx.canvas, ctx.bins, rows, background, cotangent.float().contiguous())


def _derivatives(
    canvas: _Canvas, bins: _Bins, rows: torch.Tensor, background: torch.Tensor, cotangent: torch.Tensor
) -> tuple[torch.Tensor, torch.Tensor]:
    """Those by the layers' rows and by the background."""
    grads = rows.new_zeros(len(bins.layers), rows.shape[1])
    ground = rows.new_zeros(len(bins.visible), 4)
    shared = (*_shared(canvas, bins, rows, background), cotangent)
    chunks = _chunks(bins, SCRATCH // (4 * canvas.channels * PIXELS))
    scratch = rows.new_empty(max(pairs for _, _, pairs in chunks), canvas.channels, PIXELS)
    for first, count, _ in chunks:
        _launch(canvas.module.backward_tiles, count, *shared, first, bins.places, scratch, grads, ground)
    totals = torch.empty_like(rows)
    width = 1 << (rows.shape[1] - 1).bit_length()
    _launch(canvas.module.reduce_pairs, len(rows), bins.layer_starts, grads, totals, width)
    return totals, ground.sum(0, dtype=torch.float64).float()


def _shared(canvas: _Canvas, bins: _Bins, rows: torch.Tensor, background: torch.Tensor) -> tuple[object, ...]:
    """The arguments that both directions take."""
    place = (canvas.x, canvas.y, canvas.width, canvas.height, canvas.columns)
    return bins.starts, bins.visible, bins.layers, bins.kinds, rows, background, *place


def _launch(kernel: Any, programs: int, *arguments: object) -> None:
    kernel[(programs,)](*arguments, num_warps=WARPS, enable_fp_fusion=True)


def _chunks(bins: _Bins, most: int) -> list[tuple[int, int, int]]:
    """Runs of tiles with at most so many pairs, or of one tile: first tile, number of tiles, room for pairs."""
    tiles, room = len(bins.visible), len(bins.layers)
    if room <= most:
        return [(0, tiles, room)]
    starts, edges = bins.starts.tolist(), [0]
    for tile in range(1, tiles):
        if starts[tile + 1] - starts[edges[-1]] > most:
            edges.append(tile)
    return [(a, b - a, starts[b] - starts[a]) for a, b in pairwise([*edges, tiles])]

"""Where shapes would help most: matching pursuit with soft discs, which are added to an image or painted over it.

What a shape paints over is lost, so that a wide disc of the missing colour may help where colours are added and do harm
where they hide.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Iterator, Sequence
from functools import lru_cache
from itertools import accumulate, chain, islice, repeat
from typing import NamedTuple

import numpy as np
import torch

from ..arrays import Float32Array
from ..banded import Band

ROUNDS = 2  # the residual is looked at anew so many times, more often where not all discs find room
SCALE = 1.4  # from one size of disc to the next
SMALLEST_RADIUS, LARGEST_RADIUS = (
    0.8,
    0.3,
)  # of a disc: pixels; shares of the square root of the picture's area
WIDTH = 0.6  # standard deviation of the Gaussian that stands for a disc of radius 1
FARTHEST = 4.0  # standard deviations: a Gaussian is cut off there
SPACING = 1.0 / 3.0  # of a radius, at most, between places of discs, where that is more than a pixel
DISC = 0.7  # amount of a disc in that of the Gaussian which fits it best: 1 / (2 − 2·exp(−u)), u = 1.256
TINY = 1e-9
LEAST = 1e-5  # mean squared error, below one level of 255: no reason to paint, and above what rounding makes
BLOCK = 1024  # gains of which the largest is known
APART = 1.5  # radii around a disc where none is put in the same round

Response = tuple[
    torch.Tensor, torch.Tensor
]  # at the places of a size [h, w]: amounts or colours [C, h, w], gains


class Discs(NamedTuple):
    """Position in pixels [N, 2], radius in pixels [N], what each adds or the colour that it paints [N, C]."""

    centers: torch.Tensor
    radii: torch.Tensor
    colors: torch.Tensor

    def placed(
        self, width: int, height: int, size: tuple[float, float], share: float = 1.0
    ) -> tuple[torch.Tensor, torch.Tensor]:
        """Centres, and a share of the radii, in scene units, on so many pixels of a canvas of this size."""
        centers = (self.centers / torch.tensor([width, height]) - 0.5) * torch.tensor(size)
        return centers, self.radii * share * (size[0] / width)


class Missing(NamedTuple):
    """What a picture [C, H, W] lacks, where colours are added; each pixel's error times `weights` [H, W] matters."""

    residual: torch.Tensor
    weights: torch.Tensor

    def responses(self, sizes: Sequence[Size]) -> Iterator[Response]:
        """For a disc of every size, the best amount at each of its places, and what it gains."""
        matters = self.weights.square()
        fit, weigh = Blurring.of(self.residual * matters), Blurring.of(matters[None])
        for size in sizes:
            fitted, energy = fit.by(size.once), weigh.by(size.twice).clamp_min(TINY)
            yield fitted / energy, (fitted.square() / energy).sum(0)

    def apply(self, cover: Cover, color: torch.Tensor) -> None:
        cover.of(self.residual).sub_(color[:, None, None] * cover.amounts)

    def amount(self, color: torch.Tensor) -> torch.Tensor:
        """Of a disc in that of the Gaussian that stands for it."""
        return DISC * color


class Painted(NamedTuple):
    """An image and the picture that it should be [C, H, W], where opaque colours are laid over it."""

    image: torch.Tensor
    target: torch.Tensor
    weights: torch.Tensor

    def responses(self, sizes: Sequence[Size]) -> Iterator[Response]:
        """For a disc of every size, the best colour at each of its places, and what it gains.

        With cover h, image i and residual r, colour c leaves r − h·(c − i) of it: a quadratic in c.
        """
        matters = self.weights.square()
        residual = self.target - self.image
        hidden = (residual * self.image * matters).sum(0, keepdim=True)
        lost = (self.image.square() * matters).sum(0, keepdim=True)
        fit = Blurring.of(torch.cat([residual * matters, hidden]))
        weigh = Blurring.of(torch.cat([self.image * matters, lost, matters[None]]))
        for size in sizes:
            once, twice = fit.by(size.once), weigh.by(size.twice)
            linear, energy = once[:-1] + twice[:-2], twice[-1].clamp_min(TINY)
            colors = (linear / energy).clamp(0.0, 1.0)
            fixed = 2.0 * once[-1] + twice[-2]
            yield colors, (colors * (2.0 * linear - colors * energy)).sum(0) - fixed - LEAST * energy

    def apply(self, cover: Cover, color: torch.Tensor) -> None:
        image = cover.of(self.image)
        image.add_((color[:, None, None] - image) * cover.amounts)

    def amount(self, color: torch.Tensor) -> torch.Tensor:
        """Of a disc in that of the Gaussian that stands for it."""
        return color


def canvas_of(
    image: torch.Tensor, target: torch.Tensor, weights: torch.Tensor | None, added: bool
) -> Missing | Painted:
    """An image and its target [C, H, W] to look for discs that are added, or laid over it; on the CPU."""
    image, target = image.detach().cpu(), target.cpu()
    weights = torch.ones(target.shape[1:]) if weights is None else weights.cpu()
    return Missing(target - image, weights) if added else Painted(image.clone(), target, weights)


def find_discs(canvas: Missing | Painted, count: int) -> Discs:
    """The discs that lower the squared error most; greedy (Mallat and Zhang 1993). Fewer where no more would help.

    The canvas is changed.
    """
    sizes = _sizes(*canvas.weights.shape)
    found: list[Disc] = []
    for rounds_left in chain(range(ROUNDS, 0, -1), repeat(1)):
        now = math.ceil((count - len(found)) / rounds_left)
        fresh = list(islice(_round(canvas, sizes), now))
        found += fresh
        if len(found) == count or not fresh:
            break
    centers = torch.tensor([(disc.x + 0.5, disc.y + 0.5) for disc in found]).reshape(-1, 2)
    colors = [torch.zeros(0, len(canvas[0])), *(canvas.amount(disc.color)[None] for disc in found)]
    return Discs(centers, torch.tensor([disc.radius for disc in found]), torch.cat(colors))


def _round(canvas: Missing | Painted, sizes: Sequence[Size]) -> Iterator[Disc]:
    """The best discs, put on the canvas one after the other, until their surroundings fill it."""
    colors, own = zip(*canvas.responses(sizes), strict=True)
    gains = Gains.of(own)
    while (best := gains.largest()) is not None:
        index, row, column = best
        size = sizes[index]
        x, y = size.across.place(column), size.down.place(row)
        disc = Disc(x, y, size.radius, colors[index][:, row, column].clone())
        canvas.apply(size.cover(y, x, *canvas.weights.shape), disc.color)
        for other, grid in zip(sizes, gains.grids, strict=True):
            grid[other.down.near(y, size.radius), other.across.near(x, size.radius)] = -1.0
        yield disc


class Gains(NamedTuple):
    """What discs gain at the places of every size, in blocks; numbers only become less."""

    grids: Sequence[Float32Array]  # of each size [h, w]: parts of `blocks`
    ends: Sequence[int]  # of these parts
    blocks: Float32Array  # [B, BLOCK]
    most: Float32Array  # [B] no less than the largest of each block

    @classmethod
    def of(cls, own: Sequence[torch.Tensor]) -> Gains:
        """Those of every size [h, w]."""
        ends = list(accumulate(each.numel() for each in own))
        rest = torch.full((-ends[-1] % BLOCK,), -1.0)
        flat = torch.cat([*(each.flatten() for each in own), rest]).numpy()
        parts = np.split(flat, ends)
        grids = [part.reshape(each.shape) for part, each in zip(parts, own, strict=False)]
        blocks = flat.reshape(-1, BLOCK)
        return cls(grids, ends, blocks, blocks.max(axis=1))

    def largest(self) -> tuple[int, int, int] | None:
        """Which size's it is, its row and column; None where nothing gains any more."""
        while self.most[block := int(self.most.argmax())] > 0.0:
            own = self.blocks[block]
            place = int(own.argmax())
            if own[place] == self.most[block]:
                best = block * BLOCK + place
                index = bisect_right(self.ends, best)
                grid = self.grids[index]
                return index, *divmod(best - self.ends[index] + grid.size, grid.shape[1])
            self.most[block] = own[place]
        return None


# --- Gaussians ----------------------------------------------------------------------------------------------


class Disc(NamedTuple):
    """At the middle of a pixel."""

    x: int
    y: int
    radius: float
    color: torch.Tensor  # [C]


class Axis(NamedTuple):
    """Which pixels along one side have a disc at their middle: every so many-th."""

    start: int
    step: int
    side: int

    @classmethod
    def of(cls, side: int, step: int) -> Axis:
        """As many before the first as behind the last, about; one, at least."""
        return cls(min(step, side) // 2, step, side)

    @property
    def pixels(self) -> torch.Tensor:
        """All of them."""
        return torch.arange(self.start, self.side, self.step)

    def place(self, index: int) -> int:
        """The pixel of the disc of this number."""
        return self.start + self.step * index

    def near(self, pixel: int, radius: float) -> slice:
        """Which discs are in the surroundings of one of some radius."""
        reach = math.ceil(APART * radius)
        first, last = pixel - reach - self.start, pixel + reach - self.start
        return slice(max(0, -(-first // self.step)), max(0, last // self.step + 1))

    def gaussians(self, radius: float) -> Band:
        """That of each disc at every pixel, [discs, side]."""
        return Band.of(_window(torch.arange(self.side) - self.pixels[:, None], radius))


class Size(NamedTuple):
    """Discs of one radius in pixels: where they are down and across; their Gaussians so, and these squared."""

    radius: float
    down: Axis
    across: Axis
    once: tuple[Band, Band]
    twice: tuple[Band, Band]
    window: torch.Tensor  # the Gaussian where it is not cut off, [2 · reach + 1]

    @classmethod
    def of(cls, radius: float, height: int, width: int) -> Size:
        """For a picture of so many pixels."""
        step = max(1, math.floor(SPACING * radius))
        down, across = Axis.of(height, step), Axis.of(width, step)
        once, twice = (
            (down.gaussians(own), across.gaussians(own)) for own in (radius, radius / math.sqrt(2.0))
        )
        reach = math.ceil(FARTHEST * WIDTH * radius)
        return cls(radius, down, across, once, twice, _window(torch.arange(-reach, reach + 1), radius))

    def cover(self, y: int, x: int, height: int, width: int) -> Cover:
        """What the Gaussian covers that stands for a disc at a pixel, where it is not cut off."""
        reach = len(self.window) // 2
        rows, columns = (
            slice(max(at - reach, 0), min(at + reach + 1, side)) for at, side in ((y, height), (x, width))
        )
        down, across = (
            self.window[part.start - at + reach : part.stop - at + reach]
            for part, at in ((rows, y), (columns, x))
        )
        return Cover(rows, columns, down[:, None] * across)


class Blurring(NamedTuple):
    """An image [C, H, W], as rows of all channels [H, C · W]."""

    rows: torch.Tensor
    channels: int

    @classmethod
    def of(cls, image: torch.Tensor) -> Blurring:
        """Ready to be blurred."""
        return cls(image.transpose(0, 1).flatten(1), len(image))

    def by(self, gaussians: tuple[Band, Band]) -> torch.Tensor:
        """Times the Gaussian at each of its places, summed, [C, h, w].

        A Gaussian is a product, so two banded matrices blur.
        """
        down, across = gaussians
        columns = (down @ self.rows).unflatten(1, (self.channels, -1)).flatten(0, 1)
        rows = (across @ columns.mT).mT
        blurred: torch.Tensor = rows.unflatten(0, (-1, self.channels)).transpose(0, 1)
        return blurred


@lru_cache(maxsize=8)
def _sizes(height: int, width: int) -> Sequence[Size]:
    """Of discs that are looked for in a picture."""
    longest = LARGEST_RADIUS * math.sqrt(height * width)
    steps = math.floor(math.log(max(longest / SMALLEST_RADIUS, 1.0)) / math.log(SCALE)) + 1
    return [Size.of(SMALLEST_RADIUS * SCALE**step, height, width) for step in range(steps)]


def _window(offsets: torch.Tensor, radius: float) -> torch.Tensor:
    z = offsets / (WIDTH * radius)
    return torch.where(z.abs() < FARTHEST, torch.exp(-0.5 * z.square()), 0.0)


class Cover(NamedTuple):
    """How much of each pixel of a part of the picture a disc covers."""

    rows: slice
    columns: slice
    amounts: torch.Tensor  # [h, w]

    def of(self, image: torch.Tensor) -> torch.Tensor:
        """The part of an image [C, H, W]."""
        return image[:, self.rows, self.columns]

"""Where shapes would help most: matching pursuit with soft discs, which are added to an image or painted over it.

What a shape paints over is lost, so that a wide disc of the missing colour may help where colours are added and do harm
where they hide.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import lru_cache
from itertools import chain, islice, repeat
from typing import NamedTuple

import torch

ROUNDS = 4  # the residual is looked at anew so many times, more often where not all discs find room
SCALE = 1.4  # from one size of disc to the next
SMALLEST_RADIUS, LARGEST_RADIUS = (
    0.8,
    0.3,
)  # of a disc: pixels; shares of the square root of the picture's area
WIDTH = 0.6  # standard deviation of the Gaussian that stands for a disc of radius 1
FARTHEST = 6.0  # standard deviations: a Gaussian is cut off there, as numbers next to 0 slow processors down
DISC = 0.7  # amount of a disc in that of the Gaussian which fits it best: 1 / (2 − 2·exp(−u)), u = 1.256
TINY = 1e-9
LEAST = 1e-5  # mean squared error, below one level of 255: no reason to paint, and above what rounding makes
APART = 1.5  # radii around a disc where none is put in the same round

Radii = tuple[float, ...]


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

    def responses(self, radii: Radii) -> tuple[torch.Tensor, torch.Tensor]:
        """For a disc of every size at every pixel, the best amount [S, C, H, W] and what it gains [S, H, W]."""
        matters = self.weights.square()
        fitted = _blurred(self.residual * matters, radii)
        energy = _blurred(matters[None], _squared(radii)).clamp_min(TINY)
        gains = (fitted.square() / energy).sum(1)
        return fitted / energy, gains

    def apply(self, window: torch.Tensor, color: torch.Tensor) -> None:
        self.residual.sub_(color[:, None, None] * window)

    def amount(self, color: torch.Tensor) -> torch.Tensor:
        """Of a disc in that of the Gaussian that stands for it."""
        return DISC * color


class Painted(NamedTuple):
    """An image and the picture that it should be [C, H, W], where opaque colours are laid over it."""

    image: torch.Tensor
    target: torch.Tensor
    weights: torch.Tensor

    def responses(self, radii: Radii) -> tuple[torch.Tensor, torch.Tensor]:
        """For a disc of every size at every pixel, the best colour [S, C, H, W] and what it gains [S, H, W].

        With cover h, image i and residual r, colour c leaves r − h·(c − i) of it: a quadratic in c.
        """
        matters = self.weights.square()
        residual = self.target - self.image
        hidden = (residual * self.image * matters).sum(0, keepdim=True)
        lost = (self.image.square() * matters).sum(0, keepdim=True)
        once = _blurred(torch.cat([residual * matters, hidden]), radii)
        twice = _blurred(torch.cat([self.image * matters, lost, matters[None]]), _squared(radii))
        linear, energy = once[:, :-1] + twice[:, :-2], twice[:, -1:].clamp_min(TINY)
        colors = (linear / energy).clamp(0.0, 1.0)
        fixed = 2.0 * once[:, -1] + twice[:, -2]
        gains = (colors * (2.0 * linear - colors * energy)).sum(1) - fixed - LEAST * energy[:, 0]
        return colors, gains

    def apply(self, window: torch.Tensor, color: torch.Tensor) -> None:
        self.image.add_((color[:, None, None] - self.image) * window)

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
    height, width = canvas.weights.shape
    radii = _radii(height, width)
    found: list[tuple[int, int, int, torch.Tensor]] = []
    for rounds_left in chain(range(ROUNDS, 0, -1), repeat(1)):
        now = math.ceil((count - len(found)) / rounds_left)
        fresh = list(islice(_round(canvas, radii), now))
        found += fresh
        if len(found) == count or not fresh:
            break
    x, y, scale = torch.tensor([disc[:3] for disc in found], dtype=torch.int64).reshape(-1, 3).unbind(1)
    channels = len(canvas[0])
    colors = [torch.zeros(0, channels), *(canvas.amount(color)[None] for *_, color in found)]
    return Discs(torch.stack([x + 0.5, y + 0.5], dim=1), torch.tensor(radii)[scale], torch.cat(colors))


def _round(canvas: Missing | Painted, radii: Radii) -> Iterator[tuple[int, int, int, torch.Tensor]]:
    """The best discs, put on the canvas one after the other, until their surroundings fill it."""
    colors, gains = canvas.responses(radii)
    while gains.max() > 0:
        yield _take(canvas, colors, gains, radii)


def _radii(height: int, width: int) -> Radii:
    longest = LARGEST_RADIUS * math.sqrt(height * width)
    steps = math.floor(math.log(max(longest / SMALLEST_RADIUS, 1.0)) / math.log(SCALE)) + 1
    return tuple(SMALLEST_RADIUS * SCALE**step for step in range(steps))


def _squared(radii: Radii) -> Radii:
    """Of Gaussians that are the squares of those."""
    return tuple(radius / math.sqrt(2.0) for radius in radii)


def _blurred(image: torch.Tensor, radii: Radii) -> torch.Tensor:
    """An image [C, H, W] times the Gaussian of every size at every pixel, summed, [S, C, H, W].

    A Gaussian is a product, so two small matrices blur.
    """
    channels, height, width = image.shape
    down, across = _windows(height, radii), _windows(width, radii)
    columns = down.flatten(0, 1) @ image.transpose(0, 1).flatten(1)
    return (columns.view(len(radii), -1, width) @ across).view(-1, height, channels, width).transpose(1, 2)


@lru_cache(maxsize=8)
def _windows(side: int, radii: Radii) -> torch.Tensor:
    """For each size the Gaussian of every place at every other [S, side, side]."""
    places = torch.arange(side)
    return torch.stack([_window(places[:, None] - places, radius) for radius in radii])


def _window(offsets: torch.Tensor, radius: float) -> torch.Tensor:
    z = offsets / (WIDTH * radius)
    return torch.where(z.abs() < FARTHEST, torch.exp(-0.5 * z.square()), 0.0)


def _take(
    canvas: Missing | Painted, colors: torch.Tensor, gains: torch.Tensor, radii: Radii
) -> tuple[int, int, int, torch.Tensor]:
    """The best disc (x, y, index of its radius, colour); puts it on the canvas and bars its surroundings."""
    _, height, width = gains.shape
    best = int(gains.argmax())
    scale, y, x = best // (height * width), best // width % height, best % width
    color, radius = colors[scale, :, y, x].clone(), radii[scale]
    down, across = (_window(torch.arange(side) - at, radius) for side, at in ((height, y), (width, x)))
    canvas.apply(down[:, None] * across, color)
    reach = math.ceil(APART * radius)
    gains[:, max(0, y - reach) : y + reach + 1, max(0, x - reach) : x + reach + 1] = -1.0
    return x, y, scale, color

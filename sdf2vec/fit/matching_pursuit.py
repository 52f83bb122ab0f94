"""Where shapes would help most: matching pursuit with soft discs on what is missing of a picture."""

from __future__ import annotations

import math
from collections.abc import Iterator
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
DISC = 0.7  # amount of a disc in that of the Gaussian which fits it best: 1 / (2 − 2·exp(−u)), u = 1.256
APART = 1.5  # radii around a disc where none is put in the same round


class Discs(NamedTuple):
    """Position in pixels [N, 2], radius in pixels [N], and what each adds [N, C]."""

    centers: torch.Tensor
    radii: torch.Tensor
    amounts: torch.Tensor


def find_discs(residual: torch.Tensor, count: int) -> Discs:
    """The discs that take most of a residual [C, H, W] away, squared; greedy (Mallat and Zhang 1993)."""
    height, width = residual.shape[1:]
    radii = _radii(height, width)
    left = residual.clone()
    found: list[tuple[int, int, int, torch.Tensor]] = []
    for rounds_left in chain(range(ROUNDS, 0, -1), repeat(1)):
        if len(found) == count:
            break
        now = math.ceil((count - len(found)) / rounds_left)
        found += islice(_round(left, radii), now)
    x, y, scale = torch.tensor([disc[:3] for disc in found], dtype=torch.int64).reshape(-1, 3).unbind(1)
    amounts = [residual.new_zeros(0, len(residual)), *(amount[None] for *_, amount in found)]
    return Discs(torch.stack([x + 0.5, y + 0.5], dim=1), radii[scale], DISC * torch.cat(amounts))


def _round(left: torch.Tensor, radii: torch.Tensor) -> Iterator[tuple[int, int, int, torch.Tensor]]:
    """The best discs, taken from the residual one after the other, until their surroundings fill the picture."""
    amounts, gains = _responses(left, radii)
    while not gains.max() < 0:
        yield _take(left, amounts, gains, radii)


def _radii(height: int, width: int) -> torch.Tensor:
    longest = LARGEST_RADIUS * math.sqrt(height * width)
    steps = (
        max(1, math.floor(math.log(longest / SMALLEST_RADIUS) / math.log(SCALE)) + 1)
        if longest > SMALLEST_RADIUS
        else 1
    )
    return SMALLEST_RADIUS * SCALE ** torch.arange(steps, dtype=torch.float32)


def _responses(left: torch.Tensor, radii: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
    """For a disc of every size at every pixel, the best amount [S, C, H, W] and what it gains [S, H, W]."""
    energy = torch.stack([_energy(radius) for radius in radii.tolist()])
    down, across = (_windows(side, radii) for side in left.shape[1:])
    fitted = down[:, None] @ left @ across[:, None]  # a Gaussian is a product, so two small matrices blur
    return fitted / energy[:, None, None, None], fitted.square().sum(1) / energy[:, None, None]


def _windows(side: int, radii: torch.Tensor) -> torch.Tensor:
    """For each size the Gaussian of every place at every other [S, side, side]."""
    places = torch.arange(side)
    return torch.stack([_window(places[:, None] - places, radius) for radius in radii.tolist()])


def _energy(radius: float) -> torch.Tensor:
    """The sum of squares of a whole disc."""
    half = math.ceil(4 * WIDTH * radius)
    return _window(torch.arange(-half, half + 1), radius).square().sum() ** 2


def _window(offsets: torch.Tensor, radius: float) -> torch.Tensor:
    return torch.exp(-0.5 * (offsets / (WIDTH * radius)).square())


def _take(
    left: torch.Tensor, amounts: torch.Tensor, gains: torch.Tensor, radii: torch.Tensor
) -> tuple[int, int, int, torch.Tensor]:
    """The best disc (x, y, index of its radius, amount); takes it from the residual and bars its surroundings."""
    _, height, width = gains.shape
    best = int(gains.argmax())
    scale, y, x = best // (height * width), best // width % height, best % width
    amount, radius = amounts[scale, :, y, x].clone(), float(radii[scale])
    down, across = (_window(torch.arange(side) - at, radius) for side, at in ((height, y), (width, x)))
    left -= amount[:, None, None] * down[:, None] * across
    reach = math.ceil(APART * radius)
    gains[:, max(0, y - reach) : y + reach + 1, max(0, x - reach) : x + reach + 1] = -1.0
    return x, y, scale, amount

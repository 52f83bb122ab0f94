"""What a run may take, stated once. Each limit has a variable of the environment that sets another."""

from __future__ import annotations

import os
from dataclasses import dataclass

from .errors import Sdf2vecError

MOST = 10**9  # that a variable may be set to


@dataclass(frozen=True)
class Limit:
    """How much a run may take of something; `$variable` sets another number."""

    variable: str
    usual: int
    unit: int = 1  # what the number counts

    @property
    def number(self) -> int:
        """In the words of the user: so many megapixels, say."""
        return whole_number(self.variable, self.usual)

    @property
    def most(self) -> int:
        """In pixels, bytes and so on."""
        return self.number * self.unit

    def advice(self, needed: int = 0) -> str:
        """The end of a line that refuses what needs so much."""
        return f"or raise the limit: {self.variable}={-(-needed // self.unit) or 2 * self.number}"


def whole_number(variable: str, usual: int, largest: int = MOST) -> int:
    """A variable of the environment, or what is usual where it is not set.

    Raises Sdf2vecError for anything but a whole number from 1 on.
    """
    text = os.environ.get(variable, "").strip()
    if not text:
        return usual
    number = int(text) if text.isascii() and text.isdigit() and len(text) < 20 else 0
    if not 1 <= number <= largest:
        raise Sdf2vecError(f"{variable}: a whole number from 1 to {largest} is needed, got {text!r}")
    return number


PIXELS = Limit("SDF2VEC_MAX_MEGAPIXELS", 200, 10**6)
"""Pictures of more pixels are refused before they are decoded, and renders before they are drawn."""

FITTED = Limit("SDF2VEC_FIT_MEGAPIXELS", 12, 10**6)
"""Pictures of more pixels are read at a half, a third and so on of their size."""

BYTES = Limit("SDF2VEC_MAX_MEGABYTES", 512, 10**6)
"""Larger files are refused, and streams that do not end."""

CACHED = Limit("SDF2VEC_CACHE_MEGABYTES", 200, 10**6)
"""Of compiled kernels, those that were used longest ago are removed beyond this."""

THREADS = 256
"""More threads are refused."""

TEXT_SHAPES = 4096
"""Shapes that a shader may hold in its text; more need data beside it."""

LONGEST_SIDE = 1_000_000
"""Pixels: decoders hold a pointer for each row."""

CANVAS_SIDE = 65536
"""Pixels of a scene's side; longer pictures are read smaller."""

"""Matrices with few numbers but 0 in a row, near their diagonal."""

from __future__ import annotations

from typing import NamedTuple

import torch

BLOCK = 32  # rows that are multiplied at once


class Band(NamedTuple):
    """A matrix [N, M]: for each BLOCK of its rows those columns that are not 0, and which they are."""

    blocks: tuple[tuple[torch.Tensor, int, int], ...]
    transposed: Band | None = None

    @classmethod
    def of(cls, matrix: torch.Tensor) -> Band:
        """Without its transposed."""
        used = (matrix != 0).byte()
        lows, behind = used.argmax(1).tolist(), used.flip(1).argmax(1).tolist()
        found = []
        for first in range(0, len(matrix), BLOCK):
            rows = slice(first, first + BLOCK)
            low, high = min(lows[rows]), matrix.shape[1] - min(behind[rows])
            found.append((matrix[rows, low:high].contiguous(), low, high))
        return cls(tuple(found))

    def __matmul__(self, columns: torch.Tensor) -> torch.Tensor:
        """Times columns [..., M, K]: [..., N, K]."""
        return torch.cat([block @ columns[..., low:high, :] for block, low, high in self.blocks], dim=-2)


def with_transposed(matrix: torch.Tensor) -> Band:
    """A matrix that is multiplied by and, for derivatives, its transposed."""
    return Band.of(matrix)._replace(transposed=Band.of(matrix.T))

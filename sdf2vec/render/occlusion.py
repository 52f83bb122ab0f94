"""How much of each layer is seen."""

from __future__ import annotations

import numpy as np

from ..arrays import Float32Array


def showing(alphas: Float32Array) -> Float32Array:
    """[N, P]: how much of each layer shows through those above it, from the alphas [N, P] of all, lowest first."""
    through = np.ones_like(alphas)
    for i in range(len(alphas) - 1, 0, -1):  # numpy's cumprod along the first axis takes 40 times as long
        np.multiply(through[i], 1.0 - alphas[i], out=through[i - 1])
    return through

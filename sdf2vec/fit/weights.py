"""How much an error matters at each pixel, from a picture."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..arrays import Float32Array
from ..errors import Sdf2vecError
from ..image import load, resize


def weights_of(source: Any) -> Float32Array | None:
    """How much an error matters, 0..1, [H, W]: a picture's mean channel, less where it is transparent."""
    if source is None:
        return None
    pixels = load(source).pixels
    weights: Float32Array = pixels[..., :3].mean(axis=2, dtype=np.float32)
    if pixels.shape[2] == 4:
        weights = weights * pixels[..., 3]
    if weights.max() == 0:
        raise Sdf2vecError("the weights are black all over: nothing would matter")
    return weights


def weights_for(weights: Float32Array, width: int, height: int) -> Float32Array:
    """Weights [H, W] at a picture's size, [height, width]."""
    return np.ascontiguousarray(resize(np.repeat(weights[..., None], 3, axis=2), width, height)[..., 0])

"""Pictures beside and below each other, for the figures of pages."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..arrays import Float32Array

GUTTER = 3  # pixels between pictures


def spaced(pictures: Sequence[Float32Array], across: bool, gutter: int = GUTTER) -> Float32Array:
    """Pictures [H, W, 3] beside or below each other, with white between them; a shorter row ends in white."""
    widest = max(picture.shape[1] for picture in pictures)
    found: list[Float32Array] = []
    for picture in pictures:
        height, width = picture.shape[:2]
        if not across:
            picture = np.pad(picture, ((0, 0), (0, widest - width), (0, 0)), constant_values=1)
        white = (height, gutter, 3) if across else (gutter, widest, 3)
        found += [picture, np.ones(white, np.float32)]
    return np.concatenate(found[:-1], axis=1 if across else 0)


def over_white(pixels: Float32Array) -> Float32Array:
    """Straight alpha laid on white; [H, W, 3]."""
    return pixels[..., :3] * pixels[..., 3:] + (1.0 - pixels[..., 3:])

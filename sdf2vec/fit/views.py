"""A picture as a fit sees it: scaled down, premultiplied, with how much each pixel matters."""

from __future__ import annotations

import math

import numpy as np
import torch

from ..image import Picture, premultiply, resize, unpremultiply
from .settings import Settings
from .surroundings import View
from .weights import weights_for


def pixel_of(picture: Picture) -> float:
    """The side of its pixels in scene units."""
    return 1.0 / min(picture.width, picture.height)


def planes(pixels: np.ndarray) -> torch.Tensor:
    """Pixels [H, W, C] as [C, H, W]."""
    return torch.from_numpy(np.ascontiguousarray(pixels.transpose(2, 0, 1)))


def scaled(pixels: np.ndarray, resolution: float) -> torch.Tensor:
    """A picture, premultiplied [H, W, C], scaled down to about resolution² pixels, [C, H, W]; never up.

    A resolution below 1 is a share of the picture's own.
    """
    height, width, channels = pixels.shape
    factor = resolution if resolution < 1 else min(1.0, resolution / math.sqrt(width * height))
    size = max(1, round(width * factor)), max(1, round(height * factor))
    small = premultiply(resize(unpremultiply(pixels), *size)) if channels == 4 else resize(pixels, *size)
    return planes(small)


def view_of(pixels: np.ndarray, settings: Settings, resolution: float) -> View:
    """A picture scaled down, with the weights that the settings give its pixels."""
    target = scaled(pixels, resolution)
    if settings.weights is None:
        return View(target, None)
    height, width = target.shape[1:]
    return View(target, torch.from_numpy(weights_for(settings.weights, width, height)))

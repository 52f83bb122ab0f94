"""How coarse a small drawing is, and which scenes it can draw as they are."""

from __future__ import annotations

import math
from typing import NamedTuple

from .blend import OVER
from .scene import Scene

FEW, MANY = 32, 128  # layers


class Grain(NamedTuple):
    """How coarse a small drawing is: `units` along the shortest side, how many `softnesses` of two pixels and more,
    steps of `colors` and `opacities`. One more filter is worth blurring this share of the canvas' pixels in vain.

    Of fewer layers than MANY, fewer softnesses (but `fewest`) and filters say as much.
    """

    units: int
    softnesses: int
    colors: int
    opacities: int
    filter: float
    fewest: int = 3

    def for_layers(self, count: int) -> Grain:
        """For a drawing of so many layers."""
        share = math.sqrt(min(1.0, max(count, 1) / MANY))
        softnesses = min(self.softnesses, max(self.fewest, round(self.softnesses * share)))
        return self._replace(softnesses=softnesses, filter=self.filter / share)


GRAINS = (  # finest first
    Grain(4096, 20, 255, 100, 0.8, fewest=20),
    Grain(1024, 12, 255, 100, 0.8, fewest=5),
    Grain(512, 12, 255, 20, 0.6, fewest=5),
    Grain(256, 8, 51, 10, 1.0),
    Grain(200, 5, 25, 10, 1.5),
    Grain(160, 3, 15, 10, 2.0),
)
DENSE = GRAINS[3]  # more shapes of it say more of a picture than fewer finer ones, or yet more coarser ones
USUAL = GRAINS[2::-1]  # what is tried where no size is asked for, smallest first


def is_drawable(scene: Scene) -> bool:
    """Whether a blurred element can draw each of a scene's layers."""
    return scene.compositing == OVER and not any(layer.is_patch for layer in scene.layers)


def is_few_and_sharp(scene: Scene) -> bool:
    """Whether a scene is of so few layers, all sharp, that every edge counts and plain elements are small enough."""
    return len(scene.layers) <= FEW and not any(layer.falloff for layer in scene.layers)

"""How coarse a small drawing is, which scenes it can draw, and what it then draws."""

from __future__ import annotations

import math
from typing import NamedTuple

from .blend import OVER
from .paints import FLAT
from .scene import Scene, Shape

FEW, SPARSE, MANY = 32, 64, 128  # layers
BOX = "box"
WHOLE = 0.01  # pixels by which an edge of whole pixels is off, at most
FINER = 0.1  # share by which units may be more or less


class Grain(NamedTuple):
    """How coarse a small drawing is: `units` along the shortest side, how many `softnesses` of two pixels and more,
    steps of `colors` and `opacities`. One more filter is worth blurring this share of the canvas' pixels in vain.

    `runs`: into how many runs of layers, at most, it is cut, each blurred as one; 0 where each layer is blurred alone.
    Of fewer layers than MANY, fewer softnesses (but `fewest`) and filters say as much, and one run. Of more than SPARSE
    the units are smaller, by this power of their number, `shrink`: so are what they draw.
    """

    units: int
    softnesses: int
    colors: int
    opacities: int
    filter: float = 1.0
    fewest: int = 3
    runs: int = 0
    shrink: float = 0.0

    def for_scene(self, scene: Scene) -> Grain:
        """For a drawing of as many layers as a scene has, on a canvas as large as its."""
        count = len(scene.layers)
        share = math.sqrt(min(1.0, max(count, 1) / MANY))
        softnesses = min(self.softnesses, max(self.fewest, round(self.softnesses * share)))
        runs = self.runs if count >= MANY else min(self.runs, 1)
        if is_of_pixels(scene):
            units = min(scene.width, scene.height)
        else:
            about = round(self.units * max(1.0, count / SPARSE) ** self.shrink)
            units = _in_proportion(about, scene.width, scene.height)
        return self._replace(units=units, softnesses=softnesses, filter=self.filter / share, runs=runs)

    @property
    def name(self) -> str:
        """What it is called in tables: by its grid for few layers, `runs` before that of one with runs."""
        return f"{'runs' if self.runs else 'small'} {self.units}"


def _in_proportion(about: int, width: int, height: int) -> int:
    """About so many units along the shortest side that the other has a whole number of them, too.

    resvg, and programs with it, round the sides of an SVG to whole units and its height on screen up, so that a picture
    drawn by its width gets a row too many. If there are none such near, then those by which it gets none.
    """
    short, long = sorted((width, height))
    least = short // math.gcd(short, long)
    whole = max(1, round(about / least)) * least
    if abs(whole - about) <= FINER * about:
        return whole
    near = sorted(
        range(math.ceil((1 - FINER) * about), int((1 + FINER) * about) + 1), key=lambda n: abs(n - about)
    )
    return next((units for units in near if (units * long / short % 1.0 >= 0.5) == (width > height)), about)


GRAINS = (  # finest first
    Grain(4096, 20, 255, 100, 0.8, fewest=20),
    Grain(1024, 12, 255, 100, 0.8, fewest=5),
    Grain(512, 12, 255, 20, 0.6, fewest=5),
    Grain(256, 8, 51, 10, shrink=1 / 3),
    Grain(256, 0, 51, 10, runs=3, shrink=1 / 3),
    Grain(208, 0, 51, 10, runs=3, shrink=1 / 3),
    Grain(200, 0, 25, 10, runs=3, shrink=1 / 3),
    Grain(160, 0, 15, 10, runs=3),
)
DENSE = GRAINS[4]  # more shapes of it say more of a picture than fewer finer ones, or yet more coarser ones
USUAL = GRAINS[2::-1]  # what is tried where no size is asked for, smallest first


class Run(NamedTuple):
    """Layers that follow each other and are blurred as one: how many, by which standard deviation in scene units."""

    layers: int
    deviation: float


class Drawable(NamedTuple):
    """A scene whose numbers a small drawing can say. With `runs`, which together are all of its layers, these are sharp
    and each run is blurred; without, each layer by its own falloff.
    """

    scene: Scene
    runs: tuple[Run, ...] = ()


def is_drawable(scene: Scene) -> bool:
    """Whether a blurred element can draw each of a scene's layers."""
    return scene.compositing == OVER and not any(layer.is_patch for layer in scene.layers)


def is_of_pixels(scene: Scene) -> bool:
    """Whether all layers are sharp upright boxes of whole pixels, as those of pixel art."""
    return all(
        len(layer.shapes) == 1 and not layer.falloff and _is_of_pixels(layer.shapes[0], scene)
        for layer in scene.layers
    )


def _is_of_pixels(shape: Shape, scene: Scene) -> bool:
    if shape.kind != BOX or shape.paint != FLAT:
        return False
    x, y, across, down, angle, radius = shape.parameters
    ends = [(x + sign * across, y + sign * down) for sign in (-1.0, 1.0)]
    places = [
        0.5 * side + place / scene.pixel
        for end in ends
        for side, place in zip((scene.width, scene.height), end, strict=True)
    ]
    return not angle and not radius and all(abs(place - round(place)) < WHOLE for place in places)


def is_few_and_sharp(scene: Scene) -> bool:
    """Whether a scene is of so few layers, all sharp, that every edge counts and plain elements are small enough."""
    return len(scene.layers) <= FEW and not any(layer.falloff for layer in scene.layers)

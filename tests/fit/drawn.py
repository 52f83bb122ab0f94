"""Pictures of 96 × 96 pixels drawn in numpy, by sixteen samples each: no renderer of this program has a part in it."""

import numpy as np
import torch

from sdf2vec.fit.initialization import Layers
from sdf2vec.fit.joining import Search
from sdf2vec.fit.shading import Shading
from sdf2vec.fit.surroundings import View
from sdf2vec.image import Picture, resize
from sdf2vec.render.tensors import SceneTensors
from sdf2vec.scene import Layer, Scene, Shape

WHITE, BLUE, RED, GREEN = (
    np.array(c) for c in ((1, 1, 1), (0.1, 0.2, 0.8), (0.9, 0.1, 0.1), (0.2, 0.7, 0.3))
)
SIDE, FINER = 96, 4
KINDS = ("circle", "ellipse", "box", "triangle", "rounded_triangle", "arc")
# of a gradient: its colour in the middle, and how much it rises from side to side
HALF, RISE = np.array([0.5, 0.3, 0.5]), np.array([0.4, 0.2, -0.4])

THREE = np.array([[0.9, 0.7, 0.2], [0.8, 0.1, 0.4], [0.2, 0.2, 0.8]])  # colours of a gradient


def points():
    """Pixels' samples x, y [n, n]."""
    return np.meshgrid(*((np.arange(SIDE * FINER) + 0.5) / FINER,) * 2)


def disc(x, y, radius):
    across, down = points()
    return np.hypot(across - x, down - y) < radius


def box(left, top, right, bottom):
    x, y = points()
    return (x > left) & (x < right) & (y > top) & (y < bottom)


def painted(*layers, ground=WHITE, finer=FINER):
    """A picture [H, W, 3] of masks in colours and opacities, in 8 bits; four times as large where not `finer`."""
    image = np.broadcast_to(ground, (SIDE * FINER, SIDE * FINER, 3)).astype(float)
    for mask, color, opacity in layers:
        image = image + (opacity * mask)[..., None] * (color - image)
    side = SIDE * FINER // finer
    means = image.reshape(side, finer, side, finer, 3).mean(axis=(1, 3))
    return np.rint(means * 255) / 255


def ramp(rise=RISE):
    """Colours [n, n, 3] of all samples that rise from the left to the right."""
    x, _ = points()
    return HALF + (x / SIDE - 0.5)[..., None] * rise


def rings(x=40.0, y=30.0, reach=60.0, rise=RISE):
    """Colours [n, n, 3] of all samples that rise with the distance from a point."""
    across, down = points()
    return HALF + (np.hypot(across - x, down - y) / reach - 0.5)[..., None] * rise


def bent(stop=0.4, steepness=1.0):
    """Colours [n, n, 3] of all samples that run down from one over another, at a share of the way, to a third one."""
    _, y = points()
    share = (0.5 + (y / SIDE - 0.5) * steepness).clip(0.0, 1.0)
    return np.stack([np.interp(share, (0.0, stop, 1.0), channel) for channel in THREE.T], axis=2)


def three_rings():
    """The same around a point."""
    across, down = points()
    share = np.hypot(across - 40.0, down - 30.0) / 64
    return np.stack([np.interp(share, (0.0, 0.4, 1.0), channel) for channel in THREE.T], axis=2)


def everywhere(pixels):
    """All of a picture [H, W, C]."""
    return np.ones(pixels.shape[:2], bool)


def shown(shade, pixels):
    """A gradient at each pixel of a picture."""
    height, width = pixels.shape[:2]
    x, y = (np.arange(width) + 0.5) / width, (np.arange(height) + 0.5) / height
    return shade.at(x.astype(np.float32)[None], y.astype(np.float32)[:, None])


def view_of(pixels):
    return View(torch.from_numpy(np.ascontiguousarray(pixels.transpose(2, 0, 1))).float(), None)


def bare():
    """A white square without layers."""
    return SceneTensors([], torch.tensor([*WHITE, 1.0]).float(), "over", (1.0, 1.0))


def search_of():
    return Search(
        Layers(KINDS, "over"), (0.0, 0.1), torch.Generator().manual_seed(0), lambda error: None, 1 / SIDE
    )


def rgb(color):
    red, green, blue = map(float, color)
    return red, green, blue


def sharp_disc(color, x, y, radius=20):
    center = x / SIDE - 0.5, y / SIDE - 0.5
    return Layer((Shape.of("circle", rgb(color), center=center, radius=radius / SIDE),))


def sharp_box(color, left, top, right, bottom):
    """Upright, by its sides."""
    center = (left + right) / 2 / SIDE - 0.5, (top + bottom) / 2 / SIDE - 0.5
    half_size = (right - left) / 2 / SIDE, (bottom - top) / 2 / SIDE
    shape = Shape.of("box", rgb(color), center=center, half_size=half_size, angle=0.0, corner_radius=0.0)
    return Layer((shape,))


def sharp_triangle(color, *corners):
    """By its corners."""
    a, b, c = ((x / SIDE - 0.5, y / SIDE - 0.5) for x, y in corners)
    return Layer((Shape.of("triangle", rgb(color), a=a, b=b, c=c),))


def shading_of(pixels):
    return Shading.of(pixels.astype(np.float32))


def noise():
    """Nothing that a few shapes could be."""
    coarse = np.random.default_rng(0).random((8, 12, 3), dtype=np.float32)
    return Picture(np.ascontiguousarray(resize(coarse, 48, 32)))


def hidden(count, level):
    """A grey picture with so many discs that are not seen."""
    grey = (level, level, level)
    disc = Layer((Shape("circle", (0.0, 0.0, 0.1), grey),))
    return Scene(64, 64, (disc,) * count, grey)

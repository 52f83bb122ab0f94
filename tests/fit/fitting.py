"""Small pictures, short fits of them, and how far these are off."""

import numpy as np
import torch

from sdf2vec import Layer, Scene, Shape
from sdf2vec.fit.loop import fit_picture
from sdf2vec.fit.settings import settings_of
from sdf2vec.image import Picture
from sdf2vec.metrics import mse
from sdf2vec.render.reference import render

PALETTE = "#134,#fa0b1c,#2e2eff"
AS_NUMBERS = {(17 / 255, 51 / 255, 68 / 255), (250 / 255, 11 / 255, 28 / 255), (46 / 255, 46 / 255, 1.0)}
RED, GREEN, BLUE = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
START = Scene(48, 32, (Layer((Shape("circle", (0, 0, 0.2), RED),), 0.1),), RED)


def picture(width=48, height=32, alpha=False):
    """A soft disc on a gradient, drawn by numpy."""
    y, x = np.mgrid[0:height, 0:width].astype(np.float32)
    disc = 1 / (1 + np.exp(np.hypot(x - width * 0.6, y - height * 0.4) - height * 0.25))
    pixels = np.stack([0.2 + 0.6 * disc, x / width * (1 - disc), 0.8 - 0.5 * disc], axis=2)
    return Picture(np.dstack([pixels, disc]).astype(np.float32) if alpha else pixels.astype(np.float32))


def as_tensor(pic):
    pixels = pic.pixels.copy()
    if pic.has_alpha:
        pixels[..., :3] *= pixels[..., 3:]
    return torch.from_numpy(pixels.transpose(2, 0, 1))


def remember(seen):
    """A callback that keeps all progress and never stops."""

    def callback(progress):
        seen.append(progress)
        return False

    return callback


def busy() -> Picture:
    """Coarse noise: too much for few shapes."""
    noise = np.random.default_rng(0).random((4, 6, 3), dtype=np.float32)
    return Picture(np.ascontiguousarray(noise.repeat(8, axis=0).repeat(8, axis=1)))


def fitted(pic: Picture | None = None, shapes: int = 8, callback=lambda progress: False, **options) -> Scene:
    settings = settings_of(shapes, **{"kind": "circle", "preset": "fast", **options})
    return fit_picture(pic or picture(), settings, callback)


def error(scene: Scene, pic: Picture) -> float:
    target = as_tensor(pic)
    return float(mse(render(scene, pic.width, pic.height)[: len(target)], target))


def colors_of(scene: Scene) -> set[tuple[float, ...]]:
    """All colours, in 1/1000."""
    colors = [shape.color for layer in scene.layers for shape in layer.shapes]
    colors += [scene.background[:3]] if scene.background else []
    return {tuple(round(value, 3) for value in color) for color in colors}

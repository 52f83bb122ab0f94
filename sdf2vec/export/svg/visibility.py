"""How much each layer shows: what an error of its coverage costs in the finished picture."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from ...arrays import Float64Array
from ...deferred import deferred
from ...scene import Scene

pixel_points = deferred("sdf2vec.render.reference", "canvas")
covers_at = deferred("sdf2vec.render.reference", "layers_at")
from_scene = deferred("sdf2vec.render.tensors", "from_scene")

Float = TypeVar("Float", np.float32, np.float64)

SIDE = 128  # pixels along the shortest side of the small canvas
MOST = 1 << 23  # layers × pixels
LONG = 1 << 18  # pixels, of a canvas that is very long
AT_ONCE = 1 << 20  # of them, for a formula holds dozens of numbers for each


class LayerSamples(NamedTuple):
    """Coverage [N, P] and colour [N, 3, P or 1] of all layers on a small canvas, P = width × height."""

    covers: Float64Array
    colors: Float64Array
    width: int
    height: int


def contrasts(scene: Scene, samples: LayerSamples) -> Float64Array:
    """[N]: the mean squared change of the picture, per channel, that an error 1 of each layer's coverage makes.

    It counts what lies below the layer and how much of it later layers hide; the mean is over the layer's soft edge.
    """
    covers, colors, *_ = samples
    soft = covers * (1.0 - covers) + 1e-3 * covers + 1e-9
    opacity = np.array([layer.opacity for layer in scene.layers])[:, None]
    alphas = covers * opacity
    through = showing(alphas) * opacity
    found = np.empty(len(covers))
    for i, step in enumerate(steps_over(alphas, colors, np.array(scene.ground))):
        change = np.square(step)
        shown = change[:3].mean(axis=0) + (0.0 if scene.opaque else change[3])
        found[i] = np.sum(soft[i] * shown * np.square(through[i])) / soft[i].sum()
    return found


def showing(alphas: NDArray[Float]) -> NDArray[Float]:
    """[N, P]: how much of each layer shows through those above it, from the alphas [N, P] of all, lowest first."""
    through = np.ones_like(alphas)
    for i in range(
        len(alphas) - 1, 0, -1
    ):  # row by row: numpy's cumprod along the first axis takes 40 times as long
        np.multiply(through[i], 1.0 - alphas[i], out=through[i - 1])
    return through


def steps_over(alphas: NDArray[Float], colors: Float64Array, ground: Float64Array) -> Iterator[Float64Array]:
    """For each layer, lowest first, its opaque colour minus what lies below it, premultiplied RGBA [4, P].

    `alphas` [N, P], `colors` [N, 3, P or 1], `ground` [4] premultiplied.
    """
    below = np.repeat(ground[:, None], alphas.shape[1], axis=1)
    for alpha, color in zip(alphas, colors, strict=True):
        step = np.empty_like(below)
        np.subtract(color, below[:3], out=step[:3])
        np.subtract(1.0, below[3], out=step[3])
        yield step
        below += step * alpha


def layers_at(scene: Scene) -> LayerSamples:
    """All layers on a small canvas of the scene's shape."""
    if not scene.layers:
        return LayerSamples(np.zeros((0, 1)), np.zeros((0, 3, 1)), 1, 1)
    width, height = _small_canvas(scene)
    tensors = from_scene(scene)
    x, y, pixel = pixel_points(tensors, width, height)
    scale = min(width, height) / min(scene.width, scene.height)
    chunk = max(1, AT_ONCE // len(scene.layers))
    chunks = zip(x.split(chunk), y.split(chunk), strict=True)
    parts = [covers_at(tensors, own_x, own_y, pixel * scale) for own_x, own_y in chunks]
    covers = np.concatenate([cover.numpy() for cover, _ in parts], axis=1, dtype=np.float64)
    colors = [color.double().numpy() for _, color in parts]
    flat = colors[0].shape[2] == 1
    return LayerSamples(covers, colors[0] if flat else np.concatenate(colors, axis=2), width, height)


def _small_canvas(scene: Scene) -> tuple[int, int]:
    """Width and height of a canvas with SIDE pixels along its shortest, fewer where there are many layers."""
    shortest = min(scene.width, scene.height)
    most = min(MOST / len(scene.layers), LONG)
    allowed = (most * shortest**2 / (scene.width * scene.height)) ** 0.5
    scale = min(SIDE, max(8, int(allowed)), shortest) / shortest
    return max(1, round(scene.width * scale)), max(1, round(scene.height * scale))

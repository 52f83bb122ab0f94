"""How much each layer shows: what an error of its coverage costs in the finished picture."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from ...arrays import Float32Array, Float64Array
from ...layer import is_flat
from ...render.occlusion import showing
from ...scene import Scene
from .sampling import canvas_grid, colors, covers, extent

SIDE = 128  # pixels along the shortest side of the small canvas
MOST = 1 << 23  # layers × pixels
LONG = 1 << 18  # pixels, of a canvas that is very long


class LayerSamples(NamedTuple):
    """Coverage [N, P] and colour [N, 3, P or 1] of all layers on a small canvas, P = width × height."""

    covers: Float32Array
    colors: Float32Array
    width: int
    height: int


def contrasts(scene: Scene, samples: LayerSamples) -> Float64Array:
    """[N]: the mean squared change of the picture, per channel, that an error 1 of each layer's coverage makes.

    It counts what lies below the layer and how much of it later layers hide; the mean is over the layer's soft edge.
    """
    covered, painted, *_ = samples
    soft = covered * (1.0 - covered) + 1e-3 * covered + 1e-9
    opacity = np.array([layer.opacity for layer in scene.layers], np.float32)[:, None]
    alphas = covered * opacity
    through = showing(alphas) * opacity
    found = np.empty(len(covered))
    for i, step in enumerate(steps_over(alphas, painted, np.array(scene.ground))):
        change = np.square(step)
        shown = change[:3].mean(axis=0) + (0.0 if scene.opaque else change[3])
        found[i] = np.sum(soft[i] * shown * np.square(through[i])) / soft[i].sum()
    return found


def steps_over(alphas: Float32Array, colors: Float32Array, ground: Float64Array) -> Iterator[Float32Array]:
    """For each layer, lowest first, its opaque colour minus what lies below it, premultiplied RGBA [4, P].

    `alphas` [N, P], `colors` [N, 3, P or 1], `ground` [4] premultiplied.
    """
    below = np.repeat(ground[:, None].astype(np.float32), alphas.shape[1], axis=1)
    for alpha, color in zip(alphas, colors, strict=True):
        step = np.empty_like(below)
        np.subtract(color, below[:3], out=step[:3])
        np.subtract(1.0, below[3], out=step[3])
        yield step
        below += step * alpha


def layers_at(scene: Scene) -> LayerSamples:
    """All layers on a small canvas of the scene's shape."""
    if not scene.layers:
        return LayerSamples(np.zeros((0, 1), np.float32), np.zeros((0, 3, 1), np.float32), 1, 1)
    width, height = _small_canvas(scene)
    grid, pixel = canvas_grid(scene, width, height), scene.pixel
    covered = np.zeros((len(scene.layers), height, width), np.float32)
    means = np.array([np.mean(layer.colors, axis=0) for layer in scene.layers], np.float32)
    flat = all(is_flat(layer.structure) for layer in scene.layers)
    painted = np.tile(means[..., None, None], (1, 1) if flat else (height, width))
    for index, layer in enumerate(scene.layers):
        places = grid.places_in(extent(layer, pixel))
        part = grid.part(*places)
        if part.x.size and part.y.size:
            covered[index][places] = covers(layer, part, pixel)
            if not flat:
                painted[index][:, *places] = colors(layer, part)
    return LayerSamples(
        covered.reshape(len(covered), -1), painted.reshape(len(painted), 3, -1), width, height
    )


def _small_canvas(scene: Scene) -> tuple[int, int]:
    """Width and height of a canvas with SIDE pixels along its shortest, fewer where there are many layers."""
    shortest = min(scene.width, scene.height)
    most = min(MOST / len(scene.layers), LONG)
    allowed = (most * shortest**2 / (scene.width * scene.height)) ** 0.5
    scale = min(SIDE, max(8, int(allowed)), shortest) / shortest
    return max(1, round(scene.width * scale)), max(1, round(scene.height * scale))

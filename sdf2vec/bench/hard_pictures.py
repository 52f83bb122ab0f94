"""Small pictures that are hard for descents, made by code; each by its seed, [H, W, 3], 0..1."""

from __future__ import annotations

import numpy as np
from PIL import Image, ImageDraw

from ..arrays import Float32Array

SIDE = 40
Color = tuple[float, ...] | np.ndarray  # or a picture, or a point


def _grid(side: int = SIDE) -> tuple[Float32Array, Float32Array]:
    at: Float32Array = np.arange(side, dtype=np.float32) + np.float32(0.5)
    x, y = np.meshgrid(at, at)
    return x, y


def disc(center: Color, radius: float, color: Color, ground: Color, side: int = SIDE) -> Float32Array:
    """An antialiased disc, laid on a colour or a picture; in pixels."""
    across, down = _grid(side)
    cover = np.clip(radius + 0.5 - np.hypot(across - center[0], down - center[1]), 0.0, 1.0)[..., None]
    below, own = (np.asarray(part, np.float32) for part in (ground, color))
    made: Float32Array = (below + (own - below) * cover).astype(np.float32)
    return made


def one_disc(seed: int) -> Float32Array:
    """A light disc on the right of a dark ground."""
    r = np.random.default_rng(seed)
    return disc((r.uniform(26, 32), r.uniform(10, 30)), r.uniform(4, 7), (0.9, 0.8, 0.3), (0.1, 0.1, 0.2))


def discs(seed: int, count: int = 6) -> Float32Array:
    """Discs of all colours, light and dark."""
    r = np.random.default_rng(seed)
    picture = np.full((SIDE, SIDE, 3), r.uniform(0.2, 0.8, 3), np.float32)
    for _ in range(count):
        picture = disc(r.uniform(4, SIDE - 4, 2), r.uniform(3, 9), r.random(3), picture)
    return picture


def dark_discs(seed: int) -> Float32Array:
    """The same, all dark: what is too bright has to be taken away."""
    dark: Float32Array = discs(seed) * np.float32(0.3)
    return dark


def faint(seed: int) -> Float32Array:
    """A disc of four levels on grey."""
    r = np.random.default_rng(seed)
    picture = disc(r.uniform(12, 28, 2), r.uniform(6, 10), (0.5 + 4 / 255,) * 3, (0.5,) * 3)
    levels: Float32Array = np.round(picture * 255).astype(np.float32) / np.float32(255)
    return levels


def far(seed: int) -> Float32Array:
    """A small disc in a corner of a plain ground."""
    r = np.random.default_rng(seed)
    return disc(r.uniform(3, 6, 2), 2.5, (0.9, 0.2, 0.1), (0.85, 0.85, 0.9), 64)


def lettering(seed: int) -> Float32Array:
    """Letters and lines of one pixel."""
    r = np.random.default_rng(seed)
    image = Image.new("L", (SIDE, SIDE), 255)
    draw = ImageDraw.Draw(image)
    draw.text((3, 3), "".join(r.choice(list("AKMNRWXYZ"), 5)), fill=0)
    for _ in range(3):
        draw.line([tuple(r.integers(0, SIDE, 2).tolist()) for _ in range(2)], fill=0, width=1)
    return np.repeat(np.asarray(image, np.float32)[..., None] / 255, 3, axis=2)


def checkerboard(seed: int) -> Float32Array:
    """Squares of two or three pixels, or waves nearly as fine as pixels."""
    x, y = _grid()
    cell = 2 + seed % 2
    board = (x // cell + y // cell) % 2
    waves = 0.5 + 0.5 * np.sin(x * (2.2 + 0.04 * seed)) * np.sin(y * 2.3)
    return np.repeat((waves if seed % 4 > 1 else board)[..., None], 3, axis=2).astype(np.float32)


def strip(seed: int) -> Float32Array:
    """300 times as long as wide, or the other way round."""
    r = np.random.default_rng(seed)
    knots = r.random((9, 3))
    at = np.linspace(0, 8, 600)
    line = np.stack([np.interp(at, range(9), knots[:, c]) for c in range(3)], axis=1).astype(np.float32)
    rows = np.repeat(line[None], 2, axis=0)
    return rows if seed % 2 else np.ascontiguousarray(rows.transpose(1, 0, 2))


def tiny(seed: int) -> Float32Array:
    """Noise of 1 to 16 pixels a side."""
    r = np.random.default_rng(seed)
    sides = (1, 2, 3, 4, 5, 7, 8, 10, 11, 16)
    return r.random((sides[seed % 10], sides[(3 * seed + 1) % 10], 3), dtype=np.float32)


def ring(seed: int) -> Float32Array:
    """A disc with a round hole, off its centre; 96 pixels a side, on which it is plainly drawn."""
    r = np.random.default_rng(seed)
    center, radius = r.uniform(40, 56, 2), r.uniform(24, 32)
    blue, paper = (0.2, 0.3, 0.7), (0.95, 0.95, 0.9)
    whole = disc(center, radius, blue, np.full((96, 96, 3), paper, np.float32), 96)
    return disc(center + r.uniform(-7, 7, 2), radius * 0.45, paper, whole, 96)


def noise(seed: int) -> Float32Array:
    """Every pixel on its own."""
    return np.random.default_rng(seed).random((SIDE, SIDE, 3), dtype=np.float32)


def scene_like(seed: int) -> Float32Array:
    """Soft hills of colour, edges, some texture: as a photograph has them."""
    r = np.random.default_rng(seed)
    x, y = _grid()
    hills = [
        0.5 + 0.4 * np.sin(x * r.uniform(0.02, 0.2) + y * r.uniform(-0.2, 0.2) + 6 * r.random())
        for _ in "rgb"
    ]
    picture = np.stack(hills, axis=2).astype(np.float32)
    for _ in range(4):
        picture = disc(r.uniform(0, SIDE, 2), r.uniform(4, 12), r.random(3), picture)
    return np.clip(picture + r.normal(0, 0.02, picture.shape), 0, 1).astype(np.float32)

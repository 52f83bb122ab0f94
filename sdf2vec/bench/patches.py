"""A portrait in waves: additive Gabor patches, drawn most exactly in the face, beside triangles.

The picture is scikit-image's astronaut unless another is given, with where its face is.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import skimage

from ..api import render
from ..arrays import Float32Array
from ..deferred import deferred
from ..errors import Sdf2vecError
from ..image import Picture, encode_png, load, resize
from ..scene import Scene
from . import choices
from .table import Asked, Page

if TYPE_CHECKING:
    from .fits import Fitted

measured: Callable[..., tuple[Fitted, Scene]] = deferred("sdf2vec.bench.fits", "measured")

FACE = (0.435, 0.225, 0.13)  # of the astronaut: centre and radius, in shares of the width and the height
ELSEWHERE = 0.3  # how much an error matters far from the face
SHOWN = 256  # pixels across, of each picture in the figure
FIGURE = ".png"
ASTRONAUT = Path(skimage.__file__).parent / "data" / "astronaut.png"


class Way(NamedTuple):
    """One way to say the picture."""

    name: str
    shapes: int
    options: dict[str, Any]


WAYS = (
    Way("Gabor patches, additive", 128, {"kind": "gabor", "compositing": "additive"}),
    Way("translucent sharp triangles (EvoLisa's rule)", 50, {"kind": "triangle", "max_falloff": 0.0}),
    Way("soft triangles", 128, {"kind": "triangle"}),
)


def weight_map(height: int, width: int, face: tuple[float, float, float]) -> Float32Array:
    """How much an error matters [height, width]: most in a soft disc."""
    x, y, radius = face
    rows, columns = (np.arange(height) + 0.5) / height, (np.arange(width) + 0.5) / width
    away = ((columns - x)[None] ** 2 + (rows - y)[:, None] ** 2) / radius**2
    return (ELSEWHERE + (1.0 - ELSEWHERE) * np.exp(-0.5 * away**2)).astype(np.float32)


def psnr_in_face(image: Float32Array, picture: Picture, weights: Float32Array) -> float:
    """dB of an image [H, W, 3] where an error matters more than half way between elsewhere and the face."""
    face = weights > (1.0 + ELSEWHERE) / 2
    wrong = image - picture.premultiplied[..., :3]
    return float(-10 * np.log10(np.mean(wrong[face] ** 2)))


def row(way: Way, fitted: Fitted, in_face: float, scene: Scene) -> str:
    """One way's row of the table."""
    numbers = sum(len(layer.numbers) for layer in scene.layers)
    return (
        f"| {way.shapes} {way.name} | {numbers:,} | {in_face:.2f} | {fitted.psnr:.2f} | {fitted.ssim:.3f} "
        f"| {fitted.flip:.4f} | {fitted.cpu:.0f} |"
    )


HEAD = (
    "| what | numbers | dB in the face | dB | SSIM | FLIP | CPU seconds |",
    "|---|---:|---:|---:|---:|---:|---:|",
)
ABOUT = f"""Fitted with seed 0 under a weight map that counts the face fully and what is far from it {ELSEWHERE:g}. \
A Gabor patch is a Gaussian envelope times a cosine, its colour signed. Scored at the picture's full size."""


def figure(picture: Picture, renders: list[Float32Array]) -> bytes:
    """A PNG: the picture and the renders, side by side."""
    width, height = SHOWN, round(SHOWN * picture.height / picture.width)
    images = (picture.premultiplied[..., :3], *renders)
    small = [resize(np.ascontiguousarray(image), width, height) for image in images]
    return encode_png(np.hstack(small))


def _face(text: str) -> tuple[float, float, float]:
    try:
        x, y, radius = map(float, text.split(","))
    except ValueError:
        x = y = radius = 0.0
    if not (0 <= x <= 1 and 0 <= y <= 1 and 0 < radius <= 1):
        raise Sdf2vecError(f"a face is x,y,radius in shares of the sides, got {text!r}")
    return x, y, radius


def add_choices(parser: argparse.ArgumentParser) -> None:
    """The flags of `sdf2vec bench patches`."""
    parser.add_argument("picture", nargs="?", type=choices.picture, metavar="PICTURE")
    where = ",".join(map(str, FACE))
    choices.add_list(parser, "--face", choices.reader(_face), where, "x,y,radius in shares of the sides")
    choices.add_fit(parser, "preset")


def pages(options: argparse.Namespace, asked: Asked) -> Iterator[Page]:
    """A page after every way to say the picture."""
    fit, picture = choices.fit_of(options), load(options.picture or ASTRONAUT)
    weights = weight_map(picture.height, picture.width, options.face)
    source = Picture(np.repeat(weights[..., None], 3, axis=2))
    rows: list[str] = []
    renders: list[Float32Array] = []
    for way in WAYS:
        fitted, scene = measured(picture, way.shapes, weights=source, seed=0, **fit, **way.options)
        renders.append(render(scene))
        rows.append(row(way, fitted, psnr_in_face(renders[-1], picture, weights), scene))
        asked.say(rows[-1])
        shown = asked.figure(FIGURE, "The picture, then the rows in order")
        table, figures = "\n".join((*HEAD, *rows)), {FIGURE: figure(picture, renders)}
        yield asked.page("A portrait in waves", ABOUT, table, shown, figures=figures)

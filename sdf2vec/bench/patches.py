"""A portrait in waves: additive Gabor patches, drawn most exactly in the face, beside triangles. Writes a table in
Markdown and a figure beside it.

    python -m sdf2vec.bench.patches -o docs/patches.md

The picture is scikit-image's astronaut unless another is given, with where its face is.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import skimage

from ..api import render
from ..arrays import Float32Array
from ..files import write_atomically
from ..image import Picture, encode_png, load, resize
from ..scene import Scene
from .fits import Fitted, measured

FACE = (0.435, 0.225, 0.13)  # of the astronaut: centre and radius, in shares of the width and the height
ELSEWHERE = 0.3  # how much an error matters far from the face
SHOWN = 256  # pixels across, of each picture in the figure
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


def page(picture: Picture, face: tuple[float, float, float], preset: str, command: str, shown: Path) -> str:
    """The table; the figure is written on the way."""
    weights = weight_map(picture.height, picture.width, face)
    source = Picture(np.repeat(weights[..., None], 3, axis=2))
    rows, renders = [], [picture.premultiplied[..., :3]]
    for way in WAYS:
        fitted, scene = measured(picture, way.shapes, preset=preset, weights=source, seed=0, **way.options)
        renders.append(render(scene))
        rows.append(row(way, fitted, psnr_in_face(renders[-1], picture, weights), scene))
        print(rows[-1], flush=True)
    small = [resize(np.ascontiguousarray(image), *_shown_size(picture)) for image in renders]
    write_atomically(shown, encode_png(np.hstack(small)))
    return "\n".join(
        (
            "# A portrait in waves",
            "",
            f"    {command}",
            "",
            f"Fitted with preset `{preset}`, seed 0, under a weight map that counts the face fully and what is "
            f"far from it {ELSEWHERE:g}. A Gabor patch is a Gaussian envelope times a cosine, its colour signed. "
            "Scored at the picture's full size.",
            "",
            "| what | numbers | dB in the face | dB | SSIM | FLIP | CPU seconds |",
            "|---|---:|---:|---:|---:|---:|---:|",
            *rows,
            "",
            f"![The picture, then the rows in order]({shown.name})",
            "",
        )
    )


def _shown_size(picture: Picture) -> tuple[int, int]:
    return SHOWN, round(SHOWN * picture.height / picture.width)


def main() -> None:
    """Entry point of `python -m sdf2vec.bench.patches`."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("picture", nargs="?", type=Path)
    parser.add_argument("--face", default=",".join(map(str, FACE)), help="x,y,radius in shares of the sides")
    parser.add_argument("--preset", default="balanced")
    parser.add_argument("-o", "--output", type=Path, required=True)
    options = parser.parse_args()
    x, y, radius = (float(part) for part in options.face.split(","))
    named = "" if options.picture is None else f"{options.picture} --face {options.face} "
    command = (
        f"python -m sdf2vec.bench.patches {named}--preset {options.preset} -o {options.output.as_posix()}"
    )
    picture = load(options.picture or ASTRONAUT)
    shown = options.output.with_suffix(".png")
    write_atomically(options.output, page(picture, (x, y, radius), options.preset, command, shown).encode())


if __name__ == "__main__":
    main()

"""What so many bytes of an export can say of a picture, beside WebP's. Writes a table in Markdown.

python -m sdf2vec.bench.byte_limits examples/coffee.png --limits 1000,4000,16000 -o docs/byte-limits.md
"""

from __future__ import annotations

import argparse
import io
import math
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from PIL import Image

from .. import api
from ..arrays import Float32Array
from ..files import write_atomically
from ..image import Picture, load
from ..roundtrip import ROUND_TRIPS

TARGETS = ("svg", "shadertoy")
SIDES = (12, 16, 24, 32, 48, 64, 96, 128, 192, 256)  # pixels along the longer one of a thumbnail
QUALITIES = (1, 5, 10, 20, 35, 50, 75)


class Row(NamedTuple):
    """One limit: what was written, and how near an engine draws it to the picture."""

    picture: str
    target: str
    limit: int
    bytes: int
    shapes: int
    psnr: float  # dB
    webp: float  # dB of the nearest WebP that is no larger
    seconds: float  # CPU


def measured(path: Path, target: str, limit: int, **options: Any) -> Row:
    """One fit within a limit, drawn by the first engine of its target."""
    picture = load(path)
    started = time.process_time()
    share = api.share_of([target], max_bytes=limit)
    scene = api.fitted(picture, share=share, **options).scene
    made = api.exported(scene, target, picture=picture, max_bytes=limit)
    seconds = time.process_time() - started
    drawn = ROUND_TRIPS[target][0].draw(made, scene, picture.width, picture.height)
    near = psnr(drawn[..., :3], picture.pixels[..., :3])
    webp = nearest_webp(picture, limit)
    return Row(path.name, target, limit, len(made.raw), scene.shape_count, near, webp, seconds)


def psnr(image: Float32Array, other: Float32Array) -> float:
    """In dB, of opaque pictures."""
    return -10.0 * math.log10(max(float(np.square(image.astype(np.float64) - other).mean()), 1e-10))


def nearest_webp(picture: Picture, limit: int) -> float:
    """The PSNR in dB of the best WebP of at most so many bytes: scaled down, and up again when it is drawn."""
    whole = Image.fromarray(np.rint(picture.pixels[..., :3] * 255).astype(np.uint8))
    found = -math.inf
    for side in (*SIDES, max(whole.size)):
        factor = min(1.0, side / max(whole.size))
        small = whole.resize((max(1, round(whole.width * factor)), max(1, round(whole.height * factor))))
        for quality in QUALITIES:
            stream = io.BytesIO()
            small.save(stream, "WEBP", quality=quality, method=6)
            if stream.tell() <= limit:
                large = Image.open(stream).convert("RGB").resize(whole.size, Image.Resampling.BICUBIC)
                levels: Float32Array = np.asarray(large, np.float32) / np.float32(255)
                found = max(found, psnr(levels, picture.pixels[..., :3]))
    return found


def table(rows: list[Row], command: str) -> Iterator[str]:
    """The page, line by line."""
    yield from (
        "# What so many bytes can say",
        "",
        f"    {command}",
        "",
        "Text as written with `--max-bytes`, drawn by an engine (resvg, OpenGL) at the picture's size; PSNR against "
        "it. WebP: the nearest of several sizes and qualities that is no larger, drawn large by bicubic interpolation.",
        "",
        "| picture | target | limit | bytes | used | shapes | PSNR dB | WebP dB | CPU s |",
        "|---|---|---:|---:|---:|---:|---:|---:|---:|",
    )
    for row in rows:
        yield (
            f"| {row.picture} | {row.target} | {row.limit} | {row.bytes} | {row.bytes / row.limit:.0%} "
            f"| {row.shapes} | {row.psnr:.2f} | {row.webp:.2f} | {row.seconds:.0f} |"
        )


def main() -> None:
    """Entry point of `python -m sdf2vec.bench.byte_limits`."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("pictures", type=Path, nargs="+", metavar="PICTURE")
    parser.add_argument("--limits", default="1000,4000,16000", help="bytes")
    parser.add_argument("--preset", default="balanced")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("-o", "--output", type=Path)
    options = parser.parse_args()
    rows = []
    for path in options.pictures:
        for target in TARGETS:
            for limit in map(int, options.limits.split(",")):
                rows.append(measured(path, target, limit, preset=options.preset, seed=options.seed))
                print(rows[-1], flush=True)
    names = " ".join(path.as_posix() for path in options.pictures)
    command = (
        f"python -m sdf2vec.bench.byte_limits {names} --limits {options.limits} --preset {options.preset}"
    )
    if options.output:
        write_atomically(options.output, ("\n".join(table(rows, command)) + "\n").encode())


if __name__ == "__main__":
    main()

"""What so many bytes of an export can say of a picture, beside WebP's. Writes a table in Markdown.

python -m sdf2vec.bench.byte_limits examples/coffee.png --limits 1250gz,4000,16000 -o docs/byte-limits.md
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
import torch
from PIL import Image

from .. import api
from ..arrays import Float32Array
from ..engines import ENGINES
from ..export.byte_limit import ByteLimit, gzipped_size
from ..files import write_atomically
from ..flip import flip
from ..image import Picture, load
from ..roundtrip import ROUND_TRIPS

TARGETS = "svg,shadertoy"
DRAWN = "resvg", "chromium", "opengl"  # by which engines, as far as a target has them
SIDES = (12, 16, 24, 32, 48, 64, 96, 128, 192, 256)  # pixels along the longer one of a thumbnail
QUALITIES = (1, 5, 10, 20, 35, 50, 75)


class Row(NamedTuple):
    """One limit: what was written, and how near to the picture the engine draws it that draws it worst."""

    picture: str
    target: str
    limit: str
    raw: int  # bytes
    zipped: int  # bytes
    shapes: int
    engine: str
    psnr: float  # dB
    flip: float
    webp: float  # dB of the nearest WebP that is no larger
    seconds: float  # CPU


def measured(path: Path, target: str, limit: str, **options: Any) -> Row:
    """One fit within a limit, drawn by each engine of its target that most people see it with."""
    picture = load(path)
    started = time.process_time()
    share = api.share_of([target], max_bytes=limit)
    scene = api.fitted(picture, share=share, **options).scene
    made = api.exported(scene, target, picture=picture, max_bytes=limit)
    seconds = time.process_time() - started
    drawn = {
        trip.engine: trip.draw(made, scene, picture.width, picture.height)
        for trip in reversed(ROUND_TRIPS[target])
        if trip.engine in DRAWN and not ENGINES[trip.engine].missing()
    }
    near = {engine: psnr(image[..., :3], picture.pixels[..., :3]) for engine, image in drawn.items()}
    worst = min(near, key=near.__getitem__)
    shown, seen = (_planes(image) for image in (drawn[worst], picture.pixels))
    return Row(
        path.name,
        target,
        limit,
        len(made.raw),
        gzipped_size(made.raw),
        scene.shape_count,
        worst,
        near[worst],
        float(flip(shown, seen)),
        nearest_webp(picture, ByteLimit.of(limit).most),
        seconds,
    )


def _planes(image: Float32Array) -> torch.Tensor:
    """[3, H, W]"""
    return torch.from_numpy(np.ascontiguousarray(image[..., :3].transpose(2, 0, 1), np.float32))


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
        "Text as written with `--max-bytes` (`gz`: gzipped), drawn at the picture's size by resvg and Chromium, "
        "whichever is worse, or by OpenGL; PSNR and FLIP against the picture. WebP: the nearest of several sizes and "
        "qualities that is no larger than the limit, drawn large by bicubic interpolation.",
        "",
        "| picture | target | limit | bytes | gzipped | used | shapes | engine | PSNR dB | FLIP | WebP dB | CPU s |",
        "|---|---|---:|---:|---:|---:|---:|---|---:|---:|---:|---:|",
    )
    for row in rows:
        limit = ByteLimit.of(row.limit)
        used = (row.zipped if limit.gzipped else row.raw) / limit.most
        yield (
            f"| {row.picture} | {row.target} | {row.limit} | {row.raw:,} | {row.zipped:,} | {used:.0%} | {row.shapes} "
            f"| {row.engine} | {row.psnr:.2f} | {row.flip:.4f} | {row.webp:.2f} | {row.seconds:.0f} |"
        )


def main() -> None:
    """Entry point of `python -m sdf2vec.bench.byte_limits`."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("pictures", type=Path, nargs="+", metavar="PICTURE")
    parser.add_argument("--limits", default="1000,4000,16000", help="bytes, or gzipped as 4000gz")
    parser.add_argument("--targets", default=TARGETS)
    parser.add_argument("--max-shapes", type=int, default=256)
    parser.add_argument("--preset", default="balanced")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("-o", "--output", type=Path)
    options = parser.parse_args()
    rows = []
    for path in options.pictures:
        for target in options.targets.split(","):
            for limit in options.limits.split(","):
                given = {"preset": options.preset, "seed": options.seed, "max_shapes": options.max_shapes}
                rows.append(measured(path, target, limit, **given))
                print(rows[-1], flush=True)
    names = " ".join(path.name for path in options.pictures)
    command = (
        f"python -m sdf2vec.bench.byte_limits {names} --limits {options.limits} --targets {options.targets} "
        f"--preset {options.preset} --max-shapes {options.max_shapes}"
    )
    if options.output:
        write_atomically(options.output, ("\n".join(table(rows, command)) + "\n").encode())


if __name__ == "__main__":
    main()

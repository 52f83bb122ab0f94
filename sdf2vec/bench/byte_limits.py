"""What so many bytes of an export can say of a picture, beside WebP's."""

from __future__ import annotations

import argparse
import io
import math
import time
from collections.abc import Callable, Iterator
from itertools import chain, product
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from PIL import Image

from .. import api
from ..arrays import Float32Array
from ..deferred import deferred
from ..engines import ENGINES
from ..errors import Sdf2vecError
from ..export.byte_limit import ByteLimit, gzipped_size
from ..image import Picture, load
from . import choices
from .table import Asked, Page

drawn: Callable[..., dict[str, Float32Array]] = deferred("sdf2vec.bench.fits", "drawn")
flip_of: Callable[[Float32Array, Picture], float] = deferred("sdf2vec.bench.fits", "flip_of")

# By which engines most people see them.
TARGETS = {"svg": ("resvg", "chromium"), "shadertoy": ("opengl",), "glsl": ("opengl",), "godot": ("opengl",)}
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
    images = drawn(made, scene, target, _engines(target), picture)
    near = {engine: psnr(image[..., :3], picture.pixels[..., :3]) for engine, image in images.items()}
    worst = min(near, key=near.__getitem__)
    return Row(
        path.name,
        target,
        limit,
        len(made.raw),
        gzipped_size(made.raw),
        scene.shape_count,
        worst,
        near[worst],
        flip_of(images[worst], picture),
        nearest_webp(picture, ByteLimit.of(limit).most),
        seconds,
    )


def _engines(target: str) -> list[str]:
    """Those that draw a target here. Raises Sdf2vecError where there is none."""
    present = [engine for engine in TARGETS[target] if not ENGINES[engine].missing()]
    if not present:
        raise Sdf2vecError(f"{target}: {ENGINES[TARGETS[target][0]].missing()}")
    return present


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


ABOUT = """Text as written with `--max-bytes` (`gz`: gzipped), drawn at the picture's size by resvg and Chromium, \
whichever is worse, or by OpenGL; PSNR and FLIP against the picture. WebP: the nearest of several sizes and \
qualities that is no larger than the limit, drawn large by bicubic interpolation."""
HEAD = (
    "| picture | target | limit | bytes | gzipped | used | shapes | engine | PSNR dB | FLIP | WebP dB | CPU s |",
    "|---|---|---:|---:|---:|---:|---:|---|---:|---:|---:|---:|",
)


def line(row: Row) -> str:
    """A row of the table."""
    limit = ByteLimit.of(row.limit)
    used = (row.zipped if limit.gzipped else row.raw) / limit.most
    return (
        f"| {row.picture} | {row.target} | {row.limit} | {row.raw:,} | {row.zipped:,} | {used:.0%} | {row.shapes} "
        f"| {row.engine} | {row.psnr:.2f} | {row.flip:.4f} | {row.webp:.2f} | {row.seconds:.0f} |"
    )


def add_choices(parser: argparse.ArgumentParser) -> None:
    """The flags of `sdf2vec bench byte-limits`."""
    parser.add_argument("pictures", type=choices.picture, nargs="+", metavar="PICTURE")
    choices.add_list(parser, "--limits", choices.limits, "1000,4000,16000", "bytes, or gzipped as 4000gz")
    choices.add_list(
        parser, "--targets", choices.names("target", TARGETS), "svg,shadertoy", "what is written"
    )
    choices.add_fit(parser, "max_shapes", "preset", "seed")


def pages(options: argparse.Namespace, asked: Asked) -> Iterator[Page]:
    """One page: a row for each picture, target and limit."""
    fit = choices.fit_of(options)
    for target in options.targets:
        _engines(target)
    asks = product(options.pictures, options.targets, options.limits)
    rows = (line(measured(*ask, **fit)) for ask in asks)
    yield asked.page("What so many bytes can say", ABOUT, asked.told(chain(HEAD, rows)))

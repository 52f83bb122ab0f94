"""What so many bytes of an export can say of a picture, beside WebP's."""

from __future__ import annotations

import argparse
import io
import math
import re
import time
from collections.abc import Callable, Collection, Iterator, Mapping
from functools import cache
from itertools import chain, product
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from PIL import Image

from .. import api
from ..arrays import Float32Array
from ..deferred import deferred
from ..engines import ENGINES, resvg
from ..errors import Sdf2vecError
from ..export.byte_limit import ByteLimit, gzipped_size
from ..image import Picture, encode_png, load
from . import choices
from .peers import PEERS, drawn_by, programs_of, required
from .sheet import over_white
from .table import Asked, Page

drawn: Callable[..., dict[str, Float32Array]] = deferred("sdf2vec.bench.fits", "drawn")
flip_of: Callable[[Float32Array, Picture], float] = deferred("sdf2vec.bench.fits", "flip_of")

# By which engines most people see them.
TARGETS = {"svg": ("resvg", "chromium"), "shadertoy": ("opengl",), "glsl": ("opengl",), "godot": ("opengl",)}
SIDES = (12, 16, 24, 32, 48, 64, 96, 128, 192, 256)  # pixels along the longer one of a thumbnail
QUALITIES = (1, 5, 10, 20, 35, 50, 75)
FEW = 16  # shapes of another program, by which is told how many go into a limit;
SPARE = 1.15  # so many times as many are asked for
SHAPE = re.compile(r"<(path|polygon|ellipse|circle|rect|line)\b")


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
    others: tuple[float, ...]  # the same of what other programs make
    seconds: float  # CPU


def measured(
    path: Path, target: str, limit: str, beside: Mapping[str, str] | None = None, **options: Any
) -> Row:
    """One fit within a limit, drawn by each engine of its target that most people see it with; `beside`: other programs
    and where they are.
    """
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
        tuple(nearest_of(name, where, path, limit) for name, where in (beside or {}).items()),
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


@cache
def nearest_of(name: str, where: str, path: Path, limit: str) -> float:
    """The PSNR in dB of the SVG of a program that lays one shape on the other, as many as go into a limit."""
    picture, most = load(path), ByteLimit.of(limit)
    png, size = encode_png(picture.pixels), (picture.width, picture.height)
    few, _ = drawn_by(name, png, size, FEW, where)
    bare = most.size(_without_last(few, FEW).encode())
    each = (most.size(few.encode()) - bare) / FEW
    count = math.ceil(SPARE * max(most.most - bare, 0) / each) + 1
    svg, _ = drawn_by(name, png, size, count, where)
    while SHAPE.search(svg) and most.size(svg.encode()) > most.most:
        svg = _without_last(svg, 1)
    return psnr(over_white(resvg.render(svg, *size)), picture.pixels[..., :3])


def _without_last(svg: str, count: int) -> str:
    """An SVG with a shape in a line without so many of the last."""
    lines = svg.splitlines(keepends=True)
    gone = [index for index, line in enumerate(lines) if SHAPE.search(line)][-count:]
    return "".join(line for index, line in enumerate(lines) if index not in gone)


ABOUT = """Text as written with `--max-bytes` (`gz`: gzipped), drawn at the picture's size by resvg and Chromium, \
whichever is worse, or by OpenGL; PSNR and FLIP against the picture. WebP: the nearest of several sizes and \
qualities that is no larger than the limit, drawn large by bicubic interpolation. Other programs: their SVG, \
with as many shapes as go into the limit, drawn by resvg."""


def head(beside: Collection[str]) -> Iterator[str]:
    """Of the table."""
    others = "".join(f" {name} dB |" for name in beside)
    yield (
        "| picture | target | limit | bytes | gzipped | used | shapes | engine | PSNR dB | FLIP | WebP dB "
        f"|{others} CPU s |"
    )
    yield "|---|---|---:|---:|---:|---:|---:|---|---:|---:|---:|" + "---:|" * (len(beside) + 1)


def line(row: Row) -> str:
    """A row of the table."""
    limit = ByteLimit.of(row.limit)
    used = (row.zipped if limit.gzipped else row.raw) / limit.most
    others = "".join(f" {near:.2f} |" for near in row.others)
    return (
        f"| {row.picture} | {row.target} | {row.limit} | {row.raw:,} | {row.zipped:,} | {used:.0%} | {row.shapes} "
        f"| {row.engine} | {row.psnr:.2f} | {row.flip:.4f} | {row.webp:.2f} |{others} {row.seconds:.0f} |"
    )


def add_choices(parser: argparse.ArgumentParser) -> None:
    """The flags of `sdf2vec bench byte-limits`."""
    parser.add_argument("pictures", type=choices.picture, nargs="+", metavar="PICTURE")
    choices.add_list(parser, "--limits", choices.limits, "1000,4000,16000", "bytes, or gzipped as 4000gz")
    choices.add_list(
        parser, "--targets", choices.names("target", TARGETS), "svg,shadertoy", "what is written"
    )
    grown = [name for name, peer in PEERS.items() if peer.grows]
    parser.add_argument(
        "--beside",
        type=choices.names("program", grown),
        default=[],
        metavar="LIST",
        help=f"other programs, of {', '.join(grown)} (default: none)",
    )
    choices.add_peer(parser)
    choices.add_fit(parser, "max_shapes", "preset", "seed")


def pages(options: argparse.Namespace, asked: Asked) -> Iterator[Page]:
    """One page: a row for each picture, target and limit."""
    fit = choices.fit_of(options)
    for target in options.targets:
        _engines(target)
    programs = programs_of(options.peer)
    beside = {name: required(name, programs) for name in options.beside}
    asks = product(options.pictures, options.targets, options.limits)
    rows = (line(measured(*ask, beside, **fit)) for ask in asks)
    yield asked.page("What so many bytes can say", ABOUT, asked.told(chain(head(beside), rows)))

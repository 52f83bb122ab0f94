"""How near a fit comes to its picture: PSNR, SSIM, FLIP, seconds. Writes a table in Markdown.

    python -m sdf2vec.bench.quality examples/coffee.png --shapes 64 -o docs/quality.md

Pictures with alpha are compared premultiplied.
"""

from __future__ import annotations

import argparse
import os
import time
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import torch

from .. import api
from ..files import write_atomically
from ..flip import flip
from ..image import load
from ..metrics import psnr, ssim
from ..render.reference import render
from ..scene import Scene
from .fits import tensor_of


@dataclass(frozen=True)
class Row:
    """One fit and its measures; seconds are of wall time."""

    picture: str
    kind: str
    paint: str
    compositing: str
    shapes: int
    numbers: int
    psnr: float
    ssim: float
    flip: float
    seconds: float


def measure(path: Path, shapes: int, **options: Any) -> Row:
    """Fits one picture, with options as in `api.fit`, and compares the render at its full size, 8 bits a channel."""
    picture = load(path)
    started = time.perf_counter()
    scene = api.fit(picture, shapes, **options)
    seconds = time.perf_counter() - started
    target = tensor_of(picture)
    drawn = _eight_bits(scene)[: len(target)]
    values = float(psnr(drawn, target)), float(ssim(drawn, target)), float(flip(drawn, target))
    numbers = sum(len(layer.numbers) for layer in scene.layers)
    names = (options["kind"], options["paint"], options["compositing"])
    return Row(path.stem, *names, shapes, numbers, *values, seconds)


def _eight_bits(scene: Scene) -> torch.Tensor:
    return (render(scene) * 255).round() / 255


def table(rows: list[Row], command: str) -> str:
    """The page."""
    head = (
        "# Quality of a fit",
        "",
        "Scored at the picture's full size against the original, 8 bits a channel. Seconds are wall time on "
        f"{os.cpu_count()} CPU cores: compare them within one table only.",
        "",
        f"    {command}",
        "",
        "| picture | kind | paint | compositing | shapes | numbers | PSNR dB | SSIM | FLIP | seconds |",
        "|---|---|---|---|---:|---:|---:|---:|---:|---:|",
    )
    body = (
        f"| {r.picture} | {r.kind} | {r.paint} | {r.compositing} | {r.shapes} | {r.numbers} "
        f"| {r.psnr:.2f} | {r.ssim:.4f} | {r.flip:.4f} | {r.seconds:.1f} |"
        for r in [*rows, *_means(rows)]
    )
    return "\n".join([*head, *body]) + "\n"


def _means(rows: list[Row]) -> Iterator[Row]:
    """Over the pictures, of each way; none for a single picture."""
    ways: dict[tuple[str, str, str, int], list[Row]] = {}
    for r in rows:
        ways.setdefault((r.kind, r.paint, r.compositing, r.shapes), []).append(r)
    for way, alike in ways.items():
        if len(alike) > 1:
            values = ([r.psnr, r.ssim, r.flip, r.seconds] for r in alike)
            yield Row("**mean**", *way, alike[0].numbers, *np.mean(list(values), axis=0).tolist())


def _rows(options: argparse.Namespace) -> Iterator[Row]:
    shared = {"preset": options.preset, "seed": options.seed}
    lists = (text.split(",") for text in (options.kinds, options.paints, options.compositing, options.shapes))
    for path, (kind, paint, compositing, shapes) in product(options.pictures, list(product(*lists))):
        row = measure(path, int(shapes), kind=kind, paint=paint, compositing=compositing, **shared)
        print(row, flush=True)
        yield row


def main() -> None:
    """Entry point of `python -m sdf2vec.bench.quality`."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("pictures", nargs="+", type=Path)
    parser.add_argument("--shapes", default="64", help="numbers, separated by commas")
    parser.add_argument("--kinds", default="circle,ellipse,box,triangle,displaced,mixed")
    parser.add_argument("--paints", default="flat")
    parser.add_argument("--compositing", default="over,additive")
    parser.add_argument("--preset", default="balanced")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("-o", "--output", type=Path, required=True)
    options = parser.parse_args()
    names = " ".join(path.name for path in options.pictures)
    command = (
        f"python -m sdf2vec.bench.quality {names} --shapes {options.shapes} --kinds {options.kinds} "
        f"--paints {options.paints} --compositing {options.compositing} --preset {options.preset} "
        f"--seed {options.seed} -o {options.output}"
    )
    write_atomically(options.output, table(list(_rows(options)), command).encode())


if __name__ == "__main__":
    main()

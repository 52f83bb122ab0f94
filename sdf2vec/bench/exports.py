"""How near the exports of one fit come to its render, on every engine present."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING

from .. import api
from ..deferred import deferred
from ..fit.settings import MIXED
from ..scene import Scene
from . import choices
from .table import Asked, Page

if TYPE_CHECKING:
    from ..roundtrip import Check

check: Callable[[Scene], list[Check]] = deferred("sdf2vec.roundtrip", "check")

ABOUT = """{name}, {shapes} shapes. Each export drawn by a real engine and compared with the torch render in \
float64, over all pixels and RGBA; errors in 8-bit levels, the mean signed. OpenGL and WebGPU are read back as \
floats, all others as 8 bits."""


def table(results: list[Check]) -> Iterator[str]:
    """A row for each export on each engine that is here."""
    yield "| target | engine | size | PSNR dB | largest error | mean error | verdict |"
    yield "|---|---|---:|---:|---:|---:|---|"
    for r in results:
        if not r.missing:
            yield (
                f"| {r.target} | {r.engine} | {r.width} x {r.height} | {r.psnr:.1f} | {r.largest_error:.4f} "
                f"| {r.mean_error:+.4f} | {r.verdict} |"
            )


def add_choices(parser: argparse.ArgumentParser) -> None:
    """The flags of `sdf2vec bench exports`."""
    parser.add_argument("picture", type=choices.picture, metavar="PICTURE")
    choices.add_count(parser, "--shapes", 64, "how many shapes")
    choices.add_fit(parser, "kind", "preset", "seed")
    parser.set_defaults(kind=MIXED)


def pages(options: argparse.Namespace, asked: Asked) -> Iterator[Page]:
    """One page, of shapes of all kinds unless told."""
    scene = api.fit(options.picture, options.shapes, **choices.fit_of(options))
    about = ABOUT.format(name=options.picture.name, shapes=options.shapes)
    yield asked.page("Exports against the render", about, asked.told(table(check(scene))))

"""What digits cost: bytes of a fit with all of them, and with those that the picture needs."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator
from itertools import chain
from typing import Any

from ..deferred import deferred
from ..export.byte_limit import gzipped_size
from ..export.options import Options
from ..exports import Exports
from ..fit.settings import settings_of
from ..image import Picture, load
from ..scene import Scene
from . import choices
from .table import Asked, Page

fit_picture: Callable[..., Scene] = deferred("sdf2vec.fit.loop", "fit_picture")
concise: Callable[..., Scene] = deferred("sdf2vec.fit.digits", "concise")
psnr_of: Callable[[Scene, Picture], float] = deferred("sdf2vec.quality", "psnr_of")

TARGETS = ("json", "glsl", "shadertoy", "svg")
HEAD = (
    f"| shapes | digits | PSNR dB | {' | '.join(f'{t} (gzipped)' for t in TARGETS)} |",
    "|---:|---|---:|" + "---:|" * len(TARGETS),
)


def rows(picture: Picture, shapes: int, fit: dict[str, Any]) -> Iterator[str]:
    """Two rows of a table; `fit` as in `api.fit`."""
    settings = settings_of(shapes, **fit)
    whole = fit_picture(picture, settings)
    for name, scene in (("all", whole), ("needed", concise(whole, picture, settings))):
        yield f"| {shapes} | {name} | {psnr_of(scene, picture):.3f} | {' | '.join(_sizes(scene, picture))} |"


def _sizes(scene: Scene, picture: Picture) -> Iterator[str]:
    """Bytes of each export, and gzipped."""
    for target in TARGETS:
        data = Exports(scene, picture).export(target, Options()).raw
        yield f"{len(data):,} ({gzipped_size(data):,})"


def add_choices(parser: argparse.ArgumentParser) -> None:
    """The flags of `sdf2vec bench digits`."""
    parser.add_argument("picture", type=choices.picture, metavar="PICTURE")
    choices.add_shapes(parser)
    choices.add_fit(parser, "preset", "seed")


def pages(options: argparse.Namespace, asked: Asked) -> Iterator[Page]:
    """One page: two rows for each number of shapes."""
    fit, picture = choices.fit_of(options), load(options.picture)
    found = chain.from_iterable(rows(picture, count, fit) for count in options.shapes)
    about = f"{options.picture.name}. Bytes of each export, with all digits of a fit and with those that it needs."
    yield asked.page("What digits cost", about, asked.told(chain(HEAD, found)))

"""The thesis' tables 5.1 and 5.2 again: its printed FLIP, its preset here, and `balanced` with the same shapes.

The printed values are those of its own picture, woman_darkhair at 512 × 512.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator
from statistics import median
from typing import TYPE_CHECKING, Any, NamedTuple

from ..deferred import deferred
from ..image import Picture, load
from ..scene import Scene
from . import choices
from .table import Asked, Page, spread

if TYPE_CHECKING:
    from .fits import Fitted

measured: Callable[..., tuple[Fitted, Scene]] = deferred("sdf2vec.bench.fits", "measured")

PICTURE = "woman_darkhair"  # whose FLIP is printed
COLUMNS = (
    ("circle", 1),
    ("displaced", 1),
    ("box", 1),
    ("triangle", 1),
    ("circle", 4),
    ("box", 4),
    ("triangle", 4),
)
PRINTED: dict[tuple[int, str], tuple[float, ...]] = {
    (64, "mse"): (0.2122, 0.1825, 0.1948, 0.1912),
    (64, "ssim"): (0.2186, 0.1852, 0.1870, 0.1721),
    (128, "mse"): (0.2077, 0.1674, 0.1879, 0.1811),
    (128, "ssim"): (0.1776, 0.1595, 0.1537, 0.1612, 0.1881, 0.1653, 0.1735),
    (256, "mse"): (0.1757, 0.1434, 0.1746, 0.1679),
    (256, "ssim"): (0.1468, 0.1265, 0.1373, 0.1380, 0.1522, 0.1305, 0.1348),
    (512, "mse"): (0.1434, 0.1081, 0.1343, 0.1330),
    (512, "ssim"): (0.1190, 0.0949, 0.1060, 0.1075, 0.1107, 0.1047, 0.0995),
    (1024, "mse"): (0.1372, 0.0918, 0.1277, 0.1243),
    (1024, "ssim"): (0.1093, 0.0781, 0.0993, 0.0972, 0.0945, 0.0815, 0.0784),
}


class Seeds(NamedTuple):
    """FLIP of the same fit with several seeds, and the CPU seconds of one."""

    flips: list[float]
    cpu: float

    def __str__(self) -> str:
        return spread(self.flips, 4)


def seeds_of(picture: Picture, count: int, seeds: int, **options: Any) -> Seeds:
    """So many fits of the same options; `options` as in `api.fit`."""
    fits = [measured(picture, count, seed=seed, **options)[0] for seed in range(seeds)]
    return Seeds([fit.flip for fit in fits], median(fit.cpu for fit in fits))


def rows(picture: Picture, seeds: int) -> Iterator[str]:
    """FLIP for every number of shapes, loss, kind and size of union."""
    yield "| shapes | loss | kind | thesis | `thesis` here | `balanced`, additive | CPU seconds of the two |"
    yield "|---:|---|---|---:|---:|---:|---:|"
    ours: dict[tuple[int, str, int], Seeds] = {}
    for (count, loss), printed in PRINTED.items():
        for (kind, union), value in zip(COLUMNS, printed, strict=False):
            key = (count, kind, union)
            shared: dict[str, Any] = {"kind": kind, "union": union}
            theirs = seeds_of(picture, count, seeds, preset="thesis", loss=loss, **shared)
            if key not in ours:
                ours[key] = seeds_of(picture, count, seeds, compositing="additive", **shared)
            name = kind if union == 1 else f"{kind} smin×{union}"
            spent = f"{theirs.cpu:.0f}, {ours[key].cpu:.0f}"
            yield f"| {count} | {loss} | {name} | {value:.4f} | {theirs} | {ours[key]} | {spent} |"


ABOUT = """FLIP, lower is better: the median over the seeds, and from the least to the greatest. Thesis: printed in \
its tables 5.1 and 5.2, made on a CUDA GPU. `thesis` here: its method by the fused kernels, on the CPU; what it leaves \
open is stated in `fit/presets.py`. `balanced`: the default fit with the same kind, number and compositing, by its own \
loss. Where shapes are joined, the number counts shapes, not layers. CPU seconds are those of one fit, and include \
compiling kernels when a kind is new."""


def add_choices(parser: argparse.ArgumentParser) -> None:
    """The flags of `sdf2vec bench thesis`."""
    parser.add_argument("picture", type=choices.picture, metavar="PICTURE")
    choices.add_count(parser, "--seeds", 3, "fits of each row")


def pages(options: argparse.Namespace, asked: Asked) -> Iterator[Page]:
    """One page: a row for each figure that the thesis has printed."""
    yield asked.page(
        "The thesis' tables, run again", ABOUT, asked.told(rows(load(options.picture), options.seeds))
    )

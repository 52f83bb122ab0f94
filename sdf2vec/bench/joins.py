"""Known pictures, drawn by resvg, each found by one layer of joined shapes."""

from __future__ import annotations

import argparse
from collections import Counter
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING

import numpy as np

from ..api import render
from ..blend import JOINS
from ..deferred import deferred
from ..engines import resvg
from ..image import Picture, encode_png
from ..scene import Layer, Scene
from . import choices
from .table import Asked, Page

if TYPE_CHECKING:
    from .fits import Fitted

measured: Callable[..., tuple[Fitted, Scene]] = deferred("sdf2vec.bench.fits", "measured")

FIGURE = ".png"
SEEDS = 20
SIDE = 160  # pixels
CUTS = 12
ENOUGH = 38.0  # dB
TOOTH = '<rect x="88" y="18" width="24" height="44" transform="rotate({} 100 100)"/>'
DRAWN = {
    "ring": '<circle cx="100" cy="100" r="70"/><circle class="cut" cx="100" cy="100" r="40"/>',
    "crescent": '<circle cx="95" cy="104" r="72"/><circle class="cut" cx="125" cy="85" r="58"/>',
    "keyhole": '<circle cx="100" cy="100" r="80"/><circle class="cut" cx="100" cy="78" r="25"/>'
    '<rect class="cut" x="88" y="90" width="24" height="58"/>',
    "picture frame": '<rect x="28" y="46" width="144" height="112"/>'
    '<rect class="cut" x="54" y="68" width="92" height="66"/>',
    "gear": "".join(TOOTH.format(60 * tooth) for tooth in range(6))
    + '<circle cx="100" cy="100" r="60"/><circle class="cut" cx="100" cy="100" r="24"/>',
}


def picture(body: str, side: int) -> Picture:
    """SVG shapes, white on black, those of the class `cut` black."""
    style = "<style>*{fill:#fff}.cut{fill:#000}</style>"
    ground = '<rect class="cut" width="200" height="200"/>'
    svg = f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 200 200">{style}{ground}{body}</svg>'
    return Picture(np.ascontiguousarray(resvg.render(svg, side, side)[..., :3]))


def structure(layer: Layer) -> str:
    """How a layer is joined: circle - box."""
    joined = (
        f" {JOINS[joint.join].symbol} {shape.kind}"
        for joint, shape in zip(layer.joints, layer.shapes[1:], strict=True)
    )
    return layer.shapes[0].kind + "".join(joined)


def row(name: str, found: list[tuple[Fitted, Scene]]) -> str:
    """One picture's row of the table."""
    near = np.array([fitted.psnr for fitted, _ in found])
    seconds = float(np.median([fitted.cpu for fitted, _ in found]))
    ((common, times),) = Counter(structure(scene.layers[0]) for _, scene in found).most_common(1)
    common = common.replace("|", "\\|")  # no end of a cell
    shapes = float(np.median([scene.shape_count for _, scene in found]))
    return (
        f"| {name} | `{common}` ({times} of {len(found)}) | {shapes:g} | {np.median(near):.1f} | {near.min():.1f} "
        f"| {(near >= ENOUGH).sum()} of {len(found)} | {seconds:.0f} |"
    )


def table(found: dict[str, list[tuple[Fitted, Scene]]]) -> Iterator[str]:
    """All rows."""
    yield f"| picture | structure most often found | shapes | PSNR dB | worst | ≥ {ENOUGH:g} dB | CPU seconds |"
    yield "|---|---|---:|---:|---:|---:|---:|"
    for name, fits in found.items():
        yield row(name, fits)


def side_by_side(pictures: dict[str, Picture], found: dict[str, list[tuple[Fitted, Scene]]]) -> bytes:
    """A PNG: above the pictures, below the renders of the first seed."""
    columns = [np.vstack([drawn.pixels, render(found[name][0][1])]) for name, drawn in pictures.items()]
    return encode_png(np.hstack(columns).astype(np.float32))


ABOUT = f"""Drawn by resvg at {SIDE} × {SIDE} pixels, white on black; fitted from one shape by `fit(picture, 1, \
kind="mixed", preset="fast", cuts={CUTS})`, {{seeds}} seeds each. `-` is subtraction, `&` intersection, `|` union. \
PSNR is the median over the seeds; resvg's edges are box-filtered, ours logistic: the exact ring has about 43 dB. \
Seconds are the median of user and system time."""


def add_choices(parser: argparse.ArgumentParser) -> None:
    """The flags of `sdf2vec bench joins`."""
    choices.add_count(parser, "--seeds", SEEDS, "how many seeds")


def pages(options: argparse.Namespace, asked: Asked) -> Iterator[Page]:
    """A page after every seed: it takes long."""
    drawn = {name: picture(body, SIDE) for name, body in DRAWN.items()}
    found: dict[str, list[tuple[Fitted, Scene]]] = {name: [] for name in drawn}
    for seed in range(options.seeds):
        for name, one in drawn.items():
            fitted, scene = measured(one, 1, kind="mixed", preset="fast", cuts=CUTS, seed=seed)
            found[name].append((fitted, scene))
            told = f"{fitted.psnr:.1f} dB, {fitted.cpu:.0f} s, {structure(scene.layers[0])}"
            asked.say(f"{name}, seed {seed}: {told}")
        yield asked.page(
            "Known pictures as one layer of joined shapes",
            ABOUT.format(seeds=seed + 1),
            "\n".join(table(found)),
            asked.figure(FIGURE, "The pictures above, the renders of seed 0 below"),
            figures={FIGURE: side_by_side(drawn, found)},
        )

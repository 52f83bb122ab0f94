"""How near the SVG of a fit comes to its render in every renderer, and what it weighs.

Two pictures with alpha, made by code, are added to those named.
"""

from __future__ import annotations

import argparse
import math
import time
from collections.abc import Callable, Iterator
from itertools import product
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .. import api
from ..arrays import Float64Array
from ..deferred import deferred
from ..engines import ENGINES
from ..export.byte_limit import gzipped_size
from ..export.options import Options
from ..export.svg import small_svg
from ..exports import Exports
from ..fit.settings import MIXED
from ..grain import GRAINS
from ..image import Picture, load, premultiply
from ..scene import Scene
from ..shapes import KINDS
from . import choices
from .table import Asked, Page

if TYPE_CHECKING:
    import torch

draw: Callable[[Scene, int, int], torch.Tensor] = deferred("sdf2vec.render.draw", "draw")

Pixels = Float64Array  # [H, W, 4] premultiplied RGBA, 0..1

ALPHA = "alpha: "  # before the names of pictures with alpha
BLURRING = ("resvg", "librsvg", "chromium", "firefox")
SMALL = {grain.name: grain for grain in GRAINS}  # small drawings, fitted to the picture
RENDERERS = {
    "filters": BLURRING,
    **dict.fromkeys(SMALL, BLURRING),
    "portable": (*BLURRING, "cairosvg"),
}
HEAD = (
    "| picture | kind | shapes | profile | bytes | gzip | renderer | dB | dB at twice | mean error "
    "| dB to the picture | gained | seconds |",
    "|---|---|---:|---|---:|---:|---|---:|---:|---:|---:|---:|---:|",
)


class Row(NamedTuple):
    """One drawing in one renderer. `gained`: dB to the picture more than the render has; `seconds`: wall time at the
    fitted size, start of a program included.
    """

    picture: str
    kind: str
    shapes: int
    profile: str
    size: int
    packed: int
    renderer: str
    psnr: float
    psnr_twice: float
    mean: float
    to_picture: float
    gained: float
    seconds: float

    def text(self) -> str:
        return (
            f"| {self.picture} | {self.kind} | {self.shapes} | {self.profile} | {self.size:,} | {self.packed:,} "
            f"| {self.renderer} | {self.psnr:.1f} | {self.psnr_twice:.1f} | {self.mean:+.2f} "
            f"| {self.to_picture:.2f} | {self.gained:+.2f} | {self.seconds:.2f} |"
        )


def alpha_pictures(side: int = 384) -> dict[str, NDArray[np.uint8]]:
    """Two pictures [side, side, 4] with alpha: a soft disc with a hole, and a ribbon that fades along its way."""
    y, x = np.mgrid[:side, :side] / side - 0.5
    ring = np.abs(np.hypot(x, y) - 0.28)
    disc = 1 / (1 + np.exp((ring - 0.11) * 90))
    wave = np.abs(y - 0.22 * np.sin(7 * x))
    ribbon = (wave < 0.12) * (0.25 + 0.75 * (x + 0.5))
    hues = np.stack([0.5 + 0.5 * np.sin(6 * x + phase + 4 * y) for phase in (0, 2, 4)], axis=-1)
    return {
        name: np.round(255 * np.concatenate([hues, alpha[..., None]], axis=-1)).astype(np.uint8)
        for name, alpha in ((f"{ALPHA}ring", disc), (f"{ALPHA}ribbon", ribbon))
    }


def psnr(drawn: Pixels, wanted: Pixels) -> float:
    """Peak signal-to-noise ratio in dB; alpha counts only where something should be transparent."""
    channels = 3 if wanted[..., 3].min() >= 0.999 else 4
    error = float(np.mean(np.square(drawn - wanted)[..., :channels]))
    return -10 * math.log10(error) if error else math.inf


def rows(name: str, scene: Scene, picture: Picture, kind: str, profiles: list[str]) -> Iterator[Row]:
    """All renderers present for each profile."""
    width, height = scene.width, scene.height
    once, twice = (_render(scene, factor * width, factor * height) for factor in (1, 2))
    original = _original(picture)
    for profile in profiles:
        text = _text(scene, picture, profile, name)
        sizes = len(text.encode()), gzipped_size(text.encode())
        for renderer in RENDERERS[profile]:
            if ENGINES[renderer].missing():
                continue
            started = time.perf_counter()
            drawn = _draw(renderer, text, width, height)
            seconds = time.perf_counter() - started
            larger = _draw(renderer, text, 2 * width, 2 * height)
            near = (psnr(drawn, once), psnr(larger, twice), 255 * float((drawn - once)[..., :3].mean()))
            to_picture = psnr(drawn, original)
            gained = to_picture - psnr(once, original)
            figures = (*near, to_picture, gained, seconds)
            yield Row(name, kind, scene.shape_count, profile, *sizes, renderer, *figures)


def _text(scene: Scene, picture: Picture, profile: str, name: str) -> str:
    if grain := SMALL.get(profile):
        return str(small_svg(Exports(scene, picture).drawn(grain), Options(title=name), grain).data)
    text = Exports(scene).export("svg", Options(svg_profile=profile, title=name)).data
    assert isinstance(text, str)
    return text


def _render(scene: Scene, width: int, height: int) -> Pixels:
    return draw(scene, width, height).permute(1, 2, 0).numpy().astype(np.float64)


def _original(picture: Picture) -> Pixels:
    if picture.has_alpha:
        return premultiply(picture.pixels).astype(np.float64)
    height, width, _ = picture.pixels.shape
    return np.concatenate([picture.pixels, np.ones((height, width, 1))], axis=-1).astype(np.float64)


def _draw(renderer: str, text: str, width: int, height: int) -> Pixels:
    return premultiply(ENGINES[renderer].render(text, width, height)).astype(np.float64)


def measured(options: argparse.Namespace, fit: dict[str, Any]) -> Iterator[Row]:
    """Fits and draws everything that was asked for."""
    pictures = {path.stem: load(path) for path in options.pictures}
    pictures |= {name: load(pixels) for name, pixels in alpha_pictures().items()}
    ENGINES["chromium"].missing()  # starts it, so that no drawing pays for that
    for name, picture in pictures.items():
        for kind, shapes in product(options.kinds, options.shapes):
            scene = api.fit(picture, shapes, kind=kind, **fit)
            yield from rows(name, scene, picture, kind, options.profiles)


def _worst(found: list[Row], shapes: int) -> Iterator[str]:
    """The worst of each renderer over all pictures and kinds."""
    yield from (f"## The worst at {shapes} shapes", "")
    yield "| profile | renderer | least dB | least dB at twice | mean error | lost to the photographs | seconds |"
    yield "|---|---|---:|---:|---:|---:|---:|"
    for profile, renderers in RENDERERS.items():
        for renderer in renderers:
            own = [
                row for row in found if (row.profile, row.renderer, row.shapes) == (profile, renderer, shapes)
            ]
            if own:
                photographs = [row.gained for row in own if not row.picture.startswith(ALPHA)]
                yield (
                    f"| {profile} | {renderer} | {min(r.psnr for r in own):.1f} | {min(r.psnr_twice for r in own):.1f} "
                    f"| {max((r.mean for r in own), key=abs):+.2f} | {min(photographs, default=0.0):+.2f} "
                    f"| {max(r.seconds for r in own):.2f} |"
                )
    yield ""


def _sizes(found: list[Row]) -> Iterator[str]:
    """The median size, and that gzipped, over all pictures."""
    yield "| profile | kind | shapes | bytes | gzip |"
    yield "|---|---|---:|---:|---:|"
    for profile, kind, shapes in dict.fromkeys((row.profile, row.kind, row.shapes) for row in found):
        own = {
            row.picture: row
            for row in found
            if (row.profile, row.kind, row.shapes) == (profile, kind, shapes)
        }
        size, packed = (int(np.median([row[i] for row in own.values()])) for i in (4, 5))
        yield f"| {profile} | {kind} | {shapes} | {size:,} | {packed:,} |"


ABOUT = """dB: PSNR against the torch render at the fitted size, and at twice that. Mean error: signed, in 8-bit \
levels. dB to the picture: PSNR against the original; gained: by how much more than the render's. Seconds: wall time \
at the fitted size, the start of rsvg-convert and Firefox included. Chromium draws on the CPU."""


def add_choices(parser: argparse.ArgumentParser) -> None:
    """The flags of `sdf2vec bench svg`."""
    parser.add_argument("pictures", nargs="*", type=choices.picture, metavar="PICTURE")
    choices.add_shapes(parser)
    kinds = choices.names("kind", (*KINDS, MIXED))
    choices.add_list(
        parser, "--kinds", kinds, "circle,ellipse,box,triangle,displaced", "a fit of each of them"
    )
    profiles = choices.names("profile", RENDERERS)
    choices.add_list(parser, "--profiles", profiles, ",".join(RENDERERS), "how SVGs are made")
    choices.add_fit(parser, "preset", "max_falloff", "seed")


def pages(options: argparse.Namespace, asked: Asked) -> Iterator[Page]:
    """One page: the worst of each renderer over all drawings, sizes, then everything."""
    found = []
    for row in measured(options, choices.fit_of(options)):
        asked.say(row.text())
        found.append(row)
    found.sort(key=lambda row: row.shapes)
    worst = (line for shapes in sorted(set(options.shapes)) for line in _worst(found, shapes))
    yield asked.page(
        "SVG against the render: measured",
        ABOUT,
        "\n".join(worst).strip(),
        "## Bytes",
        "\n".join(_sizes(found)),
        "## Everything",
        "\n".join((*HEAD, *(row.text() for row in found))),
    )

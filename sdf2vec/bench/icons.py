"""Icons made by others, fitted: shapes, numbers, bytes and error beside the artist's own and vtracer's.

Any folder of SVG files will do; those of the npm packages `@twemoji/svg` and `flat-color-icons`, say, which
`npm pack` brings.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from skimage.color import deltaE_ciede2000, rgb2lab

from .. import api
from ..arrays import Float32Array
from ..engines import resvg
from ..engines.engine import EngineError
from ..errors import Sdf2vecError
from ..export.byte_limit import gzipped_size
from ..fit.settings import AUTO
from ..image import encode_png, premultiply
from ..scene import Scene
from . import choices
from .peers import PEERS, drawn_by
from .recovery import psnr
from .sheet import over_white
from .svg_shapes import count_numbers, parsed, shapes_of
from .table import Asked, Page

ICONS = 100
SIDE = 256  # pixels
SHOWN = 8  # icons of the figure
FIGURE = ".png"
NEAR = 0.02  # ΔE00 that is no difference
LIMIT = "max_bytes"  # of the export; all other options are the fit's
OFTEN = 10  # icons after which the page is written again: it takes long


class Drawing(NamedTuple):
    """An SVG of an icon: what it is made of, what it weighs, how far it is from the artist's picture."""

    shapes: int  # layers, or elements of an SVG
    numbers: int  # of outlines, gradients and transforms
    bytes: int
    gzipped: int
    psnr: float  # dB, premultiplied, alpha among the channels
    error: float  # mean ΔE00 over white
    seconds: float
    parameters: int = 0  # of the scene, where there is one: numbers of its shapes but 0, no colours


class Icon(NamedTuple):
    """One icon through all hands; the pictures, one below the other, over white."""

    name: str
    drawings: dict[str, Drawing]
    pictures: Float32Array


def chosen(folder: Path, most: int) -> list[Path]:
    """So many of the SVG files below a folder, evenly spaced by name."""
    paths = sorted(folder.rglob("*.svg"))
    steps = np.linspace(0, len(paths) - 1, min(most, len(paths))).round().astype(int)
    return [paths[step] for step in steps]


def color_error(picture: Float32Array, other: Float32Array) -> float:
    """Mean ΔE00 of two pictures with straight alpha over white."""
    first, second = (rgb2lab(over_white(pixels)) for pixels in (picture, other))
    return float(deltaE_ciede2000(first, second).mean())


def measured(
    svg: str, picture: Float32Array, shapes: int, seconds: float = 0.0
) -> tuple[Drawing, Float32Array]:
    """An SVG against the artist's picture [H, W, 4], and how resvg draws it."""
    height, width = picture.shape[:2]
    drawn = resvg.render(svg, width, height)
    data = svg.encode()
    zipped = gzipped_size(data)
    near = psnr(premultiply(picture), premultiply(drawn))
    error = color_error(picture, drawn)
    return Drawing(shapes, count_numbers(svg), len(data), zipped, near, error, seconds), drawn


def elements(svg: str) -> int:
    """How many shapes an SVG draws."""
    return len(list(shapes_of(parsed(svg))))


def parameters_of(scene: Scene) -> int:
    """How many numbers say where a scene's shapes are, and how soft and how joined; a 0 says nothing."""
    joined = sum(bool(joint.smoothness) for layer in scene.layers for joint in layer.joints)
    soft = sum(bool(layer.falloff) for layer in scene.layers)
    own = sum(bool(number) for layer in scene.layers for shape in layer.shapes for number in shape.parameters)
    return joined + soft + own


# --- hands --------------------------------------------------------------------------------------------------


def _fitted(
    svg: str, picture: Float32Array, shapes: int | str, options: dict[str, Any]
) -> tuple[Drawing, Float32Array]:
    """This program's."""
    started = time.process_time()
    fit = {name: value for name, value in options.items() if name != LIMIT}
    scene = api.fit(picture, shapes, **fit)  # type: ignore[arg-type] # "auto", where it can
    text = str(api.exported(scene, "svg", picture=picture, max_bytes=options.get(LIMIT)).data)
    drawing, drawn = measured(text, picture, len(scene.layers), time.process_time() - started)
    return drawing._replace(parameters=parameters_of(scene)), drawn


def _traced(
    svg: str, picture: Float32Array, shapes: int | str, options: dict[str, Any]
) -> tuple[Drawing, Float32Array]:
    """vtracer's at its defaults."""
    text, seconds = drawn_by("vtracer", encode_png(picture))
    return measured(text, picture, elements(text), seconds)


def _own(
    svg: str, picture: Float32Array, shapes: int | str, options: dict[str, Any]
) -> tuple[Drawing, Float32Array]:
    """The artist's."""
    return measured(svg, picture, elements(svg))


HANDS: dict[str, Callable[..., tuple[Drawing, Float32Array]]] = {
    "artist": _own,
    "sdf2vec": _fitted,
    "vtracer": _traced,
}


def through(path: Path, hands: list[str], shapes: int | str, options: dict[str, Any]) -> Icon | None:
    """One icon through all hands; None where resvg draws nothing of it."""
    svg = path.read_text(encoding="utf-8")
    try:
        picture = resvg.render(svg, SIDE, SIDE)
    except EngineError:
        return None
    if not picture[..., 3].any():
        return None
    found = {hand: HANDS[hand](svg, picture, shapes, options) for hand in hands}
    drawings = {hand: drawing for hand, (drawing, _) in found.items()}
    return Icon(path.stem, drawings, np.vstack([over_white(drawn) for _, drawn in found.values()]))


# --- the page -----------------------------------------------------------------------------------------------

COLUMNS = (
    "shapes",
    "parameters",
    "numbers",
    "× artist's",
    "bytes",
    "gzip",
    "PSNR dB",
    "mean ΔE00",
    "seconds",
)


def table(icons: list[Icon]) -> Iterator[str]:
    """A row for each hand: medians."""
    yield f"| {len(icons)} icons, medians | {' | '.join(COLUMNS)} |"
    yield "|---|" + "---:|" * len(COLUMNS)
    for hand in icons[0].drawings:
        drawings = [icon.drawings[hand] for icon in icons]
        middle = Drawing(*np.median(np.array(drawings), axis=0).tolist())
        yield (
            f"| {hand} | {middle.shapes:g} | {middle.parameters:g} | {middle.numbers:g} | {_times(icons, hand)} "
            f"| {middle.bytes:g} | {middle.gzipped:g} | {middle.psnr:.1f} | {middle.error:.2f} | {middle.seconds:.1f} |"
        )


def _times(icons: list[Icon], hand: str) -> str:
    """How many times the artist's numbers a hand takes, the median; a dash where the artist's are not known."""
    if "artist" not in icons[0].drawings:
        return "–"
    numbers = [[icon.drawings[each].numbers for each in (hand, "artist")] for icon in icons]
    return f"{np.median([own / max(artists, 1) for own, artists in numbers]):.2f}"


def compared(icons: list[Icon], hand: str = "sdf2vec", other: str = "vtracer") -> str:
    """On how many icons one hand's drawing is smaller, nearer, or both, than the other's."""
    pairs = [(icon.drawings[hand], icon.drawings[other]) for icon in icons]
    nearer = [ours.error <= theirs.error + NEAR for ours, theirs in pairs]
    smaller = [ours.bytes < theirs.bytes for ours, theirs in pairs]
    zipped = [ours.gzipped < theirs.gzipped for ours, theirs in pairs]
    both = sum(a and b for a, b in zip(nearer, smaller, strict=True))
    return (
        f"Of {len(pairs)} icons, {hand} takes fewer bytes than {other} on {sum(smaller)} (gzipped on {sum(zipped)}), "
        f"is as near or nearer by mean ΔE00 on {sum(nearer)}, and is both on {both}."
    )


def figure(icons: list[Icon]) -> bytes:
    """A PNG: a column for each of some icons, a row for each hand; drawn at half the size."""
    steps = np.linspace(0, len(icons) - 1, min(SHOWN, len(icons))).round().astype(int)
    sheet = np.hstack([icons[step].pictures for step in steps])
    halves = sheet.reshape(sheet.shape[0] // 2, 2, sheet.shape[1] // 2, 2, 3)
    return encode_png(halves.mean(axis=(1, 3)))


ABOUT = """SVG icons made by others, drawn by resvg at {side} × {side} pixels with alpha, and that picture made \
SVG again. Shapes: layers, of others the elements. Parameters: the numbers of the scene's shapes but 0, no \
colours. Numbers: those of outlines, gradients and transforms in the SVG, no colours; then how many times the \
artist's, the median of the icons' own. PSNR: premultiplied, alpha among the channels. ΔE00: the mean of \
CIEDE2000, over white. Both of the SVG as resvg draws it. Seconds of user and system time."""


def page(icons: list[Icon], asked: Asked) -> Page:
    """The whole of it in Markdown."""
    hands = list(icons[0].drawings)
    both = compared(icons) if {"sdf2vec", "vtracer"} <= set(hands) else ""
    shown = asked.figure(FIGURE, f"Some of them; from above: {', '.join(hands)}")
    parts = ABOUT.format(side=SIDE), "\n".join(table(icons)), both, shown
    return asked.page("Icons made by others", *parts, figures={FIGURE: figure(icons)})


def _shapes(text: str) -> int | str:
    return text if text == AUTO else choices.whole_number(1)(text)


def add_choices(parser: argparse.ArgumentParser) -> None:
    """The flags of `sdf2vec bench icons`."""
    parser.add_argument(
        "folder", type=choices.folder, metavar="FOLDER", help="of SVG files, also within others"
    )
    parser.add_argument(
        "--shapes",
        type=choices.reader(_shapes),
        default=AUTO,
        metavar="N|auto",
        help="how many (default: auto)",
    )
    choices.add_count(parser, "--icons", ICONS, "how many of them")
    choices.add_list(parser, "--hands", choices.names("hand", HANDS), ",".join(HANDS), "whose drawings")
    choices.add_fit(parser, "kind", "preset", "max_falloff")
    parser.add_argument(
        "--max-bytes", type=choices.limit, metavar="BYTES", help="of the SVG, as 4000 or 4000gz"
    )


def pages(options: argparse.Namespace, asked: Asked) -> Iterator[Page]:
    """A page after every few icons, and one of all. Raises Sdf2vecError where there is none."""
    hands = [hand for hand in options.hands if hand != "vtracer" or PEERS["vtracer"].found()]
    given = choices.fit_of(options) | {LIMIT: options.max_bytes}
    icons: list[Icon] = []
    for path in chosen(options.folder, options.icons):
        icon = through(path, hands, options.shapes, given)
        if icon is None:
            continue
        icons.append(icon)
        for hand, drawing in icon.drawings.items():
            asked.say(f"{icon.name}, {hand}: {drawing}")
        if len(icons) % OFTEN == 0:
            yield page(icons, asked)
    if not icons:
        raise Sdf2vecError(f"{options.folder}: has no SVG that resvg draws")
    yield page(icons, asked)

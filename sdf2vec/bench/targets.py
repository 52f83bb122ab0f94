"""How many shapes and bytes a FLIP that is wanted takes, beside what the thesis' method and other programs need."""

from __future__ import annotations

import argparse
import math
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from .. import api
from ..arrays import Float32Array
from ..deferred import deferred
from ..errors import Sdf2vecError
from ..export.byte_limit import gzipped_size
from ..fit.settings import AUTO
from ..image import Picture, encode_png, load, resize
from ..outputs import stem_of
from . import choices
from .methods import Method, methods_of
from .peers import programs_of, required
from .sheet import spaced
from .table import Asked, Page
from .thesis import PICTURE, PRINTED

if TYPE_CHECKING:
    from ..quality import Quality
    from ..scene import Scene
    from .measuring import Source
    from .results import Run

quality: Callable[[Scene, Picture], Quality] = deferred("sdf2vec.quality", "quality")
source_of: Callable[[str, Picture, Path], Source] = deferred("sdf2vec.bench.measuring", "source_of")
run_of: Callable[..., tuple[Run, Float32Array]] = deferred("sdf2vec.bench.measuring", "measured")

FIGURE = ".png"
COLUMN, GUTTER = 192, 4  # pixels: how wide a picture of the figure is, and what is between them
PRINTED_NAME = "thesis, printed"


class Point(NamedTuple):
    """How near so many shapes come, and the bytes of their SVG, gzipped; 0 where that is not known."""

    shapes: int
    flip: float
    zipped: int = 0


class Found(NamedTuple):
    """What was taken for one FLIP, and the picture that it makes [H, W, 3]."""

    wanted: float
    point: Point
    raw: int  # bytes of the SVG
    seconds: float  # CPU
    image: Float32Array


Curve = Sequence[Point]  # fewest shapes first


def found(picture: Picture, wanted: float, **options: Any) -> Found:
    """One fit to a FLIP, and its SVG; `options` as in `api.fit`."""
    started = time.process_time()
    scene = api.fitted(picture, AUTO, target_flip=wanted, **options).scene
    data = api.exported(scene, "svg", picture=picture).raw
    seconds = time.process_time() - started
    point = Point(scene.shape_count, quality(scene, picture).flip, gzipped_size(data))
    return Found(wanted, point, len(data), seconds, api.render(scene)[..., :3])


def curve_of(source: Source, method: Method, program: str, counts: Sequence[int], enough: float) -> Curve:
    """What a method comes to with so many shapes, until that is enough. Raises Sdf2vecError where it fails."""
    curve = []
    for count in sorted(counts):
        run, _ = run_of(source, method, program, count, 0)
        if run.error:
            raise Sdf2vecError(f"{method.name}: {run.error}")
        curve.append(Point(run.drawn, run.flip, run.small_gzip))
        if run.flip <= enough:
            break
    return curve


def printed() -> Curve:
    """The best of the thesis' tables for each number of shapes, of its own picture."""
    counts = sorted({count for count, _ in PRINTED})
    return [Point(c, min(min(flips) for (n, _), flips in PRINTED.items() if n == c)) for c in counts]


def needed(curve: Curve, wanted: float) -> Point | None:
    """What a FLIP takes, by the power law between the two points around it; None where it is not between any."""
    for below, above in pairwise(curve):
        if below.flip > wanted >= above.flip:
            share = math.log(below.flip / wanted) / math.log(below.flip / above.flip)
            zipped = _between(below.zipped, above.zipped, share) if below.zipped else 0.0
            return Point(round(_between(below.shapes, above.shapes, share)), wanted, round(zipped))
    return None


def _between(low: float, high: float, share: float) -> float:
    return math.exp((1.0 - share) * math.log(low) + share * math.log(high))


def told(curve: Curve, wanted: float, ours: int) -> str:
    """A cell of the table: shapes, bytes, and how many times as many as ours."""
    point = needed(curve, wanted)
    if point:
        zipped = f" ({point.zipped:,} B)" if point.zipped else ""
        return f"{point.shapes}{zipped}, × {point.shapes / ours:.1f}"
    first, last = curve[0], curve[-1]
    if first.flip <= wanted:
        return f"≤ {first.shapes}"
    return f"> {last.shapes}, × > {last.shapes / ours:.1f}"


# --- the page -----------------------------------------------------------------------------------------------

ABOUT = """Shapes, FLIP and SVG (bytes, gzipped) of `--target-flip`; CPU seconds of the fit and that SVG, in one \
process. Then how many shapes others need for the FLIP that was wanted, by the power law between the two numbers of \
shapes around it that were measured, with the bytes of their smallest SVG (gzipped), and how many times as many \
shapes as ours that is. The thesis printed FLIP of its own picture alone, woman_darkhair: the best of its kinds and \
losses for each number of shapes. Everything at the picture's size."""


def head(others: Sequence[str]) -> Iterator[str]:
    """Of the table."""
    names = ("picture", "FLIP wanted", "shapes", "FLIP", "SVG", "gzipped", "CPU s", *others)
    yield f"| {' | '.join(names)} |"
    yield "|---|" + "---:|" * (len(names) - 1)


def row(name: str, one: Found, others: Mapping[str, Curve | None]) -> str:
    """One picture and FLIP."""
    cells = (told(curve, one.wanted, one.point.shapes) if curve else "" for curve in others.values())
    return (
        f"| {name} | {one.wanted:g} | {one.point.shapes} | {one.point.flip:.4f} | {one.raw:,} | {one.point.zipped:,} "
        f"| {one.seconds:.0f} | {' | '.join(cells)} |"
    )


def figure(rows: Sequence[Sequence[Float32Array]]) -> bytes:
    """A PNG: a row for each picture, itself first, then what was found."""
    strips = []
    for images in rows:
        height = round(COLUMN * images[0].shape[0] / images[0].shape[1])
        small = [resize(np.ascontiguousarray(image), COLUMN, height) for image in images]
        strips.append(spaced(small, across=True, gutter=GUTTER))
    return encode_png(spaced(strips, across=False, gutter=GUTTER))


# --- the command --------------------------------------------------------------------------------------------


def _flip(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not 0.0 < value < 1.0:
        raise Sdf2vecError(f"a FLIP between 0 and 1 is needed, got {text!r}")
    return value


def add_choices(parser: argparse.ArgumentParser) -> None:
    """The flags of `sdf2vec bench targets`."""
    parser.add_argument("pictures", type=choices.picture, nargs="+", metavar="PICTURE")
    flips = choices.reader(choices.several(_flip))
    choices.add_list(parser, "--flips", flips, "0.15,0.1,0.07", "what is wanted")
    choices.add_list(
        parser,
        "--beside",
        choices.reader(methods_of),
        "thesis:mse,primitive",
        "other methods, as of sdf2vec bench",
    )
    choices.add_shapes(parser, "16,32,64,128,256,512,1024,2048")
    choices.add_peer(parser)
    choices.add_fit(parser, "max_shapes", "preset", "seed")


def pages(options: argparse.Namespace, asked: Asked) -> Iterator[Page]:
    """A page after each picture. Raises Sdf2vecError."""
    fit, programs = choices.fit_of(options), programs_of(options.peer)
    methods = [(each, required(each.name, programs) if each.peer else "") for each in options.beside]
    names = [PRINTED_NAME, *(method.name for method in options.beside)]
    lines, rows = list(head(names)), []
    for path in options.pictures:
        picture = load(path)
        ours = [found(picture, wanted, **fit) for wanted in options.flips]
        name, least = stem_of(str(path)), min(options.flips)
        others: dict[str, Curve | None] = {PRINTED_NAME: printed() if name == PICTURE else None}
        with tempfile.TemporaryDirectory() as folder:
            source = source_of(name, picture, Path(folder))
            for method, program in methods:
                others[method.name] = curve_of(source, method, program, options.shapes, least)
        lines.append(asked.told(row(name, one, others) for one in ours))
        rows.append([picture.pixels[..., :3], *(one.image for one in ours)])
        shown = asked.figure(FIGURE, "The picture, then what was found for each FLIP")
        yield asked.page("What a FLIP takes", ABOUT, "\n".join(lines), shown, figures={FIGURE: figure(rows)})

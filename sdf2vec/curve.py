"""How good fewer of a scene's shapes are: quality against their number and the bytes of exports."""

from __future__ import annotations

import csv
import io
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from .deferred import deferred
from .errors import Sdf2vecError
from .export.byte_limit import gzipped_size
from .export.exported import MARK
from .export.options import Options
from .exports import Exports
from .extras import needed
from .files import one_line, write_atomically
from .scene import Scene

if TYPE_CHECKING:
    from .fit.settings import Settings
    from .image import Picture
    from .quality import Quality

CHARTS = (".png", ".svg")
ENDINGS = (".csv", *CHARTS)
HEAD = ("shapes", "psnr_db", "flip")

_thinned: Callable[..., Iterator[Scene]] = deferred("sdf2vec.fit.thinning", "thinned")
_quality_of: Callable[[Scene, Picture], Quality] = deferred("sdf2vec.quality", "quality")
_encoded: Callable[[Any, str], bytes] = deferred("sdf2vec.bench.chart", "encoded")
_figure: Callable[[Sequence[Point]], Any] = deferred("sdf2vec.bench.curve_chart", "figure_of")


class Size(NamedTuple):
    """Bytes of an export, with the files beside it."""

    raw: int
    gzipped: int


class Point(NamedTuple):
    """How near so many shapes come to a picture, and how large each export of them is."""

    shapes: int
    psnr: float  # dB
    flip: float
    sizes: Mapping[str, Size]  # by target


def size_of(parts: Sequence[bytes]) -> Size:
    """Of an export's files."""
    return Size(sum(map(len, parts)), sum(map(gzipped_size, parts)))


def check_curves(paths: Sequence[str]) -> None:
    """Raises Sdf2vecError for a file that is no curve, and where a chart can't be drawn."""
    for path in paths:
        if Path(path).suffix.lower() not in ENDINGS:
            raise Sdf2vecError(f"{one_line(path)}: a curve ends in {', '.join(ENDINGS)}")
    if any(Path(path).suffix.lower() in CHARTS for path in paths):
        needed("matplotlib", "bench", "a curve as a chart (not as .csv)")


def mark_of(path: str) -> bytes:
    """By what a curve is known again."""
    return MARK.encode() if Path(path).suffix.lower() in CHARTS else ",".join(HEAD).encode()


def points_of(
    first: Point,
    scene: Scene,
    picture: Picture,
    settings: Settings,
    options: Options,
    stop: Callable[[], bool] = lambda: False,
) -> list[Point]:
    """The point of a scene, and those of ever fewer of its shapes."""
    found = [first]
    for fewer in _thinned(scene, picture, settings, stop):
        quality, exports = _quality_of(fewer, picture), Exports(fewer, picture)
        made = {target: exports.sketched(target, options) for target in first.sizes}
        sizes = {target: size_of([one.raw, *one.beside.values()]) for target, one in made.items()}
        found.append(Point(fewer.shape_count, quality.psnr, quality.flip, sizes))
    return found


def write_curve(points: Sequence[Point], path: str) -> None:
    """Writes the points as what a file's ending says. Raises Sdf2vecError."""
    form = Path(path).suffix.lower()[1:]
    write_atomically(path, _table(points) if form == "csv" else _encoded(_figure(points), form))


def _table(points: Sequence[Point]) -> bytes:
    """The points as CSV, those of fewest shapes first."""
    targets = list(points[0].sizes)
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow([*HEAD, *(f"{t}_{unit}" for t in targets for unit in ("bytes", "gzip_bytes"))])
    for point in reversed(points):
        sizes = (size for target in targets for size in point.sizes[target])
        writer.writerow([point.shapes, f"{point.psnr:.3f}", f"{point.flip:.5f}", *sizes])
    return stream.getvalue().encode()

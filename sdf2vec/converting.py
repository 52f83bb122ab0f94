"""One picture after another: read, fitted, exported, written. What is heavy is imported when first needed."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

from msgspec.structs import replace

from . import api, guard
from .checkpoint import Checkpoint
from .compact_file import is_compact
from .curve import Point, Size, points_of, size_of, write_curve
from .deferred import deferred
from .errors import Sdf2vecError
from .export import EXPORTERS
from .export.byte_limit import gzipped_size
from .export.exported import Exported
from .export.options import Options
from .exports import Exports, share_of_limit
from .files import one_line, shown_as, write_atomically
from .fit.settings import settings_of
from .outputs import STREAM, Job, beside_of, stem_of
from .progress import Stop, Teller
from .running import Running
from .scene import Scene
from .scene_file import FORMAT
from .sources import bytes_of, opened

if TYPE_CHECKING:
    from .fit.auto import Fitted
    from .fit.loop import Progress
    from .image import Picture
    from .quality import Quality
    from .roundtrip import Check

load_picture: Callable[[Any], Picture] = deferred("sdf2vec.image", "load")
encode_png: Callable[[Any], bytes] = deferred("sdf2vec.image", "encode_png")
is_lettering: Callable[[Any], bool] = deferred("sdf2vec.lettering", "is_lettering")
HINT = "this looks like text: outlines serve it better (vtracer, potrace)"
quality_of: Callable[[Scene, Picture], Quality] = deferred("sdf2vec.quality", "quality")
figure: Callable[..., Check | None] = deferred("sdf2vec.roundtrip", "figure")
EXACT = 80.0  # dB from the picture of what shows it pixel by pixel


@dataclass(frozen=True)
class Work:
    """What is done with every picture: the options given for the fit, those of exports, those of the run."""

    fit: Mapping[str, Any]
    export: Options
    running: Running


@dataclass(frozen=True)
class Done:
    """What came of one picture."""

    shapes: int
    psnr: float  # dB
    flip: float
    bytes: int  # of all files
    seconds: float  # for all of it
    stopped: bool
    met: bool = True  # any target


def convert(job: Job, work: Work, teller: Teller, stop: Stop) -> Done:
    """Fits one picture and writes its exports. Raises Sdf2vecError."""
    started = time.perf_counter()
    with teller.phase("read"):
        picture, data = _read_picture(job.source)
    for note in picture.notes:
        teller.say(note)
    fitting = time.perf_counter()
    checkpoint = Checkpoint(job.checkpoint)
    if left := checkpoint.begin(work.fit.get("start")):
        teller.say(left)
    with teller.phase("fit"):
        fitted = _fit(picture, job, work, teller, stop, checkpoint)
        scene = fitted.scene
    seconds = time.perf_counter() - fitting
    with teller.phase("measure"):
        quality = quality_of(scene, picture)
    early = ", stopped early" if stop.requested else ""
    size = f"{picture.width} x {picture.height}"
    near = _described(quality, picture)
    teller.say(f"{_name(job.source)}: {size}, {scene.count_text}, {near}, fitted in {seconds:.1f} s{early}")
    if fitted.reason:
        teller.say(f"  {fitted.reason}")
    if is_lettering(picture.pixels):
        teller.say(f"  {HINT}")
    original = _original(data(), picture) if work.running.with_original else None
    export = replace(work.export, original=original)
    written = write_exports(scene, job, export, teller, picture)
    checkpoint.remove()
    if job.curves and not stop.requested:
        with teller.phase("curve"):
            first = Point(scene.shape_count, quality.psnr, quality.flip, written.sizes)
            _write_curves(first, scene, picture, job, work, teller, stop)
    seconds = time.perf_counter() - started
    teller.say(f"  {seconds:.1f} s in all{_phases(teller)}")
    met = fitted.met and written.met
    return Done(scene.shape_count, quality.psnr, quality.flip, written.bytes, seconds, stop.requested, met)


def _write_curves(
    first: Point, scene: Scene, picture: Picture, job: Job, work: Work, teller: Teller, stop: Stop
) -> None:
    """What fewer of the shapes come to."""
    options = replace(work.export, title=_title(job, work.export))
    points = points_of(first, scene, picture, settings_of(**work.fit), options, lambda: stop.requested)
    for path in job.curves:
        write_curve(points, path)
        teller.say(f"  {path}: {len(points)} numbers of shapes, {points[-1].shapes} to {points[0].shapes}")


def _phases(teller: Teller) -> str:
    return f": {teller.about_phases()}" if teller.running.verbose else ""


def _described(quality: Quality, picture: Picture) -> str:
    psnr, flip, (width, height) = quality
    where = "" if (width, height) == (picture.width, picture.height) else f" at {width} x {height}"
    return f"PSNR {psnr:.2f} dB, FLIP {flip:.4f}{where}"


def _fit(
    picture: Picture, job: Job, work: Work, teller: Teller, stop: Stop, checkpoint: Checkpoint
) -> Fitted:
    def callback(progress: Progress) -> bool:
        teller.step(progress)
        checkpoint.see(progress)
        return stop.requested

    return api.fitted(picture, callback=callback, share=_share(job, work.export), **work.fit)


def _share(job: Job, options: Options) -> Callable[[Scene], float] | None:
    """How much of the size limit a scene takes, if there is one, in what is written and heeds it."""
    if options.max_bytes is None:
        return None
    limited = [target for target in job.outputs if "max_bytes" in EXPORTERS[target].heeds]
    return share_of_limit(limited, replace(options, title=_title(job, options)))


def _title(job: Job, options: Options) -> str:
    """That of the user, or else the input's name."""
    return options.title or ("a picture" if job.source == STREAM else one_line(stem_of(job.source)))


def _read_picture(source: str) -> tuple[Picture, Callable[[], bytes]]:
    """The picture, and what gives the bytes that it was read from."""
    place = opened(source)
    try:
        return load_picture(place), lambda: bytes_of(place)
    except Sdf2vecError:
        if _is_scene(source):
            shown = one_line(source)
            raise Sdf2vecError(f"{shown}: is a scene, not a picture; sdf2vec export {shown}") from None
        raise


def _original(data: bytes, picture: Picture) -> bytes:
    """The picture's own bytes where a browser shows what was read of them, else a PNG of that."""
    return data if shown_as(data) else encode_png(picture.pixels)


def _is_scene(path: str) -> bool:
    try:
        with open(path, "rb") as stream:
            start = stream.read(200)
            return is_compact(start) or f'"{FORMAT}"'.encode() in start
    except OSError:
        return False


def _name(source: str) -> str:
    return "standard input" if source == STREAM else source


# --- exports --------------------------------------------------------------------------------------------------


class Written(NamedTuple):
    """How many bytes there are in all, whether all keep to the size limit, and how large those of shapes are."""

    bytes: int
    met: bool
    sizes: Mapping[str, Size]  # by target


def write_exports(
    scene: Scene, job: Job, options: Options, teller: Teller, picture: Picture | None = None
) -> Written:
    """Writes the exports of a scene, by default titled after the input."""
    title = _title(job, options)
    exports, written, met = Exports(scene, picture, teller.phase), 0, True
    sizes = dict[str, Size]()
    for target, path in job.outputs.items():
        chosen = replace(options, title=title, alone=path == STREAM)
        with teller.phase(f"export {target}"):
            made = exports.export(target, chosen)
        _write(path, made.raw)
        if not EXPORTERS[target].is_picture:
            sizes[target] = size_of([made.raw, *made.beside.values()])
        written, met = written + len(made.raw), met and made.met
        if path != STREAM:
            with teller.phase(f"check {target}"):
                near = _figure(scene, target, made, chosen, picture) if teller.running.check == "auto" else ""
            teller.say(f"  {path}: {len(made.raw):,} bytes{_packed(target, made.raw)}{near}")
            written += _write_beside(path, EXPORTERS[target].suffix, made.beside, teller)
        for note in made.notes:
            teller.say(f"  {note}")
    return Written(written, met, sizes)


def _write_beside(path: str, suffix: str, files: Mapping[str, bytes], teller: Teller) -> int:
    """Files that belong to an export, named after it."""
    for ending, data in files.items():
        place = beside_of(path, suffix, ending)
        write_atomically(place, data)
        teller.say(f"  {place}: {len(data):,} bytes")
    return sum(map(len, files.values()))


def _packed(target: str, data: bytes) -> str:
    """The size that a web server would send an SVG with."""
    return f" ({gzipped_size(data):,} gzipped)" if target == "svg" else ""


def _write(path: str, data: bytes) -> None:
    if path == STREAM:
        guard.write_output(data)
    else:
        write_atomically(path, data)


def _figure(scene: Scene, target: str, made: Exported, options: Options, picture: Picture | None) -> str:
    """How near the export comes to the render and the picture, where an engine can tell; at the fitted size."""
    try:
        result = figure(scene, target, made, options, picture)
    except Sdf2vecError as error:
        return f"; not checked: {one_line(str(error))}"
    if result is None:
        return ""
    worst = f"{result.largest_error:.0f}" if result.largest_error >= 10 else f"{result.largest_error:.2g}"
    drawn = f"; {result.engine} draws it at {result.psnr:.1f} dB, largest error {worst} levels"
    return drawn if math.isnan(result.near) else f"{drawn}, {_near(result.near)}"


def _near(decibels: float) -> str:
    return "exactly the picture" if decibels >= EXACT else f"{decibels:.1f} dB from the picture"

"""The command line: parses, calls the API, prints. Torch is imported only when there is work for it."""

from __future__ import annotations

import argparse
import gzip
import inspect
import signal
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING, Any, BinaryIO, Literal, NoReturn

from . import __version__, api
from .blend import FRAMINGS
from .errors import Sdf2vecError
from .export import EXPORTERS, beside, export
from .export.options import GLSL_VERSIONS, LAYOUTS, SVG_PROFILES, Options
from .files import one_line, require_writable, write_atomically
from .fit.presets import DEFAULT, PRESETS
from .fit.settings import DEVICES, LOSS_NAMES, settings_of
from .image import Picture, encode_png, load
from .scene import Scene
from .scene_file import load as load_scene
from .scene_file import loads as loads_scene
from .shapes import KINDS

if TYPE_CHECKING:
    from .fit.loop import Progress
    from .roundtrip import Check

STREAM = "-"
OK, FAILED, INTERRUPTED = 0, 2, 130


def main(argv: Sequence[str] | None = None) -> NoReturn:
    """Entry point: exits with 0, with 2 after one line on stderr, or with 130 when interrupted twice."""
    arguments = list(sys.argv[1:] if argv is None else argv)
    run = COMMANDS.get(arguments[0]) if arguments else None
    try:
        status = run(arguments[1:]) if run else _convert(arguments)
        sys.stdout.flush()
        sys.exit(status)
    except Sdf2vecError as error:
        _complain(str(error))
        sys.exit(FAILED)
    except KeyboardInterrupt:
        _complain("interrupted")
        sys.exit(INTERRUPTED)
    except BrokenPipeError:  # whoever reads standard output has seen enough
        sys.exit(OK)
    except OSError as error:
        _complain(f"{error.filename or 'standard output'}: {error.strerror or error}")
        sys.exit(FAILED)


def _complain(message: str) -> None:
    print(f"sdf2vec: {one_line(message)}", file=sys.stderr)


class _Parser(argparse.ArgumentParser):
    """An argument parser whose errors are one line."""

    def error(self, message: str) -> NoReturn:
        raise Sdf2vecError(f"{message} (see {self.prog} --help)")


# --- the main job: pictures in, exports out -----------------------------------------------------------------


def _convert_parser() -> argparse.ArgumentParser:
    parser = _Parser(
        prog="sdf2vec",
        usage="sdf2vec INPUT... [--emit TARGETS] [-o OUT] [options]",
        description="Fits a few soft geometric shapes to pictures and exports them as mathematics.",
        epilog="Other commands, each with its own --help: sdf2vec check | render | export",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("inputs", nargs="+", metavar="INPUT", help="pictures; - reads standard input")
    _add_emit(parser, "glsl")
    _add_output(parser)
    _add_settings(parser.add_argument_group("fit"))
    _add_options(parser)
    parser.add_argument(
        "--with-original", action="store_true", help="a page also holds the picture and a slider to compare"
    )
    parser.add_argument("--quiet", action="store_true", help="print errors only")
    parser.add_argument("--version", action="version", version=f"sdf2vec {__version__}")
    return parser


def _add_settings(group: argparse._ArgumentGroup) -> None:
    """The options of a fit; their names are those of `api.fit`."""
    group.add_argument(
        "--shapes", type=int, metavar="N", help="how many shapes (default: 256, or as many as --start has)"
    )
    group.add_argument(
        "--kind",
        default="triangle",
        metavar="KIND",
        help=f"{', '.join(KINDS)}, mixed, or several: box,circle (default: triangle)",
    )
    group.add_argument(
        "--union", type=int, default=1, metavar="K", help="join K shapes smoothly in each layer"
    )
    group.add_argument("--compositing", help="over or additive (default: over)")
    group.add_argument("--preset", default=DEFAULT, help=f"{', '.join(PRESETS)} (default: {DEFAULT})")
    group.add_argument(
        "--loss",
        metavar="LOSS",
        help=f"{', '.join(LOSS_NAMES)}, or several with weights: l1:0.8,ssim:0.2 (default: the preset's)",
    )
    group.add_argument("--seed", type=int, default=0, help="the same seed gives the same scene (default: 0)")
    group.add_argument(
        "--device", default="auto", choices=DEVICES, help="where to fit (default: auto, CUDA if it works)"
    )
    group.add_argument("--weights", metavar="MASK", help="a picture that is bright where errors matter")
    group.add_argument("--start", metavar="SCENE", help="a scene file to go on from, at any size")
    group.add_argument("--palette", metavar="COLORS", help='the only colours there may be: "#123,#a0b1c2"')
    group.add_argument("--colors", type=int, metavar="K", help="how many colours there may be")
    group.add_argument("--min-area", type=float, metavar="SHARE", help="least area of a shape, of the canvas")
    group.add_argument(
        "--max-falloff",
        type=float,
        metavar="SHARE",
        help="softest edge, of the shortest side: 0 for sharp shapes",
    )
    group.add_argument(
        "--trials", type=int, default=0, metavar="T", help="try a few shapes elsewhere at the end, T times"
    )


SETTINGS = tuple(inspect.signature(settings_of).parameters)[1:]


def _settings(options: argparse.Namespace) -> dict[str, Any]:
    return {name: getattr(options, name) for name in SETTINGS} | {"kind": _kinds(options)}


def _add_emit(parser: argparse.ArgumentParser, default: str) -> None:
    listed = "; ".join(f"{name}: {exporter.about}" for name, exporter in EXPORTERS.items())
    parser.add_argument(
        "--emit",
        "--target",
        action="append",
        metavar="TARGETS",
        help=f"what to write, separated by commas (default: {default}). {listed}",
    )


def _add_output(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "-o",
        "--output",
        metavar="OUT",
        help="a file for one input and one target, else a folder; - writes standard output (default: this folder)",
    )


def _add_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--size", type=int, metavar="PIXELS", help="shortest side of a PNG")
    parser.add_argument("--glsl", default="es300", help=f"GLSL version: {', '.join(GLSL_VERSIONS)}")
    parser.add_argument("--layout", default="auto", help=f"how shaders hold shapes: {', '.join(LAYOUTS)}")
    parser.add_argument(
        "--framing", default="fit", help=f"on a canvas of another shape, shaders: {', '.join(FRAMINGS)}"
    )
    parser.add_argument("--animate", action="store_true", help="the shapes of a Shadertoy breathe")
    parser.add_argument(
        "--svg-profile",
        default=SVG_PROFILES[0],
        help=f"{' or '.join(SVG_PROFILES)}: with blur filters (default), or without, for every renderer",
    )
    parser.add_argument(
        "--svg-size-limit", type=int, metavar="BYTES", help="draw an SVG coarser where it would be larger"
    )


def _export_options(options: argparse.Namespace) -> Options:
    """What the user chose about exports. Raises Sdf2vecError for impossible choices."""
    return Options(**{name: getattr(options, name) for name in EXPORT_OPTIONS if hasattr(options, name)})


EXPORT_OPTIONS = ("size", "glsl", "layout", "framing", "animate", "svg_profile", "svg_size_limit")


@dataclass(frozen=True)
class _Job:
    """One input and the files to write for it."""

    source: str
    outputs: dict[str, str]  # target → path or "-"


def _convert(arguments: list[str]) -> int:
    parser = _convert_parser()
    if not arguments:
        parser.error("no picture given")
    options = parser.parse_intermixed_args(arguments)
    targets = _targets(options.emit, "glsl")
    also_read = [path for path in (options.start, options.weights) if path is not None]
    jobs = _plan(options.inputs, targets, options.output, also_read)
    _check_settings(options, targets)
    status = OK
    for job in jobs:
        try:
            stopped = _convert_one(job, options)
        except Sdf2vecError as error:
            _complain(str(error))
            status = FAILED
            continue
        if stopped:
            return INTERRUPTED
    return status


def _check_settings(options: argparse.Namespace, targets: list[str]) -> None:
    """Refuses impossible settings, and targets that can't hold such a scene, before any work is done."""
    compositing = settings_of(options.shapes, **_settings(options)).compositing
    chosen = _export_options(options)
    for target in targets:
        api.check_export(Scene(1, 1, (), compositing=compositing), target, chosen)


def _kinds(options: argparse.Namespace) -> list[str]:
    return [name.strip() for name in options.kind.split(",") if name.strip()]


def _convert_one(job: _Job, options: argparse.Namespace) -> bool:
    """Fits one picture and writes its exports; True when the user stopped the fit."""
    say = _speaker(options.quiet, STREAM in job.outputs.values())
    picture = _read_picture(job.source)
    for note in picture.notes:
        say(note)
    started = time.perf_counter()
    with _stopping() as stop:
        scene = _fit(picture, options, stop)
        seconds = time.perf_counter() - started
        quality = _quality(scene, picture)
        early = ", stopped early" if stop.requested else ""
        size = f"{picture.width} x {picture.height}"
        say(f"{_name(job.source)}: {size}, {scene.shape_count} shapes, {quality}, {seconds:.1f} s{early}")
        original = encode_png(picture.pixels) if options.with_original else None
        _write_exports(scene, job, options, say, original)
        return stop.requested


def _quality(scene: Scene, picture: Picture) -> str:
    psnr, flip, (width, height) = api.quality(scene, picture)
    where = "" if (width, height) == (picture.width, picture.height) else f" at {width} x {height}"
    return f"PSNR {psnr:.2f} dB, FLIP {flip:.4f}{where}"


def _fit(picture: Picture, options: argparse.Namespace, stop: _Stop) -> Scene:
    with _progress(options.quiet) as report:

        def callback(progress: Progress) -> bool:
            report(progress)
            return stop.requested

        return api.fit(picture, options.shapes, callback=callback, **_settings(options))


def _read_picture(source: str) -> Picture:
    if source != STREAM:
        return load(source)
    return load(_standard_input())


def _standard_input() -> BinaryIO:
    if sys.stdin is None:
        raise Sdf2vecError("standard input: is closed")
    return sys.stdin.buffer


def _name(source: str) -> str:
    return "standard input" if source == STREAM else source


def _write_exports(
    scene: Scene,
    job: _Job,
    options: argparse.Namespace,
    say: Callable[[str], None],
    original: bytes | None = None,
) -> None:
    title = "a picture" if job.source == STREAM else one_line(_stem(job.source))
    chosen = _export_options(options)
    for target, path in job.outputs.items():
        made = replace(chosen, title=title, alone=path == STREAM, original=original)
        data = export(scene, target, made)
        raw = data.encode() if isinstance(data, str) else data
        _write(path, raw)
        if path != STREAM:
            say(f"  {path}: {len(raw):,} bytes{_packed(target, raw)}{_figure(scene, target, data, made)}")
            _write_beside(path, scene, target, made, say)
        for note in EXPORTERS[target].notes(scene, made):
            say(f"  {note}")


def _write_beside(path: str, scene: Scene, target: str, made: Options, say: Callable[[str], None]) -> None:
    """Files that belong to an export, named after it."""
    suffix = EXPORTERS[target].suffix
    for ending, data in beside(scene, target, made).items():
        place = path.removesuffix(suffix) + ending if path.endswith(suffix) else path + ending[len(suffix) :]
        write_atomically(place, data)
        say(f"  {place}: {len(data):,} bytes")


def _packed(target: str, data: bytes) -> str:
    """The size that a web server would send an SVG with."""
    return f" ({len(gzip.compress(data, 9, mtime=0)):,} gzipped)" if target == "svg" else ""


def _write(path: str, data: bytes) -> None:
    if path == STREAM:
        sys.stdout.buffer.write(data)
        sys.stdout.buffer.flush()
    else:
        write_atomically(path, data)


def _figure(scene: Scene, target: str, data: str | bytes, options: Options) -> str:
    """How near the export comes to the render, where an engine can tell; at the fitted size."""
    from .roundtrip import figure

    try:
        result = figure(scene, target, data, options)
    except Sdf2vecError as error:
        return f"; not checked: {one_line(str(error))}"
    if result is None:
        return ""
    return (
        f"; {result.engine} draws it at {result.psnr:.1f} dB, largest error {result.largest_error:.2g} levels"
    )


# --- where things go ----------------------------------------------------------------------------------------


def _targets(emit: list[str] | None, default: str) -> list[str]:
    names = [name.strip() for text in emit or [default] for name in text.split(",")]
    targets = list(dict.fromkeys(name for name in names if name))
    if not targets:
        raise Sdf2vecError(f"--emit names nothing; choose from {', '.join(EXPORTERS)}")
    api.check_targets(targets)
    return targets


def _plan(
    inputs: list[str], targets: list[str], output: str | None, also_read: Sequence[str] = ()
) -> list[_Job]:
    """Which file each export goes to. Raises Sdf2vecError when two would share one, or one can't be written."""
    single = len(inputs) == len(targets) == 1
    if output == STREAM and not single:
        raise Sdf2vecError("standard output takes one input and one target; give a folder with -o")
    jobs = [_Job(source, _outputs(source, targets, output, single)) for source in inputs]
    taken: dict[str, str] = {}
    sources = {str(Path(source).resolve()) for source in (*inputs, *also_read) if source != STREAM}
    for job in jobs:
        for path in job.outputs.values():
            _claim(path, job.source, taken, sources)
    return jobs


def _claim(path: str, source: str, taken: dict[str, str], sources: set[str]) -> None:
    if path == STREAM:
        return
    resolved = str(Path(path).resolve())
    if resolved in sources:
        raise Sdf2vecError(f"{path}: would overwrite an input; choose another -o")
    if resolved in taken:
        raise Sdf2vecError(
            f"{path}: both {taken[resolved]} and {source} would be written there; convert them apart"
        )
    taken[resolved] = source
    require_writable(path)


def _outputs(source: str, targets: list[str], output: str | None, single: bool) -> dict[str, str]:
    if output == STREAM:
        return {targets[0]: STREAM}
    folder = Path(output or ".")
    if single and output and not folder.is_dir() and not output.endswith(("/", "\\")):
        return {targets[0]: output}
    if folder.exists() and not folder.is_dir():
        raise Sdf2vecError(f"{output}: is a file, but a folder is needed for several outputs")
    return {target: str(folder / f"{_stem(source)}{EXPORTERS[target].suffix}") for target in targets}


def _stem(source: str) -> str:
    """What outputs are named after: the same for a picture and for the scene file that was made of it."""
    if source == STREAM:
        return "picture"
    name = Path(source).name
    return name.removesuffix(".scene.json") if name.endswith(".scene.json") else Path(name).stem


# --- progress and interruption ------------------------------------------------------------------------------


class _Stop:
    """Set by the first Ctrl-C; the second one interrupts as usual."""

    requested = False


@contextmanager
def _stopping() -> Iterator[_Stop]:
    stop = _Stop()

    def request(number: int, frame: FrameType | None) -> None:
        stop.requested = True
        signal.signal(signal.SIGINT, signal.default_int_handler)

    before = signal.signal(signal.SIGINT, request)
    try:
        yield stop
    finally:
        signal.signal(signal.SIGINT, before)


@contextmanager
def _progress(quiet: bool) -> Iterator[Callable[[Progress], None]]:
    """A progress bar on a terminal, nothing elsewhere."""
    if quiet or not sys.stderr.isatty():
        yield lambda progress: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, TextColumn, TimeRemainingColumn
    from rich.progress import Progress as Bar

    columns = (
        TextColumn("{task.description:>7}"),
        BarColumn(),
        TextColumn("step {task.completed:.0f}/{task.total:.0f}  loss {task.fields[loss]:.5f}"),
        TimeRemainingColumn(),
    )
    with Bar(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("start", total=1, loss=0.0)

        def report(progress: Progress) -> None:
            bar.update(
                task,
                description=f"{progress.phase} on {progress.device}",
                completed=progress.step,
                total=progress.steps,
                loss=progress.loss,
            )

        yield report


def _speaker(quiet: bool, to_stderr: bool) -> Callable[[str], None]:
    """Prints a line on stdout, or on stderr when stdout carries an export."""

    def say(line: str) -> None:
        if not quiet:
            print(one_line(line), file=sys.stderr if to_stderr else sys.stdout, flush=True)

    return say


# --- scene files --------------------------------------------------------------------------------------------


def _read_scene(source: str) -> Scene:
    if source != STREAM:
        return load_scene(source)
    text = _standard_input().read()
    try:
        return loads_scene(text)
    except Sdf2vecError as error:
        raise Sdf2vecError(f"standard input: {error}") from None


def _render_command(arguments: list[str]) -> int:
    parser = _Parser(prog="sdf2vec render", description="Renders a scene file as PNG.")
    parser.add_argument("scene", help="a .scene.json file; - reads standard input")
    parser.add_argument("--size", type=int, metavar="PIXELS", help="shortest side (default: as fitted)")
    _add_output(parser)
    return _write_scene_exports(parser, parser.parse_args(arguments), ["png"])


def _export_command(arguments: list[str]) -> int:
    parser = _Parser(prog="sdf2vec export", description="Exports a scene file, without fitting anew.")
    parser.add_argument("scene", help="a .scene.json file; - reads standard input")
    _add_emit(parser, "glsl")
    _add_output(parser)
    _add_options(parser)
    options = parser.parse_args(arguments)
    return _write_scene_exports(parser, options, _targets(options.emit, "glsl"))


def _write_scene_exports(
    parser: argparse.ArgumentParser, options: argparse.Namespace, targets: list[str]
) -> int:
    (job,) = _plan([options.scene], targets, options.output)
    _export_options(options)
    scene = _read_scene(options.scene)
    _write_exports(scene, job, options, _speaker(False, STREAM in job.outputs.values()))
    return OK


def _check_command(arguments: list[str]) -> int:
    parser = _Parser(
        prog="sdf2vec check",
        description="Re-renders each export of a scene file on the engines present and compares it with the render.",
    )
    parser.add_argument("scene", help="a .scene.json file; - reads standard input")
    parser.add_argument("--emit", action="append", metavar="TARGETS", help="only these targets")
    options = parser.parse_args(arguments)
    targets = _targets(options.emit, "glsl") if options.emit else None
    results = api.check(_read_scene(options.scene), targets)
    _print_table(results)
    if all(result.missing for result in results):
        raise Sdf2vecError(f"no engine could check anything: {results[0].missing}")
    return OK if all(result.verdict != "differs" for result in results) else 1


def _print_table(results: list[Check]) -> None:
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table

    table = Table(box=None, pad_edge=False)
    for name, justify in TABLE_COLUMNS.items():
        table.add_column(name, justify=justify)
    for r in results:
        numbers = (
            f"{r.width} x {r.height}",
            f"{r.psnr:.1f}",
            f"{r.largest_error:.3f}",
            f"{r.mean_error:+.4f}",
        )
        row = ("", "", "", "") if r.missing else numbers
        verdict = f"{r.verdict}: {r.missing}" if r.missing else r.verdict
        table.add_row(r.target, r.engine, *row, escape(verdict))
    Console(width=None if sys.stdout.isatty() else 200).print(table)


TABLE_COLUMNS: dict[str, Literal["left", "right"]] = {
    "target": "left",
    "engine": "left",
    "size": "right",
    "PSNR dB": "right",
    "largest error": "right",
    "mean error": "right",
    "verdict": "left",
}

COMMANDS: dict[str, Callable[[list[str]], int]] = {
    "check": _check_command,
    "render": _render_command,
    "export": _export_command,
}

if __name__ == "__main__":
    main()

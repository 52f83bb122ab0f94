"""The command line: parses, calls the API, prints. Torch is imported only when there is work for it."""

from __future__ import annotations

import argparse
import gzip
import signal
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING, Any, BinaryIO, Literal, NoReturn

from msgspec.structs import replace

from . import __version__, api, cached, guard
from .declared import add_flags, check_choice, checked, chosen, options_of
from .deferred import deferred
from .errors import Sdf2vecError
from .export import EXPORTERS
from .export.exported import Exported
from .export.options import Options
from .exports import Exports
from .files import one_line, require_writable, write_atomically
from .fit.settings import Settings, settings_of
from .scene import Scene
from .scene_file import load as load_scene
from .scene_file import loads as loads_scene

if TYPE_CHECKING:
    from .fit.loop import Progress
    from .image import Picture
    from .quality import Quality
    from .roundtrip import Check

load_picture: Callable[[Any], Picture] = deferred("sdf2vec.image", "load")
encode_png: Callable[[Any], bytes] = deferred("sdf2vec.image", "encode_png")
quality_of: Callable[[Scene, Picture], Quality] = deferred("sdf2vec.quality", "quality")
figure: Callable[..., Check | None] = deferred("sdf2vec.roundtrip", "figure")
Console, Table = deferred("rich.console", "Console"), deferred("rich.table", "Table")
escape: Callable[[str], str] = deferred("rich.markup", "escape")
Bar, BarColumn = deferred("rich.progress", "Progress"), deferred("rich.progress", "BarColumn")
TextColumn = deferred("rich.progress", "TextColumn")
TimeRemainingColumn = deferred("rich.progress", "TimeRemainingColumn")

SET_HERE = ("title", "alone", "original")  # options of exports that have no flag
STREAM = "-"


def main(argv: Sequence[str] | None = None) -> NoReturn:
    """Entry point: exits with 0, with 2 after one line on stderr, with 70 after one that names a bug, and with 130
    (SIGTERM: 143) when interrupted."""
    guard.run(_run, list(sys.argv[1:] if argv is None else argv))


def _run(arguments: list[str]) -> int:
    run = COMMANDS.get(arguments[0]) if arguments else None
    return run(arguments[1:]) if run else _convert(arguments)


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
        epilog="Other commands, each with its own --help: sdf2vec check | render | export | cache. "
        "--traceback shows where an error that is a bug came from.",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("inputs", nargs="+", metavar="INPUT", help="pictures; - reads standard input")
    _add_emit(parser, "glsl")
    _add_output(parser)
    add_flags(parser.add_argument_group("fit"), Settings)
    add_flags(parser.add_argument_group("export"), Options, SET_HERE)
    parser.add_argument(
        "--with-original", action="store_true", help="a page also holds the picture and a slider to compare"
    )
    parser.add_argument("--quiet", action="store_true", help="print errors only")
    parser.add_argument("--version", action="version", version=f"sdf2vec {__version__}")
    return parser


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


def _export_options(namespace: argparse.Namespace) -> Options:
    """What the user chose about exports. Raises Sdf2vecError for impossible choices."""
    return checked(Options, chosen(namespace, Options))


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
    given = chosen(options, Settings)
    also_read = [given[name] for name in ("start", "weights") if name in given]
    jobs = _plan(options.inputs, targets, options.output, also_read)
    _check_settings(options, targets)
    status = guard.OK
    for job in jobs:
        try:
            stopped = _convert_one(job, options)
        except Exception as error:
            status = max(status, guard.report(error))
            continue
        if stopped:
            return stopped
    return status


def _check_settings(options: argparse.Namespace, targets: list[str]) -> None:
    """Refuses impossible settings, and targets that can't hold such a scene, before any work is done."""
    settings = settings_of(**chosen(options, Settings))
    exports = Exports(Scene(1, 1, (), compositing=settings.compositing))
    for target in targets:
        EXPORTERS[target].check_count(settings.shapes, _export_options(options))
        exports.export(target, replace(_export_options(options), svg_size_limit=None))


def _convert_one(job: _Job, options: argparse.Namespace) -> int:
    """Fits one picture and writes its exports; the exit status where a signal stopped the fit, else 0."""
    say = _speaker(options.quiet, STREAM in job.outputs.values())
    picture = _read_picture(job.source)
    for note in picture.notes:
        say(note)
    started = time.perf_counter()
    with _stopping() as stop:
        scene = _fit(picture, options, stop)
        seconds = time.perf_counter() - started
        quality = _described(scene, picture)
        early = ", stopped early" if stop.requested else ""
        size = f"{picture.width} x {picture.height}"
        say(f"{_name(job.source)}: {size}, {scene.shape_count} shapes, {quality}, {seconds:.1f} s{early}")
        original = encode_png(picture.pixels) if options.with_original else None
        _write_exports(scene, job, options, say, original)
        return stop.status


def _described(scene: Scene, picture: Picture) -> str:
    psnr, flip, (width, height) = quality_of(scene, picture)
    where = "" if (width, height) == (picture.width, picture.height) else f" at {width} x {height}"
    return f"PSNR {psnr:.2f} dB, FLIP {flip:.4f}{where}"


def _fit(picture: Picture, options: argparse.Namespace, stop: _Stop) -> Scene:
    with _progress(options.quiet) as report:

        def callback(progress: Progress) -> bool:
            report(progress)
            return stop.requested

        return api.fit(picture, callback=callback, **chosen(options, Settings))


def _read_picture(source: str) -> Picture:
    if source != STREAM:
        return load_picture(source)
    return load_picture(_standard_input())


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
    plain, exports = _export_options(options), Exports(scene)
    for target, path in job.outputs.items():
        chosen = replace(plain, title=title, alone=path == STREAM, original=original)
        made = exports.export(target, chosen)
        _write(path, made.raw)
        if path != STREAM:
            near = _figure(scene, target, made, chosen)
            say(f"  {path}: {len(made.raw):,} bytes{_packed(target, made.raw)}{near}")
            _write_beside(path, EXPORTERS[target].suffix, made.beside, say)
        for note in made.notes:
            say(f"  {note}")


def _write_beside(path: str, suffix: str, files: Mapping[str, bytes], say: Callable[[str], None]) -> None:
    """Files that belong to an export, named after it."""
    for ending, data in files.items():
        place = path.removesuffix(suffix) + ending if path.endswith(suffix) else path + ending[len(suffix) :]
        write_atomically(place, data)
        say(f"  {place}: {len(data):,} bytes")


def _packed(target: str, data: bytes) -> str:
    """The size that a web server would send an SVG with."""
    return f" ({len(gzip.compress(data, 9, mtime=0)):,} gzipped)" if target == "svg" else ""


def _write(path: str, data: bytes) -> None:
    if path == STREAM:
        guard.write_output(data)
    else:
        write_atomically(path, data)


def _figure(scene: Scene, target: str, made: Exported, options: Options) -> str:
    """How near the export comes to the render, where an engine can tell; at the fitted size."""
    try:
        result = figure(scene, target, made, options)
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
    for target in targets:
        check_choice("target", target, EXPORTERS)
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
    """Set by the first Ctrl-C or SIGTERM; the second one interrupts as usual."""

    status = guard.OK

    @property
    def requested(self) -> bool:
        return self.status != guard.OK


@contextmanager
def _stopping() -> Iterator[_Stop]:
    stop = _Stop()

    def request(number: int, frame: FrameType | None) -> None:
        stop.status = guard.SIGNALLED + number
        _restore(before)

    before = {number: signal.signal(number, request) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield stop
    finally:
        _restore(before)


def _restore(handlers: Mapping[signal.Signals, Any]) -> None:
    for number, handler in handlers.items():
        signal.signal(number, handler)


@contextmanager
def _progress(quiet: bool) -> Iterator[Callable[[Progress], None]]:
    """A progress bar on a terminal, nothing elsewhere."""
    if quiet or not sys.stderr.isatty():
        yield lambda progress: None
        return
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
            guard.say(line, sys.stderr if to_stderr else sys.stdout)

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
    options_of(Options)["size"].add_flag(parser)
    _add_output(parser)
    return _write_scene_exports(parser, parser.parse_args(arguments), ["png"])


def _export_command(arguments: list[str]) -> int:
    parser = _Parser(prog="sdf2vec export", description="Exports a scene file, without fitting anew.")
    parser.add_argument("scene", help="a .scene.json file; - reads standard input")
    _add_emit(parser, "glsl")
    _add_output(parser)
    add_flags(parser, Options, SET_HERE)
    options = parser.parse_args(arguments)
    return _write_scene_exports(parser, options, _targets(options.emit, "glsl"))


def _write_scene_exports(
    parser: argparse.ArgumentParser, options: argparse.Namespace, targets: list[str]
) -> int:
    (job,) = _plan([options.scene], targets, options.output)
    _export_options(options)
    scene = _read_scene(options.scene)
    _write_exports(scene, job, options, _speaker(False, STREAM in job.outputs.values()))
    return guard.OK


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
    return guard.OK if all(result.verdict != "differs" for result in results) else 1


def _cache_command(arguments: list[str]) -> int:
    about = "Where compiled kernels are kept, how large that is, and how to empty it."
    return cached.command(_Parser(prog="sdf2vec cache", description=about), arguments)


def _print_table(results: list[Check]) -> None:
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
    "cache": _cache_command,
}

if __name__ == "__main__":
    main()

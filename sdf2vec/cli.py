"""The command line: parses, calls the API, prints. Torch is imported only when there is work for it."""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Callable, Collection, Sequence
from dataclasses import asdict
from math import isfinite
from typing import TYPE_CHECKING, Literal, NoReturn

from msgspec.structs import replace

from . import __version__, cached, completing, guard, warming
from .batch import READ_TOO, Batch, about, about_left, check_streams, exit_status, run_batch
from .bench import command as benching
from .checkpoint import OFF
from .converting import Work, write_exports
from .curve import check_curves
from .declared import add_flags, checked, chosen, options_of
from .deferred import deferred
from .errors import Sdf2vecError
from .export import EXPORTERS
from .export.options import Options
from .exports import Exports
from .fit.settings import Settings, settings_of
from .outputs import STREAM, Places, places_of, plan, read_exports
from .progress import Teller, stopping, telling
from .report import Report
from .running import Running, check_together
from .scene import Scene
from .scene_file import load as load_scene
from .scene_file import loads as loads_scene
from .sources import sources_of, standard_input

if TYPE_CHECKING:
    from .roundtrip import Check

Console, Table = deferred("rich.console", "Console"), deferred("rich.table", "Table")
round_trips: Callable[..., list[Check]] = deferred("sdf2vec.roundtrip", "check")
legend: Callable[[], str] = deferred("sdf2vec.roundtrip", "legend")
escape: Callable[[str], str] = deferred("rich.markup", "escape")

SET_HERE = ("alone", "original", "drawing")  # options of exports that have no flag
OF_FITS = (
    "with_original",
    "recursive",
    "skip_existing",
    "jobs",
    "engine",
    "address",
    "shard",
    "report",
    "checkpoint",
    "curve",
)  # what only fits heed of a run
WARM_UP = "--warm-up"
DIFFERS = 1  # exit status of a check


def main(argv: Sequence[str] | None = None) -> NoReturn:
    """Entry point: exits with 0; 1 where a check finds a difference; 2 after one line on stderr; 3 where some pictures
    failed; 4 where a target was missed; 70 after a line that names a bug; 130 (SIGTERM: 143) when interrupted."""
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
        epilog="Other commands, with their own --help: sdf2vec check | render | export | bench | cache | completion. "
        "--warm-up compiles all that fits may need. --traceback shows where an error that is a bug came from. "
        "Exit status: 0; 2 for what you can mend, 3 where only some pictures failed, 4 where a target was not reached "
        "(the nearest is written), 70 for a bug.",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument(
        "inputs",
        nargs="+",
        metavar="INPUT",
        help="pictures, folders of pictures, patterns; - reads standard input",
    )
    _add_emit(parser, "glsl")
    _add_output(parser)
    add_flags(parser.add_argument_group("run"), Running)
    add_flags(parser.add_argument_group("fit"), Settings)
    add_flags(parser.add_argument_group("export"), Options, SET_HERE)
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
        action="append",
        metavar="OUT",
        help="a file, whose ending says what it is to be, or a folder (a name without an ending); - writes standard "
        "output; may be given several times (default: this folder)",
    )


def _running_of(namespace: argparse.Namespace) -> Running:
    """What the user chose about the run. Raises Sdf2vecError for what is impossible or without effect."""
    given = chosen(namespace, Running)
    running = checked(Running, given)
    check_together(running, given)
    return running


def _export_options(namespace: argparse.Namespace, targets: Collection[str]) -> Options:
    """What the user chose about exports. Raises Sdf2vecError for impossible choices, and for those without effect."""
    given = chosen(namespace, Options)
    options = checked(Options, given)
    also = {"original": "--with-original"} if getattr(namespace, "with_original", False) else {}
    for name, flag in ({name: options_of(Options)[name].flag for name in given} | also).items():
        heeding = [target for target, exporter in EXPORTERS.items() if name in exporter.heeds]
        if not set(targets) & set(heeding):
            raise Sdf2vecError(
                f"{flag} has no effect on {', '.join(targets)}; it is for {', '.join(heeding)}"
            )
    return replace(options, title=given.get("title", ""))


def _convert(arguments: list[str]) -> int:
    parser = _convert_parser()
    if not arguments:
        parser.error("no picture given")
    options = parser.parse_intermixed_args(arguments)
    places = places_of(options.emit, options.output, "glsl")
    given, running = chosen(options, Settings), _running_of(options)
    also_read = [given[name] for name in READ_TOO if name in given]
    sources = sources_of(options.inputs, running.recursive)
    check_curves(running.curve)
    jobs = plan(sources, places, also_read, running.force, running.checkpoint, running.curve)
    check_streams(jobs, running)
    work = Work(given, _export_options(options, places.targets), running)
    _check_settings(work, places)
    batch = Batch(jobs, work, Report(running.report, running.force))
    with stopping() as stop:
        try:
            run_batch(batch, stop)
        finally:
            left = about_left(batch)
            if left and len(jobs) > 1:
                guard.complain(left)
    if len(jobs) > 1:
        Teller(running, to_stderr=any(STREAM in job.outputs.values() for job in jobs)).say(about(batch))
    return stop.status or exit_status(batch)


def _check_settings(work: Work, places: Places) -> None:
    """Refuses impossible settings, and targets that can't hold such a scene, before any work is done."""
    settings = settings_of(**work.fit)
    exports = Exports(Scene(1, 1, (), compositing=settings.compositing))
    for target in places.targets:
        options = replace(work.export, alone=places.files.get(target) == STREAM)
        EXPORTERS[target].check_count(settings.most, options)
        if not (made := exports.export(target, options)).met:
            raise Sdf2vecError(made.notes[-1])


# --- scene files --------------------------------------------------------------------------------------------


def _read_scene(source: str) -> Scene:
    if source != STREAM:
        return load_scene(source)
    text = standard_input().read()
    try:
        return loads_scene(text)
    except Sdf2vecError as error:
        raise Sdf2vecError(f"standard input: {error}") from None


def _render_parser() -> argparse.ArgumentParser:
    parser = _scene_parser("render", "Renders a scene file as PNG, JPEG or WebP.")
    _add_output(parser)
    options_of(Options)["size"].add_flag(parser)
    add_flags(parser, Running, (*OF_FITS, "check"))
    return parser


def _render_command(arguments: list[str]) -> int:
    options = _render_parser().parse_args(arguments)
    pictures = [name for name, exporter in EXPORTERS.items() if exporter.is_picture]
    return _write_scene_exports(options, places_of(None, options.output, "png", pictures))


def _export_parser() -> argparse.ArgumentParser:
    parser = _scene_parser("export", "Exports a scene file, without fitting anew.")
    _add_emit(parser, "glsl")
    _add_output(parser)
    add_flags(parser.add_argument_group("run"), Running, OF_FITS)
    add_flags(parser.add_argument_group("export"), Options, SET_HERE)
    return parser


def _export_command(arguments: list[str]) -> int:
    options = _export_parser().parse_args(arguments)
    return _write_scene_exports(options, places_of(options.emit, options.output, "glsl"))


def _scene_parser(command: str, does: str) -> argparse.ArgumentParser:
    parser = _Parser(prog=f"sdf2vec {command}", description=does)
    parser.add_argument("scene", help="a .scene.json or .sdf file; - reads standard input")
    return parser


def _write_scene_exports(options: argparse.Namespace, places: Places) -> int:
    running = _running_of(options)
    (job,) = plan({options.scene: ""}, places, force=running.force, checkpoint=OFF)
    export = _export_options(options, places.targets)
    with telling(running, STREAM in job.outputs.values()) as teller:
        started = time.perf_counter()
        written = write_exports(_read_scene(options.scene), job, export, teller)
        if running.verbose:
            teller.say(f"  {time.perf_counter() - started:.1f} s in all: {teller.about_phases()}")
    return guard.OK if written.met else guard.MISSED


def _check_parser() -> argparse.ArgumentParser:
    parser = _Parser(
        prog="sdf2vec check",
        usage="sdf2vec check [FILE...] SCENE [--emit TARGETS] [--json] [-q] [-v]",
        description="Re-renders exports of a scene file on the engines present and compares them with the render: "
        "the files given, or each target anew. Exit code 1 where one differs.",
    )
    parser.add_argument("files", nargs="+", metavar="FILE", help="exports, and a scene file; - reads it")
    parser.add_argument("--emit", action="append", metavar="TARGETS", help="only these targets")
    parser.add_argument("--json", action="store_true", help="print a JSON list instead of a table")
    add_flags(parser, Running, (*OF_FITS, "check", "force"))
    return parser


def _check_command(arguments: list[str]) -> int:
    options = _check_parser().parse_intermixed_args(arguments)
    running = _running_of(options)
    scene, files = _scene_and_files(options.files)
    if files and options.emit:
        raise Sdf2vecError("either files to check or --emit, not both")
    targets = places_of(options.emit, None, "glsl").targets if options.emit else None
    with telling(running) as teller, teller.phase("check"):
        results = round_trips(_read_scene(scene), targets, None, read_exports(files) or None, teller.name)
    if options.json:
        teller.say_all(_as_json(results))
    else:
        _print_table(results, running)
    if all(result.missing for result in results):
        raise Sdf2vecError(f"no engine could check anything: {results[0].missing}")
    if running.verbose and not options.json:
        teller.say(f"{teller.seconds['check']:.1f} s in all")
    return guard.OK if all(result.verdict != "differs" for result in results) else DIFFERS


def _cache_parser() -> argparse.ArgumentParser:
    about = "Where compiled kernels are kept, how large that is, and how to empty it."
    parser = _Parser(prog="sdf2vec cache", description=about)
    cached.add_choices(parser)
    return parser


def _cache_command(arguments: list[str]) -> int:
    return cached.command(_cache_parser().parse_args(arguments))


def _bench_parser(name: str = "") -> argparse.ArgumentParser:
    parser = _Parser(prog=f"sdf2vec bench {name}".rstrip())
    benching.add_choices(parser, name)
    return parser


def _bench_command(arguments: list[str]) -> int:
    name = benching.name_in(arguments)
    options = _bench_parser(name).parse_intermixed_args(arguments[1 if name else 0 :])
    return benching.command(name, options, arguments)


def _warm_up_command(arguments: list[str]) -> int:
    about = "Compiles the kernels of every kind of shape, so that no fit has to: half a minute, once."
    return warming.command(_Parser(prog="sdf2vec --warm-up", description=about), arguments)


def _completion_parser() -> argparse.ArgumentParser:
    parser = _Parser(
        prog="sdf2vec completion",
        description="Prints a script that completes the command line: for bash, source <(sdf2vec completion bash).",
    )
    parser.add_argument("shell", help=", ".join(completing.SHELLS))
    return parser


def _completion_command(arguments: list[str]) -> int:
    parsers = {
        "": _convert_parser(),
        "check": _check_parser(),
        "render": _render_parser(),
        "export": _export_parser(),
        "cache": _cache_parser(),
        "bench": _bench_parser(),
        "completion": _completion_parser(),
    }
    print(completing.script(_completion_parser().parse_args(arguments).shell, parsers), end="")
    return guard.OK


def _scene_and_files(files: Sequence[str]) -> tuple[str, list[str]]:
    scenes = [path for path in files if path == STREAM or path.lower().endswith(".json")]
    scenes = scenes or [path for path in files if path.lower().endswith(EXPORTERS["sdf"].suffix)]
    scene = scenes[0] if len(scenes) == 1 else files[0] if len(files) == 1 else None
    if scene is None:
        raise Sdf2vecError(f"one scene file (.json or .sdf) is needed, got {len(scenes)}: {', '.join(files)}")
    return scene, [path for path in files if path != scene]


def _as_json(results: list[Check]) -> str:
    rows = ({**asdict(result), "verdict": result.verdict} for result in results)
    plain = [
        {k: v if not isinstance(v, float) or isfinite(v) else None for k, v in row.items()} for row in rows
    ]
    return json.dumps(plain, indent=1)


def _print_table(results: list[Check], running: Running) -> None:
    if running.quiet:
        return
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
    console = Console(width=None if sys.stdout.isatty() else 200)
    console.print(table)
    console.print(f"\n{legend()}", highlight=False)


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
    "bench": _bench_command,
    "completion": _completion_command,
    WARM_UP: _warm_up_command,
}

if __name__ == "__main__":
    main()

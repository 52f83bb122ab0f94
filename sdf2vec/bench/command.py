"""`sdf2vec bench`: the comparison of pictures, where methods fail, the baseline, and all other benches by name."""

from __future__ import annotations

import argparse
import textwrap
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from .. import guard
from ..deferred import deferred
from ..errors import Sdf2vecError
from ..extras import needed
from ..outputs import STREAM
from . import choices, table
from .benches import BENCHES
from .methods import GROUPS, USUAL, methods_of
from .peers import programs_of

compare: Callable[..., Any] = deferred("sdf2vec.bench.comparing", "compare")
make_plan: Callable[..., Any] = deferred("sdf2vec.bench.comparing", "Plan")
write_page: Callable[..., Any] = deferred("sdf2vec.bench.comparing", "write_page")
run_catalogue: Callable[..., Any] = deferred("sdf2vec.bench.stability", "run")
check_baseline: Callable[..., Any] = deferred("sdf2vec.bench.baseline", "check")

WORSE = 1  # exit status
USAGE = """sdf2vec bench PICTURE... -o DIR [options]
       sdf2vec bench --stability -o DIR
       sdf2vec bench --baseline FILE
       sdf2vec bench NAME [arguments] [-o FILE]"""
ABOUT = """Compares presets, variants, the thesis' method and other programs on pictures.
Speed and size are charted against accuracy. What a folder holds already is not run again.
By its NAME another bench is run, which writes a page in Markdown (sdf2vec bench NAME --help)."""


def name_in(arguments: Sequence[str]) -> str:
    """The bench that is asked for by its name; empty for none."""
    return arguments[0] if arguments and arguments[0] in BENCHES else ""


def add_choices(parser: argparse.ArgumentParser, name: str) -> None:
    """The flags of a bench."""
    if not name:
        _add_comparison(parser)
        return
    about = BENCHES[name].about
    parser.description = f"{about[0].upper()}{about[1:]}."
    BENCHES[name].add_choices(parser)
    parser.add_argument(
        "-o",
        "--output",
        default=STREAM,
        metavar="FILE",
        help="where the page in Markdown goes, figures beside it; a folder takes it by the bench's name "
        "(default: standard output, without figures)",
    )


def _add_comparison(parser: argparse.ArgumentParser) -> None:
    parser.usage, parser.description, parser.epilog = USAGE, ABOUT, _epilog()
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    parser.add_argument("pictures", nargs="*", metavar="PICTURE")
    parser.add_argument(
        "-o", "--output", type=Path, metavar="DIR", help="where results, charts and the page go"
    )
    choices.add_shapes(parser)
    parser.add_argument(
        "--methods", default=",".join(USUAL), help=f"methods and groups of them (default: {','.join(USUAL)})"
    )
    choices.add_count(parser, "--repeat", 1, "so many seeds")
    choices.add_peer(parser)
    parser.add_argument("--stability", action="store_true", help="run the catalogue of where methods fail")
    choices.add_count(parser, "--seeds", 20, "of the catalogue")
    parser.add_argument(
        "--cases", default="", metavar="NAMES", help="only these of the catalogue, separated by semicolons"
    )
    parser.add_argument(
        "--baseline",
        metavar="FILE",
        help="compare fast fits of five small pictures with FILE; where there is none, write it",
    )


def _epilog() -> str:
    """Which benches there are, and which methods."""
    widest = max(map(len, BENCHES))
    benches = (f"  {name:{widest}}  {bench.about}" for name, bench in BENCHES.items())
    groups = "; ".join(f"{name}: {', '.join(group)}" for name, group in GROUPS.items())
    methods = (
        f"Groups of methods: {groups}. A method may be changed by words, as in balanced:circle:additive, "
        "fast:sharp, thesis:ssim:box:union4."
    )
    told = "A picture that is called like one of them is given as ./NAME."
    return "\n".join(("benches:", *benches, told, "", textwrap.fill(methods, 100, break_on_hyphens=False)))


def command(name: str, options: argparse.Namespace, arguments: list[str]) -> int:
    """Runs a bench. Raises Sdf2vecError."""
    if name:
        asked = table.asked_of(name, options.output, arguments)
        table.write(BENCHES[name].pages(options, asked), asked)
        return guard.OK
    if options.baseline:
        return WORSE if check_baseline(Path(options.baseline), print) else guard.OK
    if not options.stability:
        _check_pictures(options.pictures)
    if options.output is None:
        raise Sdf2vecError("bench needs a folder for what it finds: -o DIR")
    needed("matplotlib", "bench", "sdf2vec bench")
    needed("resvg_py", "check", "sdf2vec bench")
    if options.stability:
        return WORSE if run_catalogue(options.output, options.seeds, options.cases, _say) else guard.OK
    return _compare(options, arguments)


def _check_pictures(pictures: Sequence[str]) -> None:
    """Raises Sdf2vecError where there is none, and for what is neither a picture nor a bench."""
    if not pictures:
        raise Sdf2vecError("no picture and no bench given (see sdf2vec bench --help)")
    for path in pictures:
        if path in BENCHES and not Path(path).exists():
            raise Sdf2vecError(f"{path}: the name of a bench comes first: sdf2vec bench {path} ...")
        if not Path(path).exists():
            raise Sdf2vecError(f"{path}: no such picture, and no bench; benches are {', '.join(BENCHES)}")


def _compare(options: argparse.Namespace, arguments: list[str]) -> int:
    methods = methods_of(options.methods)
    plan = make_plan(
        tuple(options.pictures),
        tuple(methods),
        tuple(options.shapes),
        options.repeat,
        programs_of(options.peer),
        options.output,
        table.command_of(arguments),
    )
    results = compare(plan, _say)
    write_page(results, options.output)
    _say(f"{options.output}/index.html: {len(results.runs)} runs")
    return guard.OK


def _say(line: str) -> None:
    print(line, flush=True)

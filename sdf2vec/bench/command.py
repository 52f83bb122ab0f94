"""`sdf2vec bench`: speed against accuracy, where methods fail, and whether anything has become worse."""

from __future__ import annotations

import argparse
import shlex
from collections.abc import Callable
from pathlib import Path
from typing import Any

from .. import guard
from ..deferred import deferred
from ..errors import Sdf2vecError
from ..extras import needed
from .methods import GROUPS, USUAL, counts_of, methods_of
from .peers import programs_of

compare: Callable[..., Any] = deferred("sdf2vec.bench.comparing", "compare")
make_plan: Callable[..., Any] = deferred("sdf2vec.bench.comparing", "Plan")
write_page: Callable[..., Any] = deferred("sdf2vec.bench.comparing", "write_page")
run_catalogue: Callable[..., Any] = deferred("sdf2vec.bench.stability", "run")
check_baseline: Callable[..., Any] = deferred("sdf2vec.bench.baseline", "check")

WORSE = 1  # exit status
USAGE = "sdf2vec bench PICTURE... -o DIR [options] | sdf2vec bench --stability -o DIR | sdf2vec bench --baseline FILE"
ABOUT = (
    "Compares presets, variants, the thesis' method and other programs on the same pictures, and charts speed and size "
    "against accuracy. What a folder holds already is not run again."
)


def add_choices(parser: argparse.ArgumentParser) -> None:
    """The flags of `sdf2vec bench`."""
    parser.usage = USAGE
    names = "; ".join(f"{name}: {', '.join(group)}" for name, group in GROUPS.items())
    parser.epilog = (
        f"Groups of methods: {names}. A method may be changed by words, as in balanced:circle:additive, "
        "fast:sharp, thesis:ssim:box:union4."
    )
    parser.add_argument("pictures", nargs="*", metavar="PICTURE")
    parser.add_argument(
        "-o", "--output", type=Path, metavar="DIR", help="where results, charts and the page go"
    )
    parser.add_argument(
        "--shapes", default="64,256", metavar="N,N", help="numbers of shapes (default: 64,256)"
    )
    parser.add_argument(
        "--methods", default=",".join(USUAL), help=f"methods and groups of them (default: {','.join(USUAL)})"
    )
    parser.add_argument("--repeat", type=int, default=1, metavar="N", help="so many seeds (default: 1)")
    parser.add_argument(
        "--peer", action="append", default=[], metavar="NAME=PATH", help="where another program is"
    )
    parser.add_argument("--stability", action="store_true", help="run the catalogue of where methods fail")
    parser.add_argument("--seeds", type=int, default=20, metavar="N", help="of the catalogue (default: 20)")
    parser.add_argument(
        "--cases", default="", metavar="NAMES", help="only these of the catalogue, separated by semicolons"
    )
    parser.add_argument(
        "--baseline",
        metavar="FILE",
        help="compare fast fits of five small pictures with FILE; where there is none, write it",
    )


def command(options: argparse.Namespace, arguments: list[str]) -> int:
    """Runs it. Raises Sdf2vecError."""
    if options.baseline:
        return WORSE if check_baseline(Path(options.baseline), print) else guard.OK
    if options.output is None:
        raise Sdf2vecError("bench needs a folder for what it finds: -o DIR")
    needed("matplotlib", "bench", "sdf2vec bench")
    needed("resvg_py", "check", "sdf2vec bench")
    if options.stability:
        return WORSE if run_catalogue(options.output, options.seeds, options.cases, _say) else guard.OK
    if not options.pictures:
        raise Sdf2vecError("no picture given (see sdf2vec bench --help)")
    if options.repeat < 1 or options.seeds < 1:
        raise Sdf2vecError("--repeat and --seeds are at least 1")
    methods = methods_of(options.methods)
    plan = make_plan(
        tuple(options.pictures),
        tuple(methods),
        tuple(counts_of(options.shapes)),
        options.repeat,
        programs_of(options.peer),
        options.output,
        shlex.join(["sdf2vec", "bench", *_without_paths(arguments)]),
    )
    results = compare(plan, _say)
    write_page(results, options.output)
    _say(f"{options.output}/index.html: {len(results.runs)} runs")
    return guard.OK


def _without_paths(arguments: list[str]) -> list[str]:
    """The command as it is told to others: files by their names alone."""
    return [
        f"{name}={Path(path).name}"
        if name in ("primitive", "geometrize", "vtracer", "sqip")
        else Path(word).name
        for word in arguments
        for name, _, path in [word.partition("=")]
    ]


def _say(line: str) -> None:
    print(line, flush=True)

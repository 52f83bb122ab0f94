"""What a user may choose about a run of the command line, beside the fit and the exports."""

from __future__ import annotations

from collections.abc import Collection
from typing import Annotated

from msgspec import Struct

from .declared import choice, number, plain
from .errors import Sdf2vecError

CHECKS = ("auto", "off")


PROCESSES = "processes"
ENGINES = (PROCESSES, "dask", "ray")

Jobs = Annotated[
    int,
    number(
        "number of processes",
        "N",
        1,
        65536,
        "convert so many pictures at once; default: 1, on a cluster all it can",
    ),
]
Shard = Annotated[
    int, number("number of pictures (shard)", "N", 1, 100_000, "a worker is handed so many pictures at once")
]


class Running(Struct, frozen=True, kw_only=True):
    """How a run goes about its work."""

    force: Annotated[bool, plain("replace files that sdf2vec has not made")] = False
    recursive: Annotated[bool, plain("look for pictures in the folders inside a folder, too")] = False
    skip_existing: Annotated[bool, plain("leave out pictures whose outputs are all there")] = False
    jobs: Jobs | None = None
    engine: Annotated[
        str, choice("engine", "what converts many pictures: processes of this machine, or a cluster", ENGINES)
    ] = PROCESSES
    address: Annotated[
        str | None,
        plain("of the cluster's scheduler (default: a cluster of --jobs processes here)", "ADDRESS"),
    ] = None
    shard: Shard = 1
    report: Annotated[
        str | None,
        plain(
            "a line a picture: .jsonl, .csv or .parquet; what it says to be done, and is, is not done again",
            "FILE",
        ),
    ] = None
    checkpoint: Annotated[
        str | None,
        plain(
            "save a fit that takes long every 30 s, to go on from with --start should it be killed; removed at the end "
            "(default: beside the outputs; off: nowhere)",
            "FILE",
        ),
    ] = None
    curve: Annotated[
        tuple[str, ...],
        plain(
            "PSNR and FLIP of ever fewer of the shapes against their number and the exports' bytes: .csv, or a chart, "
            ".png or .svg (pip install 'sdf2vec[bench]'); may be given several times",
            "FILE",
            several=True,
        ),
    ] = ()
    with_original: Annotated[bool, plain("a page also holds the picture and a slider to compare")] = False
    check: Annotated[
        str, choice("check", "draw each export on a quick engine that is here, to say how near it is", CHECKS)
    ] = CHECKS[0]
    quiet: Annotated[bool, plain("print errors only", short="q")] = False
    verbose: Annotated[bool, plain("print how long each phase took, too", short="v")] = False


def check_together(running: Running, given: Collection[str]) -> None:
    """Raises Sdf2vecError for what has no effect beside what else is given."""
    if running.quiet and running.verbose:
        raise Sdf2vecError("either -q or -v, not both")
    if running.curve and (running.report is not None or running.skip_existing):
        other = "--skip-existing" if running.skip_existing else "--report"
        raise Sdf2vecError(
            f"--curve is for one picture that is fitted, {other} for many: leave one of them out"
        )
    if running.engine == PROCESSES and running.address is not None:
        raise Sdf2vecError("--address has no effect on processes; it is for --engine dask and ray")
    if running.engine == PROCESSES and "shard" in given and (running.jobs or 1) == 1:
        raise Sdf2vecError("--shard has no effect on one process; it is for --jobs and --engine dask and ray")

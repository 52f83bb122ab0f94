"""What a user may choose about a run of the command line, beside the fit and the exports."""

from __future__ import annotations

from typing import Annotated

from msgspec import Struct

from .declared import choice, number, plain

CHECKS = ("auto", "off")


Jobs = Annotated[int, number("number of processes", "N", 1, 256, "convert so many pictures at once")]


class Running(Struct, frozen=True, kw_only=True):
    """How a run goes about its work."""

    force: Annotated[bool, plain("replace files that sdf2vec has not made")] = False
    recursive: Annotated[bool, plain("look for pictures in the folders inside a folder, too")] = False
    skip_existing: Annotated[bool, plain("leave out pictures whose outputs are all there")] = False
    jobs: Jobs = 1
    report: Annotated[
        str | None,
        plain("a line a picture: .jsonl or .csv; what it says to be done, and is, is not done again", "FILE"),
    ] = None
    checkpoint: Annotated[
        str | None,
        plain(
            "save a fit that takes long every 30 s, to go on from with --start should it be killed; removed at the end "
            "(default: beside the outputs; off: nowhere)",
            "FILE",
        ),
    ] = None
    with_original: Annotated[bool, plain("a page also holds the picture and a slider to compare")] = False
    check: Annotated[
        str, choice("check", "draw each export on a quick engine that is here, to say how near it is", CHECKS)
    ] = CHECKS[0]
    quiet: Annotated[bool, plain("print errors only", short="q")] = False
    verbose: Annotated[bool, plain("print how long each phase took, too", short="v")] = False

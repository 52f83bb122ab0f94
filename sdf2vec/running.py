"""What a user may choose about a run of the command line, beside the fit and the exports."""

from __future__ import annotations

from typing import Annotated

from msgspec import Struct

from .declared import choice, plain

CHECKS = ("auto", "off")


class Running(Struct, frozen=True, kw_only=True):
    """How a run goes about its work."""

    force: Annotated[bool, plain("replace files that sdf2vec has not made")] = False
    with_original: Annotated[bool, plain("a page also holds the picture and a slider to compare")] = False
    check: Annotated[
        str, choice("check", "draw each export on a quick engine that is here, to say how near it is", CHECKS)
    ] = CHECKS[0]
    quiet: Annotated[bool, plain("print errors only", short="q")] = False
    verbose: Annotated[bool, plain("print how long each phase took, too", short="v")] = False

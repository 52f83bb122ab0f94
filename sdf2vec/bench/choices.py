"""What benches are told on the command line: each sort of thing is said, read and refused in one way."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Collection
from pathlib import Path
from typing import Any

from ..declared import check_choice, options_of
from ..errors import Sdf2vecError
from ..export.byte_limit import ByteLimit
from ..fit.settings import Settings, settings_of
from ..scene import MAX_SHAPES

Reader = Callable[[str], Any]


def reader(read: Reader) -> Reader:
    """For a parser, which drops the message of every error but its own."""

    def told(text: str) -> Any:
        try:
            return read(text)
        except Sdf2vecError as error:
            raise argparse.ArgumentTypeError(str(error)) from None

    return told


def several(read: Reader) -> Reader:
    """Several things separated by commas, none of them twice."""

    def told(text: str) -> list[Any]:
        found = list(dict.fromkeys(read(part.strip()) for part in text.split(",") if part.strip()))
        if not found:
            raise Sdf2vecError("at least one is needed")
        return found

    return told


def whole_number(least: int, most: int = MAX_SHAPES) -> Reader:
    """A number that counts something."""

    def read(text: str) -> int:
        if not text.isdecimal() or not least <= int(text) <= most:
            raise Sdf2vecError(f"a whole number between {least} and {most} is needed, got {text!r}")
        return int(text)

    return read


def name_of(what: str, known: Collection[str]) -> Reader:
    """One of the names that are known."""

    def read(text: str) -> str:
        check_choice(what, text, known)
        return text

    return read


def _limit(text: str) -> str:
    ByteLimit.of(text)
    return text


def _file(text: str) -> Path:
    if not Path(text).is_file():
        raise Sdf2vecError(f"{text}: no such file")
    return Path(text)


def _folder(text: str) -> Path:
    if not Path(text).is_dir():
        raise Sdf2vecError(f"{text}: no such folder")
    return Path(text)


count = reader(whole_number(1))
counts = reader(several(whole_number(1)))
limit, limits = reader(_limit), reader(several(_limit))
picture, folder = reader(_file), reader(_folder)


def names(what: str, known: Collection[str]) -> Reader:
    """A list of names, such as svg,shadertoy."""
    return reader(several(name_of(what, known)))


def add_list(parser: argparse.ArgumentParser, flag: str, read: Reader, default: str, about: str) -> None:
    """A flag that takes several things separated by commas."""
    told = f"{about} (default: {default})"
    parser.add_argument(flag, type=read, default=default, metavar="LIST", help=told)


def add_shapes(parser: argparse.ArgumentParser, default: str = "64,256") -> None:
    """Numbers of shapes."""
    add_list(parser, "--shapes", counts, default, "numbers of shapes")


def add_count(parser: argparse.ArgumentParser, flag: str, default: int, about: str) -> None:
    """A flag that takes one number."""
    parser.add_argument(flag, type=count, default=default, metavar="N", help=f"{about} (default: {default})")


def add_peer(parser: argparse.ArgumentParser) -> None:
    """Where other programs are."""
    parser.add_argument(
        "--peer", action="append", default=[], metavar="NAME=PATH", help="where another program is"
    )


def add_fit(parser: argparse.ArgumentParser, *options: str) -> None:
    """Options of a fit, as `sdf2vec` itself has them."""
    for name in options:
        options_of(Settings)[name].add_flag(parser)
    parser.set_defaults(fit=options)


def fit_of(options: argparse.Namespace) -> dict[str, Any]:
    """Those that were given. Raises Sdf2vecError for an impossible one."""
    given = {name: value for name, value in vars(options).items() if name in options.fit}
    settings_of(**given)
    return given

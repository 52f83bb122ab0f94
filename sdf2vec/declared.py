"""Options declared as fields of records: from a declaration come its check, its flag and its line of documentation.

Each field is annotated by `number`, `choice` or, where nothing is checked here, `plain`. `title` names it in an error,
`metavar` stands for its value in `--help`.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Collection, Container, Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from functools import cache
from numbers import Integral, Real
from types import NoneType
from typing import Any, Literal, TypeVar, get_args, get_origin, get_type_hints

import msgspec

from .errors import Sdf2vecError

Record = TypeVar("Record", bound=msgspec.Struct)
Function = TypeVar("Function", bound=Callable[..., Any])

NUMBERS = {int: "a whole number", float: "a number"}


def number(title: str, metavar: str, low: float, high: float | None, description: str) -> msgspec.Meta:
    """A number from `low` to `high`, or without an end."""
    return msgspec.Meta(title=title, description=description, ge=low, le=high, extra={"metavar": metavar})


def choice(title: str, description: str, known: Collection[str]) -> msgspec.Meta:
    """One of the names that are known when it is asked for."""
    return msgspec.Meta(title=title, description=description, extra={"known": known})


def plain(
    description: str, metavar: str | None = None, short: str = "", several: bool = False
) -> msgspec.Meta:
    """Anything: a switch, or what is read elsewhere; `short` is a letter that is a flag, too. `several`: a tuple, a
    flag for each.
    """
    return msgspec.Meta(
        description=description, extra={"metavar": metavar, "short": short, "several": several}
    )


@dataclass(frozen=True)
class Option:
    """One field: `hint` is what a value is checked against, `type` that of one which is neither None nor a word.

    `words`: what may be said in place of a number.
    """

    name: str
    hint: Any
    type: Any
    meta: msgspec.Meta
    default: Any
    words: tuple[str, ...] = ()

    @property
    def known(self) -> Collection[str]:
        """The names to choose from, if there are any."""
        names: Collection[str] = self._extra.get("known", ())
        return names

    @property
    def _extra(self) -> dict[str, Any]:
        return self.meta.extra or {}

    @property
    def flag(self) -> str:
        """How it is called on the command line."""
        return f"--{self.name.replace('_', '-')}"

    @property
    def help(self) -> str:
        """One line: what it does, what to choose from, what it is unless told."""
        default = ", ".join(self.default) if isinstance(self.default, tuple) else self.default
        told = [", ".join(self.known)] if self.known else []
        if default not in (None, "") and self.type is not bool:
            told.append(f"default: {default}")
        return f"{self.meta.description} ({'; '.join(told)})" if told else str(self.meta.description)

    def checked(self, value: Any) -> Any:
        """The value as the record holds it. Raises Sdf2vecError for an impossible one."""
        if self.type is str and self.known:
            check_choice(str(self.meta.title), value, self.known)
        if self.type not in NUMBERS or value in self.words:
            return value
        try:
            return msgspec.convert(_plain(value), self.hint)
        except msgspec.ValidationError:
            least, most = self.meta.ge, self.meta.le
            bounds = f"of at least {least}" if most is None else f"between {least} and {most}"
            words = f"the {self.meta.title} must be {' or '.join([*self.words, NUMBERS[self.type]])} {bounds}"
            raise Sdf2vecError(f"{words}, got {value!r}") from None

    def add_flag(self, parser: argparse._ActionsContainer) -> None:
        """Adds the flag of this name; what the user leaves out stays out of the namespace."""
        form: dict[str, Any] = {"action": "store_true"}
        if self.type is not bool:
            form = {"type": self._read if self.type in NUMBERS else str}
            form["metavar"] = self._extra.get("metavar")
            form["action"] = "append" if self._extra.get("several") else "store"
        short = [f"-{self._extra['short']}"] if self._extra.get("short") else []
        told = self.help.replace("%", "%%")
        parser.add_argument(*short, self.flag, default=argparse.SUPPRESS, help=told, **form)

    def _read(self, text: str) -> Any:
        """A number, or a word in its place. Raises ArgumentTypeError for anything else."""
        if text in self.words:
            return text
        try:
            return self.type(text)
        except ValueError:
            wanted = " or ".join([*self.words, NUMBERS[self.type]])
            raise argparse.ArgumentTypeError(f"{text!r} is not {wanted}") from None


@cache
def options_of(record: type[msgspec.Struct]) -> dict[str, Option]:
    """The fields of a record by name."""
    hints = get_type_hints(record, include_extras=True)
    return {
        field.name: Option(
            field.name,
            hints[field.name],
            *_declared(hints[field.name]),
            field.default,
            _words_of(hints[field.name]),
        )
        for field in msgspec.structs.fields(record)
    }


def _declared(hint: Any) -> tuple[Any, msgspec.Meta]:
    """The type and the Meta of `Annotated[type, Meta]`, which may be one of a union with None."""
    parts = get_args(hint)
    if isinstance(parts[-1], msgspec.Meta):
        return parts[0], parts[-1]
    return _declared(next(part for part in parts if part is not NoneType and get_origin(part) is not Literal))


def _words_of(hint: Any) -> tuple[str, ...]:
    """The words of a `Literal` among the types of a union."""
    return tuple(word for part in get_args(hint) if get_origin(part) is Literal for word in get_args(part))


def _plain(value: Any) -> Any:
    """A number of any library as Python's own."""
    if isinstance(value, bool) or not isinstance(value, Real):
        return value
    return int(value) if isinstance(value, Integral) else float(value)


def checked(record: type[Record], given: Mapping[str, Any]) -> Record:
    """A record of the values given. Raises Sdf2vecError for the first impossible one, TypeError for an unknown name."""
    options = options_of(record)
    for name in given:
        if name not in options:
            near = get_close_matches(name, options, 1)
            known = f"did you mean {near[0]!r}?" if near else f"known are {', '.join(options)}"
            raise TypeError(f"unknown option {name!r}; {known}")
    made = record(**given)
    return msgspec.structs.replace(made, **{n: options[n].checked(value) for n, value in given.items()})


def add_flags(
    parser: argparse._ActionsContainer, record: type[msgspec.Struct], without: Container[str] = ()
) -> None:
    """Adds a flag for each option."""
    for option in options_of(record).values():
        if option.name not in without:
            option.add_flag(parser)


def chosen(namespace: argparse.Namespace, record: type[msgspec.Struct]) -> dict[str, Any]:
    """What the user has given of a record's options."""
    return {name: value for name, value in vars(namespace).items() if name in options_of(record)}


def documented(record: type[msgspec.Struct]) -> Callable[[Function], Function]:
    """A decorator that adds a record's options to a docstring, a line each."""

    def add(function: Function) -> Function:
        lines = (f"    - `{option.name}`: {option.help}" for option in options_of(record).values())
        function.__doc__ = "\n".join([(function.__doc__ or "").rstrip(), "", "    Options:", "", *lines, ""])
        return function

    return add


def check_choice(what: str, value: Any, known: Collection[str]) -> None:
    """Raises Sdf2vecError for an unknown name."""
    if value not in list(known):
        raise Sdf2vecError(f"unknown {what} {value!r}; choose from {', '.join(known)}")

"""Completion of the command line in a shell: `sdf2vec completion bash`, a script made from the parsers."""

from __future__ import annotations

import argparse
import shlex
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from .bench.benches import BENCHES
from .declared import Option, check_choice, options_of
from .deferred import deferred
from .export import EXPORTERS
from .export.options import Options
from .fit.settings import Settings
from .running import Running

template: Callable[..., Any] = deferred("sdf2vec.templating", "template")  # jinja2
SHELLS = ("bash", "zsh", "fish")
FILES = ("OUT", "FILE", "SCENE", "MASK")  # what stands for a path in a flag's help
SEVERAL = ("emit", "kind", "loss")  # take several values, separated by commas


@dataclass(frozen=True)
class Flag:
    """A flag as shells complete it: its spellings, a line about it, the values there are, whether it takes a path."""

    names: tuple[str, ...]
    about: str
    takes: bool
    values: tuple[str, ...]
    is_path: bool
    is_list: bool

    @property
    def zsh(self) -> str:
        """As a specification of zsh's _arguments."""
        about = "".join(f"\\{c}" if c in "[]\\:" else c for c in self.about)
        names = f"{{{','.join(self.names)}}}" if len(self.names) > 1 else self.names[0]
        values = " ".join(self.values)
        what = (
            "_files" if self.is_path else f"_sequence compadd - {values}" if self.is_list else f"({values})"
        )
        rest = (
            f":{self.names[-1].lstrip('-')}:{what if self.is_path or values else ' '}" if self.takes else ""
        )
        return f"{names}{shlex.quote(f'[{about}]{rest}')}"

    @property
    def fish(self) -> str:
        """As the options of fish's complete."""
        spelled = [f"-l {n[2:]}" if n.startswith("--") else f"-s {n[1:]}" for n in self.names]
        values = " ".join(self.values)
        listed = f"(__fish_append , {values})" if self.is_list else values
        takes = ["-rF" if self.is_path else "-x"] if self.takes else []
        takes += ["-a", shlex.quote(listed)] if values else []
        return " ".join([*spelled, *takes, "-d", shlex.quote(self.about.replace("\n", " "))])


def script(shell: str, parsers: Mapping[str, argparse.ArgumentParser]) -> str:
    """The script for a shell; `parsers` are those of the commands by name, "" that of pictures.

    Raises Sdf2vecError for an unknown shell.
    """
    check_choice("shell", shell, SHELLS)
    flags = {command: list(_flags_of(parser)) for command, parser in parsers.items()}
    flags[""].append(Flag(("--warm-up",), "compile all that fits may need", False, (), False, False))
    script: str = template(f"completion.{shell}.jinja").render(
        flags=flags,
        commands=[name for name in parsers if name],
        abouts={
            name: (parser.description or "").split(":")[0].split(".")[0] for name, parser in parsers.items()
        },
        words={"completion": SHELLS, "bench": tuple(BENCHES)},
    )
    return script


def _flags_of(parser: argparse.ArgumentParser) -> Iterable[Flag]:
    for action in parser._actions:
        if not action.option_strings:
            continue
        takes = action.nargs != 0
        about = (action.help or "").replace("%%", "%").split(" (default")[0].split(". glsl:")[0]
        yield Flag(
            tuple(action.option_strings),
            about,
            takes,
            _values_of(action.dest) if takes else (),
            takes and action.metavar in FILES,
            action.dest in SEVERAL,
        )


def _values_of(name: str) -> tuple[str, ...]:
    """The values that an option may have, where they are words."""
    if name == "emit":
        return tuple(EXPORTERS)
    option = _declared().get(name)
    return (*option.words, *option.known) if option else ()


def _declared() -> dict[str, Option]:
    return {**options_of(Settings), **options_of(Options), **options_of(Running)}

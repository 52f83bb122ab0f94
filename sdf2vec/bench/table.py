"""What the pages of all benches have in common: their head, the figures beside them, the file that they go to."""

from __future__ import annotations

import shlex
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from typing import TYPE_CHECKING, NamedTuple

from .. import guard
from ..deferred import deferred
from ..errors import Sdf2vecError
from ..files import require_writable, write_atomically
from ..outputs import STREAM

if TYPE_CHECKING:
    from .results import Machine

machine: Callable[[], Machine] = deferred("sdf2vec.bench.results", "machine")

SUFFIX = ".md"


def spread(values: Sequence[float], digits: int) -> str:
    """The median, and from the least to the greatest."""
    middle, least, most = (f"{value:.{digits}f}" for value in (median(values), min(values), max(values)))
    return f"{middle} ({least} to {most})"


class Page(NamedTuple):
    """A page in Markdown, and the figures beside it, by how their names end."""

    text: str
    figures: Mapping[str, bytes]


@dataclass(frozen=True)
class Asked:
    """What a bench was asked for: the command as it is told to others, the file of its page; none: standard output."""

    command: str
    output: Path | None = None

    def say(self, line: str) -> None:
        """Tells how far it has come, where the page doesn't go."""
        guard.say(line, sys.stdout if self.output else sys.stderr)

    def told(self, lines: Iterable[str]) -> str:
        """Lines of the page, each said as soon as it is there."""
        found = []
        for line in lines:
            self.say(line)
            found.append(line)
        return "\n".join(found)

    def figure(self, suffix: str, caption: str) -> str:
        """The mention of a figure whose name ends so. Standard output takes none: then nothing."""
        return f"![{caption}]({self.output.with_suffix(suffix).name})" if self.output else ""

    def page(self, title: str, *parts: str, figures: Mapping[str, bytes] | None = None) -> Page:
        """A page of these paragraphs and tables, below how it was made, and with what."""
        head = f"# {title}", f"    {self.command}", f"{machine().told}."
        return Page("\n\n".join(part for part in (*head, *parts) if part) + "\n", figures or {})


def asked_of(name: str, output: str, arguments: Sequence[str]) -> Asked:
    """What a bench is asked for. Raises Sdf2vecError where its page can't be written."""
    path = _path_of(name, output)
    if path:
        require_writable(path)
    return Asked(command_of(arguments), path)


def _path_of(name: str, output: str) -> Path | None:
    """A file as it is, in a folder one of the bench's name."""
    if output == STREAM:
        return None
    path = Path(output)
    if path.is_dir() or output.endswith("/") or not path.suffix:
        return path / f"{name}{SUFFIX}"
    if path.suffix.lower() != SUFFIX:
        raise Sdf2vecError(
            f"{output}: a bench writes Markdown; choose a name that ends in {SUFFIX}, or a folder"
        )
    return path


def command_of(arguments: Sequence[str]) -> str:
    """The command as it is told to others: of files that aren't below this folder only the name."""
    return shlex.join(["sdf2vec", "bench", *map(_for_others, arguments)])


def _for_others(word: str) -> str:
    flag, equals, given = word.rpartition("=")  # of --output=FILE, vtracer=FILE
    path = Path(given)
    return f"{flag}{equals}{path.name}" if path.is_absolute() or ".." in path.parts else word


def write(pages: Iterator[Page], asked: Asked) -> None:
    """Writes a page each time that it has grown, its figures first; to standard output once. Raises Sdf2vecError."""
    page = None
    for page in pages:
        if asked.output:
            for suffix, figure in page.figures.items():
                write_atomically(asked.output.with_suffix(suffix), figure)
            write_atomically(asked.output, page.text.encode())
    if page and asked.output:
        asked.say(f"{asked.output}: written")
    elif page:
        guard.write_output(page.text.encode())

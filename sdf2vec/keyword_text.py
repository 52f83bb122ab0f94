"""Writes `keywords.py`, the keywords of the public functions for type checkers, from where options are declared.

python -m sdf2vec.keyword_text
"""

from __future__ import annotations

from pathlib import Path
from types import NoneType
from typing import get_args

import msgspec

from .declared import Option, options_of
from .export.options import Options
from .files import write_atomically
from .fit.settings import Settings

PLACE = Path(__file__).with_name("keywords.py")
APART = ("shapes",)  # a parameter of its own
READ = {  # what is read is more than what the record holds
    "kind": "str | Sequence[str]",
    "loss": "str | Sequence[tuple[str, float]] | None",
    "start": "str | PathLike[str] | Scene | None",
    "palette": "str | Sequence[Color | str] | None",
    "weights": "PictureSource | None",
}
HEAD = '''"""Keywords of the public functions, for type checkers. Written by `python -m sdf2vec.keyword_text`."""

from __future__ import annotations

from collections.abc import Sequence
from os import PathLike
from typing import TYPE_CHECKING, Any, Literal, Protocol, TypedDict

if TYPE_CHECKING:
    from numpy.typing import NDArray
    from PIL.Image import Image

    from .image import Picture
    from .scene import Color, Scene


class Readable(Protocol):
    """A binary stream."""

    def read(self, size: int, /) -> bytes:
        """So many bytes."""


if TYPE_CHECKING:
    PictureSource = (
        str | PathLike[str] | bytes | bytearray | memoryview | Readable | Image | Picture | NDArray[Any]
    )
'''


def text() -> str:
    """The whole module."""
    parts = (
        ("FitKeywords", "What a fit takes.", Settings),
        ("ExportKeywords", "What an export takes.", Options),
    )
    return HEAD + "".join(_class(*part) for part in parts)


def _class(name: str, about: str, record: type[msgspec.Struct]) -> str:
    fields = "".join(
        f"    {option.name}: {_type(option)}\n"
        for option in options_of(record).values()
        if option.name not in APART
    )
    return f'\n\nclass {name}(TypedDict, total=False):\n    """{about}"""\n\n{fields}'


def _type(option: Option) -> str:
    """What may be given for an option, as text."""
    if option.name in READ:
        return READ[option.name]
    known = ", ".join(f'"{name}"' for name in option.known)
    words = ", ".join(f'"{word}"' for word in option.words)
    plain = option.type.__name__ if isinstance(option.type, type) else str(option.type)
    parts = [f"Literal[{known}]" if known else plain]
    parts += [f"Literal[{words}]"] if words else []
    parts += ["None"] if NoneType in get_args(option.hint) else []
    return " | ".join(parts)


if __name__ == "__main__":
    write_atomically(PLACE, text().encode())

"""Which pictures a run reads, and their bytes: files, folders, patterns, URLs, standard input."""

from __future__ import annotations

import glob
import hashlib
import io
import os
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, BinaryIO

from . import remote
from .deferred import deferred
from .errors import Sdf2vecError
from .export import EXPORTERS
from .files import one_line
from .outputs import STREAM

PICTURES = (".png", ".jpg", ".jpeg", ".webp", ".avif", ".tif", ".tiff", ".gif", ".bmp")
_read_all: Callable[[BinaryIO, str], io.BytesIO] = deferred("sdf2vec.decoding", "read_all")


def sources_of(inputs: Sequence[str], recursive: bool) -> dict[str, str]:
    """Every picture, with the folder inside the output folder that its files go to.

    An input is a picture, a folder, or a pattern like `*.png` that the shell has left, each on a disk or a URL. Raises
    Sdf2vecError for one given twice, and for a folder or a pattern without pictures.
    """
    seen: set[str] = set()
    found: dict[str, str] = {}
    for source in inputs:
        if source in seen:
            raise Sdf2vecError(f"{one_line(source)}: is given twice")
        seen.add(source)
        found |= _found(source, recursive)
    return found


def _found(source: str, recursive: bool) -> dict[str, str]:
    if source == STREAM:
        return {source: ""}
    if remote.is_url(source):
        return _at_url(source, recursive)
    if os.path.isdir(source):
        return _in_folder(source, recursive)
    if glob.has_magic(source) and not os.path.exists(source):
        return dict.fromkeys(_matching(source), "")
    return {source: ""}


def _at_url(url: str, recursive: bool) -> dict[str, str]:
    listed = remote.listed(url, recursive)
    if listed is None:
        return {url: ""}
    pictures = {found: within for found, within in listed.items() if _is_picture(remote.name_of(found))}
    return pictures or _refuse_empty(url, recursive)


def _in_folder(folder: str, recursive: bool) -> dict[str, str]:
    paths = sorted(Path(folder).rglob("*") if recursive else Path(folder).iterdir())
    pictures = {
        str(path): str(path.parent.relative_to(folder))
        for path in paths
        if path.is_file() and _is_picture(path.name)
    }
    return pictures or _refuse_empty(folder, recursive)


def _refuse_empty(folder: str, recursive: bool) -> dict[str, str]:
    deeper = "" if recursive else "; --recursive looks into the folders inside it"
    raise Sdf2vecError(f"{one_line(folder)}: is a folder without pictures ({', '.join(PICTURES)}){deeper}")


def _is_picture(name: str) -> bool:
    """By its name; not hidden, and not one of our own renders."""
    name = name.lower()
    ours = any(name.endswith(exporter.suffix) for exporter in EXPORTERS.values())
    return name.endswith(PICTURES) and not name.startswith(".") and not ours


def _matching(pattern: str) -> list[str]:
    paths = sorted(path for path in glob.glob(pattern, recursive=True) if os.path.isfile(path))
    if not paths:
        raise Sdf2vecError(f"{one_line(pattern)}: no such file")
    return paths


# --- what is in them ------------------------------------------------------------------------------------------


class Held(io.BytesIO):
    """The bytes of what can't be read twice, and what it is called."""

    def __init__(self, data: bytes, name: str) -> None:
        super().__init__(data)
        self.name = name


def opened(source: str) -> str | Held:
    """What the picture is read from: a file's path, else the bytes. Raises Sdf2vecError."""
    if source == STREAM:
        return Held(_read_all(standard_input(), "standard input").getvalue(), "standard input")
    if remote.is_url(source):
        with remote.opened(source) as stream:
            return Held(_read_all(stream, one_line(source)).getvalue(), source)
    return source


def bytes_of(source: str | Held) -> bytes:
    """All bytes of what `opened` gave; none of a pipe, which has been read."""
    if isinstance(source, Held):
        return source.getvalue()
    return Path(source).read_bytes() if os.path.isfile(source) else b""


def standard_input() -> BinaryIO:
    """Standard input as bytes. Raises Sdf2vecError where there is none."""
    if sys.stdin is None:
        raise Sdf2vecError("standard input: is closed")
    return sys.stdin.buffer


def version_of(source: str) -> str:
    """What changes when a picture does: of its size and its time, or of what its server says of it."""
    if remote.is_url(source):
        return remote.version_of(source)
    try:
        status = os.stat(source)
    except OSError:
        return ""
    return hashlib.sha256(f"{status.st_size} {status.st_mtime_ns}".encode()).hexdigest()


def whole(path: Any) -> Any:
    """A path from the root on; streams, URLs and what is no path as they are."""
    is_path = isinstance(path, str) and path != STREAM and not remote.is_url(path)
    return os.path.abspath(path) if is_path else path

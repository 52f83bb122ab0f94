"""Pictures elsewhere: URLs of anything that fsspec reads (https, s3, gs, zip …), imported when one is given."""

from __future__ import annotations

import posixpath
import re
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, BinaryIO

from .errors import Sdf2vecError
from .extras import needed
from .files import one_line

URL = re.compile(r"[A-Za-z][A-Za-z0-9+.-]+(::[A-Za-z][A-Za-z0-9+.-]+)*://")
MAGIC = re.compile(r"[*?\[]")


def is_url(source: str) -> bool:
    """Whether an input is read by fsspec; a drive's letter is none."""
    return URL.match(source) is not None


def name_of(url: str) -> str:
    """The last part of a URL's path, without what is asked of a server."""
    return posixpath.basename(url.split("::")[0].split("?")[0].split("#")[0].rstrip("/"))


def listed(url: str, recursive: bool) -> dict[str, str] | None:
    """Everything in a folder or that fits a pattern, as URLs, with the folder each is in; None for a single file.

    Raises Sdf2vecError where it can't be read.
    """
    with _refusing(url):
        files, path = _files(url)
        is_pattern = MAGIC.search(url.split("::")[0].split("?")[0]) and not files.exists(path)
        if is_pattern:
            found = [name for name in files.glob(path) if not files.isdir(name)]
        elif url.endswith("/") or files.isdir(path):
            found = files.find(path, maxdepth=None if recursive else 1)
        else:
            return None
    if is_pattern and not found:
        raise Sdf2vecError(f"{one_line(url)}: no such file")
    return {_url_of(files, name, url): "" if is_pattern else _within(name, path) for name in sorted(found)}


def _within(name: str, folder: str) -> str:
    inside = posixpath.dirname(name.strip("/").removeprefix(folder.strip("/")).lstrip("/"))
    return "/".join(part for part in inside.split("/") if part not in ("", ".", ".."))


def _url_of(files: Any, name: str, url: str) -> str:
    """The URL of a file of the same file system, which may lie in another one."""
    _, *chain = url.split("::")
    return "::".join([str(files.unstrip_protocol(name)), *chain])


@contextmanager
def opened(url: str) -> Iterator[BinaryIO]:
    """Its bytes, as a stream. Raises Sdf2vecError where it can't be read."""
    with _refusing(url):
        files, path = _files(url)
        with files.open(path, "rb") as stream:
            yield stream


def version_of(url: str) -> str:
    """What changes when a file does, as far as its server says so; empty where it does not."""
    try:
        files, path = _files(url)
        return str(files.ukey(path))
    except Exception:  # each file system has exceptions of its own
        return ""


def _files(url: str) -> tuple[Any, str]:
    found: tuple[Any, str] = needed("fsspec", "remote", "a URL").url_to_fs(url)
    return found


@contextmanager
def _refusing(url: str) -> Iterator[None]:
    """One line for whatever a file system raises: each has exceptions of its own."""
    try:
        yield
    except (Sdf2vecError, MemoryError):
        raise
    except FileNotFoundError:
        raise Sdf2vecError(f"{one_line(url)}: no such file") from None
    except Exception as error:
        reason = " ".join(str(error).split()) or type(error).__name__
        raise Sdf2vecError(f"{one_line(url)}: cannot be read ({reason})") from error

"""Writing files so that a reader never meets half of one."""

from __future__ import annotations

import contextlib
import hashlib
import os
import platform
import secrets
import time
from functools import cache
from pathlib import Path

from sdf2vec.errors import Sdf2vecError

_DAY = 86_400  # seconds
_OURS = (
    f".sdf2vec-{hashlib.sha256(platform.node().encode()).hexdigest()[:8]}-"  # this machine's temporary files
)

_REFUSALS: dict[type[OSError], str] = {
    FileNotFoundError: "no such folder",
    IsADirectoryError: "is a folder, not a file",
    NotADirectoryError: "part of the path is a file, not a folder",
    PermissionError: "no permission to write here",
    FileExistsError: "part of the path is a file, not a folder",
}


def write_atomically(path: str | os.PathLike[str], data: bytes) -> None:
    """Write `data` to `path` so that the file is either complete or untouched.

    The bytes go to a new file in the same folder, which is then renamed over `path`; on failure that new
    file is removed. Missing parent folders are created. Permissions are those of any newly created file
    (0666 less the umask), a symbolic link keeps pointing where it did, and a device or pipe is written to
    directly, because replacing it by a file is never what was asked for. Temporary files of runs that were killed
    are removed from the folder.

    Raises Sdf2vecError when the folder cannot be written to, `path` is a folder, the disk is full, and so on.
    """
    try:
        target = Path(os.path.realpath(path))
        if target.exists() and not target.is_file():
            target.write_bytes(data)
        else:
            target.parent.mkdir(parents=True, exist_ok=True)
            _write_and_rename(target, data)
    except (OSError, ValueError) as error:  # ValueError: a NUL character in the path
        raise _refusal(path, error) from error


def require_writable(path: str | os.PathLike[str], tried: set[Path] | None = None) -> None:
    """Raises Sdf2vecError where `write_atomically` is bound to fail: before hours of work. Leaves nothing behind.

    `tried`: folders that need not be tried again; this one comes to them.
    """
    try:
        target = Path(os.path.realpath(path))
        if target.is_dir():
            raise IsADirectoryError
        if (not target.exists() or target.is_file()) and target.parent not in (tried or ()):
            _require_folder(target.parent)
        if tried is not None:
            tried.add(target.parent)
    except (OSError, ValueError) as error:
        raise _refusal(path, error) from error


def _require_folder(folder: Path) -> None:
    """That files can be made in a folder, or in the nearest one above it that exists."""
    while not folder.exists():
        folder = folder.parent
    if not folder.is_dir():
        raise NotADirectoryError
    _write_and_remove(folder)


def _write_and_remove(folder: Path) -> None:
    """Tries it: what a folder's mode says is not true of every user and every file system."""
    tried = folder / _temporary_name()
    try:
        tried.touch(exist_ok=False)
    finally:
        with contextlib.suppress(OSError):
            tried.unlink()


def _temporary_name() -> str:
    return f"{_OURS}{os.getpid()}-{secrets.token_hex(8)}.tmp"


def shown_as(data: bytes) -> str:
    """What a browser shows a still picture's file as: png, jpeg, webp. Nothing for any other, and for a moving one."""
    if data.startswith(b"\x89PNG"):
        return "" if b"acTL" in data[:4096] else "png"
    if data[:4] == b"RIFF" and data[8:12] == b"WEBP":
        return "" if b"ANIM" in data[:64] else "webp"
    return "jpeg" if data.startswith(b"\xff\xd8\xff") else ""


def one_line(text: str) -> str:
    """`text` fit for one line of a message: control characters and undecodable bytes as escapes."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text) or "''"


def _write_and_rename(target: Path, data: bytes) -> None:
    _sweep(target.parent)
    beside = target.parent / _temporary_name()
    try:
        with open(beside, "xb") as stream:
            stream.write(data)
            stream.flush()
            os.fsync(stream.fileno())  # else a power cut may keep the new name and lose the bytes
        os.replace(beside, target)
    finally:
        with contextlib.suppress(FileNotFoundError):
            beside.unlink()


@cache
def _sweep(folder: Path) -> None:
    """Removes what runs that were killed have left beside their outputs."""
    for path in folder.glob(".sdf2vec-*.tmp"):
        with contextlib.suppress(OSError, ValueError):
            if _is_left(path):
                path.unlink()


def _is_left(path: Path) -> bool:
    """Whether its process has ended; on another machine: whether it is a day old."""
    if path.name.startswith(_OURS) and os.name == "posix":
        try:
            os.kill(int(path.name.removeprefix(_OURS).split("-")[0]), 0)
        except ProcessLookupError:
            return True
    return time.time() - path.stat().st_mtime > _DAY


def _refusal(path: str | os.PathLike[str], error: Exception) -> Sdf2vecError:
    return Sdf2vecError(f"{one_line(os.fspath(path))}: {_reason(error)}; choose another place")


def _reason(error: Exception) -> str:
    plain = f"cannot write it ({getattr(error, 'strerror', None) or error})"
    return next((line for kind, line in _REFUSALS.items() if type(error) is kind), plain)

"""The folder that compiled kernels are kept in: where it is, how large, whose; `sdf2vec cache`."""

from __future__ import annotations

import argparse
import contextlib
import os
import stat
from pathlib import Path

import platformdirs

from .files import one_line
from .limits import CACHED

OURS = ("*.kernel", "kernels_*.py", ".sdf2vec-*.tmp")  # what may be in it; whatever else stays there


def cache_folder() -> Path:
    """`$SDF2VEC_CACHE`, or the user's cache folder as the system has it."""
    return Path(os.environ.get("SDF2VEC_CACHE") or platformdirs.user_cache_path("sdf2vec", appauthor=False))


def read_kept(path: Path) -> bytes:
    """A kept file, which is now the one used last. Raises OSError where there is none, or one that somebody else may
    have written: it holds code."""
    with open(path, "rb") as stream:
        status = os.fstat(stream.fileno())
        if os.name == "posix" and (
            status.st_uid not in (os.geteuid(), 0) or status.st_mode & stat.S_IWOTH  # a folder may be shared
        ):
            raise PermissionError
        data = stream.read()
    with contextlib.suppress(OSError):
        os.utime(path)
    return data


def files() -> list[tuple[Path, os.stat_result]]:
    """Files of ours in the folder, the one used longest ago first."""
    found = []
    for pattern in OURS:
        for path in cache_folder().glob(pattern):
            with contextlib.suppress(OSError):  # another process may clear the folder
                found.append((path, path.lstat()))
    return sorted(found, key=lambda entry: entry[1].st_mtime)


def trim(most: int | None = None) -> int:
    """Removes what was used longest ago until there are no more than so many bytes; how many files went."""
    kept = files()
    spare = sum(status.st_size for _, status in kept) - (CACHED.most if most is None else most)
    removed = 0
    for path, status in kept:
        if spare <= 0:
            break
        with contextlib.suppress(OSError):
            path.unlink()
            removed += 1
        spare -= status.st_size
    return removed


def add_choices(parser: argparse.ArgumentParser) -> None:
    """The flags of `sdf2vec cache`."""
    choice = parser.add_mutually_exclusive_group(required=True)
    choice.add_argument(
        "--path", action="store_true", help="print the folder that compiled kernels are kept in"
    )
    choice.add_argument("--size", action="store_true", help="print how many files are in it, and their bytes")
    choice.add_argument(
        "--clear", action="store_true", help="remove them; they are compiled again when needed"
    )


def command(options: argparse.Namespace) -> int:
    """`sdf2vec cache`: says where the folder is, how large, or empties it."""
    if options.path:
        print(one_line(str(cache_folder())))
    elif options.size:
        kept = files()
        print(f"{len(kept)} files, {sum(status.st_size for _, status in kept):,} bytes")
    else:
        print(f"{trim(-1)} files removed, {len(files())} left")
    return 0

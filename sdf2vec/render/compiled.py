"""Compiles a text of numba kernels and keeps it, and its machine code, in the user's cache folder.

The file's name is made from the text and the versions of what compiles it. Without a folder to write to, the
text is compiled anew in every run, with one warning.
"""

from __future__ import annotations

import hashlib
import importlib.util
import os
import sys
import warnings
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from types import ModuleType

import numba
import numpy as np

from ..errors import Sdf2vecError
from ..files import write_atomically

MARK = "CACHE"  # in the text: whether numba keeps the machine code


@cache
def load(source: str) -> ModuleType:
    """The module of this text. Its functions are compiled when they are first called."""
    path = path_of(source)
    try:
        if not path.exists():
            write_atomically(path, source.replace(MARK, "True", 1).encode())
        return _import(path)
    except (Sdf2vecError, OSError, RuntimeError):
        _warn_once(path.parent)
        module = ModuleType(path.stem)
        exec(compile(source.replace(MARK, "False", 1), str(path), "exec"), module.__dict__)
        return module


@cache
def load_file(source: str) -> ModuleType:
    """The module of this text, always from a file: Triton reads the text of its functions from there.

    Without a cache folder the file is in a temporary one, which is removed when the program ends.
    """
    path = path_of(source)
    try:
        if not path.exists():
            write_atomically(path, source.encode())
    except (Sdf2vecError, OSError) as error:
        _warn_once(str(error))
        path = Path(_temporary_folder().name) / path.name
        write_atomically(path, source.encode())
    return _import(path)


def is_compiled(source: str, function: str) -> bool:
    """Whether a function of this text has been compiled before on this machine."""
    path = path_of(source)
    return any((path.parent / "__pycache__").glob(f"{path.stem}.{function}-*.nbi"))


def path_of(source: str) -> Path:
    """Where the module of this text is kept."""
    versions = (numba.__version__, np.__version__, sys.version)
    key = hashlib.sha256("\n".join((source, *versions)).encode()).hexdigest()[:20]
    return cache_folder() / f"kernels_{key}.py"


def cache_folder() -> Path:
    """`$SDF2VEC_CACHE`, or the user's cache folder as the system has it."""
    if own := os.environ.get("SDF2VEC_CACHE"):
        return Path(own)
    if sys.platform == "win32":
        return Path(os.environ.get("LOCALAPPDATA", Path.home() / "AppData" / "Local")) / "sdf2vec"
    if sys.platform == "darwin":
        return Path.home() / "Library" / "Caches" / "sdf2vec"
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "sdf2vec"


def _import(path: Path) -> ModuleType:
    spec = importlib.util.spec_from_file_location(path.stem, path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[path.stem] = module
    spec.loader.exec_module(module)
    return module


@cache
def _temporary_folder() -> TemporaryDirectory[str]:
    return TemporaryDirectory(prefix="sdf2vec-")


@cache
def _warn_once(folder: Path) -> None:
    warnings.warn(
        f"cannot write to {folder}: kernels are compiled anew in every run", RuntimeWarning, stacklevel=4
    )

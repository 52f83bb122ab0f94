"""Optional packages, imported where they are asked for; one line where they are missing says how to get them."""

from __future__ import annotations

from importlib import import_module
from typing import Any

from .errors import Sdf2vecError


def needed(module: str, extra: str, what: str) -> Any:
    """A module of an optional package. Raises Sdf2vecError where it is missing."""
    try:
        return import_module(module)
    except ImportError as error:
        missing = error.name or module
        raise Sdf2vecError(
            f"{what} needs the Python package {missing}, which is not here: pip install 'sdf2vec[{extra}]'"
        ) from None

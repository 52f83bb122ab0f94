"""Where three.js is, for pages that check its export: `make engines` puts it next to this environment by npm."""

import os
import sys
from functools import cache
from pathlib import Path


@cache
def missing() -> str | None:
    """None if three.js is here, else one line on how to get it."""
    return None if (folder() / "three.module.min.js").exists() else "three.js is not here: make engines"


def folder() -> Path:
    """The folder with three.js' modules; SDF2VEC_THREE names another."""
    named = os.environ.get("SDF2VEC_THREE")
    return Path(named) if named else Path(sys.prefix, "npm", "node_modules", "three", "build")


def files() -> dict[str, str]:
    """The modules by name."""
    return {path.name: path.read_text() for path in folder().glob("three.*.min.js")}

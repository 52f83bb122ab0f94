"""SVGO, which many put SVGs through before they publish them."""

import shutil
import subprocess
from functools import cache
from pathlib import Path

from sdf2vec.engines.engine import EngineError, answer_of
from sdf2vec.npm import NODE_MODULES

PLACE = NODE_MODULES / ".bin" / "svgo"


@cache
def missing() -> str | None:
    """None if SVGO works, else one line on how to get it."""
    program = _program()
    if not Path(program).exists():
        return "svgo is not installed: make test puts it in a place of its own"
    done = subprocess.run([program, "--version"], capture_output=True, text=True, check=False)
    return (
        None if done.returncode == 0 else f"svgo fails ({' '.join(done.stderr.split())[:200]}): reinstall it"
    )


def optimized(svg: str) -> str:
    """What SVGO makes of an SVG with its default options.

    Raises:
        EngineError: SVGO is missing, or refuses the SVG.
    """
    if reason := missing():
        raise EngineError(reason)
    return answer_of([_program(), "-i", "-", "-o", "-"], svg.encode(), "svgo refuses the SVG").decode()


def _program() -> str:
    return shutil.which("svgo") or str(PLACE)

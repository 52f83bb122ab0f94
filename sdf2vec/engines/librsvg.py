"""SVG drawn by librsvg's command."""

import shutil
import subprocess

from sdf2vec.engines.engine import EngineError, Picture, pixels_of, with_viewport

PROGRAM = "rsvg-convert"


def probe() -> None:
    """Raises where librsvg's command is not here."""
    if not shutil.which(PROGRAM):
        raise EngineError(f"{PROGRAM} is not installed")


def render(svg: str, width: int, height: int) -> Picture:
    """Draws an SVG into a viewport of `width` × `height` pixels.

    Returns:
        float32 `[height, width, 4]` in 0..1 with straight (not premultiplied) alpha, row 0 at the top.

    Raises:
        EngineError: the SVG is refused.
    """
    sized = with_viewport(svg, width, height)
    done = subprocess.run([PROGRAM, "--unlimited"], input=sized.encode(), capture_output=True, check=False)
    if done.returncode != 0:
        log = done.stderr.decode(errors="replace")
        raise EngineError(f"librsvg refuses the SVG: {log}", log=log)
    return pixels_of(done.stdout)

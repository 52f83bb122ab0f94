"""SVG drawn by librsvg's command."""

import shutil
import subprocess
from functools import cache

from sdf2vec.engines.engine import EngineError, Picture, pixels_of, require_present, with_viewport

PROGRAM = "rsvg-convert"


@cache
def missing() -> str | None:
    """None if librsvg's command is here, else one line on how to get it."""
    return None if shutil.which(PROGRAM) else f"{PROGRAM} is not installed: apt-get install librsvg2-bin"


def render(svg: str, width: int, height: int) -> Picture:
    """Draws an SVG into a viewport of `width` × `height` pixels.

    Returns:
        float32 `[height, width, 4]` in 0..1 with straight (not premultiplied) alpha, row 0 at the top.

    Raises:
        EngineError: librsvg is missing, the size is out of range or the SVG is refused.
    """
    sized = with_viewport(svg, width, height)
    require_present(missing())
    done = subprocess.run([PROGRAM, "--unlimited"], input=sized.encode(), capture_output=True, check=False)
    if done.returncode != 0:
        log = done.stderr.decode(errors="replace")
        raise EngineError(f"librsvg refuses the SVG: {log}", log=log)
    return pixels_of(done.stdout)

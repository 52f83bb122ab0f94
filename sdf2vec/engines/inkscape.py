"""SVG drawn by Inkscape's command."""

import shutil
import subprocess

from sdf2vec.engines.engine import EngineError, Picture, pixels_of, with_viewport

PROGRAM = "inkscape"


def probe() -> None:
    """Raises where Inkscape's command is not here."""
    if not shutil.which(PROGRAM):
        raise EngineError(f"{PROGRAM} is not installed")


def render(svg: str, width: int, height: int) -> Picture:
    """Draws an SVG into a viewport of `width` × `height` pixels.

    Returns:
        float32 `[height, width, 4]` in 0..1 with straight (not premultiplied) alpha, row 0 at the top.

    Raises:
        EngineError: the SVG is refused.
    """
    sized = with_viewport(svg, width, height).encode()
    area = ["--export-area-page", f"--export-width={width}", f"--export-height={height}"]
    command = [PROGRAM, "--pipe", *area, "--export-type=png", "--export-filename=-"]
    done = subprocess.run(command, input=sized, capture_output=True, check=False)
    if done.returncode != 0 or not done.stdout:  # it ends with 0 where it can't read what it is given
        log = done.stderr.decode(errors="replace")
        raise EngineError(f"Inkscape refuses the SVG: {log}", log=log)
    pixels = pixels_of(done.stdout)
    pixels[pixels[..., 3] == 0.0] = 0.0  # where nothing is drawn it says white
    return pixels

"""SVG drawn by Firefox, headless, by its own screenshot command: one start a picture.

A screenshot is opaque, so the picture is shown twice, on white and on black, which together tell its alpha.
"""

import shutil
import subprocess
import tempfile
from functools import cache
from pathlib import Path

import numpy as np

from sdf2vec.engines.engine import EngineError, Picture, pixels_of, with_viewport

PROGRAMS = ("firefox-esr", "firefox")
SECONDS = 120.0

# No first-run page and no telemetry: nothing but the picture is opened, and the network stays quiet.
PREFERENCES = """user_pref("datareporting.policy.dataSubmissionEnabled", false);
user_pref("toolkit.telemetry.reportingpolicy.firstRun", false);
user_pref("browser.shell.checkDefaultBrowser", false);
user_pref("app.normandy.enabled", false);
user_pref("network.captive-portal-service.enabled", false);
user_pref("network.connectivity-service.enabled", false);
user_pref("browser.safebrowsing.update.enabled", false);
user_pref("layout.css.devPixelsPerPx", "1.0");
user_pref("gfx.color_management.mode", 0);
"""

PAGE = (
    "<!DOCTYPE html><style>*{margin:0}html{background:#fff;overflow:hidden}"
    "img{display:block;width:%dpx;height:%dpx}img+img{background:#000}</style>"
    '<img src="picture.svg" alt=""><img src="picture.svg" alt="">'
)


@cache
def probe() -> str:
    """The program. Raises EngineError where it is not here."""
    program = next(filter(None, map(shutil.which, PROGRAMS)), None)
    if program is None:
        raise EngineError("Firefox is not installed")
    return program


def render(svg: str, width: int, height: int) -> Picture:
    """Draws an SVG, as an `<img>`, into `width` × `height` pixels.

    Returns:
        float32 `[height, width, 4]` in 0..1 with straight (not premultiplied) alpha, row 0 at the top.

    Raises:
        EngineError: no picture came.
    """
    sized = with_viewport(svg, width, height)
    with tempfile.TemporaryDirectory(prefix="sdf2vec-firefox-", ignore_cleanup_errors=True) as name:
        folder = Path(name)
        (folder / "profile").mkdir()
        (folder / "profile" / "user.js").write_text(PREFERENCES)
        (folder / "picture.svg").write_text(sized, encoding="utf-8")
        (folder / "index.html").write_text(PAGE % (width, height))
        shown = _screenshot(folder, width, 2 * height)
    return _with_alpha(shown[:height], shown[height:])


def _with_alpha(on_white: Picture, on_black: Picture) -> Picture:
    """RGBA with straight alpha from the RGB [H, W, 3] of one picture on two grounds."""
    alpha = 1.0 - (on_white - on_black).mean(axis=-1, keepdims=True).clip(0.0, 1.0)
    color = np.divide(on_black, alpha, out=np.zeros_like(on_black), where=alpha > 0)
    return np.concatenate([color.clip(0.0, 1.0), alpha], axis=-1)


def _screenshot(folder: Path, width: int, height: int) -> Picture:
    """RGB [height, width, 3] of the page in a folder."""
    output = folder / "out.png"
    command = [probe(), "--headless", "--no-remote", "--profile", str(folder / "profile")]
    command += [f"--window-size={max(width, 450)},{max(height, 100)}", "--screenshot", str(output)]
    command += [(folder / "index.html").as_uri()]
    try:
        done = subprocess.run(command, capture_output=True, timeout=SECONDS, check=False)
    except subprocess.TimeoutExpired:
        raise EngineError(f"Firefox took no picture in {SECONDS:g} seconds") from None
    if not output.exists():
        raise EngineError("Firefox took no picture", log=done.stderr.decode(errors="replace"))
    pixels = pixels_of(output.read_bytes())[:height, :width, :3]
    if pixels.shape != (height, width, 3):
        raise EngineError(
            f"Firefox drew {pixels.shape[1]} × {pixels.shape[0]} pixels, not {width} × {height}"
        )
    return pixels

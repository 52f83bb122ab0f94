"""SVG drawn by Firefox, headless, which is told what to do by Marionette, its own protocol.

One browser is started per process and lives until the process ends; it listens on this machine alone. A screenshot is
opaque, so the picture is shown twice, on white and on black, which together tell its alpha.
"""

import atexit
import base64
import json
import shutil
import socket
import subprocess
import tempfile
import time
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from io import BufferedReader
from pathlib import Path
from typing import Any

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
user_pref("marionette.port", 0);
"""
ACTIVE_PORT = "MarionetteActivePort"  # the file in a profile that says which port was free
POLL = 0.05  # seconds between two looks at it
DECODED = "return Promise.all([...document.images].map((image) => image.decode()))"

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
    with tempfile.TemporaryDirectory(prefix="sdf2vec-firefox-") as name:
        folder = Path(name)
        (folder / "picture.svg").write_text(sized, encoding="utf-8")
        (folder / "index.html").write_text(PAGE % (width, height))
        shown = _screenshot(folder / "index.html", width, 2 * height)
    return _with_alpha(shown[:height], shown[height:])


def _with_alpha(on_white: Picture, on_black: Picture) -> Picture:
    """RGBA with straight alpha from the RGB [H, W, 3] of one picture on two grounds."""
    alpha = 1.0 - (on_white - on_black).mean(axis=-1, keepdims=True).clip(0.0, 1.0)
    color = np.divide(on_black, alpha, out=np.zeros_like(on_black), where=alpha > 0)
    return np.concatenate([color.clip(0.0, 1.0), alpha], axis=-1)


def _screenshot(page: Path, width: int, height: int) -> Picture:
    """RGB [height, width, 3] of a page."""
    tell = _browser()
    try:
        tell("WebDriver:Navigate", url=page.as_uri())
        tell("WebDriver:ExecuteScript", script=DECODED, args=[])
        png = tell("WebDriver:TakeScreenshot", full=True)["value"]
    except (OSError, ValueError) as error:
        _browser.cache_clear()
        raise EngineError(f"Firefox took no picture: {error}") from None
    pixels = pixels_of(base64.b64decode(png))[:height, :width, :3]
    if pixels.shape != (height, width, 3):
        raise EngineError(
            f"Firefox drew {pixels.shape[1]} × {pixels.shape[0]} pixels, not {width} × {height}"
        )
    return pixels


@cache
def _browser() -> Callable[..., Any]:
    """What tells a running browser a command with its parameters, and gives the answer."""
    profile = Path(tempfile.mkdtemp(prefix="sdf2vec-firefox-"))
    atexit.register(shutil.rmtree, profile, ignore_errors=True)
    (profile / "user.js").write_text(PREFERENCES)
    command = [probe(), "--headless", "--no-remote", "--marionette", "--profile", str(profile)]
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    atexit.register(process.wait)
    atexit.register(process.kill)
    connection = socket.create_connection(("127.0.0.1", _port(profile, process)), SECONDS)
    answers = connection.makefile("rb")
    _answer(answers)  # a greeting

    def tell(name: str, **parameters: Any) -> Any:
        said = json.dumps([0, 1, name, parameters]).encode()
        connection.sendall(b"%d:%s" % (len(said), said))
        _, _, error, result = _answer(answers)
        if error:
            raise EngineError(f"Firefox: {error['message']}", log=str(error))
        return result

    tell("WebDriver:NewSession")
    return tell


def _port(profile: Path, process: subprocess.Popen[bytes]) -> int:
    """Where the browser listens. Raises EngineError where it does not come to that."""
    end = time.monotonic() + SECONDS
    while time.monotonic() < end and process.poll() is None:
        with suppress(OSError, ValueError):
            return int((profile / ACTIVE_PORT).read_text())
        time.sleep(POLL)
    process.kill()
    raise EngineError(f"Firefox did not start in {SECONDS:g} seconds")


def _answer(answers: BufferedReader) -> Any:
    """The next message: its length, a colon, JSON."""
    length = b""
    while (byte := answers.read(1)) != b":":
        if not byte:
            raise ConnectionError("it has ended")
        length += byte
    return json.loads(answers.read(int(length)))

"""Shadertoy code drawn by a client of its own, wgpu-shadertoy.

It wants another version of wgpu than this package, so it lives in an environment of its own, which
`make engines` puts next to this one; SDF2VEC_SHADERTOY_PYTHON names the interpreter of another. One client is started
per process, for its start takes seconds, and lives until the process ends; one that fails is started anew.
"""

import atexit
import os
import subprocess
import sys
import tempfile
import threading
from collections.abc import Callable
from functools import cache
from pathlib import Path

import numpy as np

from sdf2vec.engines.engine import EngineError, Picture

SECONDS = 120
CLIENT = """
import sys
import numpy as np
from wgpu_shadertoy import Shadertoy
answers, sys.stdout = sys.stdout.buffer, sys.stderr
while asked := sys.stdin.buffer.readline():
    width, height, length = map(int, asked.split())
    text = sys.stdin.buffer.read(length).decode()
    shader = Shadertoy(text, resolution=(width, height), offscreen=True)
    answers.write(np.ascontiguousarray(shader.snapshot()).tobytes())
    answers.flush()
"""
NOTHING = "void mainImage(out vec4 fragColor, in vec2 fragCoord) { fragColor = vec4(1.0); }"


def probe() -> None:
    """Raises where wgpu-shadertoy does not work."""
    render(NOTHING, 4, 4)


def render(text: str, width: int, height: int) -> Picture:
    """Draws a Shadertoy text with `mainImage` over `width` × `height` pixels.

    Returns:
        float32 `[height, width, 4]` of 8-bit levels in 0..1, row 0 at the top.

    Raises:
        EngineError: the text is refused.
    """
    drawn = _client()(text.encode(), width, height)
    levels = np.frombuffer(drawn, np.uint8).reshape(height, width, 4)
    return levels.astype(np.float32) / np.float32(255)


@cache
def _client() -> Callable[[bytes, int, int], bytes]:
    """What asks a running client for a picture."""
    log = tempfile.TemporaryFile()  # noqa: SIM115 (as long as the process)
    process = subprocess.Popen(
        [str(_python()), "-c", CLIENT],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=log,
        env=os.environ | {"WGPU_FORCE_OFFSCREEN": "true"},
    )
    atexit.register(process.kill)
    stdin, stdout = process.stdin, process.stdout
    assert stdin is not None
    assert stdout is not None

    def ask(text: bytes, width: int, height: int) -> bytes:
        timer = threading.Timer(SECONDS, process.kill)
        timer.start()
        try:
            stdin.write(b"%d %d %d\n" % (width, height, len(text)) + text)
            stdin.flush()
            drawn = stdout.read(width * height * 4)
        except BrokenPipeError:
            drawn = b""
        finally:
            timer.cancel()
        if len(drawn) == width * height * 4:
            return drawn
        _client.cache_clear()
        process.kill()
        process.wait()
        log.seek(0)
        said = log.read().decode(errors="replace")
        raise EngineError(f"wgpu-shadertoy fails: {(said.strip().splitlines() or ['no pixels'])[-1]}", said)

    return ask


def _python() -> Path:
    python = Path(
        os.environ.get("SDF2VEC_SHADERTOY_PYTHON") or Path(sys.prefix, "shadertoy", "bin", "python")
    )
    if not python.exists():
        raise EngineError("wgpu-shadertoy is not installed")
    return python

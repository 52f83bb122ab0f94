"""Shadertoy code drawn by a client of its own, wgpu-shadertoy.

It wants another version of wgpu than this package, so it lives in an environment of its own, which
`make engines` puts next to this one; SDF2VEC_SHADERTOY_PYTHON names the interpreter of another.
"""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np

from sdf2vec.engines.engine import EngineError, Picture

SECONDS = 120
DRAW = """
import sys
import numpy as np
from wgpu_shadertoy import Shadertoy
width, height = map(int, sys.argv[1:])
shader = Shadertoy(sys.stdin.read(), resolution=(width, height), offscreen=True)
sys.stdout.buffer.write(np.ascontiguousarray(shader.snapshot()).tobytes())
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
    environment = os.environ | {"WGPU_FORCE_OFFSCREEN": "true"}
    command = [str(_python()), "-c", DRAW, str(width), str(height)]
    done = subprocess.run(
        command, input=text.encode(), env=environment, capture_output=True, check=False, timeout=SECONDS
    )
    if done.returncode or len(done.stdout) != width * height * 4:
        log = done.stderr.decode(errors="replace")
        raise EngineError(f"wgpu-shadertoy fails: {(log.strip().splitlines() or ['no pixels'])[-1]}", log)
    levels = np.frombuffer(done.stdout, np.uint8).reshape(height, width, 4)
    return levels.astype(np.float32) / np.float32(255)


def _python() -> Path:
    python = Path(
        os.environ.get("SDF2VEC_SHADERTOY_PYTHON") or Path(sys.prefix, "shadertoy", "bin", "python")
    )
    if not python.exists():
        raise EngineError("wgpu-shadertoy is not installed")
    return python

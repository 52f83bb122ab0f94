"""GLSL judged by Khronos' reference compiler, which is stricter than most drivers."""

import shutil
import subprocess
from functools import cache

from sdf2vec.engines.engine import EngineError

PROGRAM = "glslangValidator"


@cache
def missing() -> str | None:
    """None if glslangValidator is here, else one line on how to get it."""
    return None if shutil.which(PROGRAM) else f"{PROGRAM} is not installed: apt-get install glslang-tools"


def glslang_validate(fragment: str) -> str | None:
    """None if a fragment shader is valid, else all that the compiler says against it.

    Raises:
        EngineError: glslangValidator is missing.
    """
    if reason := missing():
        raise EngineError(reason)
    command = [PROGRAM, "--stdin", "-S", "frag"]
    done = subprocess.run(
        command, input=fragment, capture_output=True, text=True, encoding="utf-8", check=False
    )
    return None if done.returncode == 0 else (done.stdout + done.stderr).removeprefix("stdin\n").strip()

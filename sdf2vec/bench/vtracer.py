"""What vtracer, a tracer of outlines, makes of a picture at its defaults: its Python package or its program."""

from __future__ import annotations

import shutil
import subprocess
import tempfile
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path

from ..engines.engine import EngineError

ADVICE = "vtracer is not installed: pip install vtracer"


def is_there() -> bool:
    """Whether it can be called."""
    return find_spec("vtracer") is not None or shutil.which("vtracer") is not None


def traced(png: bytes) -> str:
    """The SVG of a picture. Raises EngineError where vtracer is missing or fails."""
    if find_spec("vtracer") is not None:
        svg: str = import_module("vtracer").convert_raw_image_to_svg(png, img_format="png")
        return svg
    program = shutil.which("vtracer")
    if program is None:
        raise EngineError(ADVICE)
    with tempfile.TemporaryDirectory() as folder:
        source, target = Path(folder, "picture.png"), Path(folder, "picture.svg")
        source.write_bytes(png)
        command = [program, "--input", str(source), "--output", str(target)]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if done.returncode or not target.exists():
            raise EngineError(f"vtracer failed: {done.stderr or done.stdout}")
        return target.read_text(encoding="utf-8")

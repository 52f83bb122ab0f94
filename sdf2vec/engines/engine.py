"""What the engines have in common: their record, their error and their checks."""

import io
import os
import shutil
import subprocess
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from typing import Any
from xml.etree import ElementTree

import numpy as np
from PIL import Image

from sdf2vec.errors import Sdf2vecError

from ..arrays import Float32Array

Picture = Float32Array  # [height, width, 4], row 0 is the top of the picture
Uniforms = Mapping[str, float | tuple[float, ...]]

SVG_NAMESPACE = "http://www.w3.org/2000/svg"
LARGEST_SIDE = 16384
LARGEST_AREA = 2**26  # one gibibyte of float32 RGBA


class EngineError(Sdf2vecError):
    """An engine is missing or refuses what it was given; `log` holds the engine's whole answer."""

    def __init__(self, message: str, log: str = "") -> None:
        super().__init__(" ".join(message.split()))
        self.log = log or message


@dataclass(frozen=True)
class Engine:
    """A program that draws an export without this package's own renderer.

    `probe()` raises where it does not work, `advice` says how to get it. `is_quick`: a picture takes it no seconds.
    """

    name: str
    probe: Callable[[], object]
    draw: Callable[..., Picture]
    advice: str
    is_quick: bool = True

    def missing(self) -> str | None:
        """None where the engine works, else one line on how to get it; never raises."""
        return reason_missing(self.probe, self.advice)

    def render(self, content: str | bytes, width: int, height: int, **more: Any) -> Picture:
        """Draws an export into `width` × `height` pixels; `more` is what the engine's own `render` takes.

        Returns:
            float32 RGBA `[height, width, 4]`, row 0 at the top.

        Raises:
            EngineError: the engine is missing, the size is out of range or the export is refused.
        """
        require_drawable(width, height)
        reason = self.missing()
        if reason is not None:
            raise EngineError(reason)
        return self.draw(content, width, height, **more)


@cache
def reason_missing(probe: Callable[[], object], advice: str) -> str | None:
    """None if `probe()` works, else one line: what failed and the advice that mends it."""
    try:
        probe()
    except ModuleNotFoundError as error:
        return f"the Python package {error.name} is not installed: pip install 'sdf2vec[check]'"
    except (
        Exception
    ) as error:  # a driver may fail in any way; the caller asked for a line, not for a traceback
        return f"{' '.join(str(error).split()) or type(error).__name__}; {advice}"
    return None


def prepare_mesa() -> None:
    """Before one of Mesa's drivers is loaded.

    Triton comes first where it is installed: its LLVM crashes when a driver has brought another one before. Shaders are
    drawn once, so that a software driver's LLVM should not optimise them: that takes longer than all else.
    """
    with suppress(ImportError):
        import_module("triton")
    os.environ.setdefault("GALLIVM_PERF", "nopt")


def require_drawable(width: int, height: int) -> None:
    """Raises EngineError for a size in pixels that no engine should be asked for."""
    if not (1 <= width <= LARGEST_SIDE and 1 <= height <= LARGEST_SIDE and width * height <= LARGEST_AREA):
        raise EngineError(
            f"cannot draw {width} × {height} pixels: "
            f"a side has 1 to {LARGEST_SIDE}, the picture at most {LARGEST_AREA}"
        )


def require_program(program: str) -> None:
    """Raises EngineError where a command is not here."""
    if not shutil.which(program):
        raise EngineError(f"{program} is not installed")


def answer_of(command: Sequence[str], given: bytes, refused: str) -> bytes:
    """What a command writes when it is given this. Raises EngineError where it fails, or writes nothing."""
    done = subprocess.run(command, input=given, capture_output=True, check=False)
    if done.returncode != 0 or not done.stdout:
        log = done.stderr.decode(errors="replace")
        raise EngineError(f"{refused}: {log}", log=log)
    return done.stdout


def pixels_of(png: bytes) -> Picture:
    """A PNG as float32 `[height, width, 4]` in 0..1 with straight alpha, row 0 at the top."""
    with Image.open(io.BytesIO(png)) as picture:
        return np.asarray(picture.convert("RGBA"), np.float32) / np.float32(255)


def with_viewport(svg: str, width: int, height: int) -> str:
    """An SVG with another width and height, fitted into them and centred, just as a browser does.

    Raises:
        EngineError: the text is no SVG.
    """
    try:
        root = ElementTree.fromstring(svg)
    except ElementTree.ParseError as error:
        raise EngineError(f"the SVG is not well-formed XML: {error}") from None
    if root.tag != f"{{{SVG_NAMESPACE}}}svg":
        raise EngineError(f"the SVG has no svg element at its root, but {root.tag!r}")
    if "viewBox" not in root.attrib and {"width", "height"} <= root.attrib.keys():
        own_size = (root.attrib[name].removesuffix("px") for name in ("width", "height"))
        root.set("viewBox", " ".join(("0 0", *own_size)))
    root.set("width", str(width))
    root.set("height", str(height))
    return ElementTree.tostring(root, encoding="unicode")

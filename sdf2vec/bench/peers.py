"""Other programs that make a picture of shapes: how each is found and called, and what its SVG needs to be drawn.

Figures of programs that are not on the machine are those that were published or measured elsewhere, and are marked so.
"""

from __future__ import annotations

import json
import re
import shutil
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import NamedTuple

from ..errors import Sdf2vecError

SVG = "http://www.w3.org/2000/svg"


class Call(NamedTuple):
    """What a program is asked for: files as paths, the picture's size in pixels, a number of shapes."""

    program: str
    source: str
    target: str
    size: tuple[int, int]
    shapes: int


class Published(NamedTuple):
    """Figures that were not measured in the run that shows them."""

    what: str
    picture: str
    shapes: int
    seconds: float | None
    psnr: float | None
    flip: float | None
    gzipped: int | None
    source: str


@dataclass(frozen=True)
class Peer:
    """A program: `programs` are the names it is found by; `command` calls it such that it writes an SVG.

    `counts`: whether it is told a number of shapes. `mend`: what its SVG needs before a renderer takes it.
    """

    about: str
    programs: tuple[str, ...]
    command: Callable[[Call], list[str]]
    counts: bool = True
    mend: Callable[[str, Call], str] = lambda svg, call: svg

    def found(self, given: str | None) -> str | None:
        """Where the program is: as given, or as the system finds it."""
        names = (given,) if given else self.programs
        return next(filter(None, map(shutil.which, names)), None)


# --- calls --------------------------------------------------------------------------------------------------


def _primitive(mode: int) -> Callable[[Call], list[str]]:
    def command(call: Call) -> list[str]:
        side = str(max(call.size))
        return [
            call.program,
            *("-i", call.source, "-o", call.target, "-n", str(call.shapes), "-s", side, "-m", str(mode)),
        ]

    return command


def _geometrize(call: Call) -> list[str]:
    shapes = ("--iterations", str(call.shapes), "--shapeTypes", "rotated_ellipse")
    return [call.program, "--input", call.source, "--output", call.target, "--format", "svg", *shapes]


def _sqip(call: Call) -> list[str]:
    return [call.program, "-n", str(call.shapes), "-o", call.target, call.source]


VTRACER = "import json, sys, vtracer as v; v.convert_image_to_svg_py(*sys.argv[1:3], **json.loads(sys.argv[3]))"


def _vtracer(**options: int | str) -> Callable[[Call], list[str]]:
    """By its program, or by a Python that has its package."""

    def command(call: Call) -> list[str]:
        if "python" in call.program.rpartition("/")[2]:
            return [call.program, "-I", "-c", VTRACER, call.source, call.target, json.dumps(options)]
        flags = [part for name, value in options.items() for part in (f"--{name}", str(value))]
        return [call.program, "--input", call.source, "--output", call.target, *flags]

    return command


# --- what renderers need ------------------------------------------------------------------------------------


def _namespaced(svg: str, call: Call) -> str:
    """geometrize names a namespace that is none."""
    return re.sub(r'xmlns="[^"]*"', f'xmlns="{SVG}"', svg, count=1)


FRUGAL = {
    "mode": "polygon",
    "color_precision": 8,
    "filter_speckle": 16,
    "layer_difference": 32,
    "path_precision": 0,
}

PEERS: dict[str, Peer] = {
    "primitive": Peer("fogleman/primitive, triangles", ("primitive",), _primitive(1)),
    "primitive-ellipse": Peer("fogleman/primitive, rotated ellipses", ("primitive",), _primitive(7)),
    "geometrize": Peer(
        "geometrizejs-cli, rotated ellipses", ("geometrize",), _geometrize, mend=_namespaced
    ),
    "vtracer": Peer("vtracer at its defaults, paths", ("vtracer",), _vtracer(), counts=False),
    "vtracer-frugal": Peer(
        "vtracer with large polygons, paths", ("vtracer",), _vtracer(**FRUGAL), counts=False
    ),
    "sqip": Peer("sqip, blurred triangles", ("sqip",), _sqip),
}


def programs_of(given: list[str]) -> Mapping[str, str]:
    """From NAME=PATH; a name stands for all peers that call that program. Raises Sdf2vecError for an unknown one."""
    names = {program for peer in PEERS.values() for program in peer.programs}
    found = {}
    for text in given:
        name, _, path = text.partition("=")
        if name not in names or not path:
            raise Sdf2vecError(f"a program is told as NAME=PATH, NAME of {', '.join(sorted(names))}: {text!r}")
        if shutil.which(path) is None:
            raise Sdf2vecError(f"{path} is no program; give the path of {name}")
        found[name] = path
    return found


# --- figures of others --------------------------------------------------------------------------------------

MEASURED = "512 × 512, two busy cores, measured once for this project"
_GEOMETRIZE = "geometrize-lib, rotated ellipses"
PUBLISHED = (
    Published("primitive, triangles", "woman_darkhair", 64, 29, 24.54, 0.173, 1246, MEASURED),
    Published("primitive, triangles", "woman_darkhair", 256, 66, 27.70, 0.122, 4091, MEASURED),
    Published("primitive, triangles", "cameraman", 256, 56, 23.12, 0.144, 4045, MEASURED),
    Published("primitive, triangles", "livingroom", 256, 54, 21.98, 0.195, 4158, MEASURED),
    Published("primitive, triangles", "jetplane", 256, 59, 22.48, 0.175, 4145, MEASURED),
    Published("primitive, triangles", "peppers", 256, 72, 22.15, 0.286, 4547, MEASURED),
    Published(_GEOMETRIZE, "woman_darkhair", 64, 3.6, 23.46, 0.195, 1494, MEASURED),
    Published(_GEOMETRIZE, "woman_darkhair", 256, 8.0, 27.69, 0.126, 4734, MEASURED),
    Published(_GEOMETRIZE, "cameraman", 256, 8.2, 23.14, 0.140, 4701, MEASURED),
    Published(_GEOMETRIZE, "livingroom", 256, 6.3, 21.75, 0.201, 4742, MEASURED),
    Published(_GEOMETRIZE, "jetplane", 256, 7.8, 22.17, 0.177, 4696, MEASURED),
    Published(_GEOMETRIZE, "peppers", 256, 7.0, 21.64, 0.297, 5204, MEASURED),
    Published("sqip, blurred", "woman_darkhair", 8, 12.7, 15.9, 0.397, 447, MEASURED),
    Published("thesis, triangles, MSE", "woman_darkhair", 64, None, None, 0.1912, None, "its table 5.1, GPU"),
    Published("thesis, triangles, SSIM", "woman_darkhair", 64, None, None, 0.1721, None, "its table 5.1, GPU"),
    Published("thesis, triangles, MSE", "woman_darkhair", 256, None, None, 0.1679, None, "its table 5.1, GPU"),
    Published("thesis, triangles, SSIM", "woman_darkhair", 256, None, None, 0.1380, None, "its table 5.1, GPU"),
)

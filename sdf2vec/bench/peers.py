"""Other programs that make a picture of shapes: how each is found and called.

Figures of programs that are not on the machine are those that were published or measured elsewhere, and are marked so.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import NamedTuple

from ..errors import Sdf2vecError
from ..npm import NODE_MODULES


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

    `counts`: whether it is told a number of shapes; `grows`: whether it lays one on the other, a line of its SVG each,
    so that what fewer would be is the same without the last ones. `package`: of Python, which does instead of a
    program. `modules`: of npm, which the program needs.
    """

    about: str
    programs: tuple[str, ...]
    command: Callable[[Call], list[str]]
    counts: bool = True
    grows: bool = False
    package: str = ""
    modules: tuple[str, ...] = ()

    def found(self, given: str | None = None) -> str | None:
        """Where the program is: as given, this Python where it has the package, or as the system finds it; nowhere
        without its modules.
        """
        if not all((NODE_MODULES / module).is_dir() for module in self.modules):
            return None
        if not given and self.package and find_spec(self.package):
            return sys.executable
        names = (given,) if given else self.programs
        return next(filter(None, map(shutil.which, names)), None)

    def among(self, programs: Mapping[str, str]) -> str | None:
        """The same, of programs whose places were told, by their names."""
        return self.found(programs.get(self.programs[0]))


# --- calls --------------------------------------------------------------------------------------------------


def _primitive(mode: int) -> Callable[[Call], list[str]]:
    def command(call: Call) -> list[str]:
        side = str(max(call.size))
        return [
            call.program,
            *("-i", call.source, "-o", call.target, "-n", str(call.shapes), "-s", side, "-m", str(mode)),
        ]

    return command


# It begins with the picture's mean colour, which its SVG does not have.
GEOMETRIZE = """
const fs = require("fs"), [modules, source, target, count] = process.argv.slice(1);
const { PNG } = require(`${modules}/pngjs`);
const { Bitmap, ImageRunner, ShapeTypes, SvgExporter } = require(`${modules}/geometrizejs`);
const { width, height, data } = PNG.sync.read(fs.readFileSync(source));
const sums = [0, 0, 0].map((sum, c) => data.reduce((all, value, i) => (i % 4 === c ? all + value : all), sum));
const [r, g, b] = sums.map((sum) => Math.round(sum / (width * height)));
const ground = (r << 24) | (g << 16) | (b << 8) | 255;
const runner = new ImageRunner(Bitmap.createFromByteArray(width, height, data), ground);
const options = { shapeTypes: [ShapeTypes.ROTATED_ELLIPSE] };
const shapes = Array.from({ length: +count }, () => runner.step(options)).flat();
const below = `<rect width="${width}" height="${height}" fill="rgb(${r},${g},${b})"/>`;
const svg = SvgExporter.export(shapes, width, height).replace("</svg>", "\\n</svg>");
fs.writeFileSync(target, svg.replace(/<svg[^>]*>/, (opened) => opened + below));
"""


def _geometrize(call: Call) -> list[str]:
    return [call.program, "-e", GEOMETRIZE, str(NODE_MODULES), call.source, call.target, str(call.shapes)]


def _sqip(call: Call) -> list[str]:
    return [call.program, "-n", str(call.shapes), "-o", call.target, call.source]


VTRACER = (
    "import json, sys, vtracer as v; v.convert_image_to_svg_py(*sys.argv[1:3], **json.loads(sys.argv[3]))"
)


def _vtracer(**options: int | str) -> Callable[[Call], list[str]]:
    """By its program, or by a Python that has its package."""

    def command(call: Call) -> list[str]:
        if "python" in call.program.rpartition("/")[2]:
            return [call.program, "-I", "-c", VTRACER, call.source, call.target, json.dumps(options)]
        flags = [part for name, value in options.items() for part in (f"--{name}", str(value))]
        return [call.program, "--input", call.source, "--output", call.target, *flags]

    return command


# --- the programs ------------------------------------------------------------------------------------------

FRUGAL: dict[str, int | str] = {
    "mode": "polygon",
    "color_precision": 8,
    "filter_speckle": 16,
    "layer_difference": 32,
    "path_precision": 0,
}

PEERS: dict[str, Peer] = {
    "primitive": Peer("fogleman/primitive, triangles", ("primitive",), _primitive(1), grows=True),
    "primitive-ellipse": Peer(
        "fogleman/primitive, rotated ellipses", ("primitive",), _primitive(7), grows=True
    ),
    "geometrize": Peer(
        "geometrizejs, rotated ellipses",
        ("node",),
        _geometrize,
        grows=True,
        modules=("geometrizejs", "pngjs"),
    ),
    "vtracer": Peer(
        "vtracer at its defaults, paths", ("vtracer",), _vtracer(), counts=False, package="vtracer"
    ),
    "vtracer-frugal": Peer(
        "vtracer with large polygons, paths",
        ("vtracer",),
        _vtracer(**FRUGAL),
        counts=False,
        package="vtracer",
    ),
    "sqip": Peer("sqip, blurred triangles", ("sqip",), _sqip),
}


def missing(name: str) -> str:
    """One line that says that a peer isn't here, and how to get it."""
    peer = PEERS[name]
    if peer.modules:
        how = f"make test puts {' and '.join(peer.modules)} where they are looked for"
    else:
        package = f"pip install {peer.package}, or " if peer.package else ""
        how = f"{package}put its program on the path, or tell a bench by --peer NAME=PATH where it is"
    return f"{name}: not on this machine; {how}"


def required(name: str, programs: Mapping[str, str]) -> str:
    """Where the program of a peer is. Raises Sdf2vecError where it isn't."""
    where = PEERS[name].among(programs)
    if where is None:
        raise Sdf2vecError(missing(name))
    return where


def drawn_by(
    name: str, png: bytes, size: tuple[int, int] = (0, 0), shapes: int = 0, given: str | None = None
) -> tuple[str, float]:
    """The SVG that a program makes of a picture, and its CPU seconds; of what size that is and with how many shapes,
    for one that is told that. `given`: where the program is.

    Raises Sdf2vecError where it is missing or fails.
    """
    peer = PEERS[name]
    program = peer.found(given)
    if program is None:
        raise Sdf2vecError(missing(name))
    with tempfile.TemporaryDirectory() as folder:
        source, target = Path(folder, "picture.png"), Path(folder, "picture.svg")
        source.write_bytes(png)
        call = Call(program, str(source), str(target), size, shapes)
        before = os.times()
        done = subprocess.run(peer.command(call), capture_output=True, text=True, check=False)
        after = os.times()
        if done.returncode or not target.exists():
            raise Sdf2vecError(f"{name} failed: {done.stderr or done.stdout}")
        spent = sum(after[2:4]) - sum(before[2:4])  # of children
        return target.read_text(encoding="utf-8"), spent


def programs_of(given: list[str]) -> dict[str, str]:
    """From NAME=PATH; a name stands for all peers that call that program. Raises Sdf2vecError for an unknown one."""
    names = {program for peer in PEERS.values() for program in peer.programs}
    found = {}
    for text in given:
        name, _, path = text.partition("=")
        if name not in names or not path:
            raise Sdf2vecError(
                f"a program is told as NAME=PATH, NAME of {', '.join(sorted(names))}: {text!r}"
            )
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
    Published(
        "thesis, triangles, SSIM", "woman_darkhair", 64, None, None, 0.1721, None, "its table 5.1, GPU"
    ),
    Published(
        "thesis, triangles, MSE", "woman_darkhair", 256, None, None, 0.1679, None, "its table 5.1, GPU"
    ),
    Published(
        "thesis, triangles, SSIM", "woman_darkhair", 256, None, None, 0.1380, None, "its table 5.1, GPU"
    ),
)

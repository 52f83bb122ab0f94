"""One run of a benchmark: a process that makes an SVG of a picture, what it took, and how near that comes."""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import NamedTuple

import numpy as np
from msgspec.structs import replace

from .. import api
from ..arrays import Float32Array
from ..engines import resvg
from ..engines.engine import EngineError
from ..errors import Sdf2vecError
from ..export.byte_limit import gzipped_size
from ..export.options import Options
from ..exports import Exports
from ..fit.views import planes
from ..flip import flip
from ..image import Picture, encode_png, premultiply, unpremultiply
from ..metrics import psnr, ssim
from ..render.draw import draw_fast
from ..scene import Scene
from ..scene_file import load as load_scene
from . import launcher
from .methods import Method
from .peers import Call
from .results import Run
from .svg_shapes import count_numbers, parsed, shapes_of

LIMIT = 1800.0  # seconds of one run
SMALLEST = Options(max_bytes=1)  # of a drawing, which no limit keeps from its smallest form
SMALL = 48  # pixels of the picture that compiles a method's kernels


@dataclass(frozen=True)
class Source:
    """A picture, and the file that programs read: of its pixels as read, eight bits a channel."""

    name: str
    picture: Picture
    path: str


class Score(NamedTuple):
    """How near a drawing [H, W, 4] comes to a picture, premultiplied, at the picture's size."""

    psnr: float
    ssim: float
    flip: float


def score(drawn: Float32Array, picture: Picture) -> Score:
    """Of a drawing with straight alpha; rounded to eight bits."""
    target = planes(picture.premultiplied)
    levels = np.rint(premultiply(drawn) * 255.0).astype(np.float32) / 255.0
    image = planes(levels)[: len(target)]
    return Score(*(float(metric(image, target)) for metric in (psnr, ssim, flip)))


def source_of(name: str, picture: Picture, folder: Path) -> Source:
    """With the file that all programs read."""
    path = folder / f"{name}.png"
    path.write_bytes(encode_png(picture.pixels))
    return Source(name, picture, str(path))


def measured(
    source: Source, method: Method, program: str, shapes: int, seed: int
) -> tuple[Run, Float32Array]:
    """One run, and what it made as pixels [H, W, 4], straight. A program that fails gives a run with its error."""
    run = Run(source.name, method.name, method.family, shapes, seed)
    with tempfile.TemporaryDirectory() as folder:
        if method.peer is None:
            warm_up(method)
            scene_path, svg_path = Path(folder, "scene.json"), Path(folder, "drawing.svg")
            run = took(run, worker(source.path, scene_path, svg_path, shapes, seed, method.name))
            if run.error:
                return run, _nothing(source)
            return _of_scene(run, load_scene(str(scene_path)), svg_path.read_text("utf-8"), source)
        target = Path(folder, "drawing.svg")
        size = (source.picture.width, source.picture.height)
        call = Call(program, source.path, str(target), size, shapes)
        run = took(run, method.peer.command(call))
        if run.error or not target.exists():
            return replace(run, error=run.error or "wrote nothing"), _nothing(source)
        return _of_svg(run, target.read_text("utf-8"), source)


def worker(*arguments: object) -> list[str]:
    """The command of one of our fits."""
    return [sys.executable, "-m", f"{__package__}.worker", *map(str, arguments)]


@cache
def _warmed(name: str, union: int) -> None:
    rows = np.linspace(0.0, 1.0, SMALL * SMALL * 3, dtype=np.float32).reshape(SMALL, SMALL, 3)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "ramp.png")
        path.write_bytes(encode_png(rows))
        files = (path, Path(folder, "scene.json"), Path(folder, "drawing.svg"))
        done = subprocess.run(
            worker(*files, 16 * union, 0, name), capture_output=True, text=True, check=False
        )
        if done.returncode:
            raise Sdf2vecError(f"{name}: {_last_line(done.stderr)}")


def warm_up(method: Method) -> None:
    """Compiles a method's kernels, once, so that it is not measured. Raises Sdf2vecError where it can't work."""
    _warmed(method.name, method.union)


def took(run: Run, command: list[str]) -> Run:
    """Calls a program and fills in what it took."""
    with tempfile.TemporaryDirectory() as folder:
        report = Path(folder, "report.json")
        call = [sys.executable, "-I", "-S", launcher.__file__, str(report), str(LIMIT), *command]
        said = _called(call)
        if not report.exists():
            return replace(run, error=_last_line(said))
        found = json.loads(report.read_bytes())
    status = found.pop("status")
    error = "" if status == 0 else f"ended with {status}: {_last_line(said)}"
    return replace(run, **found, error=error)


def _called(command: list[str]) -> str:
    """What the launcher and its program say on stderr; they end with this process."""
    pipes = {"stdout": subprocess.DEVNULL, "stderr": subprocess.PIPE}
    process = subprocess.Popen(command, text=True, errors="replace", **pipes)  # type: ignore[call-overload]
    try:
        said: str = process.communicate()[1]
    except BaseException:
        process.terminate()
        process.wait()
        raise
    return said


def _last_line(text: str) -> str:
    return (text.strip().splitlines() or ["no word"])[-1][:200]


def _nothing(source: Source) -> Float32Array:
    return np.zeros((source.picture.height, source.picture.width, 4), np.float32)


def _of_scene(run: Run, scene: Scene, svg: str, source: Source) -> tuple[Run, Float32Array]:
    """Scores of the render and of both SVGs; what all exports weigh."""
    image = draw_fast(scene, scene.width, scene.height)
    straight = unpremultiply(np.ascontiguousarray(image.permute(1, 2, 0).numpy()))
    own = score(straight, source.picture)
    small = str(Exports(scene, source.picture).export("svg", SMALLEST).data)
    near, smaller = (score(_drawn(text, source), source.picture) for text in (svg, small))
    shader = api.exported(scene, "shadertoy").raw
    figures = {
        **own._asdict(),
        "drawn": scene.shape_count,
        "numbers": sum(len(layer.numbers) for layer in scene.layers),
        **_weight("svg", svg.encode()),
        **_weight("small", small.encode()),
        **_weight("shader", shader),
        "svg_psnr": near.psnr,
        "svg_flip": near.flip,
        "small_psnr": smaller.psnr,
        "small_flip": smaller.flip,
    }
    return replace(run, **figures), straight


def _of_svg(run: Run, svg: str, source: Source) -> tuple[Run, Float32Array]:
    """Scores of another program's SVG."""
    try:
        pixels = _drawn(svg, source)
        shapes, numbers = len(list(shapes_of(parsed(svg)))), numbers_of(svg)
    except EngineError as error:
        return replace(run, error=f"its SVG: {error}"), _nothing(source)
    near = score(pixels, source.picture)
    weight = {**_weight("svg", svg.encode()), **_weight("small", svg.encode())}
    drawn = {"svg_psnr": near.psnr, "svg_flip": near.flip, "small_psnr": near.psnr, "small_flip": near.flip}
    return replace(run, **near._asdict(), **weight, **drawn, drawn=shapes, numbers=numbers), pixels


def numbers_of(svg: str) -> int:
    """How many numbers an SVG is made of: those of places, three of each shape's colour, its opacity."""
    return count_numbers(svg) + 3 * len(list(shapes_of(parsed(svg)))) + svg.count("opacity=")


def _drawn(svg: str, source: Source) -> Float32Array:
    return resvg.render(svg, source.picture.width, source.picture.height)


def _weight(name: str, data: bytes) -> dict[str, int]:
    return {f"{name}_bytes": len(data), f"{name}_gzip": gzipped_size(data)}

"""What the layouts of a shader cost on software engines, and how true they are. Writes a page in Markdown.

python -m sdf2vec.bench.shaders examples/coffee.png -o docs/shaders.md
"""

from __future__ import annotations

import argparse
import multiprocessing
import os
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from queue import Empty
from typing import Any

import numpy as np

from .. import api
from ..engines import EngineError, opengl, webgl, webgpu
from ..export.layouts import TEXT_LIMIT, fits_constants
from ..export.options import Options
from ..export.shader import Shader, shader
from ..files import write_atomically
from ..render.draw import draw
from ..roundtrip import SHADERTOY_HEAD, SHADERTOY_TAIL
from ..scene import Scene

COUNTS = (16, 64, 256, 768, 1024, 4096)  # 768: nearly the most that a constant table takes
SIDE = 512  # pixels of the square canvas
SECONDS = 60  # after which a combination is given up
FRAMES = 2
MOST_READABLE = 1024  # statements; more take minutes to compile
LAYOUTS = {
    "glsl": ("readable", "table", "tiled", "data"),
    "shadertoy": ("readable", "tiled", "packed"),
    "wgsl": ("readable", "data"),
}
ENGINES = {"glsl": ("llvmpipe", "Chromium"), "shadertoy": ("llvmpipe", "Chromium"), "wgsl": ("lavapipe",)}


@dataclass(frozen=True)
class Measured:
    """Seconds, and the largest error in 8-bit levels."""

    compile: float
    first: float
    frame: float
    error: float


def measure(scene: Scene, target: str, layout: str, engine: str) -> Measured:
    """One text on one engine. A driver's first frame holds most of its compilation."""
    os.environ["MESA_SHADER_CACHE_DISABLE"] = "true"
    made = shader(scene, target, Options(layout=layout, framing="fit"))
    compiled, first, frame, pixels = DRAW[engine](made, target)

    expected = draw(scene, SIDE, SIDE).permute(1, 2, 0).numpy()
    return Measured(compiled, first, frame, float(np.abs(pixels - expected).max()) * 255.0)


def _wrapped(made: Shader, target: str) -> str:
    return SHADERTOY_HEAD + made.text + SHADERTOY_TAIL if target == "shadertoy" else made.text


def _uniforms(side: int) -> dict[str, tuple[float, ...]]:
    return {"resolution": (side, side), "iResolution": (side, side, 1.0)}


def _chromium(made: Shader, target: str) -> tuple[float, float, float, Any]:
    drawn = webgl.draw(_wrapped(made, target), SIDE, SIDE, _uniforms(SIDE), made.data, FRAMES)
    return drawn.compile, drawn.first, drawn.frame, drawn.pixels


def _native(render: Callable[..., Any]) -> Callable[[Shader, str], tuple[float, float, float, Any]]:
    """An engine that compiles anew for every picture: a tiny picture tells how long that takes."""

    def run(made: Shader, target: str) -> tuple[float, float, float, Any]:
        text = _wrapped(made, target)
        times = []
        for side in (1, SIDE):
            started = time.perf_counter()
            pixels = render(text, side, side, uniforms=_uniforms(side), texture=made.data)
            times.append(time.perf_counter() - started)
        return times[0], times[1], max(times[1] - times[0], 0.0), pixels

    return run


DRAW = {"Chromium": _chromium, "llvmpipe": _native(opengl.render), "lavapipe": _native(webgpu.render)}


def _worker(queue: Any, *arguments: Any) -> None:
    _warm(arguments[-1])
    try:
        queue.put(measure(*arguments))
    except EngineError:
        queue.put("refused")


def _warm(engine: str) -> None:
    """Starts an engine, which is not what is measured."""
    scene = Scene(8, 8, ())
    target = "wgsl" if engine == "lavapipe" else "glsl"
    DRAW[engine](shader(scene, target, Options()), target)


def in_time(*arguments: Any) -> Measured | str:
    """`measure` in a process of its own, or in a word why there is none."""
    context = multiprocessing.get_context("spawn")
    queue = context.Queue()
    process = context.Process(target=_worker, args=(queue, *arguments))
    process.start()
    try:
        found: Measured | str = queue.get(timeout=SECONDS)
    except Empty:
        found = f"over {SECONDS}"
    process.kill()
    process.join()
    return found


def rows(scenes: dict[int, Scene], target: str) -> Iterator[str]:
    """Lines of the table for one target."""
    for layout in LAYOUTS[target]:
        for count, scene in scenes.items():
            if layout == "readable" and count > MOST_READABLE:
                continue
            if layout in ("table", "tiled") and not fits_constants(scene):
                continue
            yield from _rows_of(scene, target, layout)


def _rows_of(scene: Scene, target: str, layout: str) -> Iterator[str]:
    made = shader(scene, target, Options(layout=layout))
    size = len(made.text) + (0 if made.data is None else made.data.nbytes)
    tiles = made.choice.tiles
    depth = tiles.depth if tiles else float(len(scene.layers))
    for engine in ENGINES[target]:
        head = f"| {target} | {layout} | {scene.shape_count} | {depth:.1f} | {size:,} | {engine} |"
        found = in_time(scene, target, layout, engine)
        if isinstance(found, str):
            yield f"{head} {found} | | | |"
        else:
            yield (
                f"{head} {found.compile:.2f} | {found.first:.2f} | {found.frame:.3f} | {found.error:.3f} |"
            )


def page(scenes: dict[int, Scene], name: str, command: str) -> str:
    """The whole page."""
    default = shader(scenes[256], "shadertoy", Options(title=name))
    head = (
        "# Shader layouts",
        "",
        f"{name} in triangles, preset fast, at {SIDE} x {SIDE}, on software engines: read times as ratios. "
        "llvmpipe and lavapipe compile anew for every picture: compile is a picture of one pixel, frame what a "
        "whole one takes beyond that. Chromium (SwiftShader) compiles most of a shader in its first frame. Depth: "
        "layers that a pixel evaluates, on average; bytes: text and data; error: largest difference from the torch "
        "render, in 8-bit levels, over the whole square canvas. Packed text is made for a canvas of 16:9: below and "
        "above the picture, which that does not show, it may be off by more.",
        "",
        f"    {command}",
        "",
        f"Default Shadertoy text at 256 shapes: {len(default.text):,} bytes, {default.about}, measured on a full HD "
        f"canvas. Hosts are warned of above {TEXT_LIMIT // 1024} KiB.",
        "",
        "`--layout buffer` writes a Shadertoy of two tabs, marked `// --- Buffer A ---` and `// --- Image "
        "---`, which both have Buffer A as iChannel0. Buffer A draws the picture in the first frame, and "
        "where `iResolution` is not what the alpha of its first two texels keeps beside the alpha itself; "
        "else it repeats itself. The Image tab shows it. So a frame costs two reads of a texture, however "
        "many shapes there are; nothing moves.",
        "",
        "| target | layout | shapes | depth | bytes | engine | compile s | first frame s | frame s | error |",
        "|---|---|---:|---:|---:|---|---:|---:|---:|---:|",
    )
    lines = (line for target in LAYOUTS for line in rows(scenes, target))
    return "\n".join([*head, *lines]) + "\n"


def main() -> None:
    """Entry point of `python -m sdf2vec.bench.shaders`."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("picture", type=Path)
    parser.add_argument(
        "-o", "--output", type=Path, help="the whole page; without, rows of the table are printed"
    )
    parser.add_argument("--targets", nargs="+", choices=LAYOUTS, default=list(LAYOUTS))
    parser.add_argument("--counts", nargs="+", type=int, default=COUNTS)
    options = parser.parse_args()
    scenes = {count: api.fit(options.picture, count, preset="fast") for count in options.counts}
    if options.output is None:
        for target in options.targets:
            for row in rows(scenes, target):
                print(row, flush=True)
        return
    command = f"python -m sdf2vec.bench.shaders {options.picture} -o {options.output}"
    write_atomically(options.output, page(scenes, options.picture.stem, command).encode())


if __name__ == "__main__":
    main()

"""What one shader costs on one software engine, measured in a process of its own."""

from __future__ import annotations

import multiprocessing
import os
import time
from collections.abc import Callable
from dataclasses import dataclass
from queue import Empty
from typing import Any

import numpy as np

from ..engines import EngineError, opengl, webgl, webgpu
from ..export.options import Options
from ..export.shader import Shader, shader
from ..render.draw import draw
from ..roundtrip import SHADERTOY_HEAD, SHADERTOY_TAIL
from ..scene import Scene

SECONDS = 60  # after which a combination is given up
FRAMES = 2


@dataclass(frozen=True)
class Measured:
    """Seconds, and the largest error in 8-bit levels."""

    compile: float
    first: float
    frame: float
    error: float


def measure(scene: Scene, target: str, layout: str, side: int, engine: str) -> Measured:
    """One text on one engine, on so many pixels squared. A driver's first frame holds most of its compilation."""
    os.environ["MESA_SHADER_CACHE_DISABLE"] = "true"
    made = shader(scene, target, Options(layout=layout, framing="fit"))
    compiled, first, frame, pixels = DRAW[engine](made, target, side)
    expected = draw(scene, side, side).permute(1, 2, 0).numpy()
    return Measured(compiled, first, frame, float(np.abs(pixels - expected).max()) * 255.0)


def _wrapped(made: Shader, target: str) -> str:
    return SHADERTOY_HEAD + made.text + SHADERTOY_TAIL if target == "shadertoy" else made.text


def _uniforms(side: int) -> dict[str, tuple[float, ...]]:
    return {"resolution": (side, side), "iResolution": (side, side, 1.0)}


def _chromium(made: Shader, target: str, side: int) -> tuple[float, float, float, Any]:
    drawn = webgl.draw(_wrapped(made, target), side, side, _uniforms(side), made.data, FRAMES)
    return drawn.compile, drawn.first, drawn.frame, drawn.pixels


def _native(render: Callable[..., Any]) -> Callable[[Shader, str, int], tuple[float, float, float, Any]]:
    """An engine that compiles anew for every picture: a tiny picture tells how long that takes."""

    def run(made: Shader, target: str, side: int) -> tuple[float, float, float, Any]:
        text = _wrapped(made, target)
        times = []
        for length in (1, side):
            started = time.perf_counter()
            pixels = render(text, length, length, uniforms=_uniforms(length), texture=made.data)
            times.append(time.perf_counter() - started)
        return times[0], times[1], max(times[1] - times[0], 0.0), pixels

    return run


DRAW = {"Chromium": _chromium, "llvmpipe": _native(opengl.render), "lavapipe": _native(webgpu.render)}


def _worker(queue: Any, *arguments: Any) -> None:
    _warm(*arguments[-2:])
    try:
        queue.put(measure(*arguments))
    except EngineError:
        queue.put("refused")


def _warm(side: int, engine: str) -> None:
    """Starts an engine, which is not what is measured."""
    scene = Scene(8, 8, ())
    target = "wgsl" if engine == "lavapipe" else "glsl"
    DRAW[engine](shader(scene, target, Options()), target, side)


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

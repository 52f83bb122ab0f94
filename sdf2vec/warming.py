"""`sdf2vec --warm-up`: compiles the kernels of every kind before they are needed, in a process for each core."""

from __future__ import annotations

import argparse
import os
import time
from collections.abc import Callable
from typing import Any

from . import guard
from .blend import COMPOSITING
from .deferred import deferred
from .fit.settings import MIXED
from .progress import Teller
from .running import Running
from .shapes import KINDS
from .workers import working

SIDE, SHAPES = 16, 5  # of a picture whose fit takes no time but that of compiling
PRESET = "fast"
_ramp: Callable[..., Any] = deferred("numpy", "linspace")
_fit: Callable[..., Any] = deferred("sdf2vec.api", "fit")


def command(parser: argparse.ArgumentParser, arguments: list[str]) -> int:
    """Compiles what fits of every kind need, and of all of them mixed; says what is done."""
    parser.parse_args(arguments)
    teller = Teller(Running())
    parts = [(kind, compositing) for compositing in COMPOSITING for kind in (*KINDS, MIXED)]
    with working(Running(jobs=os.cpu_count() or 1), len(parts)) as workers:
        waiting, under_way, done = parts[::-1], dict[Any, tuple[str, str]](), 0
        while waiting or under_way:
            while waiting and len(under_way) < workers.capacity:
                part = waiting.pop()
                under_way[workers.start(warm, *part)] = part
            for task, seconds in workers.ended(1.0):
                kind, compositing = under_way.pop(task)
                done += 1
                took = "killed" if seconds is None else f"{seconds:.1f} s"
                teller.say(f"{done}/{len(parts)} {kind}, {compositing}: {took}")
    return guard.OK


def warm(kind: str, compositing: str) -> float:
    """In a process of its own: a fit of a tiny picture; how many seconds it took."""
    guard.begin_worker(guard.Output.show)
    started = time.perf_counter()
    picture = _ramp(0.0, 1.0, SIDE * SIDE * 3).reshape(SIDE, SIDE, 3)
    _fit(picture, SHAPES, kind=kind, compositing=compositing, preset=PRESET)
    return time.perf_counter() - started

"""`sdf2vec --warm-up`: compiles kernels before they are needed."""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from typing import Any

from . import guard
from .deferred import deferred
from .progress import Teller
from .running import Running

_all_kernels: Callable[..., Any] = deferred("sdf2vec.all_kernels", "all_kernels")


def command(parser: argparse.ArgumentParser, arguments: list[str]) -> int:
    """Compiles what fits of every kind need, where that is not kept; says what is done."""
    parser.parse_args(arguments)
    teller = Teller(Running())
    parts = list(_all_kernels())
    for number, (name, assemblies) in enumerate(parts, 1):
        started = time.perf_counter()
        for assembly in assemblies:
            assembly.code()
        teller.say(f"{number}/{len(parts)} {name}: {time.perf_counter() - started:.1f} s")
    return guard.OK

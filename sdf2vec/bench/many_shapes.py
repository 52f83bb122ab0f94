"""What the exports of many shapes take: seconds and memory of a process that makes one. Prints a table in Markdown.

python -m sdf2vec.bench.many_shapes
"""

from __future__ import annotations

import argparse
import json
import math
import os
import random
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any, NamedTuple

from .. import api
from ..export import EXPORTERS
from ..scene import Layer, Scene, Shape

COUNTS = (256, 1024, 4096)
WIDTH, HEIGHT = 600, 400
SPREAD = 3.0  # of a triangle's corners, times 1/√n of the shortest side: n of them cover the canvas about ten times
FALLOFF = 0.02
FORMS: dict[str, tuple[str, dict[str, Any]]] = {name: (name, {}) for name in EXPORTERS} | {
    "shadertoy, packed": ("shadertoy", {"layout": "packed"}),
    "svg, portable": ("svg", {"svg_profile": "portable"}),
}
"""By what the table calls them: target and options."""


class Took(NamedTuple):
    """CPU seconds and megabytes of a process, and what it wrote, in bytes; `error`: why it wrote nothing."""

    seconds: float
    memory: float
    size: int
    error: str = ""


def scattered(count: int, seed: int = 0) -> Scene:
    """Random triangles: soft, half of them translucent, smaller the more there are, as those of a fit."""
    r = random.Random(seed)
    reach = SPREAD / math.sqrt(count)
    return Scene(WIDTH, HEIGHT, tuple(_triangle(r, reach) for _ in range(count)), (1.0, 1.0, 1.0))


def _triangle(r: random.Random, reach: float) -> Layer:
    x, y = r.uniform(-0.75, 0.75), r.uniform(-0.5, 0.5)
    corners = tuple(middle + r.uniform(-reach, reach) for _ in range(3) for middle in (x, y))
    shape = Shape("triangle", corners, (r.random(), r.random(), r.random()))
    return Layer((shape,), FALLOFF, r.choice([1.0, r.uniform(0.2, 1.0)]))


def export(form: str, count: int, output: str) -> None:
    """What is measured: one export of so many shapes, as a user makes it."""
    target, options = FORMS[form]
    Path(output).write_bytes(api.exported(scattered(count), target, **options).raw)


def took(form: str, count: int) -> Took:
    """`export` in a process of its own."""
    with tempfile.TemporaryDirectory() as folder:
        output = Path(folder, "export")
        call = [sys.executable, "-m", __spec__.name, "--one", json.dumps([form, count, str(output)])]
        process = subprocess.Popen(call, stderr=subprocess.PIPE, text=True)
        assert process.stderr is not None
        said = process.stderr.read()
        _, status, used = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        size = output.stat().st_size if output.exists() else 0
    error = said.strip().splitlines()[-1] if process.returncode else ""
    return Took(used.ru_utime + used.ru_stime, used.ru_maxrss / 1024, size, error)


def row(form: str, counts: list[int]) -> str:
    """A line of the table."""
    cells = []
    for count in counts:
        found = took(form, count)
        cells.append(
            f"{found.seconds:.1f} s, {found.memory:,.0f} MB, {found.size:,} B"
            if not found.error
            else found.error
        )
    return f"| {form} | {' | '.join(cells)} |"


def main() -> None:
    """Entry point of `python -m sdf2vec.bench.many_shapes`."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--forms", nargs="+", choices=FORMS, default=list(FORMS), metavar="FORM")
    parser.add_argument("--counts", nargs="+", type=int, default=COUNTS)
    parser.add_argument("--one", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.one:
        export(*json.loads(options.one))
        return
    print("| target |", " | ".join(f"{count:,} shapes" for count in options.counts), "|")
    print("|---|" + "---|" * len(options.counts))
    for form in options.forms:
        print(row(form, options.counts), flush=True)


if __name__ == "__main__":
    main()

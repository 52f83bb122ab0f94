"""One export of so many shapes in a process of its own, as a user makes it.

python -m sdf2vec.bench.export_worker FORM SHAPES FILE
"""

from __future__ import annotations

import math
import random
import sys
from pathlib import Path
from typing import Any

from .. import api
from ..export import EXPORTERS
from ..scene import Layer, Scene, Shape

WIDTH, HEIGHT = 600, 400
SPREAD = 3.0  # of a triangle's corners, times 1/√n of the shortest side: n of them cover the canvas about ten times
FALLOFF = 0.02
FORMS: dict[str, tuple[str, dict[str, Any]]] = {name: (name, {}) for name in EXPORTERS} | {
    "shadertoy packed": ("shadertoy", {"layout": "packed"}),
    "svg portable": ("svg", {"svg_profile": "portable"}),
}
"""By what the table calls them: target and options."""


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
    """What is measured."""
    target, options = FORMS[form]
    Path(output).write_bytes(api.exported(scattered(count), target, **options).raw)


def main() -> None:
    """Entry point."""
    form, count, output = sys.argv[1:]
    export(form, int(count), output)


if __name__ == "__main__":
    main()

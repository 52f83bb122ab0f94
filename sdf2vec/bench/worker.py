"""One fit in a process of its own, as the command line does it: a picture is read, fitted, and its SVG written.

python -m sdf2vec.bench.worker PICTURE SCENE SVG SHAPES SEED METHOD
"""

from __future__ import annotations

import sys
from typing import Any

from .. import api
from ..files import write_atomically
from ..fit.presets import PRESETS
from ..scene_file import dumps
from .methods import method_of

PACED = "paced"  # the preset of a method, for this process


def main() -> None:
    """Entry point."""
    picture, scene_path, svg_path, shapes, seed, name = sys.argv[1:]
    method = method_of(name)
    assert method.pace is not None
    PRESETS[PACED] = PRESETS[method.pace.preset].paced(method.pace.steps)
    options: dict[str, Any] = {"preset": PACED, **(method.options or {})}
    scene = api.fit(picture, int(shapes), seed=int(seed), **options)
    write_atomically(scene_path, dumps(scene).encode())
    write_atomically(svg_path, api.exported(scene, "svg", picture=picture).raw)


if __name__ == "__main__":
    main()

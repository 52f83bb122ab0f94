"""What the tests of the command line have in common: how it is called, what it says, what is there afterwards."""

import io
from typing import NamedTuple

import numpy as np
from PIL import Image

SHORT = ("--shapes", "5", "--preset", "fast")
ALL = "glsl,shadertoy,wgsl,svg,json,png"
OUTPUTS = ["glsl", "render.png", "scene.json", "shadertoy.glsl", "svg", "wgsl"]


class Outcome(NamedTuple):
    code: int
    out: bytes
    err: str


def picture(width=24, height=16, seed=0):
    rows = np.random.default_rng(seed).integers(0, 256, (4, 4, 3), dtype=np.uint8)
    return Image.fromarray(rows).resize((width, height), Image.Resampling.BILINEAR)


def names(folder):
    return sorted(str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file())


def as_png(image):
    stream = io.BytesIO()
    image.save(stream, "PNG")
    return stream.getvalue()


def assert_refused(outcome, *words):
    """Exit code 2 and exactly one line on stderr, which names all the words."""
    assert outcome.code == 2
    assert outcome.err.count("\n") == 1
    assert outcome.err.startswith("sdf2vec: ")
    for word in words:
        assert word in outcome.err
    assert outcome.out == b""

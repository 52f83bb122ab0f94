"""The same bytes from the same seed: for any number of threads, after another fit, in a fresh process."""

import os
import subprocess
import sys
from typing import Any
from unittest.mock import patch

import numpy as np
import pytest

import sdf2vec
from sdf2vec.fit.presets import PRESETS

NOISE = np.random.default_rng(0).integers(0, 256, (33, 47, 3), dtype=np.uint8)
SQUARE = np.full((24, 24, 3), 255, np.uint8)
SQUARE[5:14, 8:20] = (200, 0, 0)
PICTURES: dict[str, tuple[np.ndarray, dict[str, Any]]] = {
    "painted": (NOISE, {"shapes": 9, "kind": "circle"}),
    "drawn": (SQUARE, {"max_shapes": 1}),
}


def made(name):
    """The text of a scene fitted in a fifth of the usual steps."""
    pixels, options = PICTURES[name]
    with patch.dict(PRESETS, fast=PRESETS["fast"].paced(0.2)):
        return sdf2vec.dumps(sdf2vec.fit(pixels, seed=5, preset="fast", **options))


@pytest.mark.parametrize(("name", "several"), [("painted", "128"), ("drawn", "18")])
def test_threads_and_fits_before_change_nothing(name, several, monkeypatch):
    found = set()
    for threads in several:
        monkeypatch.setenv("SDF2VEC_THREADS", threads)
        found.add(made(name))
    assert len(found) == 1


def test_a_fresh_process_makes_the_same():
    code = f"from {__name__} import made; print(made('painted'), end='')"
    environment = {**os.environ, "SDF2VEC_THREADS": "3", "PYTHONHASHSEED": "7"}
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, env=environment
    )
    assert done.stdout == made("painted")

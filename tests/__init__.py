"""Tests; where several processes share them, each has one thread."""

import os

if "PYTEST_XDIST_WORKER" in os.environ:  # numpy and torch read it when they are loaded, after this
    for name in ("OMP_NUM_THREADS", "SDF2VEC_THREADS"):
        os.environ.setdefault(name, "1")

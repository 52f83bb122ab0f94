"""Where Triton's kernels run in tests: on a GPU, or in Triton's interpreter without one."""

import os
from importlib import import_module
from importlib.util import find_spec

import pytest
import torch

MARKS = [
    pytest.mark.filterwarnings("ignore::RuntimeWarning:triton"),  # the interpreter's 0.5 / 0, not selected
    pytest.mark.usefixtures("triton"),
]
DEVICE = "cuda" if torch.cuda.is_available() else "cpu"
if DEVICE == "cpu":  # before anything imports Triton
    os.environ.setdefault("TRITON_INTERPRET", "1")
if find_spec("triton"):
    import_module("triton")  # now: its LLVM does not load after that of a software OpenGL driver

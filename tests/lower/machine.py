"""Machine code, called as kernels call it."""

import ctypes

import numpy as np

from sdf2vec.kernel_cache import Assembly
from sdf2vec.lower.llvm import assembled, forward


def run(entry, *arguments):
    """Calls an entry with integers, and with arrays as pointers to their first number."""
    kinds = [ctypes.c_int64 if isinstance(value, int) else ctypes.c_void_p for value in arguments]
    given = [value if isinstance(value, int) else value.ctypes.data for value in arguments]
    ctypes.CFUNCTYPE(None, *kinds)(entry.address)(*given)


def outputs_of(block, rows):
    """The outputs [outputs, N] of a block without uniforms for the rows [N, inputs]."""
    given = np.ascontiguousarray(np.asarray(rows, np.float32).T)
    found = np.empty((len(block.outputs), len(rows)), np.float32)
    planes = {"given": len(block.varying), "found": len(block.outputs)}
    entry = Assembly(assembled([forward(block, planes, len(rows))]))[block.name]
    run(entry, np.empty(0, np.float32), 0, len(rows), given, found)
    return found

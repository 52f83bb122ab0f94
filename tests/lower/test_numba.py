"""Every operation in a kernel's loop, on hard inputs, against numpy."""

import numpy as np
import pytest

from sdf2vec import kernel_cache
from sdf2vec.expr import OPERATIONS, var
from sdf2vec.graph import scalarize
from sdf2vec.lower import numba as numba_lowering
from tests.operations import MEANINGS, expected

ARGUMENTS = [var(name) for name in ("x0", "x1", "x2", "x3", "x4")]


@pytest.fixture(scope="module")
def numba_operations():
    """One module with a forward block for every operation."""
    size = max(len(meaning.cases) for meaning in MEANINGS.values())
    blocks = {}
    for name, meaning in MEANINGS.items():
        inputs = tuple(ARGUMENTS[: meaning.arity])
        outputs = scalarize(meaning.build(*inputs))
        blocks[name] = numba_lowering.forward(numba_lowering.Block(f"op_{name}", outputs, inputs, ()))
    return kernel_cache.load("\n\n".join([numba_lowering.PREAMBLE, *blocks.values()])), size


@pytest.mark.parametrize("name", OPERATIONS)
def test_numba(name, numba_operations):
    module, size = numba_operations
    meaning = MEANINGS[name]
    cases = np.array(meaning.cases, dtype=np.float32)
    repeated = np.resize(cases, (size, meaning.arity))
    outputs = [
        np.empty(size, np.float32) for _ in range(meaning.build(*ARGUMENTS[: meaning.arity]).type.width)
    ]
    columns = [np.ascontiguousarray(column) for column in repeated.T]
    getattr(module, f"op_{name}")(np.empty(0, np.float32), np.uint64(0), np.uint64(size), *columns, *outputs)
    got, want = np.stack(outputs)[:, : len(cases)], expected(meaning, cases)
    size_of = np.abs(cases).max(axis=1) if name in ("add", "sub", "mix", "dot") else 1.0
    scale = np.maximum(np.abs(want), size_of**2 if name == "dot" else size_of)
    assert (np.abs(got - want) <= 2e-5 * scale).all()

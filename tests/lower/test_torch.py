"""Every operation in torch, on hard inputs, against numpy; the functions that are made."""

import numpy as np
import pytest
import torch

from sdf2vec.expr import OPERATIONS, const, select, var, vec2
from sdf2vec.lower.torch import compile_torch, source
from tests.operations import MEANINGS, expected

ARGUMENTS = [var(name) for name in ("x0", "x1", "x2", "x3", "x4")]
a, b = var("a"), var("b")


@pytest.mark.parametrize("name", OPERATIONS)
@pytest.mark.parametrize(("dtype", "tolerance"), [(torch.float64, 1e-13), (torch.float32, 2e-6)])
def test_torch(name, dtype, tolerance):
    meaning = MEANINGS[name]
    cases = np.array(meaning.cases, dtype=np.float32)
    inputs = ARGUMENTS[: meaning.arity]
    lowered = compile_torch([meaning.build(*inputs)], inputs)
    got = np.stack([part.numpy() for part in lowered(*(torch.tensor(c, dtype=dtype) for c in cases.T))])
    want = expected(meaning, cases)
    size = np.abs(cases).max(axis=1) if name in ("add", "sub", "mix", "dot") else 1.0
    scale = size**2 if name == "dot" else size
    assert (np.abs(got - want) <= tolerance * np.maximum(np.abs(want), scale)).all()


def test_torch_source_is_one_assignment_per_node():
    assert source([(a + b) * (a + b)], [a, b]) == (
        "def lowered(a, b):\n    t1 = a + b\n    t2 = t1 * t1; del t1\n    return (t2,)\n"
    )


def test_torch_constants_take_the_inputs_dtype():
    lowered = compile_torch([const(0.1), select(a < 0.0, 0.1, 0.7)], [a])
    for dtype in (torch.float32, torch.float64):
        values = lowered(torch.tensor([-1.0, 1.0], dtype=dtype))
        assert all(value.dtype == dtype for value in values)
        assert values[1].tolist() == torch.tensor([0.1, 0.7], dtype=dtype).tolist()


def test_an_unknown_variable_is_an_error():
    with pytest.raises(KeyError):
        compile_torch([vec2(a, b)], [a])

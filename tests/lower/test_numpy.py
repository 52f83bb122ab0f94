"""Every operation in numpy, on hard inputs, against what it means; the functions that are made."""

import numpy as np
import pytest

from sdf2vec.expr import OPERATIONS, const, select, var, vec2
from sdf2vec.lower.numpy import compile_numpy
from tests.operations import MEANINGS, expected

ARGUMENTS = [var(name) for name in ("x0", "x1", "x2", "x3", "x4")]
a, b = var("a"), var("b")


@pytest.mark.parametrize("name", OPERATIONS)
def test_numpy(name):
    meaning = MEANINGS[name]
    cases = np.array(meaning.cases, dtype=np.float32)
    inputs = ARGUMENTS[: meaning.arity]
    got = np.stack(compile_numpy([meaning.build(*inputs)], inputs)(*cases.T))
    want = expected(meaning, cases)
    size = np.abs(cases).max(axis=1) if name in ("add", "sub", "mix", "dot") else 1.0
    scale = size**2 if name == "dot" else size
    assert got.dtype == np.float64
    assert (np.abs(got - want) <= 1e-13 * np.maximum(np.abs(want), scale)).all()


def test_arrays_and_numbers_are_broadcast():
    lowered = compile_numpy([vec2(a + b, a * 2.0), const(0.5)], [a, b])
    both, doubled, half = lowered(np.arange(3.0), np.ones((2, 1)))
    assert both.tolist() == [[1.0, 2.0, 3.0]] * 2
    assert doubled.tolist() == [0.0, 2.0, 4.0]
    assert half == 0.5


def test_a_branch_that_is_not_taken_may_divide_by_nothing(recwarn):
    (found,) = compile_numpy([select(a < 0.5, 0.0, b / a)], [a, b])(np.array([0.0, 2.0]), 1.0)
    assert found.tolist() == [0.0, 0.5]
    assert not recwarn.list


def test_an_unknown_variable_is_an_error():
    with pytest.raises(KeyError):
        compile_numpy([vec2(a, b)], [a])

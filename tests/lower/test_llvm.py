"""Every operation in a compiled loop, on hard inputs, against numpy; loops that begin and end anywhere."""

from typing import Any

import numpy as np
import pytest

from sdf2vec.expr import OPERATIONS, cos, exp, log, sigmoid, sin, var
from sdf2vec.graph import scalarize
from sdf2vec.kernel_cache import Assembly
from sdf2vec.lower.block import Block
from sdf2vec.lower.llvm import assembled, backward, scalar
from tests.lower.machine import outputs_of, run
from tests.operations import MEANINGS, expected

ARGUMENTS = [var(name) for name in ("x0", "x1", "x2", "x3", "x4")]
X, SCALE = ARGUMENTS[0], var("scale")


@pytest.mark.parametrize("name", OPERATIONS)
def test_operation(name):
    meaning = MEANINGS[name]
    cases = np.array(meaning.cases, dtype=np.float32)
    inputs = tuple(ARGUMENTS[: meaning.arity])
    block = Block("operation", scalarize(meaning.build(*inputs)), inputs, ())
    got, want = outputs_of(block, cases), expected(meaning, cases)
    size_of = np.abs(cases).max(axis=1) if name in ("add", "sub", "mix", "dot") else 1.0
    scale = np.maximum(np.abs(want), size_of**2 if name == "dot" else size_of)
    assert (np.abs(got - want) <= 2e-5 * scale).all()


# name: what it is, where, and how near: relative above 1 (everywhere, for the exponential)
FUNCTIONS: dict[str, tuple[Any, Any, Any, float]] = {
    "exp": (exp, np.exp, np.linspace(-80, 80, 4001), 2e-6),
    "log": (log, np.log, np.geomspace(1e-30, 1e30, 4001), 2e-7),
    "sin": (sin, np.sin, np.linspace(-20, 20, 4001), 1e-6),
    "cos": (cos, np.cos, np.linspace(-20, 20, 4001), 2e-6),
    "sigmoid": (sigmoid, lambda x: 1 / (1 + np.exp(-x)), np.linspace(-20, 20, 4001), 2e-7),
}


def computed(function, values):
    return outputs_of(Block("each", (function(X),), (X,), ()), [[value] for value in values])[0]


@pytest.mark.parametrize("name", FUNCTIONS)
def test_functions_are_near(name):
    function, exact, values, tolerance = FUNCTIONS[name]
    wanted = exact(values.astype(np.float32).astype(np.float64))
    size = np.maximum(np.abs(wanted), 0.0 if name == "exp" else 1.0)
    assert (np.abs(computed(function, values) - wanted) <= tolerance * size).all()


def test_logarithms_of_powers_of_two_are_exact():
    powers = 2.0 ** np.arange(-40, 40)
    assert computed(log, powers) == pytest.approx(np.log(powers), rel=2e-7)


def test_the_exponential_stays_finite():
    values = computed(exp, [-1e30, -200.0, 200.0, 1e30])
    assert np.isfinite(values).all()
    assert (values > 0).all()


def test_what_is_not_positive_has_the_logarithm_of_the_least():
    assert computed(log, [0.0, -1.0, 1e-38]) == pytest.approx([np.log(1e-30)] * 3, rel=1e-6)


@pytest.mark.parametrize(("first", "last"), [(0, 40), (3, 29), (7, 8), (5, 5)])
def test_derivatives_of_some_pixels(first, last):
    """Those by what lies below replace its cotangent, those by uniforms are added up: nothing beyond the range."""
    below = ARGUMENTS[1]
    block = Block("layer", (X * SCALE * SCALE + below * 0.5,), (X, below), (SCALE,))
    text = backward(block, {"x": 1, "below": 1, "cotangent": 1}, 40, (below,))
    r = np.random.default_rng(0)
    x, under, cotangent = (r.random(40, dtype=np.float32) for _ in range(3))
    grad, given = np.array([100.0], np.float32), cotangent.copy()
    entry = Assembly(assembled([text]))["layer_backward"]
    run(entry, np.array([3.0], np.float32), first, last, x, under, given, grad)
    some = slice(first, last)
    assert grad[0] == pytest.approx(100 + (cotangent[some] * x[some]).sum() * 6, rel=1e-5)
    wanted = cotangent.copy()
    wanted[some] *= 0.5
    assert given == pytest.approx(wanted)


def test_outputs_at_one_point():
    entry = Assembly(assembled([scalar("at", (X - SCALE, SCALE), (X,), (SCALE,))]))["at"]
    found = np.empty(2, np.float32)
    run(entry, np.array([3.0], np.float32), np.array([10.0], np.float32), found)
    assert found.tolist() == [7.0, 3.0]

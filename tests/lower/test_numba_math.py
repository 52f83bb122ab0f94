"""The functions that generated kernels call, against numpy in float64."""

from typing import Any

import numpy as np
import pytest

from sdf2vec import kernel_cache
from sdf2vec.lower.numba_math import fast_exp, fast_log, fast_sigmoid, fast_sin

ONE_BY_ONE = """
from sdf2vec.kernel_cache import kernel
from sdf2vec.lower.numba_math import {name}
@kernel
def each(values, results):
    for i in range(values.size):
        results[i] = {name}(values[i])
"""

# name: what it computes, where, and how near: relative above 1 (everywhere, for the exponential)
FUNCTIONS: dict[str, tuple[Any, Any, float]] = {
    "fast_exp": (np.exp, np.linspace(-80, 80, 4001), 2e-6),
    "fast_log": (np.log, np.geomspace(1e-30, 1e30, 4001), 2e-7),
    "fast_sin": (np.sin, np.linspace(-20, 20, 4001), 1e-6),
    "fast_sigmoid": (lambda x: 1 / (1 + np.exp(-x)), np.linspace(-20, 20, 4001), 2e-7),
}


def computed(name, values):
    each = kernel_cache.load(ONE_BY_ONE.format(name=name)).each
    results = np.empty_like(values)
    each(values, results)
    return results


@pytest.mark.parametrize("name", FUNCTIONS)
def test_functions_are_near(name):
    exact, values, tolerance = FUNCTIONS[name]
    values = values.astype(np.float32)
    wanted = exact(values.astype(np.float64))
    size = np.maximum(np.abs(wanted), 0.0 if name == "fast_exp" else 1.0)
    assert (np.abs(computed(name, values) - wanted) <= tolerance * size).all()


def test_powers_of_two_are_exact():
    powers = 2.0 ** np.arange(-40, 40)
    assert computed("fast_log", powers.astype(np.float32)) == pytest.approx(np.log(powers), rel=2e-7)


@pytest.mark.parametrize("x", [-1e30, -200.0, 200.0, 1e30])
def test_the_exponential_stays_finite(x):
    (value,) = computed("fast_exp", np.array([x], np.float32))
    assert np.isfinite(value)
    assert value > 0


def test_what_is_not_positive_has_the_logarithm_of_the_least():
    values = computed("fast_log", np.array([0.0, -1.0, 1e-38], np.float32))
    assert values == pytest.approx([np.log(1e-30)] * 3, rel=1e-6)


def test_the_functions_are_inlined():
    assert all(f.targetoptions["forceinline"] for f in (fast_exp, fast_log, fast_sigmoid, fast_sin))

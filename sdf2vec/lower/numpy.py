"""Lowering to numpy: expressions become a Python function of float64 arrays, for what needs neither speed nor torch."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Float64Array
from ..expr import OPERATIONS, Expr
from ..graph import scalarize
from .eager import compiled, function_text

Arrays = tuple[Float64Array, ...]


def compile_numpy(outputs: Sequence[Expr], inputs: Sequence[Expr]) -> Callable[..., Arrays]:
    """A function from arrays or numbers (one per float variable in `inputs`, broadcastable) to a tuple of arrays.

    Vector outputs give one array per component; what depends on no array is a number.
    Raises KeyError when an output uses a variable that is not among the inputs.
    """
    scalars = [scalar for output in outputs for scalar in scalarize(output)]
    lowered: Callable[..., Any] = compiled(function_text(scalars, inputs, _spell, str), {**FUNCTIONS})

    def call(*given: ArrayLike) -> Arrays:
        with np.errstate(all="ignore"):  # a branch that is not taken may divide by 0
            found: Arrays = lowered(*(np.asarray(value, np.float64) for value in given))
        return found

    return call


def _spell(node: Expr, args: list[str]) -> str:
    text = OPERATIONS[node.op].python
    assert text is not None, f"{node.op} must be scalarized first"
    return text.format(*args)


def _sqrt(x: Float64Array) -> Float64Array:
    return np.asarray(np.sqrt(np.maximum(x, 0.0)))


def _log(x: Float64Array) -> Float64Array:
    return np.asarray(np.log(np.maximum(x, 1e-30)))


def _sigmoid(x: Float64Array) -> Float64Array:
    return np.asarray(1.0 / (1.0 + np.exp(np.minimum(-x, 80.0))))


FUNCTIONS: dict[str, object] = {
    "absolute": np.absolute,
    "minimum": np.minimum,
    "maximum": np.maximum,
    "sqrt": _sqrt,
    "exp": np.exp,
    "log": _log,
    "sin": np.sin,
    "cos": np.cos,
    "sigmoid": _sigmoid,
    "select": np.where,
}

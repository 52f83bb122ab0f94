"""Lowering to torch: expressions become a Python function of tensors, differentiable by autograd."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import torch

from ..expr import OPERATIONS, Expr
from ..graph import scalarize
from .eager import compiled, function_text

Tensors = tuple[torch.Tensor, ...]


def compile_torch(outputs: Sequence[Expr], inputs: Sequence[Expr]) -> Callable[..., Tensors]:
    """A function from tensors (one per float variable in `inputs`, broadcastable) to a tuple of tensors.

    Vector outputs give one tensor per component. Constants take the dtype and device of the first input.
    Raises KeyError when an output uses a variable that is not among the inputs.
    """
    scalars = [scalar for output in outputs for scalar in scalarize(output)]
    lowered: Callable[..., Any] = compiled(source(scalars, inputs), {"torch": torch})
    return lowered


def source(scalars: Sequence[Expr], inputs: Sequence[Expr]) -> str:
    """The text of the Python function."""
    like = str(inputs[0].payload)
    return function_text(scalars, inputs, partial(_spell, like), f"{like}.new_full((), {{}})".format)


def _spell(like: str, node: Expr, args: list[str]) -> str:
    text = OPERATIONS[node.op].torch
    assert text is not None, f"{node.op} must be scalarized first"
    if node.op == "select" and node.args[1].op == node.args[2].op == "const":
        # two bare numbers would come out in torch's default dtype
        args[1] = f"{like}.new_full((), {args[1]})"
    return text.format(*args)

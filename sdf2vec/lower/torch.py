"""Lowering to torch: expressions become a Python function of tensors, differentiable by autograd."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import torch

from ..expr import OPERATIONS, Expr, constant
from ..graph import scalarize, walk

Tensors = tuple[torch.Tensor, ...]


def compile_torch(outputs: Sequence[Expr], inputs: Sequence[Expr]) -> Callable[..., Tensors]:
    """A function from tensors (one per float variable in `inputs`, broadcastable) to a tuple of tensors.

    Vector outputs give one tensor per component. Constants take the dtype and device of the first input.
    Raises KeyError when an output uses a variable that is not among the inputs.
    """
    scalars = [scalar for output in outputs for scalar in scalarize(output)]
    namespace: dict[str, object] = {"torch": torch}
    exec(compile(source(scalars, inputs), "<lowered to torch>", "exec"), namespace)
    lowered = namespace["lowered"]
    assert callable(lowered)
    return lowered


def source(scalars: Sequence[Expr], inputs: Sequence[Expr]) -> str:
    """The text of the Python function: one assignment per node, in order."""
    names = {variable: str(variable.payload) for variable in inputs}
    like = names[inputs[0]]
    lines = [f"def lowered({', '.join(names.values())}):"]
    for node in walk(scalars):
        if node.op == "const":
            names[node] = repr(constant(node))
        elif node.op != "var":
            name = f"t{len(lines)}"
            lines.append(f"    {name} = {_spell(node, names, like)}")
            names[node] = name
    results = (f"{like}.new_tensor({names[s]})" if s.op == "const" else names[s] for s in scalars)
    return "\n".join([*lines, f"    return ({', '.join(results)},)"]) + "\n"


def _spell(node: Expr, names: dict[Expr, str], like: str) -> str:
    text = OPERATIONS[node.op].torch
    assert text is not None, f"{node.op} must be scalarized first"
    args = [names[arg] for arg in node.args]
    if node.op == "select" and node.args[1].op == node.args[2].op == "const":
        args[1] = f"{like}.new_tensor({args[1]})"  # two bare numbers would come out in torch's default dtype
    return text.format(*args)

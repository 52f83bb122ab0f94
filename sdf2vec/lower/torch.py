"""Lowering to torch: expressions become a Python function of tensors, differentiable by autograd."""

from __future__ import annotations

from collections.abc import Callable, Container, Sequence

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
    """The text of the Python function: one assignment per node, in order; each value goes when it is no longer used."""
    names = {variable: str(variable.payload) for variable in inputs}
    like, nodes = names[inputs[0]], list(walk(scalars))
    last = {arg: node for node in nodes for arg in node.args}
    kept = set(scalars)
    lines = [f"def lowered({', '.join(names.values())}):"]
    for node in nodes:
        if node.op == "const":
            names[node] = repr(constant(node))
        elif node.op != "var":
            names[node] = f"t{len(lines)}"
            lines.append(f"    {names[node]} = {_spell(node, names, like)}{_freed(node, last, names, kept)}")
    results = (f"{like}.new_tensor({names[s]})" if s.op == "const" else names[s] for s in scalars)
    return "\n".join([*lines, f"    return ({', '.join(results)},)"]) + "\n"


def _freed(node: Expr, last: dict[Expr, Expr], names: dict[Expr, str], kept: Container[Expr]) -> str:
    """Forgets what was used for the last time: a union of many shapes would hold thousands of arrays."""
    spent = [
        a
        for a in dict.fromkeys(node.args)
        if last[a] is node and a.op not in ("const", "var") and a not in kept
    ]
    return f"; del {', '.join(names[a] for a in spent)}" if spent else ""


def _spell(node: Expr, names: dict[Expr, str], like: str) -> str:
    text = OPERATIONS[node.op].torch
    assert text is not None, f"{node.op} must be scalarized first"
    args = [names[arg] for arg in node.args]
    if node.op == "select" and node.args[1].op == node.args[2].op == "const":
        args[1] = f"{like}.new_tensor({args[1]})"  # two bare numbers would come out in torch's default dtype
    return text.format(*args)

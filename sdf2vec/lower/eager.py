"""Expressions as the text of a Python function that computes whole arrays, one operation after the other."""

from __future__ import annotations

from collections.abc import Callable, Container, Sequence

from ..expr import Expr, constant
from ..graph import walk

Spell = Callable[[Expr, list[str]], str]  # a node, from the names of its arguments
Full = Callable[[str], str]  # a number as an array


def function_text(outputs: Sequence[Expr], inputs: Sequence[Expr], spell: Spell, full: Full) -> str:
    """`def lowered(…)`: one assignment per node, in order; each value goes when it is no longer used.

    `outputs` are scalarized. Raises KeyError when one uses a variable that is not among the inputs.
    """
    names = {variable: str(variable.payload) for variable in inputs}
    nodes, kept = list(walk(outputs)), set(outputs)
    last = {arg: node for node in nodes for arg in node.args}
    lines = [f"def lowered({', '.join(names.values())}):"]
    for node in nodes:
        if node.op == "const":
            names[node] = repr(constant(node))
        elif node.op != "var":
            names[node] = f"t{len(lines)}"
            spelled = spell(node, [names[arg] for arg in node.args])
            lines.append(f"    {names[node]} = {spelled}{_freed(node, last, names, kept)}")
    results = (full(names[s]) if s.op == "const" else names[s] for s in outputs)
    return "\n".join([*lines, f"    return ({', '.join(results)},)"]) + "\n"


def _freed(node: Expr, last: dict[Expr, Expr], names: dict[Expr, str], kept: Container[Expr]) -> str:
    """Forgets what was used for the last time: a union of many shapes would hold thousands of arrays."""
    spent = [
        a
        for a in dict.fromkeys(node.args)
        if last[a] is node and a.op not in ("const", "var") and a not in kept
    ]
    return f"; del {', '.join(names[a] for a in spent)}" if spent else ""


def compiled(text: str, names: dict[str, object]) -> Callable[..., tuple[object, ...]]:
    """The function of a text that uses these names."""
    exec(compile(text, "<lowered>", "exec"), names)
    lowered = names["lowered"]
    assert callable(lowered)
    return lowered

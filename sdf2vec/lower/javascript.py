"""Lowering to JavaScript: expressions become arrow functions of numbers."""

from __future__ import annotations

from collections.abc import Sequence

from ..expr import OPERATIONS, Expr, constant
from ..graph import walk


def function_text(name: str, scalars: Sequence[Expr], inputs: Sequence[Expr]) -> str:
    """`const name = (…) => {…}`, which returns an array; `scalars` are scalarized, `inputs` float variables.

    Raises KeyError when an expression uses a variable that is not among the inputs.
    """
    names = {variable: str(variable.payload) for variable in inputs}
    lines = [f"const {name} = ({', '.join(names.values())}) => {{"]
    for node in walk(scalars):
        if node.op == "const":
            names[node] = f"({constant(node)!r})"
        elif node.op != "var":
            names[node], text = f"t{len(lines)}", _spell(node, names)
            lines.append(f"  const {names[node]} = {text};")
    return "\n".join([*lines, f"  return [{', '.join(names[s] for s in scalars)}];", "};"])


def _spell(node: Expr, names: dict[Expr, str]) -> str:
    text = OPERATIONS[node.op].javascript
    assert text is not None, f"{node.op} must be scalarized first"
    return text.format(*(names[arg] for arg in node.args))

"""Lowering to shader languages: text as a shader artist would write it.

Nodes used once are written where they are used; shared ones and those named by `let` become local variables.
A dialect is one table (`Dialect`) and one template in `templates/`.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from ..expr import OPERATIONS, Expr, constant
from ..function import Function
from ..graph import walk
from ..operation import CALL, COMPONENTS, PRECEDENCE, Cell, Operation, Type


@dataclass(frozen=True)
class Dialect:
    """A shader language: which column of the table it reads, and the few words that differ."""

    name: str
    cell: Callable[[Operation], Cell]
    types: dict[Type, str]
    signature: str  # of a function: {name}, {parameters}, {type}
    parameter: str  # {name}, {type}
    local: str  # a local variable: {name}, {type}, {value}


GLSL = Dialect(
    "glsl",
    cell=lambda row: row.glsl,
    types={type: type.value for type in Type},
    signature="{type} {name}({parameters})",
    parameter="{type} {name}",
    local="{type} {name} = {value};",
)

WGSL = Dialect(
    "wgsl",
    cell=lambda row: row.wgsl,
    types=dict(zip(Type, ("bool", "f32", "vec2f", "vec3f", "vec4f"), strict=True)),
    signature="fn {name}({parameters}) -> {type}",
    parameter="{name}: {type}",
    local="let {name} = {value};",
)


def literal(value: float) -> str:
    """The shortest text that reads back as the same float32."""
    single = np.float32(value)
    if 1e-6 <= abs(single) < 1e9 or single == 0:
        return np.format_float_positional(single, unique=True, trim="0")
    return np.format_float_scientific(single, unique=True, trim="-", exp_digits=1)


def expression(expr: Expr, dialect: Dialect) -> str:
    """The expression on one line; `let` names are dropped."""
    return _print(expr, dialect, {})[0]


def statements(result: str, expr: Expr, dialect: Dialect) -> list[str]:
    """Lines that compute the local variables of `expr`, then `result`, in which `{}` stands for its text."""
    names, lines = _locals(expr, dialect)
    return [*lines, result.format(_print(expr, dialect, names)[0])]


def definition(function: Function, dialect: Dialect, documented: bool = True) -> str:
    """The function's text, its documentation above it unless `documented` says otherwise."""
    parameters = ", ".join(
        dialect.parameter.format(name=p.payload, type=dialect.types[p.type]) for p in function.parameters
    )
    head = dialect.signature.format(
        name=function.name, parameters=parameters, type=dialect.types[function.body.type]
    )
    body = statements("return {};", function.body, dialect)
    doc = [f"// {function.doc}"] if documented else []
    return "\n".join([*doc, f"{head} {{", *(f"  {line}" for line in body), "}"])


def used_functions(roots: Iterable[Expr]) -> list[Function]:
    """All functions that the expressions call, directly or not, each after those it calls itself."""
    found: dict[Function, None] = {}
    for node in walk(roots):
        if isinstance(node.payload, Function) and node.payload not in found:
            found |= dict.fromkeys(used_functions([node.payload.body]))
            found[node.payload] = None
    return list(found)


def _locals(root: Expr, dialect: Dialect) -> tuple[dict[Expr, str], list[str]]:
    """Names of the nodes that become local variables, and the lines that declare them."""
    nodes = list(walk([root]))
    uses = Counter(arg for node in nodes for arg in node.args)
    names: dict[Expr, str] = {}
    lines: list[str] = []
    automatic = (f"t{i}" for i in range(1, len(nodes) + 1))
    for node in nodes:
        if node.op == "let" or (uses[node] > 1 and not _trivial(node)):
            name = _name(node, automatic)
            assert name not in names.values(), f"two local variables are called {name}"
            value = _print(node.args[0] if node.op == "let" else node, dialect, names)[0]
            lines.append(dialect.local.format(name=name, type=dialect.types[node.type], value=value))
            names[node] = name
    return names, lines


def _name(node: Expr, automatic: Iterator[str]) -> str:
    return str(node.payload) if node.op == "let" else next(automatic)


def _trivial(node: Expr) -> bool:
    """Too short for a name of its own."""
    if node.op in ("component", "neg"):
        return node.args[0].op in ("var", "let", "const")
    if node.op == "var":
        return "(" not in str(node.payload)  # some stand for what is called
    return node.op == "const" or all(arg.op == "const" for arg in node.args)


def _print(expr: Expr, dialect: Dialect, names: dict[Expr, str]) -> tuple[str, int]:
    """Text and how tightly it binds."""
    if expr in names:
        return names[expr], CALL
    return _PRINT.get(expr.op, _print_operation)(expr, dialect, names)


def _arguments(expr: Expr, dialect: Dialect, names: dict[Expr, str]) -> str:
    return ", ".join(_print(arg, dialect, names)[0] for arg in expr.args)


def _print_const(expr: Expr, dialect: Dialect, names: dict[Expr, str]) -> tuple[str, int]:
    return literal(constant(expr)), CALL if constant(expr) >= 0 else PRECEDENCE["unary"]


def _print_var(expr: Expr, dialect: Dialect, names: dict[Expr, str]) -> tuple[str, int]:
    return str(expr.payload), CALL


def _print_let(expr: Expr, dialect: Dialect, names: dict[Expr, str]) -> tuple[str, int]:
    return _print(expr.args[0], dialect, names)


def _print_call(expr: Expr, dialect: Dialect, names: dict[Expr, str]) -> tuple[str, int]:
    assert isinstance(expr.payload, Function)
    return f"{expr.payload.name}({_arguments(expr, dialect, names)})", CALL


def _print_component(expr: Expr, dialect: Dialect, names: dict[Expr, str]) -> tuple[str, int]:
    assert isinstance(expr.payload, int)
    return f"{_bound(expr.args[0], CALL, dialect, names)}.{COMPONENTS[expr.payload]}", CALL


def _print_operation(expr: Expr, dialect: Dialect, names: dict[Expr, str]) -> tuple[str, int]:
    cell = dialect.cell(OPERATIONS[expr.op])
    if (swizzle := _swizzled(expr)) is not None:
        return f"{_bound(swizzle, CALL, dialect, names)}.{COMPONENTS[: len(expr.args)]}", CALL
    if "{*}" in cell.text:
        return cell.text.replace("{*}", _arguments(expr, dialect, names)), CALL
    if cell.precedence == CALL:
        return cell.text.format(*(_print(arg, dialect, names)[0] for arg in expr.args)), CALL
    # an operand on the right of an operator binds tighter, so that the order of evaluation stays the graph's
    needed = max(cell.precedence, cell.operands)
    parts = [_bound(arg, needed + (i > 0), dialect, names) for i, arg in enumerate(expr.args)]
    return cell.text.format(*parts), cell.precedence


def _swizzled(expr: Expr) -> Expr | None:
    """The vector of which a joined one takes the first components."""
    parts = [arg.payload if arg.op == "component" else None for arg in expr.args]
    if not expr.op.startswith("vec") or parts != list(range(expr.type.width)):
        return None
    bases = {arg.args[0] for arg in expr.args}
    return bases.pop() if len(bases) == 1 else None


def _bound(expr: Expr, precedence: int, dialect: Dialect, names: dict[Expr, str]) -> str:
    text, binds = _print(expr, dialect, names)
    return text if binds >= precedence else f"({text})"


_PRINT: dict[str, Callable[[Expr, Dialect, dict[Expr, str]], tuple[str, int]]] = {
    "const": _print_const,
    "var": _print_var,
    "let": _print_let,
    "call": _print_call,
    "component": _print_component,
}

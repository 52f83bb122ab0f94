"""Walks over expressions: substitution, splitting into scalars, derivatives."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Container, Iterable, Iterator, Mapping, Sequence

from .expr import OPERATIONS, Expr, component, const, operation, var
from .expr import node as made
from .function import Function
from .operation import COMPONENTS

# --- walking ------------------------------------------------------------------------------------------------


def walk(roots: Iterable[Expr]) -> Iterator[Expr]:
    """Every node once, arguments before what uses them."""
    seen: set[Expr] = set()
    stack = list(roots)[::-1]
    while stack:
        node = stack[-1]
        before = [] if node in seen else [arg for arg in node.args[::-1] if arg not in seen]
        if before:
            stack += before
            continue
        stack.pop()
        if node not in seen:
            seen.add(node)
            yield node


def substitute(expr: Expr, values: Mapping[Expr, Expr]) -> Expr:
    """The expression with the nodes that are keys of `values` replaced; it folds anew."""
    done: dict[Expr, Expr] = {}
    for node in walk([expr]):
        done[node] = values.get(node) or _rebuild(node, tuple(done[arg] for arg in node.args))
    return done[expr]


def opened(expr: Expr, others: Container[Function] = ()) -> Expr:
    """Sees through the calls of functions that have no local variables and use each argument once at most, and
    through those of `others`; names of local variables are dropped.
    """
    done: dict[Expr, Expr] = {}
    for node in walk([expr]):
        args = tuple(done[arg] for arg in node.args)
        function = node.payload
        if isinstance(function, Function) and (function in others or _is_brief(function)):
            body = opened(function.body, others)
            done[node] = substitute(body, dict(zip(function.parameters, args, strict=True)))
        else:
            done[node] = args[0] if node.op == "let" else _rebuild(node, args)
    return done[expr]


def called_once(roots: Iterable[Expr]) -> set[Function]:
    """The functions that are called at one place only, of all that the expressions call, directly or not."""
    calls: Counter[Function] = Counter()
    rest = list(roots)
    while rest:
        for node in walk([rest.pop()]):
            if isinstance(node.payload, Function):
                rest += [] if node.payload in calls else [node.payload.body]
                calls[node.payload] += 1
    return {called for called, times in calls.items() if times == 1}


def _is_brief(function: Function) -> bool:
    nodes = list(walk([function.body]))
    uses = Counter(arg for node in nodes for arg in node.args if arg.op != "const")
    return max(uses.values(), default=0) <= 1 and all(node.op != "let" for node in nodes)


def _rebuild(node: Expr, args: tuple[Expr, ...]) -> Expr:
    if args == node.args:
        return node
    if node.op in OPERATIONS:
        return operation(node.op, *args)
    if node.op == "component":
        assert isinstance(node.payload, int)
        return component(args[0], node.payload)
    return made(node.op, args, node.type, node.payload)


def hoist(expr: Expr, varying: Container[Expr]) -> list[Expr]:
    """The largest parts of `expr`, constants aside, that do not depend on what is `varying`, in a fixed order.

    They can be computed once and replaced by table entries. Calls are looked at from outside only.
    """
    depends: set[Expr] = set()
    candidates: list[Expr] = []
    for node in walk([expr]):
        if node in varying or any(arg in depends for arg in node.args):
            depends.add(node)
            candidates += [arg for arg in node.args if arg not in depends and arg.op != "const"]
    return list(dict.fromkeys(candidates))


def scalarize(expr: Expr) -> tuple[Expr, ...]:
    """The same value as one float (or bool) expression per component: no vectors, calls or lets remain.

    A vector variable `p` becomes the floats `p_x`, `p_y`, …
    """
    return _scalarize(expr, {})


def components_of(variable: Expr) -> tuple[Expr, ...]:
    """The float variables that stand for a variable's components after `scalarize`."""
    if variable.type.width == 1:
        return (variable,)
    return tuple(var(f"{variable.payload}_{c}") for c in COMPONENTS[: variable.type.width])


Split = tuple[Expr, ...]


def _scalarize(root: Expr, bindings: Mapping[Expr, Split]) -> Split:
    done: dict[Expr, Split] = {}
    for node in walk([root]):
        parts = [done[arg] for arg in node.args]
        done[node] = _SPLIT.get(node.op, _split_operation)(node, parts, bindings)
    return done[root]


def _split_leaf(node: Expr, parts: list[Split], bindings: Mapping[Expr, Split]) -> Split:
    return bindings[node] if node in bindings else components_of(node)


def _split_const(node: Expr, parts: list[Split], bindings: Mapping[Expr, Split]) -> Split:
    return (node,)


def _split_let(node: Expr, parts: list[Split], bindings: Mapping[Expr, Split]) -> Split:
    return parts[0]


def _split_component(node: Expr, parts: list[Split], bindings: Mapping[Expr, Split]) -> Split:
    assert isinstance(node.payload, int)
    return (parts[0][node.payload],)


def _split_call(node: Expr, parts: list[Split], bindings: Mapping[Expr, Split]) -> Split:
    assert isinstance(node.payload, Function)
    return _scalarize(node.payload.body, dict(zip(node.payload.parameters, parts, strict=True)))


def _split_operation(node: Expr, parts: list[Split], bindings: Mapping[Expr, Split]) -> Split:
    row = OPERATIONS[node.op]
    if row.expand:
        return row.expand(*parts)
    width = node.type.width
    aligned = [part * width if len(part) == 1 else part for part in parts]
    return tuple(operation(node.op, *column) for column in zip(*aligned, strict=True))


_SPLIT: dict[str, Callable[[Expr, list[Split], Mapping[Expr, Split]], Split]] = {
    "var": _split_leaf,
    "const": _split_const,
    "let": _split_let,
    "component": _split_component,
    "call": _split_call,
}


# --- derivatives --------------------------------------------------------------------------------------------


def gradient(output: Expr, variables: Sequence[Expr]) -> tuple[Expr, ...]:
    """Derivatives of a scalarized float expression by float variables, in one backward pass."""
    found = adjoints({output: const(1.0)})
    return tuple(found.get(variable, const(0.0)) for variable in variables)


def adjoints(seeds: Mapping[Expr, Expr], leaves: Container[Expr] = ()) -> dict[Expr, Expr]:
    """Derivatives of Σ seed·node by every float node below, of scalarized nodes; `leaves` are not entered."""
    found: dict[Expr, Expr] = dict(seeds)
    for node in reversed(list(walk(seeds))):
        if node not in found or not node.args or node in leaves:
            continue
        partials = OPERATIONS[node.op].partials
        assert partials is not None, f"{node.op} must be scalarized first"
        for arg, slope in zip(node.args, partials(*node.args, node), strict=True):
            if slope is not None:
                found[arg] = found.get(arg, const(0.0)) + found[node] * slope
    return found

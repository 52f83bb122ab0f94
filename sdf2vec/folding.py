"""What trivial operations fold to: 0·x, 1·x, x + 0, −(−x), a choice that is none."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .expr import Expr


def _is(expr: Expr, value: float) -> bool:
    return expr.op == "const" and expr.payload == value


def _simple_add(a: Expr, b: Expr) -> Expr | None:
    return b if _is(a, 0.0) else a if _is(b, 0.0) else None


def _simple_sub(a: Expr, b: Expr) -> Expr | None:
    return a if _is(b, 0.0) else -b if _is(a, 0.0) else None


def _simple_mul(a: Expr, b: Expr) -> Expr | None:
    for one, other in ((a, b), (b, a)):
        if _is(one, 0.0):
            return one
        if _is(one, 1.0):
            return other
        if _is(one, -1.0):
            return -other
    return None


def _simple_div(a: Expr, b: Expr) -> Expr | None:
    return a if _is(b, 1.0) or _is(a, 0.0) else None


def _simple_neg(a: Expr) -> Expr | None:
    return a.args[0] if a.op == "neg" else None


def _simple_select(condition: Expr, a: Expr, b: Expr) -> Expr | None:
    if condition.op == "less":
        left, right = (arg.payload for arg in condition.args)
        if isinstance(left, float) and isinstance(right, float):
            return a if left < right else b
    return a if a is b else None


def scalars_of(args: tuple[Expr, ...]) -> tuple[Expr, ...]:
    """What joins to the same vector: scalars that are joined twice, joined once."""
    return tuple(part for arg in args for part in (arg.args if _is_joined(arg) else (arg,)))


def _is_joined(expr: Expr) -> bool:
    return expr.op.startswith("vec") and len(expr.args) == expr.type.width


# By operation: what it is where its arguments are trivial, None where they are not.
SIMPLER: dict[str, Callable[..., Expr | None]] = {
    "add": _simple_add,
    "sub": _simple_sub,
    "mul": _simple_mul,
    "div": _simple_div,
    "neg": _simple_neg,
    "select": _simple_select,
}

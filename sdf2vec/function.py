"""Names that shader text keeps: functions, and local variables."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from .expr import Expr, Operand, expression_of, node, var
from .operation import Type


@dataclass(frozen=True, eq=False)
class Function:
    """A formula with a name: shader text defines and calls it, other targets see through the call."""

    name: str
    parameters: tuple[Expr, ...]
    body: Expr
    doc: str

    def __call__(self, *args: Operand) -> Expr:
        given = tuple(expression_of(arg) for arg in args)
        expected = [parameter.type for parameter in self.parameters]
        if [arg.type for arg in given] != expected:
            raise TypeError(f"{self.name} takes {expected}, got {[arg.type for arg in given]}")
        return node("call", given, self.body.type, self)


def function(name: str, **types: Type) -> Callable[[Callable[..., Expr]], Function]:
    """Decorator: a Python function of expressions becomes a `Function`, its docstring a comment."""

    def decorate(formula: Callable[..., Expr]) -> Function:
        parameters = tuple(var(parameter, type) for parameter, type in types.items())
        return Function(name, parameters, formula(*parameters), (formula.__doc__ or "").strip())

    return decorate


def let(name: str, value: Expr) -> Expr:
    """`value`, which shader text shall compute as a local variable of this name."""
    return node("let", (value,), value.type, name)

"""The expression language: every formula of sdf2vec is written once, here, and lowered to every target.

    formula in Python ── Expr (typed DAG) ──┬── lower.shader ──▶ GLSL, WGSL
                                            └── scalarize ── lower.torch ──▶ torch
                                                    └── gradient ──▶ derivatives, again as Expr

An expression is a node of a hash-consed graph: two equal expressions are the same object, so common
sub-expressions are shared without looking for them. Smart constructors fold what is trivial.

`OPERATIONS` is the one table of operations: how each is spelled in every target, and its derivative. Choices
that keep NaN away (a square root at zero, ties of `min`) are made in its rows and nowhere else.
"""

from __future__ import annotations

import math
from collections.abc import Hashable
from functools import partial
from weakref import WeakValueDictionary

from .folding import SIMPLER, scalars_of
from .operation import (
    CALL,
    FLOAT,
    PRECEDENCE,
    Cell,
    Operation,
    Type,
    arithmetic,
    blended,
    both,
    call,
    chosen,
    compared,
    equal,
    joined,
    reduced,
    widest,
)


class Expr:
    """One node. Make nodes with the constructors of this module, never directly."""

    __slots__ = ("__weakref__", "args", "op", "payload", "type")

    def __init__(self, op: str, args: tuple[Expr, ...], type: Type, payload: Hashable) -> None:
        self.op = op
        self.args = args
        self.type = type
        self.payload = payload

    def __repr__(self) -> str:
        inside = [repr(arg) for arg in self.args] if self.payload is None else [str(self.payload)]
        return f"{self.op}({', '.join(inside)})"

    def __add__(self, other: Operand) -> Expr:
        return operation("add", self, other)

    def __radd__(self, other: Operand) -> Expr:
        return operation("add", other, self)

    def __sub__(self, other: Operand) -> Expr:
        return operation("sub", self, other)

    def __rsub__(self, other: Operand) -> Expr:
        return operation("sub", other, self)

    def __mul__(self, other: Operand) -> Expr:
        return operation("mul", self, other)

    def __rmul__(self, other: Operand) -> Expr:
        return operation("mul", other, self)

    def __truediv__(self, other: Operand) -> Expr:
        return operation("div", self, other)

    def __rtruediv__(self, other: Operand) -> Expr:
        return operation("div", other, self)

    def __neg__(self) -> Expr:
        return operation("neg", self)

    def __lt__(self, other: Operand) -> Expr:
        return operation("less", self, other)

    def __gt__(self, other: Operand) -> Expr:
        return operation("less", other, self)

    @property
    def x(self) -> Expr:
        return component(self, 0)

    @property
    def y(self) -> Expr:
        return component(self, 1)

    @property
    def z(self) -> Expr:
        return component(self, 2)

    @property
    def w(self) -> Expr:
        return component(self, 3)


Operand = Expr | float

_nodes: WeakValueDictionary[tuple[object, ...], Expr] = WeakValueDictionary()


def node(op: str, args: tuple[Expr, ...], type: Type, payload: Hashable = None) -> Expr:
    key = (op, args, type, payload)
    found = _nodes.get(key)
    if found is None:
        found = _nodes[key] = Expr(op, args, type, payload)
    return found


# --- leaves -------------------------------------------------------------------------------------------------


def const(value: float) -> Expr:
    """A float constant; it must be finite. −0 becomes 0."""
    if not math.isfinite(value):
        raise ValueError(f"a constant must be finite, got {value}")
    return node("const", (), FLOAT, float(value) + 0.0)


def constant(expr: Expr) -> float:
    """The value of a constant."""
    assert isinstance(expr.payload, float)
    return expr.payload


def var(name: str, type: Type = FLOAT) -> Expr:
    """A named input."""
    return node("var", (), type, name)


# --- the table of operations --------------------------------------------------------------------------------


def _sigmoid(x: float) -> float:
    return 1.0 / (1.0 + math.exp(min(-x, 80.0)))


def _dot(*components: tuple[Expr, ...]) -> tuple[Expr, ...]:
    a, b = components
    total = a[0] * b[0]
    for left, right in zip(a[1:], b[1:], strict=True):
        total = total + left * right
    return (total,)


def _length(v: tuple[Expr, ...]) -> tuple[Expr, ...]:
    return (sqrt(_dot(v, v)[0]),)


def _join(width: int, *parts: tuple[Expr, ...]) -> tuple[Expr, ...]:
    flat = tuple(part for group in parts for part in group)
    return flat * width if len(flat) == 1 else flat


def _mix(a: tuple[Expr, ...], b: tuple[Expr, ...], t: tuple[Expr, ...]) -> tuple[Expr, ...]:
    return tuple(left + (right - left) * t[0] for left, right in zip(a, b, strict=True))


def _clamp(x: tuple[Expr, ...], low: tuple[Expr, ...], high: tuple[Expr, ...]) -> tuple[Expr, ...]:
    return tuple(minimum(maximum(v, a), b) for v, a, b in zip(x, low, high, strict=True))


def _vector(width: int) -> Operation:
    return Operation(
        partial(joined, width),
        Cell(f"vec{width}({{*}})"),
        Cell(f"vec{width}f({{*}})"),
        expand=partial(_join, width),
    )


_SIGMOID = Cell("1.0 / (1.0 + exp(min(-{0}, 80.0)))", PRECEDENCE["/"], operands=CALL)
_SQRT = "torch.where({0} > 0, torch.sqrt(torch.where({0} > 0, {0}, 1.0)), 0.0)"

# Ties: min and max return (and pass the gradient to) their second argument, abs counts 0 as positive.
OPERATIONS: dict[str, Operation] = {
    "add": Operation(
        widest,
        *both(arithmetic("+")),
        torch="{0} + {1}",
        python="{0} + {1}",
        triton="{0} + {1}",
        javascript="{0} + {1}",
        value=lambda a, b: a + b,
        partials=lambda a, b, y: (1.0, 1.0),
    ),
    "sub": Operation(
        widest,
        *both(arithmetic("-")),
        torch="{0} - {1}",
        python="{0} - {1}",
        triton="{0} - {1}",
        javascript="{0} - {1}",
        value=lambda a, b: a - b,
        partials=lambda a, b, y: (1.0, -1.0),
    ),
    "mul": Operation(
        widest,
        *both(arithmetic("*")),
        torch="{0} * {1}",
        python="{0} * {1}",
        triton="{0} * {1}",
        javascript="{0} * {1}",
        value=lambda a, b: a * b,
        partials=lambda a, b, y: (b, a),
    ),
    "div": Operation(
        widest,
        *both(arithmetic("/")),
        torch="{0} / {1}",
        python="{0} / {1}",
        triton="{0} / {1}",
        javascript="{0} / {1}",
        value=lambda a, b: a / b,
        partials=lambda a, b, y: (1.0 / b, -(y / b)),
        domain="divisor not 0: whoever divides keeps it away from 0",
    ),
    "neg": Operation(
        widest,
        *both(Cell("-{0}", PRECEDENCE["unary"])),
        torch="-{0}",
        python="-{0}",
        triton="-{0}",
        javascript="-{0}",
        value=lambda a: -a,
        partials=lambda a, y: (-1.0,),
    ),
    "abs": Operation(
        widest,
        *both(call("abs")),
        torch="torch.where({0} < 0, -{0}, {0})",
        python="absolute({0})",
        triton="tl.abs({0})",
        javascript="Math.abs({0})",
        value=abs,
        partials=lambda a, y: (select(a < 0.0, -1.0, 1.0),),
    ),
    "min": Operation(
        equal,
        *both(call("min", 2)),
        torch="torch.where({0} < {1}, {0}, {1})",
        python="minimum({0}, {1})",
        triton="tl.minimum({0}, {1})",
        javascript="Math.min({0}, {1})",
        value=min,
        partials=lambda a, b, y: (select(a < b, 1.0, 0.0), select(a < b, 0.0, 1.0)),
    ),
    "max": Operation(
        equal,
        *both(call("max", 2)),
        torch="torch.where({0} > {1}, {0}, {1})",
        python="maximum({0}, {1})",
        triton="tl.maximum({0}, {1})",
        javascript="Math.max({0}, {1})",
        value=max,
        partials=lambda a, b, y: (select(a > b, 1.0, 0.0), select(a > b, 0.0, 1.0)),
    ),
    "clamp": Operation(equal, *both(call("clamp", 3)), expand=_clamp, domain="low not above high"),
    "sqrt": Operation(
        widest,
        *both(call("sqrt")),
        torch=_SQRT,
        python="sqrt({0})",
        triton="tl.sqrt(tl.maximum({0}, 0.0))",
        javascript="Math.sqrt(Math.max({0}, 0))",
        value=lambda a: math.sqrt(max(a, 0.0)),
        partials=lambda a, y: (select(a > 0.0, 0.5 / y, 0.0),),
        domain="not below 0; the derivative at 0 is 0",
    ),
    "exp": Operation(
        widest,
        *both(call("exp")),
        torch="torch.exp({0})",
        python="exp({0})",
        triton="tl.exp({0})",
        javascript="Math.exp({0})",
        value=math.exp,
        partials=lambda a, y: (y,),
        domain="at most 80, so that float32 holds it",
    ),
    "log": Operation(
        widest,
        *both(Cell("log(max({0}, 1e-30))")),
        torch="torch.log(torch.where({0} > 1e-30, {0}, 1e-30))",
        python="log({0})",
        triton="tl.log(tl.maximum({0}, 1e-30))",
        javascript="Math.log(Math.max({0}, 1e-30))",
        value=lambda a: math.log(max(a, 1e-30)),
        partials=lambda a, y: (select(a > 1e-30, 1.0 / a, 0.0),),
        domain="below 1e-30 it stays what it is there",
    ),
    "sin": Operation(
        widest,
        *both(call("sin")),
        torch="torch.sin({0})",
        python="sin({0})",
        triton="tl.sin({0})",
        javascript="Math.sin({0})",
        value=math.sin,
        partials=lambda a, y: (cos(a),),
        domain="a few hundred radians, beyond which float32 loses the phase",
    ),
    "cos": Operation(
        widest,
        *both(call("cos")),
        torch="torch.cos({0})",
        python="cos({0})",
        triton="tl.cos({0})",
        javascript="Math.cos({0})",
        value=math.cos,
        partials=lambda a, y: (-sin(a),),
        domain="a few hundred radians, beyond which float32 loses the phase",
    ),
    "sigmoid": Operation(
        widest,
        *both(_SIGMOID),
        torch="torch.sigmoid({0})",
        python="sigmoid({0})",
        triton="1.0 / (1.0 + tl.exp(tl.minimum(-{0}, 80.0)))",
        javascript="1 / (1 + Math.exp(Math.min(-{0}, 80)))",
        value=_sigmoid,
        partials=lambda a, y: (y * (1.0 - y),),
    ),
    "less": Operation(
        compared,
        *both(arithmetic("<")),
        torch="{0} < {1}",
        python="{0} < {1}",
        triton="{0} < {1}",
        javascript="{0} < {1}",
        value=lambda a, b: float(a < b),
        partials=lambda a, b, y: (None, None),
    ),
    "select": Operation(
        chosen,
        Cell("{0} ? {1} : {2}", PRECEDENCE["?"]),
        Cell("select({2}, {1}, {0})"),
        torch="torch.where({0}, {1}, {2})",
        python="select({0}, {1}, {2})",
        triton="tl.where({0}, {1}, {2})",
        javascript="({0} ? {1} : {2})",
        value=lambda condition, a, b: a if condition else b,
        partials=lambda condition, a, b, y: (None, select(condition, 1.0, 0.0), select(condition, 0.0, 1.0)),
    ),
    "fixed": Operation(
        widest,
        *both(Cell("{0}", PRECEDENCE["unary"], operands=CALL)),
        torch="{0}.detach()",
        python="{0}",
        triton="{0}",
        javascript="{0}",
        value=lambda a: a,
        partials=lambda a, y: (None,),
        domain="its derivative counts as 0",
    ),
    "mix": Operation(blended, *both(call("mix", 3)), expand=_mix),
    "dot": Operation(reduced, *both(call("dot", 2)), expand=_dot),
    "length": Operation(reduced, *both(call("length")), expand=_length),
    "vec2": _vector(2),
    "vec3": _vector(3),
    "vec4": _vector(4),
}


def expression_of(value: Operand) -> Expr:
    """A number as a constant."""
    return value if isinstance(value, Expr) else const(value)


def operation(op: str, *args: Operand) -> Expr:
    """The node of a table row, folded where that is trivial. Raises TypeError when the types do not fit."""
    row = OPERATIONS[op]
    given = tuple(expression_of(arg) for arg in args)
    given = scalars_of(given) if op.startswith("vec") else given
    type = row.result([arg.type for arg in given])
    if row.value and type is FLOAT and all(arg.op == "const" for arg in given):
        return const(row.value(*(constant(arg) for arg in given)))
    simple = SIMPLER[op](*given) if op in SIMPLER else None
    return simple if simple is not None and simple.type is type else node(op, given, type)


# --- constructors by name -----------------------------------------------------------------------------------


def _broadcast(op: str, *args: Operand) -> Expr:
    """For rows whose shader spelling wants equal types: floats become vectors of equal components first."""
    given = [expression_of(arg) for arg in args]
    width = max(arg.type.width for arg in given)
    return operation(op, *(operation(f"vec{width}", arg) if arg.type.width < width else arg for arg in given))


def minimum(a: Operand, b: Operand) -> Expr:
    """The smaller, component by component."""
    return _broadcast("min", a, b)


def maximum(a: Operand, b: Operand) -> Expr:
    """The larger, component by component."""
    return _broadcast("max", a, b)


def clamp(x: Operand, low: Operand, high: Operand) -> Expr:
    """`x` held within low..high, component by component."""
    return _broadcast("clamp", x, low, high)


def absolute(x: Expr) -> Expr:
    """|x|, component by component."""
    return operation("abs", x)


def sqrt(x: Expr) -> Expr:
    """Square root; 0 below 0, with derivative 0 at 0."""
    return operation("sqrt", x)


def exp(x: Expr) -> Expr:
    """The exponential function."""
    return operation("exp", x)


def log(x: Expr) -> Expr:
    """The natural logarithm."""
    return operation("log", x)


def sin(x: Expr) -> Expr:
    """Sine of radians."""
    return operation("sin", x)


def cos(x: Expr) -> Expr:
    """Cosine of radians."""
    return operation("cos", x)


def sigmoid(x: Expr) -> Expr:
    """1 / (1 + e^−x)."""
    return operation("sigmoid", x)


def fixed(x: Expr) -> Expr:
    """`x` as if it were constant: for values at which the derivative is known to vanish."""
    return operation("fixed", x)


def select(condition: Expr, if_true: Operand, if_false: Operand) -> Expr:
    """`if_true` where the condition holds, else `if_false`; both sides are evaluated."""
    return operation("select", condition, if_true, if_false)


def mix(a: Expr, b: Expr, t: Operand) -> Expr:
    """a + (b − a)·t."""
    return operation("mix", a, b, t)


def dot(a: Expr, b: Expr) -> Expr:
    """Inner product of two vectors."""
    return operation("dot", a, b)


def length(v: Expr) -> Expr:
    """Euclidean length of a vector."""
    return operation("length", v)


def vec2(*parts: Operand) -> Expr:
    """A vector of two components, from one float (repeated) or from parts."""
    return operation("vec2", *parts)


def vec3(*parts: Operand) -> Expr:
    """A vector of three components, from one float (repeated) or from parts."""
    return operation("vec3", *parts)


def vec4(*parts: Operand) -> Expr:
    """A vector of four components, from one float (repeated) or from parts."""
    return operation("vec4", *parts)


def component(v: Expr, index: int) -> Expr:
    """Component `index` of a vector."""
    if index >= v.type.width or v.type.width == 1:
        raise TypeError(f"{v.type.value} has no component {index}")
    if v.op == f"vec{v.type.width}":
        parts = [(arg, place) for arg in v.args for place in range(arg.type.width)]
        arg, place = parts[index % len(parts)]  # one part is repeated
        return arg if arg.type is FLOAT else component(arg, place)
    return node("component", (v,), FLOAT, index)

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
from collections.abc import Callable, Container, Hashable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from functools import partial
from weakref import WeakValueDictionary


class Type(Enum):
    """Type of an expression; the value is its GLSL name."""

    BOOL = "bool"
    FLOAT = "float"
    VEC2 = "vec2"
    VEC3 = "vec3"
    VEC4 = "vec4"

    @property
    def width(self) -> int:
        """Number of scalar components."""
        return {"vec2": 2, "vec3": 3, "vec4": 4}.get(self.value, 1)


BOOL, FLOAT, VEC2, VEC3, VEC4 = Type
VECTOR = {1: FLOAT, 2: VEC2, 3: VEC3, 4: VEC4}
COMPONENTS = "xyzw"


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


def _node(op: str, args: tuple[Expr, ...], type: Type, payload: Hashable = None) -> Expr:
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
    return _node("const", (), FLOAT, float(value) + 0.0)


def constant(expr: Expr) -> float:
    """The value of a constant."""
    assert isinstance(expr.payload, float)
    return expr.payload


def var(name: str, type: Type = FLOAT) -> Expr:
    """A named input."""
    return _node("var", (), type, name)


def let(name: str, value: Expr) -> Expr:
    """`value`, which shader text shall compute as a local variable of this name."""
    return _node("let", (value,), value.type, name)


# --- functions ----------------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class Function:
    """A formula with a name: shader text defines and calls it, other targets see through the call."""

    name: str
    parameters: tuple[Expr, ...]
    body: Expr
    doc: str

    def __call__(self, *args: Operand) -> Expr:
        given = tuple(_expr(arg) for arg in args)
        expected = [parameter.type for parameter in self.parameters]
        if [arg.type for arg in given] != expected:
            raise TypeError(f"{self.name} takes {expected}, got {[arg.type for arg in given]}")
        return _node("call", given, self.body.type, self)


def function(name: str, **types: Type) -> Callable[[Callable[..., Expr]], Function]:
    """Decorator: a Python function of expressions becomes a `Function`, its docstring a comment."""

    def decorate(formula: Callable[..., Expr]) -> Function:
        parameters = tuple(var(parameter, type) for parameter, type in types.items())
        return Function(name, parameters, formula(*parameters), (formula.__doc__ or "").strip())

    return decorate


# --- the table of operations --------------------------------------------------------------------------------

CALL = 100
PRECEDENCE = {"?": 1, "<": 3, "+": 5, "-": 5, "*": 6, "/": 6, "unary": 8}


@dataclass(frozen=True)
class Cell:
    """How a shader language spells an operation: a format text, how tightly it binds, and how tightly its
    operands must bind (as tightly as itself, when not said)."""

    text: str
    precedence: int = CALL
    operands: int = 0


@dataclass(frozen=True)
class Operation:
    """One row: types, spelling per target, value on constants, derivative.

    A row either has a text for every target, `value` and `partials` (it works on floats; vectors go by
    component) or `expand` (other rows define it once its arguments are split into components).
    """

    result: Callable[[Sequence[Type]], Type]
    glsl: Cell
    wgsl: Cell
    torch: str | None = None
    numba: str | None = None
    triton: str | None = None
    javascript: str | None = None
    value: Callable[..., float] | None = None
    partials: Callable[..., tuple[Operand | None, ...]] | None = None
    expand: Callable[..., tuple[Expr, ...]] | None = None
    domain: str = "all"


def _widest(types: Sequence[Type]) -> Type:
    """Floats broadcast to the one vector type present."""
    vectors = {type for type in types if type.width > 1}
    if len(vectors) > 1 or BOOL in types:
        raise TypeError(f"types do not fit: {[type.value for type in types]}")
    return vectors.pop() if vectors else FLOAT


def _equal(types: Sequence[Type]) -> Type:
    if len(set(types)) > 1 or BOOL in types:
        raise TypeError(f"types must be equal: {[type.value for type in types]}")
    return types[0]


def _compared(types: Sequence[Type]) -> Type:
    if set(types) != {FLOAT}:
        raise TypeError(f"only floats compare, got {[type.value for type in types]}")
    return BOOL


def _chosen(types: Sequence[Type]) -> Type:
    if types[0] is not BOOL:
        raise TypeError("select takes a bool first")
    return _equal(types[1:])


def _blended(types: Sequence[Type]) -> Type:
    if types[2] is not FLOAT:
        raise TypeError("mix takes a float last")
    return _equal(types[:2])


def _reduced(types: Sequence[Type]) -> Type:
    if _equal(types).width == 1:
        raise TypeError("takes vectors")
    return FLOAT


def _joined(width: int, types: Sequence[Type]) -> Type:
    if list(types) != [FLOAT] and sum(type.width for type in types) != width:
        raise TypeError(f"{width} components wanted, got {[type.value for type in types]}")
    return VECTOR[width]


def _arithmetic(symbol: str) -> Cell:
    return Cell(f"{{0}} {symbol} {{1}}", PRECEDENCE[symbol])


def _call(name: str, arity: int = 1) -> Cell:
    return Cell(f"{name}({', '.join(f'{{{i}}}' for i in range(arity))})")


def _both(cell: Cell) -> tuple[Cell, Cell]:
    """GLSL and WGSL agree."""
    return cell, cell


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
        partial(_joined, width),
        Cell(f"vec{width}({{*}})"),
        Cell(f"vec{width}f({{*}})"),
        expand=partial(_join, width),
    )


_SIGMOID = Cell("1.0 / (1.0 + exp(min(-{0}, 80.0)))", PRECEDENCE["/"], operands=CALL)
_SQRT = "torch.where({0} > 0, torch.sqrt(torch.where({0} > 0, {0}, 1.0)), 0.0)"

# Ties: min and max return (and pass the gradient to) their second argument, abs counts 0 as positive.
OPERATIONS: dict[str, Operation] = {
    "add": Operation(
        _widest,
        *_both(_arithmetic("+")),
        torch="{0} + {1}",
        numba="{0} + {1}",
        triton="{0} + {1}",
        javascript="{0} + {1}",
        value=lambda a, b: a + b,
        partials=lambda a, b, y: (1.0, 1.0),
    ),
    "sub": Operation(
        _widest,
        *_both(_arithmetic("-")),
        torch="{0} - {1}",
        numba="{0} - {1}",
        triton="{0} - {1}",
        javascript="{0} - {1}",
        value=lambda a, b: a - b,
        partials=lambda a, b, y: (1.0, -1.0),
    ),
    "mul": Operation(
        _widest,
        *_both(_arithmetic("*")),
        torch="{0} * {1}",
        numba="{0} * {1}",
        triton="{0} * {1}",
        javascript="{0} * {1}",
        value=lambda a, b: a * b,
        partials=lambda a, b, y: (b, a),
    ),
    "div": Operation(
        _widest,
        *_both(_arithmetic("/")),
        torch="{0} / {1}",
        numba="{0} / {1}",
        triton="{0} / {1}",
        javascript="{0} / {1}",
        value=lambda a, b: a / b,
        partials=lambda a, b, y: (1.0 / b, -(y / b)),
        domain="divisor not 0: whoever divides keeps it away from 0",
    ),
    "neg": Operation(
        _widest,
        *_both(Cell("-{0}", PRECEDENCE["unary"])),
        torch="-{0}",
        numba="-{0}",
        triton="-{0}",
        javascript="-{0}",
        value=lambda a: -a,
        partials=lambda a, y: (-1.0,),
    ),
    "abs": Operation(
        _widest,
        *_both(_call("abs")),
        torch="torch.where({0} < 0, -{0}, {0})",
        numba="({0} if {0} > ZERO else -{0})",
        triton="tl.abs({0})",
        javascript="Math.abs({0})",
        value=abs,
        partials=lambda a, y: (select(a < 0.0, -1.0, 1.0),),
    ),
    "min": Operation(
        _equal,
        *_both(_call("min", 2)),
        torch="torch.where({0} < {1}, {0}, {1})",
        numba="({0} if {0} < {1} else {1})",
        triton="tl.minimum({0}, {1})",
        javascript="Math.min({0}, {1})",
        value=min,
        partials=lambda a, b, y: (select(a < b, 1.0, 0.0), select(a < b, 0.0, 1.0)),
    ),
    "max": Operation(
        _equal,
        *_both(_call("max", 2)),
        torch="torch.where({0} > {1}, {0}, {1})",
        numba="({0} if {0} > {1} else {1})",
        triton="tl.maximum({0}, {1})",
        javascript="Math.max({0}, {1})",
        value=max,
        partials=lambda a, b, y: (select(a > b, 1.0, 0.0), select(a > b, 0.0, 1.0)),
    ),
    "clamp": Operation(_equal, *_both(_call("clamp", 3)), expand=_clamp, domain="low not above high"),
    "sqrt": Operation(
        _widest,
        *_both(_call("sqrt")),
        torch=_SQRT,
        numba="sqrt({0} if {0} > ZERO else ZERO)",
        triton="tl.sqrt(tl.maximum({0}, 0.0))",
        javascript="Math.sqrt(Math.max({0}, 0))",
        value=lambda a: math.sqrt(max(a, 0.0)),
        partials=lambda a, y: (select(a > 0.0, 0.5 / y, 0.0),),
        domain="not below 0; the derivative at 0 is 0",
    ),
    "exp": Operation(
        _widest,
        *_both(_call("exp")),
        torch="torch.exp({0})",
        numba="fast_exp({0})",
        triton="tl.exp({0})",
        javascript="Math.exp({0})",
        value=math.exp,
        partials=lambda a, y: (y,),
        domain="at most 80, so that float32 holds it",
    ),
    "log": Operation(
        _widest,
        *_both(Cell("log(max({0}, 1e-30))")),
        torch="torch.log(torch.where({0} > 1e-30, {0}, 1e-30))",
        numba="fast_log({0})",
        triton="tl.log(tl.maximum({0}, 1e-30))",
        javascript="Math.log(Math.max({0}, 1e-30))",
        value=lambda a: math.log(max(a, 1e-30)),
        partials=lambda a, y: (select(a > 1e-30, 1.0 / a, 0.0),),
        domain="below 1e-30 it stays what it is there",
    ),
    "sin": Operation(
        _widest,
        *_both(_call("sin")),
        torch="torch.sin({0})",
        numba="fast_sin({0})",
        triton="tl.sin({0})",
        javascript="Math.sin({0})",
        value=math.sin,
        partials=lambda a, y: (cos(a),),
        domain="a few hundred radians, beyond which float32 loses the phase",
    ),
    "cos": Operation(
        _widest,
        *_both(_call("cos")),
        torch="torch.cos({0})",
        numba="fast_sin({0} + QUARTER)",
        triton="tl.cos({0})",
        javascript="Math.cos({0})",
        value=math.cos,
        partials=lambda a, y: (-sin(a),),
        domain="a few hundred radians, beyond which float32 loses the phase",
    ),
    "sigmoid": Operation(
        _widest,
        *_both(_SIGMOID),
        torch="torch.sigmoid({0})",
        numba="fast_sigmoid({0})",
        triton="1.0 / (1.0 + tl.exp(tl.minimum(-{0}, 80.0)))",
        javascript="1 / (1 + Math.exp(Math.min(-{0}, 80)))",
        value=_sigmoid,
        partials=lambda a, y: (y * (1.0 - y),),
    ),
    "less": Operation(
        _compared,
        *_both(_arithmetic("<")),
        torch="{0} < {1}",
        numba="{0} < {1}",
        triton="{0} < {1}",
        javascript="{0} < {1}",
        value=lambda a, b: float(a < b),
        partials=lambda a, b, y: (None, None),
    ),
    "select": Operation(
        _chosen,
        Cell("{0} ? {1} : {2}", PRECEDENCE["?"]),
        Cell("select({2}, {1}, {0})"),
        torch="torch.where({0}, {1}, {2})",
        numba="({1} if {0} else {2})",
        triton="tl.where({0}, {1}, {2})",
        javascript="({0} ? {1} : {2})",
        value=lambda condition, a, b: a if condition else b,
        partials=lambda condition, a, b, y: (None, select(condition, 1.0, 0.0), select(condition, 0.0, 1.0)),
    ),
    "fixed": Operation(
        _widest,
        *_both(Cell("{0}", PRECEDENCE["unary"], operands=CALL)),
        torch="{0}.detach()",
        numba="{0}",
        triton="{0}",
        javascript="{0}",
        value=lambda a: a,
        partials=lambda a, y: (None,),
        domain="its derivative counts as 0",
    ),
    "mix": Operation(_blended, *_both(_call("mix", 3)), expand=_mix),
    "dot": Operation(_reduced, *_both(_call("dot", 2)), expand=_dot),
    "length": Operation(_reduced, *_both(_call("length")), expand=_length),
    "vec2": _vector(2),
    "vec3": _vector(3),
    "vec4": _vector(4),
}


def _expr(value: Operand) -> Expr:
    return value if isinstance(value, Expr) else const(value)


def operation(op: str, *args: Operand) -> Expr:
    """The node of a table row, folded where that is trivial. Raises TypeError when the types do not fit."""
    row = OPERATIONS[op]
    given = tuple(_expr(arg) for arg in args)
    type = row.result([arg.type for arg in given])
    if row.value and type is FLOAT and all(arg.op == "const" for arg in given):
        return const(row.value(*(constant(arg) for arg in given)))
    simple = _SIMPLIFY[op](*given) if op in _SIMPLIFY else None
    return simple if simple is not None and simple.type is type else _node(op, given, type)


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
    if condition.op == "less" and all(arg.op == "const" for arg in condition.args):
        left, right = map(constant, condition.args)
        return a if left < right else b
    return a if a is b else None


_SIMPLIFY: dict[str, Callable[..., Expr | None]] = {
    "add": _simple_add,
    "sub": _simple_sub,
    "mul": _simple_mul,
    "div": _simple_div,
    "neg": _simple_neg,
    "select": _simple_select,
}


# --- constructors by name -----------------------------------------------------------------------------------


def _splat(value: Operand, width: int) -> Expr:
    """`value` as a vector of `width` equal components, when it is a float and a vector is wanted."""
    expr = _expr(value)
    return operation(f"vec{width}", expr) if width > 1 and expr.type is FLOAT else expr


def _broadcast(op: str, *args: Operand) -> Expr:
    """For rows whose shader spelling wants equal types: floats become vectors first."""
    width = max(_expr(arg).type.width for arg in args)
    return operation(op, *(_splat(arg, width) for arg in args))


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
    if v.op == f"vec{v.type.width}" and len(v.args) == v.type.width:
        return v.args[index]
    return _node("component", (v,), FLOAT, index)


# --- walking ------------------------------------------------------------------------------------------------


def walk(roots: Iterable[Expr]) -> Iterator[Expr]:
    """Every node once, arguments before what uses them."""
    seen: set[Expr] = set()
    stack = [(root, False) for root in reversed(list(roots))]
    while stack:
        node, ready = stack.pop()
        if node in seen:
            continue
        if ready:
            seen.add(node)
            yield node
        else:
            stack.append((node, True))
            stack.extend((arg, False) for arg in reversed(node.args))


def substitute(expr: Expr, values: Mapping[Expr, Expr]) -> Expr:
    """The expression with the nodes that are keys of `values` replaced; it folds anew."""
    done: dict[Expr, Expr] = {}
    for node in walk([expr]):
        done[node] = values.get(node) or _rebuild(node, tuple(done[arg] for arg in node.args))
    return done[expr]


def _rebuild(node: Expr, args: tuple[Expr, ...]) -> Expr:
    if args == node.args:
        return node
    if node.op in OPERATIONS:
        return operation(node.op, *args)
    if node.op == "component":
        assert isinstance(node.payload, int)
        return component(args[0], node.payload)
    return _node(node.op, args, node.type, node.payload)


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

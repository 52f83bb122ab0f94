"""Lowering of plain Python functions to LLVM's assembly language: the loops around the formulas.

What is understood is little, and compiles in milliseconds: numbers; arrays of a stated type in C order, rows and
parts of them; `for … in range(…)`, `if`, `continue`, `return`; arithmetic, comparisons, `min`, `max`, `floor`,
`ceil`, `f32`; `a if … else b` and `and`, which compute both sides; functions that are `inlined`; `empty` and `call`.
Arrays that are arguments must not overlap. Integers have 64 bits, `//` and `%` are of such as are not negative; an
integer and a float32 make a float64, as in numpy.
"""

from __future__ import annotations

import ast
import inspect
import math
import operator
import textwrap
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cache, reduce
from types import FunctionType
from typing import Any

import numpy as np

from . import llvm_math
from .llvm_math import Lines, Number

STORED = {"float32": "float", "float64": "double", "int32": "i32", "int64": "i64"}
f32 = np.float32
ZERO, ONE, TWO = f32(0), f32(1), f32(2)


@dataclass(frozen=True)
class Kind:
    """What an argument is: a number of a type of numpy, or an array `[of so many dimensions]`."""

    dtype: str
    dimensions: int = 0

    def __getitem__(self, dimensions: int) -> Kind:
        return Kind(self.dtype, dimensions)


F32, F64, I32, I64 = map(Kind, STORED)


@dataclass(frozen=True)
class Array:
    """Numbers from a place on, in C order; its lengths are numbers or constants."""

    stored: str
    start: Number
    shape: tuple[Any, ...]


@dataclass(frozen=True)
class Slot:
    """A variable: the place of its number."""

    place: str
    type: str


# --- what kernels are written with ----------------------------------------------------------------------------


def inlined(function: Any) -> Any:
    """Decorator: a function that kernels contain wherever they call it."""
    function.is_inlined = True
    return function


def call(address: Any, arguments: Sequence[Any]) -> None:
    """Calls the function at an address; of arrays it gets a pointer to the first number."""
    raise NotImplementedError("for kernels")


def empty(*shape: int) -> Any:
    """Room for float32s, for as long as the kernel runs."""
    raise NotImplementedError("for kernels")


def arguments_of(function: FunctionType) -> dict[str, Kind]:
    """The kind of each."""
    return {name: kind for name, kind in inspect.get_annotations(function).items() if name != "return"}


def result_of(function: FunctionType) -> Kind | None:
    """The kind of what it returns."""
    return inspect.get_annotations(function).get("return")


def text_of(function: FunctionType) -> str:
    """The function in assembly: an array is a pointer, and the lengths of its dimensions."""
    return _Writer().text(function)


# --- how they are read ----------------------------------------------------------------------------------------

ARITHMETIC: dict[type[ast.AST], Callable[[Any, Any], Any]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.FloorDiv: operator.floordiv,
    ast.Mod: operator.mod,
}
RELATIONS: dict[type[ast.AST], str] = {
    ast.Lt: "lt",
    ast.LtE: "le",
    ast.Gt: "gt",
    ast.GtE: "ge",
    ast.Eq: "eq",
    ast.NotEq: "ne",
}


@dataclass
class _Frame:
    """A function while it is written: what its names mean, and where its ends go."""

    names: dict[str, Any]
    globals: dict[str, Any]
    end: str
    results: list[Slot] | None = None
    loops: list[str] = field(default_factory=list)


@cache
def _tree(function: FunctionType) -> ast.FunctionDef:
    tree: Any = ast.parse(textwrap.dedent(inspect.getsource(function)))
    found: ast.FunctionDef = tree.body[0]
    return found


def _computed(stored: str) -> str:
    return "i64" if stored == "i32" else stored


def _type_of(value: Any) -> str:
    if isinstance(value, Number):
        return value.type
    return "float" if isinstance(value, np.float32) else "double" if isinstance(value, float) else "i64"


def _common(a: str, b: str) -> str:
    return a if a == b else "double"


class _Writer:
    """Follows the statements of a kernel once, and writes what they do."""

    def __init__(self) -> None:
        self.lines = Lines()
        self.slots: list[str] = []
        self.frame = _Frame({}, {}, "end")
        self.labels = 0

    def text(self, function: FunctionType) -> str:
        self.frame = _Frame({}, function.__globals__, "end")
        given = [part for name, kind in arguments_of(function).items() for part in self._given(name, kind)]
        self._block(_tree(function).body)
        self._label("end", "  br label %end")
        result, returned = result_of(function), "void"
        if result:
            assert self.frame.results
            number = self._converted(self._loaded(self.frame.results[0]), STORED[result.dtype])
            returned = f"{number.type} {number.text}"
        self._line(f"  ret {returned}")
        head = f"define {returned.split()[0]} @{function.__name__}({', '.join(given)}) {{"
        return "\n".join([head, "entry:", *self.slots, *self.lines.taken(), "}"])

    def _given(self, name: str, kind: Kind) -> list[str]:
        stored = STORED[kind.dtype]
        own = Number(f"%{name}", "ptr" if kind.dimensions else stored, self.lines)
        lengths = [Number(f"%{name}.{d}", "i64", self.lines) for d in range(kind.dimensions)]
        self.frame.names[name] = Array(stored, own, tuple(lengths)) if kind.dimensions else own
        first = f"ptr noalias {own.text}" if kind.dimensions else f"{stored} {own.text}"
        return [first, *(f"i64 {length.text}" for length in lengths)]

    def _line(self, text: str) -> None:
        self.lines.written.append(text)

    def _labelled(self, name: str) -> str:
        self.labels += 1
        return f"{name}{self.labels}"

    def _label(self, label: str, before: str | None = None) -> None:
        self._line(before or f"  br label %{label}")
        self._line(f"{label}:")

    # --- statements

    def _block(self, statements: Sequence[ast.stmt]) -> None:
        for statement in statements:
            getattr(self, f"_do_{type(statement).__name__.lower()}")(statement)

    def _do_expr(self, statement: ast.Expr) -> None:
        if not isinstance(statement.value, ast.Constant):  # of text: it says what the function does
            self._value(statement.value)

    def _do_assign(self, statement: ast.Assign) -> None:
        value = self._value(statement.value)
        for target in statement.targets:
            self._assign(target, value)

    def _do_augassign(self, statement: ast.AugAssign) -> None:
        before, value = self._value(statement.target), self._value(statement.value)
        self._assign(statement.target, self._binary(ARITHMETIC[type(statement.op)], before, value))

    def _assign(self, target: ast.expr, value: Any) -> None:
        if isinstance(target, ast.Tuple):
            for part, each in zip(target.elts, value, strict=True):
                self._assign(part, each)
        elif isinstance(target, ast.Subscript):
            self._put(self._indexed(target), value)
        else:
            assert isinstance(target, ast.Name)
            self._name(target.id, value)

    def _name(self, name: str, value: Any) -> None:
        """Numbers go to a slot, for they may be assigned again where it is not known whether they are."""
        if isinstance(value, (Array, tuple)):
            self.frame.names[name] = value
            return
        slot = self.frame.names.get(name) or self._slot(_type_of(value))
        assert isinstance(slot, Slot), f"{name} is an argument, or counts a loop"
        self.frame.names[name] = slot
        self._set(slot, value)

    def _slot(self, type: str) -> Slot:
        place = f"%slot{len(self.slots)}"
        self.slots.append(f"  {place} = alloca {type}")
        return Slot(place, type)

    def _set(self, slot: Slot, value: Any) -> None:
        self._line(f"  store {slot.type} {self._converted(value, slot.type).text}, ptr {slot.place}")

    def _loaded(self, slot: Slot) -> Number:
        return self.lines.add(slot.type, f"load {slot.type}, ptr {slot.place}")

    def _put(self, array: Array, value: Any) -> None:
        """One number everywhere in an array, or those of another one."""

        def put(index: Any) -> None:
            source = self._element(value, index) if isinstance(value, Array) else value
            number = self._converted(source, array.stored)
            self._line(f"  store {array.stored} {number.text}, ptr {self._place(array, index).text}")

        if array.shape:
            self._loop(0, self._product(array.shape), 1, put)
        else:
            put(0)

    def _do_if(self, statement: ast.If) -> None:
        condition = self._value(statement.test)
        if not isinstance(condition, Number):
            self._block(statement.body if condition else statement.orelse)
            return
        then, otherwise, after = map(self._labelled, ("then", "else", "after"))
        self._label(then, self._branch(condition, then, otherwise))
        self._block(statement.body)
        self._label(otherwise, f"  br label %{after}")
        self._block(statement.orelse)
        self._label(after)

    def _branch(self, condition: Number, yes: str, no: str) -> str:
        test = condition if condition.type == "i1" else condition.compared("ne", 0)
        return f"  br i1 {test.text}, label %{yes}, label %{no}"

    def _do_for(self, statement: ast.For) -> None:
        assert isinstance(statement.iter, ast.Call)
        assert isinstance(statement.target, ast.Name)
        given = [self._value(argument) for argument in statement.iter.args]
        first, last, step = (*given, 1)[:3] if len(given) > 1 else (0, given[0], 1)
        name = statement.target.id

        def body(index: Any) -> None:
            self.frame.names[name] = index
            self._block(statement.body)

        self._loop(first, last, step, body)

    def _loop(self, first: Any, last: Any, step: Any, body: Callable[[Number], None]) -> None:
        slot, end = self._slot("i64"), self._converted(last, "i64")
        again, inside, further, after = map(self._labelled, ("again", "inside", "further", "after"))
        self._set(slot, first)
        self._label(again)
        index = self._loaded(slot)
        self._label(inside, self._branch(index < end, inside, after))
        self.frame.loops.append(further)
        body(index)
        self.frame.loops.pop()
        self._label(further)
        more = self.lines.add("i64", f"add nsw i64 {index.text}, {self._converted(step, 'i64').text}")
        self._set(slot, more)
        self._label(after, f"  br label %{again}")

    def _do_continue(self, statement: ast.Continue) -> None:
        self._label(self._labelled("unreached"), f"  br label %{self.frame.loops[-1]}")

    def _do_return(self, statement: ast.Return) -> None:
        value = None if statement.value is None else self._value(statement.value)
        numbers = value if isinstance(value, tuple) else () if value is None else (value,)
        if self.frame.results is None:
            self.frame.results = [self._slot(_type_of(number)) for number in numbers]
        for slot, number in zip(self.frame.results, numbers, strict=True):
            self._set(slot, number)
        self._label(self._labelled("unreached"), f"  br label %{self.frame.end}")

    # --- expressions

    def _value(self, expression: ast.expr) -> Any:
        return getattr(self, f"_of_{type(expression).__name__.lower()}")(expression)

    def _of_constant(self, expression: ast.Constant) -> Any:
        return expression.value

    def _of_name(self, expression: ast.Name) -> Any:
        value = self.frame.names.get(expression.id, self.frame.globals.get(expression.id))
        if value is None:
            value = {"min": min, "max": max, "len": len}[expression.id]
        return self._loaded(value) if isinstance(value, Slot) else value

    def _of_tuple(self, expression: ast.Tuple) -> Any:
        return tuple(map(self._value, expression.elts))

    def _of_binop(self, expression: ast.BinOp) -> Any:
        operation = ARITHMETIC[type(expression.op)]
        return self._binary(operation, self._value(expression.left), self._value(expression.right))

    def _of_unaryop(self, expression: ast.UnaryOp) -> Any:
        value = self._value(expression.operand)
        assert isinstance(expression.op, ast.USub)
        return -value

    def _of_compare(self, expression: ast.Compare) -> Any:
        (relation,), (right,) = expression.ops, expression.comparators
        a, b = self._alike(self._value(expression.left), self._value(right))
        name = RELATIONS[type(relation)]
        return a.compared(name, b) if isinstance(a, Number) else getattr(operator, name)(a, b)

    def _of_boolop(self, expression: ast.BoolOp) -> Any:
        assert isinstance(expression.op, ast.And)
        a, b = map(self._value, expression.values)
        return self.lines.add("i1", f"and i1 {a.text}, {b.text}")

    def _of_ifexp(self, expression: ast.IfExp) -> Any:
        condition = self._value(expression.test)
        if not isinstance(condition, Number):
            return self._value(expression.body if condition else expression.orelse)
        a, b = self._value(expression.body), self._value(expression.orelse)
        type = _common(_type_of(a), _type_of(b))
        return llvm_math.select(condition, self._converted(a, type), self._converted(b, type))

    def _of_attribute(self, expression: ast.Attribute) -> Any:
        array = self._value(expression.value)
        return array.shape if expression.attr == "shape" else self._product(array.shape)

    def _of_subscript(self, expression: ast.Subscript) -> Any:
        found = self._indexed(expression)
        return self._element(found, 0) if isinstance(found, Array) and not found.shape else found

    def _of_call(self, expression: ast.Call) -> Any:
        function = self._value(expression.func)
        given = [self._value(argument) for argument in expression.args]
        return BUILT_IN[function](self, *given) if function in BUILT_IN else self._inline(function, given)

    def _inline(self, function: FunctionType, given: Sequence[Any]) -> Any:
        assert getattr(function, "is_inlined", False), f"{function} is no function of kernels"
        outer, tree = self.frame, _tree(function)
        names = dict(zip((argument.arg for argument in tree.args.args), given, strict=True))
        self.frame = _Frame(names, function.__globals__, self._labelled("end"))
        self._block(tree.body)
        self._label(self.frame.end)
        results = [self._loaded(slot) for slot in self.frame.results or ()]
        self.frame = outer
        return results[0] if len(results) == 1 else tuple(results)

    # --- numbers and arrays

    def _binary(self, operation: Callable[[Any, Any], Any], a: Any, b: Any) -> Any:
        return operation(*self._alike(a, b))

    def _alike(self, a: Any, b: Any) -> tuple[Any, Any]:
        """Constants as they are, else numbers of one type."""
        if not isinstance(a, Number) and not isinstance(b, Number):
            return a, b
        type = _common(_type_of(a), _type_of(b))
        return self._converted(a, type), self._converted(b, type)

    def _converted(self, value: Any, type: str) -> Number:
        if not isinstance(value, Number):
            return llvm_math.constant(value, type, self.lines)
        if value.type == type:
            return value
        return value.cast(CASTS[value.type, type], type)

    def _product(self, lengths: Sequence[Any]) -> Any:
        return reduce(lambda a, b: self._binary(operator.mul, a, b), lengths) if lengths else 1

    def _indexed(self, expression: ast.Subscript) -> Any:
        """A part of an array (no dimensions: one number), or of a tuple."""
        array, index = self._value(expression.value), expression.slice
        if isinstance(array, tuple):
            return array[self._value(index)]
        *rows, last = index.elts if isinstance(index, ast.Tuple) else [index]
        for row in rows:
            array = self._row(array, self._value(row))
        return self._cut(array, last) if isinstance(last, ast.Slice) else self._row(array, self._value(last))

    def _row(self, array: Array, index: Any) -> Array:
        rest = array.shape[1:]
        return Array(
            array.stored, self._place(array, self._binary(operator.mul, index, self._product(rest))), rest
        )

    def _cut(self, array: Array, part: ast.Slice) -> Array:
        first = self._value(part.lower) if part.lower else 0
        last = self._value(part.upper) if part.upper else array.shape[0]
        length = self._binary(operator.sub, last, first)
        start = self._row(array, first).start
        return Array(array.stored, start, (length, *array.shape[1:]))

    def _place(self, array: Array, index: Any) -> Number:
        offset = self._converted(index, "i64").text
        return self.lines.add(
            "ptr", f"getelementptr inbounds {array.stored}, ptr {array.start.text}, i64 {offset}"
        )

    def _element(self, array: Array, index: Any) -> Number:
        number = self.lines.add(array.stored, f"load {array.stored}, ptr {self._place(array, index).text}")
        return self._converted(number, _computed(array.stored))

    # --- functions that kernels may call

    def _extreme(self, choose: Callable[[Any, Any], Any], plain: Callable[..., Any], *values: Any) -> Any:
        if not any(isinstance(value, Number) for value in values):
            return plain(values)
        found = values[0]
        for value in values[1:]:
            found = choose(*self._alike(found, value))
        return found

    def _rounded(self, function: Callable[[Number], Number], value: Number) -> Number:
        return self._converted(function(value), "i64")

    def _empty(self, *shape: int) -> Array:
        place = f"%slot{len(self.slots)}"
        self.slots.append(f"  {place} = alloca [{math.prod(shape)} x float], align 64")
        return Array("float", Number(place, "ptr", self.lines), shape)

    def _call(self, address: Number, arguments: Sequence[Any]) -> None:
        given = [
            f"ptr {value.start.text}"
            if isinstance(value, Array)
            else f"{_type_of(value)} {self._converted(value, _type_of(value)).text}"
            for value in arguments
        ]
        self._line(f"  call void {address.cast('inttoptr', 'ptr').text}({', '.join(given)})")


BUILT_IN: dict[Any, Callable[..., Any]] = {
    min: lambda writer, *values: writer._extreme(llvm_math.minimum, min, *values),
    max: lambda writer, *values: writer._extreme(llvm_math.maximum, max, *values),
    len: lambda writer, array: array.shape[0],
    f32: lambda writer, value: writer._converted(value, "float") if isinstance(value, Number) else f32(value),
    math.floor: lambda writer, value: writer._rounded(llvm_math.floor, value),
    math.ceil: lambda writer, value: writer._rounded(llvm_math.ceil, value),
    empty: _Writer._empty,
    call: _Writer._call,
}
CASTS = {
    ("i1", "i64"): "zext",
    ("i32", "i64"): "sext",
    ("i64", "i32"): "trunc",
    ("i64", "float"): "sitofp",
    ("i64", "double"): "sitofp",
    ("float", "double"): "fpext",
    ("double", "float"): "fptrunc",
    ("float", "i64"): "fptosi",
    ("double", "i64"): "fptosi",
}

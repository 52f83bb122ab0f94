"""Lowering to LLVM's assembly language: expressions become loops over a block of pixels, forward and backward.

What does not depend on the pixel is computed once before the loop, and its derivatives are chained after it.
Everything is float32, and written such that LLVM vectorises the loops: selects instead of branches, no calls,
divisions by what is constant turned into multiplications. This module makes text only; `kernel_cache` compiles it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence

from ..expr import OPERATIONS, Expr, constant
from ..graph import walk
from . import llvm_math
from .block import Block, dependent, derivatives, without_divisions
from .llvm_math import DECLARATIONS, FAST, Lines, Number

Planes = Mapping[str, int]  # pointers by name, and how many rows (a value for each pixel) each points to

SPELLED: dict[str, Callable[..., Number]] = {
    name: eval(f"lambda a, b=None, c=None: {row.python.format('a', 'b', 'c')}", dict(vars(llvm_math)))
    for name, row in OPERATIONS.items()
    if row.python
}


def forward(block: Block, planes: Planes, size: int, carried: Sequence[Expr] = ()) -> str:
    """`void NAME(u, first, last, PLANES…)`: fills the outputs for the pixels from `first` to before `last`.

    The varying inputs and then the outputs are the rows of the planes, each `size` long. With `carried`, as many
    varying inputs as there are outputs: each output replaces its carried input in place, and what was there before
    is kept in the rows of the outputs.
    """
    writer = _Loop(block.uniforms, planes, size)
    inputs, others = writer.rows[: len(block.varying)], writer.rows[len(block.varying) :]
    places = dict(zip(block.varying, inputs, strict=True))
    outputs = without_divisions(block.outputs, block.varying)
    writer.write(outputs, places, keep=carried)
    if carried:
        for row, before in zip(others, carried, strict=True):
            writer.store(row, before)
    for row, output in zip([places[c] for c in carried] or others, outputs, strict=True):
        writer.store(row, output)
    return writer.function(block.name)


def backward(block: Block, planes: Planes, size: int, carried: Sequence[Expr] = ()) -> str:
    """`void NAME_backward(u, first, last, PLANES…, grad)`: the derivatives of Σ cotangentᵢ·outputᵢ.

    The varying inputs and then the cotangents are the rows of the planes. Derivatives by the uniforms are added to
    `grad`; with `carried`, as many varying inputs as there are outputs, those by each of these replace its cotangent.
    """
    found = derivatives(block, carried)
    writer = _Loop(block.uniforms, planes, size)
    places = dict(zip((*block.varying, *found.cotangents), writer.rows, strict=True))
    writer.write((*found.sums, *found.carried), places)
    for cotangent, derivative in zip(found.cotangents, found.carried, strict=False):
        writer.store(places[cotangent], derivative)
    return writer.function(f"{block.name}_backward", found.sums, found.uniforms)


def scalar(name: str, outputs: Sequence[Expr], inputs: Sequence[Expr], uniforms: Sequence[Expr]) -> str:
    """`void NAME(u, given, found)`: the outputs at one point; without `given` where there are no inputs."""
    writer = _Writer(uniforms)
    for index, variable in enumerate(inputs):
        writer.values[variable] = writer.load("given", index)
    writer.take(walk(outputs))
    for index, output in enumerate(outputs):
        writer.store_at("found", str(index), output)
    pointers = ["u", *(["given"] if inputs else []), "found"]
    return _definition(name, _pointers(pointers), [*writer.lines.taken(), "  ret void"])


def assembled(functions: Iterable[str]) -> str:
    """A module of functions."""
    return "\n\n".join([DECLARATIONS, *functions, ""])


class _Writer:
    """Computes nodes, each once; uniforms are read from the row that `u` points to."""

    def __init__(self, uniforms: Sequence[Expr]) -> None:
        self.lines = Lines()
        self.values = {uniform: self.load("u", index) for index, uniform in enumerate(uniforms)}

    def load(self, pointer: str, index: object) -> Number:
        """A number of an array."""
        return self.lines.add("float", f"load float, ptr {self._place(pointer, index)}")

    def store_at(self, pointer: str, index: object, value: Expr | Number) -> None:
        """Into an array."""
        number = value if isinstance(value, Number) else self.value(value)
        place = self._place(pointer, index)
        self.lines.written.append(f"  store float {number.text}, ptr {place}")

    def _place(self, pointer: str, index: object) -> str:
        return self.lines.add("ptr", f"getelementptr inbounds float, ptr %{pointer}, i64 {index}").text

    def value(self, node: Expr) -> Number:
        """Of a constant, or of what has been computed."""
        if node.op == "const":
            return llvm_math.constant(constant(node), "float", self.lines)
        return self.values[node]

    def take(self, nodes: Iterable[Expr]) -> None:
        """Writes what computes those that are not known yet."""
        for node in nodes:
            if node.op != "const" and node not in self.values:
                self.values[node] = SPELLED[node.op](*map(self.value, node.args))


class _Loop(_Writer):
    """A function that loops over pixels."""

    def __init__(self, uniforms: Sequence[Expr], planes: Planes, size: int) -> None:
        super().__init__(uniforms)
        self.uniforms, self.planes = uniforms, planes
        self.rows = [
            self.lines.add("ptr", f"getelementptr inbounds float, ptr %{name}, i64 {size * row}").text[1:]
            for name, count in planes.items()
            for row in range(count)
        ]
        self.before: list[str] = []

    def write(self, roots: Sequence[Expr], places: Mapping[Expr, str], keep: Sequence[Expr] = ()) -> None:
        """What computes the roots: before the loop, and inside; `keep`: inputs to read in any case."""
        nodes = list(walk(roots))
        depends = dependent(roots, places)
        self.take(node for node in nodes if node not in depends)
        self.before = self.lines.taken()
        used = {*nodes, *keep}
        self.values |= {
            variable: self.load(row, "%i") for variable, row in places.items() if variable in used
        }
        self.take(node for node in nodes if node in depends)

    def store(self, row: str, value: Expr) -> None:
        """The pixel's value in a row."""
        self.store_at(row, "%i", value)

    def function(
        self, name: str, sums: Sequence[Expr] = (), derivatives: Sequence[Expr | None] | None = None
    ) -> str:
        """The text; with derivatives, which depend on the variables sum0, sum1, … of these nodes."""
        names = [f"sum{i}" for i in range(len(sums))]
        added = [
            f"  %{s}_next = fadd {FAST} float %{s}, {self.value(node).text}"
            for s, node in zip(names, sums, strict=True)
        ]
        inside = [*self.lines.taken(), *added]
        grads = [] if derivatives is None else ["grad"]
        body = [
            *self.before,
            "  %empty = icmp uge i64 %first, %last",
            "  br i1 %empty, label %after, label %loop",
            "loop:",
            "  %i = phi i64 [ %first, %entry ], [ %next, %loop ]",
            *(f"  %{s} = phi float [ 0.0, %entry ], [ %{s}_next, %loop ]" for s in names),
            *inside,
            "  %next = add nuw nsw i64 %i, 1",
            "  %more = icmp ult i64 %next, %last",
            "  br i1 %more, label %loop, label %after",
            "after:",
            *(f"  %{s}_all = phi float [ 0.0, %entry ], [ %{s}_next, %loop ]" for s in names),
            *self._chained(derivatives or ()),
            "  ret void",
        ]
        pointers = _pointers([*self.planes, *grads])
        return _definition(name, f"{_pointers(['u'])}, i64 %first, i64 %last, {pointers}", body)

    def _chained(self, derivatives: Sequence[Expr | None]) -> list[str]:
        """Adds the derivatives by the uniforms to `grad`."""
        wanted = {index: node for index, node in enumerate(derivatives) if node is not None}
        for node in walk(wanted.values()):
            if node.op == "var" and node not in self.values:
                self.values[node] = Number(f"%{node.payload}_all", "float", self.lines)
        self.take(walk(wanted.values()))
        for index, node in wanted.items():
            self.store_at("grad", index, self.load("grad", index) + self.value(node))
        return self.lines.taken()


def _pointers(names: Sequence[str]) -> str:
    """Nothing that one of them points to is reached by another."""
    return ", ".join(f"ptr noalias %{name}" for name in names)


def _definition(name: str, arguments: str, body: Sequence[str]) -> str:
    return "\n".join([f"define void @{name}({arguments}) {{", "entry:", *body, "}"])

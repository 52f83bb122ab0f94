"""What a row of the table of operations holds: types, and how it is spelled in every target.

Shader languages need to know how tightly a spelling binds; the others get a plain format text.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .expr import Expr, Operand


class Type(Enum):
    """Type of an expression; the value is its GLSL name."""

    BOOL = "bool"
    FLOAT = "float"
    VEC2 = "vec2"
    VEC3 = "vec3"
    VEC4 = "vec4"

    def __init__(self, name: str) -> None:
        self.width = {"vec2": 2, "vec3": 3, "vec4": 4}.get(name, 1)  # scalar components

    __hash__ = object.__hash__  # an Enum's own hashes its name anew each time


BOOL, FLOAT, VEC2, VEC3, VEC4 = Type
VECTOR = {1: FLOAT, 2: VEC2, 3: VEC3, 4: VEC4}
COMPONENTS = "xyzw"


# --- rows --------------------------------------------------------------------------------------------------

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
    python: str | None = None
    triton: str | None = None
    javascript: str | None = None
    value: Callable[..., float] | None = None
    partials: Callable[..., tuple[Operand | None, ...]] | None = None
    expand: Callable[..., tuple[Expr, ...]] | None = None
    domain: str = "all"


def widest(types: Sequence[Type]) -> Type:
    """Floats broadcast to the one vector type present."""
    vectors = set(types) - {FLOAT}
    if len(vectors) > 1 or BOOL in vectors:
        raise TypeError(f"types do not fit: {[type.value for type in types]}")
    return vectors.pop() if vectors else FLOAT


def equal(types: Sequence[Type]) -> Type:
    if len(set(types)) > 1 or BOOL in types:
        raise TypeError(f"types must be equal: {[type.value for type in types]}")
    return types[0]


def compared(types: Sequence[Type]) -> Type:
    if set(types) != {FLOAT}:
        raise TypeError(f"only floats compare, got {[type.value for type in types]}")
    return BOOL


def chosen(types: Sequence[Type]) -> Type:
    if types[0] is not BOOL:
        raise TypeError("select takes a bool first")
    return equal(types[1:])


def blended(types: Sequence[Type]) -> Type:
    if types[2] is not FLOAT:
        raise TypeError("mix takes a float last")
    return equal(types[:2])


def reduced(types: Sequence[Type]) -> Type:
    if equal(types).width == 1:
        raise TypeError("takes vectors")
    return FLOAT


def joined(width: int, types: Sequence[Type]) -> Type:
    if list(types) != [FLOAT] and sum(type.width for type in types) != width:
        raise TypeError(f"{width} components wanted, got {[type.value for type in types]}")
    return VECTOR[width]


def arithmetic(symbol: str) -> Cell:
    return Cell(f"{{0}} {symbol} {{1}}", PRECEDENCE[symbol])


def call(name: str, arity: int = 1) -> Cell:
    return Cell(f"{name}({', '.join(f'{{{i}}}' for i in range(arity))})")


def both(cell: Cell) -> tuple[Cell, Cell]:
    """GLSL and WGSL agree."""
    return cell, cell

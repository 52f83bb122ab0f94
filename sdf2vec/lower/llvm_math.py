"""Numbers of LLVM instructions: arithmetic with them writes the text of the instructions that compute it.

The functions are those of the table of operations, for float32, in arithmetic that LLVM vectorises.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Sequence
from dataclasses import dataclass, field

FAST = "reassoc nsz arcp contract afn"
FLOATS = ("float", "double")
DECLARATIONS = "\n".join(
    f"declare {type} @llvm.{name}.{suffix}({type})"
    for type, suffix in (("float", "f32"), ("double", "f64"))
    for name in ("ceil", "floor", "sqrt")
)


@dataclass
class Lines:
    """The instructions of a function so far; each result has a name of its own."""

    written: list[str] = field(default_factory=list)
    count: int = 0

    def add(self, type: str, instruction: str) -> Number:
        """The result of one more instruction."""
        self.count += 1
        self.written.append(f"  %t{self.count} = {instruction}")
        return Number(f"%t{self.count}", type, self)

    def taken(self) -> list[str]:
        """What has been written since this was last asked for."""
        taken, self.written = self.written, []
        return taken


@dataclass(frozen=True)
class Number:
    """A result or a constant: float, double, i64, i32 or i1 (and ptr, with which nothing is computed)."""

    text: str
    type: str
    lines: Lines

    def __add__(self, other: Number | float) -> Number:
        return self._with("fadd", "add", other)

    def __sub__(self, other: Number | float) -> Number:
        return self._with("fsub", "sub", other)

    def __mul__(self, other: Number | float) -> Number:
        return self._with("fmul", "mul", other)

    def __truediv__(self, other: Number | float) -> Number:
        return self._with("fdiv", "", other)

    def __floordiv__(self, other: Number | float) -> Number:
        return self._with("", "sdiv", other)

    def __mod__(self, other: Number | float) -> Number:
        return self._with("", "srem", other)

    def __rshift__(self, other: int) -> Number:
        return self._with("", "ashr", other)

    def __rsub__(self, other: float) -> Number:
        return self.like(other) - self

    __radd__, __rmul__ = __add__, __mul__

    def __neg__(self) -> Number:
        if self.type in FLOATS:
            return self.lines.add(self.type, f"fneg {FAST} {self.type} {self.text}")
        return self.like(0) - self

    def __lt__(self, other: Number | float) -> Number:
        return self.compared("lt", other)

    def __gt__(self, other: Number | float) -> Number:
        return self.compared("gt", other)

    def compared(self, relation: str, other: Number | float) -> Number:
        """By lt, le, gt, ge, eq or ne."""
        if self.type in FLOATS:
            name = f"fcmp {FAST} {'u' if relation == 'ne' else 'o'}{relation}"
        else:
            name = f"icmp {relation if relation in ('eq', 'ne') else 's' + relation}"
        return self.lines.add("i1", f"{name} {self.type} {self.text}, {self.like(other).text}")

    def like(self, value: Number | float) -> Number:
        """A constant of this type."""
        if isinstance(value, Number):
            assert value.type == self.type, (value.type, self.type)
            return value
        return constant(value, self.type, self.lines)

    def _with(self, of_floats: str, of_integers: str, other: Number | float) -> Number:
        name = f"{of_floats} {FAST}" if self.type in FLOATS else of_integers
        return self.lines.add(self.type, f"{name} {self.type} {self.text}, {self.like(other).text}")

    def cast(self, name: str, type: str) -> Number:
        """In another type."""
        return self.lines.add(type, f"{name} {self.type} {self.text} to {type}")


def constant(value: float, type: str, lines: Lines) -> Number:
    """LLVM reads a float32 by the bits of the double that is equal to it."""
    if type not in FLOATS:
        return Number(str(int(value)), type, lines)
    if type == "float":
        (value,) = struct.unpack("f", struct.pack("f", value))
    return Number(f"0x{struct.pack('>d', value).hex().upper()}", type, lines)


# --- functions ----------------------------------------------------------------------------------------------


def select(condition: Number, a: Number, b: Number) -> Number:
    """a where the condition holds, else b."""
    return a.lines.add(a.type, f"select i1 {condition.text}, {a.type} {a.text}, {b.type} {b.text}")


def minimum(a: Number, b: Number | float) -> Number:
    """The second one of equal ones."""
    return select(a < b, a, a.like(b))


def maximum(a: Number, b: Number | float) -> Number:
    """The second one of equal ones."""
    return select(a > b, a, a.like(b))


def absolute(x: Number) -> Number:
    """0 counts as negative."""
    return select(x > 0.0, x, -x)


def sqrt(x: Number) -> Number:
    """0 for what is below 0."""
    return _called("sqrt", maximum(x, 0.0))


def floor(x: Number) -> Number:
    """The next whole number below."""
    return _called("floor", x)


def ceil(x: Number) -> Number:
    """The next whole number above."""
    return _called("ceil", x)


def _called(name: str, x: Number) -> Number:
    suffix = "f32" if x.type == "float" else "f64"
    return x.lines.add(x.type, f"call {FAST} {x.type} @llvm.{name}.{suffix}({x.type} {x.text})")


def polynomial(x: Number, coefficients: Sequence[float]) -> Number:
    """The constant first."""
    value = x.like(coefficients[-1])
    for coefficient in coefficients[-2::-1]:
        value = coefficient + x * value
    return value


TANH_SPAN = 7.90531110763549805  # beyond it the tangent is 1
TANH_OVER = (
    4.89352455891786e-03,
    6.37261928875436e-04,
    1.48572235717979e-05,
    5.12229709037114e-08,
    -8.60467152213735e-11,
    2.00018790482477e-13,
    -2.76076847742355e-16,
)
TANH_UNDER = (4.89352518554385e-03, 2.26843463243900e-03, 1.18534705686654e-04, 1.19825839466702e-06)


def sigmoid(x: Number) -> Number:
    """A rational hyperbolic tangent of degrees 13 and 6, accurate to a few units in the last place."""
    t = maximum(minimum(0.5 * x, TANH_SPAN), -TANH_SPAN)
    q = t * t
    return 0.5 + 0.5 * (t * polynomial(q, TANH_OVER)) / polynomial(q, TANH_UNDER)


TURN_HIGH, TURN_LOW = 6.28125, 0.0019353071795864769
SINE = (1.0, -1 / 6, 1 / 120, -1 / 5040, 1 / 362880, -1 / 39916800)


def sin(x: Number) -> Number:
    """Sine by reduction to half a turn and a polynomial of degree 11."""
    k = floor(x * (0.5 / math.pi) + 0.5)
    r = (x - k * TURN_HIGH) - k * TURN_LOW
    r = select(r > math.pi / 2, math.pi - r, r)
    r = select(r < -math.pi / 2, -math.pi - r, r)
    return r * polynomial(r * r, SINE)


def cos(x: Number) -> Number:
    """A quarter of a turn farther."""
    return sin(x + math.pi / 2)


MANTISSA, BIAS = 23, 127  # a float32 is m · 2ⁿ: bits of m; what is added to n
ROOT_HALF = 0x3F3504F3  # bits of √½
LOWEST, HIGHEST, LEAST = -87.0, 88.0, 1e-30
EXPONENTIAL = tuple(1 / math.factorial(n) for n in range(7))
TANGENT = (1.0, 1 / 3, 1 / 5, 1 / 7, 1 / 9)


def exp(x: Number) -> Number:
    """Exponential by a polynomial of degree 6 on ±ln √2 and a power of 2; constant below −87 and above 88."""
    x = minimum(maximum(x, LOWEST), HIGHEST)
    n = floor(x * (1 / math.log(2)) + 0.5)
    power = ((n.cast("fptosi", "i32") + BIAS) * (1 << MANTISSA)).cast("bitcast", "float")
    return power * polynomial(x - n * math.log(2), EXPONENTIAL)


def log(x: Number) -> Number:
    """Natural logarithm by the series of the inverse hyperbolic tangent; for x below 1e-30, of that."""
    bits = maximum(x, LEAST).cast("bitcast", "i32")
    n = (bits - ROOT_HALF) >> MANTISSA
    m = (bits - n * (1 << MANTISSA)).cast("bitcast", "float")  # in √½..√2
    s = (m - 1.0) / (m + 1.0)
    return n.cast("sitofp", "float") * math.log(2) + 2.0 * s * polynomial(s * s, TANGENT)

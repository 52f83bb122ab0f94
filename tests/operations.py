"""What every operation of the table means, written down a second time in numpy, and inputs that are hard."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from sdf2vec import expr
from sdf2vec.expr import Expr, operation, vec2, vec3, vec4

HARD = [0.0, -0.0, 1.0, -1.0, 0.5, -2.5, 1e-7, -1e-7, 1e-3, 3e4, -3e4]
TIES = [(0.0, 0.0), (-0.0, 0.0), (1.5, 1.5), (-2.0, -2.0)]
SMOOTH = [0.7, -1.3, 2.1, 0.11, -0.4]  # no ties among them, no kinks near them


@dataclass(frozen=True)
class Meaning:
    """`build` makes the expression from float arguments, `value` computes it; `cases` are argument rows."""

    arity: int
    build: Callable[..., Expr]
    value: Callable[..., object]
    cases: Sequence[tuple[float, ...]]
    kinks: bool = False


def _pairs(values: Sequence[float]) -> Sequence[tuple[float, ...]]:
    return [(a, b) for a in values for b in values] + TIES


def _singles(values: Sequence[float]) -> list[tuple[float, ...]]:
    return [(a,) for a in values]


def _rotations(count: int, values: list[float]) -> list[tuple[float, ...]]:
    return [
        tuple(values[(start + 3 * i) % len(values)] for i in range(count)) for start in range(len(values))
    ]


def _op(name: str) -> Callable[..., Expr]:
    return lambda *args: operation(name, *args)


NONZERO = [1.0, -1.0, 0.5, -2.5, 1e-3, -1e-3, 3e4]
NOT_NEGATIVE = [0.0, -0.0, 1e-12, 1e-6, 0.25, 1.0, 2.0, 3e4, 1e12]
ANGLES = [0.0, -0.0, 1e-6, 0.5, -1.0, 3.1415927, -6.0, 60.0, -60.0]

MEANINGS: dict[str, Meaning] = {
    "add": Meaning(2, _op("add"), np.add, _pairs(HARD)),
    "sub": Meaning(2, _op("sub"), np.subtract, _pairs(HARD)),
    "mul": Meaning(2, _op("mul"), np.multiply, _pairs(HARD)),
    "div": Meaning(2, _op("div"), np.divide, [(a, b) for a in HARD for b in NONZERO]),
    "neg": Meaning(1, _op("neg"), np.negative, _singles(HARD)),
    "abs": Meaning(1, _op("abs"), np.abs, _singles(HARD), kinks=True),
    "min": Meaning(2, _op("min"), np.minimum, _pairs(HARD), kinks=True),
    "max": Meaning(2, _op("max"), np.maximum, _pairs(HARD), kinks=True),
    "clamp": Meaning(
        3,
        _op("clamp"),
        lambda x, low, high: np.minimum(np.maximum(x, low), high),
        [(x, low, high) for x in HARD for low, high in ((0.0, 1.0), (-1.0, 0.5), (0.5, 0.5), (-1e-7, 3e4))],
        kinks=True,
    ),
    "sqrt": Meaning(1, _op("sqrt"), np.sqrt, _singles(NOT_NEGATIVE)),
    "exp": Meaning(1, _op("exp"), np.exp, _singles([0.0, -0.0, 1.0, -1.0, 1e-6, 20.0, -20.0, -3e4])),
    "log": Meaning(
        1,
        _op("log"),
        lambda a: np.log(np.maximum(a, 1e-30)),
        _singles([0.0, -0.0, 1e-12, 0.3, 1.0, 2.0, 3e4]),
    ),
    "sin": Meaning(1, _op("sin"), np.sin, _singles(ANGLES)),
    "cos": Meaning(1, _op("cos"), np.cos, _singles(ANGLES)),
    "sigmoid": Meaning(
        1, _op("sigmoid"), lambda a: 0.5 + 0.5 * np.tanh(0.5 * a), _singles([*HARD, 5.0, -5.0, 90.0, -90.0])
    ),
    "less": Meaning(
        2, lambda a, b: expr.select(operation("less", a, b), 1.0, 0.0), np.less, _pairs(HARD), kinks=True
    ),
    "select": Meaning(
        4,
        lambda a, b, x, y: expr.select(operation("less", a, b), x, y),
        lambda a, b, x, y: np.where(a < b, x, y),
        [(*pair, 2.0, -3.0) for pair in _pairs([0.0, 1.0, -1e-7])],
        kinks=True,
    ),
    "fixed": Meaning(1, _op("fixed"), lambda a: a, _singles(HARD)),
    "mix": Meaning(
        5,
        lambda a, b, c, d, t: operation("mix", vec2(a, b), vec2(c, d), t),
        lambda a, b, c, d, t: [a * (1 - t) + c * t, b * (1 - t) + d * t],
        [(*row[:4], t) for row in _rotations(4, HARD[:9]) for t in (0.0, 1.0, 0.25)],
    ),
    "dot": Meaning(
        4,
        lambda a, b, c, d: operation("dot", vec2(a, b), vec2(c, d)),
        lambda a, b, c, d: a * c + b * d,
        _rotations(4, HARD),
    ),
    "length": Meaning(
        2,
        lambda a, b: operation("length", vec2(a, b)),
        np.hypot,
        _pairs([0.0, -0.0, 1.0, -2.5, 1e-7, 3e4]),
    ),
    "vec2": Meaning(2, vec2, lambda *parts: list(parts), _rotations(2, HARD)),
    "vec3": Meaning(3, vec3, lambda *parts: list(parts), _rotations(3, HARD)),
    "vec4": Meaning(4, vec4, lambda *parts: list(parts), _rotations(4, HARD)),
}


def expected(meaning: Meaning, cases: np.ndarray) -> np.ndarray:
    """[components, cases] in float64."""
    with np.errstate(all="ignore"):
        value = meaning.value(*cases.astype(np.float64).T)
    return np.atleast_2d(np.array(value, dtype=np.float64))

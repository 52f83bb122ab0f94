"""A scene's numbers as constant expressions."""

from __future__ import annotations

from ..expr import Expr, const, vec2
from ..scene import Shape


def constants(shape: Shape) -> list[Expr]:
    """The shape's parameters as constants, in the order that its kind's formulas take them."""
    values = shape.named().values()
    return [vec2(*map(const, value)) if isinstance(value, tuple) else const(value) for value in values]

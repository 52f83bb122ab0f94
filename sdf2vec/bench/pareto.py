"""Which points of a chart nothing else beats."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple


class Point(NamedTuple):
    """What a run costs, the less the better, and what it brings; `name`: the method, and its number of shapes."""

    cost: float
    value: float
    name: str
    family: str


def front(points: Sequence[Point], lower_is_better: bool) -> list[Point]:
    """The points for which no other costs no more and is better, the cheapest first."""
    sign = -1.0 if lower_is_better else 1.0
    kept: list[Point] = []
    for point in sorted(points, key=lambda p: (p.cost, -sign * p.value)):
        if not kept or sign * point.value > sign * kept[-1].value:
            kept.append(point)
    return kept

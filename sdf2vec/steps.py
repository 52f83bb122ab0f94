"""Numbers that can be written: those at the steps of a scale, linear in their roots."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

from .layer import Slot
from .units import ANGLE, Unit

if TYPE_CHECKING:
    from .render.tensors import Group


class Steps(NamedTuple):
    """The root of step 0, how far steps are apart, the first and the last one: of all numbers or of each."""

    start: Any
    width: Any
    least: Any = -math.inf
    most: Any = math.inf

    @classmethod
    def between(cls, start: Any, end: Any, most: Any) -> Steps:
        """Those from one root to another, `most` after the first; one where both are the same."""
        width = (end - start) / most
        return cls(start, width + (width == 0.0), 0.0, most * (width != 0.0))

    def nearest(self, values: Any, unit: Unit) -> Any:
        """The numbers [G, width] at the steps nearest to some; tensors."""
        around = values % math.tau if unit is ANGLE else values
        steps = (
            ((unit.codec.root(around) - self.start) / self.width)
            .round()
            .clip(min=self.least)
            .clip(max=self.most)
        )
        return unit.codec.value(self.start + steps * self.width)


StepsOf = Callable[
    ["Group"], Mapping[Slot, Steps]
]  # what can be written of a group's numbers, all that is not free

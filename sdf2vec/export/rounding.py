"""How finely an export says numbers, for so much of a scene's picture.

An error of rounding falls by half with every bit, so that looking once at each sort of numbers tells how many bits
each wants: such that one bit less would cost all the same (Lagrange).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import product
from typing import TYPE_CHECKING, NamedTuple

from ..deferred import deferred
from ..scene import Scene
from ..steps import StepsOf
from .exported import Exported

if TYPE_CHECKING:
    from ..arrays import Float32Array

glance: Callable[[Scene], Float32Array] = deferred("sdf2vec.render.draw", "glance")  # torch

FINEST, COARSEST = 56.0, 16.0  # dB that a rounded scene may be asked to be from its render
Bits = Mapping[str, int]  # by precision


class Rounded(NamedTuple):
    """An export whose numbers are so coarse: which of a scene's numbers can be written; what writes such a scene, and
    says which scene is read back.
    """

    steps_of: StepsOf
    write: Callable[[Scene], tuple[Exported, Scene]]


Rounding = Callable[[float], Rounded]  # for so many dB from the render, about, where numbers are only rounded


@dataclass(frozen=True)
class Chooser:
    """What each precision's rounding costs. `counts`: how many numbers it has. `errors`: the mean squared error of the
    picture where it has the bits `looked_at`, and all others are fine.
    """

    counts: Mapping[str, int]
    errors: Mapping[str, float]
    looked_at: Bits
    least: Bits
    most: Bits

    @classmethod
    def of(
        cls,
        scene: Scene,
        counts: Mapping[str, int],
        said: Callable[[Bits], Scene],
        looked_at: Bits,
        least: Bits,
        most: Bits,
    ) -> Chooser:
        """By looking at what a scene becomes with some bits."""
        wanted = glance(scene)

        def error(name: str) -> float:
            wrong = glance(said({**most, name: looked_at[name]})) - wanted
            return float((wrong * wrong).mean())

        return cls(counts, {name: error(name) for name in counts}, looked_at, least, most)

    def bits(self, aim: float) -> dict[str, int]:
        """The bits of each precision for so many dB, where numbers are rounded to the nearest step."""
        allowed = 10.0 ** (-aim / 10.0)
        each = allowed / max(1, sum(self.counts.values()))
        choices = {name: [least] for name, least in self.least.items()}
        for name, error in self.errors.items():
            even = self.looked_at[name] + 0.5 * math.log2(max(error, 1e-20) / (each * self.counts[name]))
            around = (math.floor(even) + more for more in (-1, 0, 1, 2))
            choices[name] = sorted({min(max(bits, self.least[name]), self.most[name]) for bits in around})
        tried = [dict(zip(choices, bits, strict=True)) for bits in product(*choices.values())]
        enough = [bits for bits in tried if self._expected(bits) <= allowed]
        return min(enough or tried[-1:], key=lambda bits: (self._cost(bits), self._expected(bits)))

    def _expected(self, bits: Bits) -> float:
        return sum(error * 4.0 ** (self.looked_at[name] - bits[name]) for name, error in self.errors.items())

    def _cost(self, bits: Bits) -> int:
        return sum(count * bits[name] for name, count in self.counts.items())

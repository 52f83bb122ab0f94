"""What happens in a fit, as data: a preset says how shapes start and which phases follow."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Literal

Loss = tuple[tuple[str, float], ...]  # name in `losses.LOSSES`, weight

MANY = 256  # shapes beyond which the phases' resolution grows
SOFTEST = 1.5  # falloff of any shape, in scene units
DOUBLINGS = 5  # of the number of layers, at most: 2048 that began with 16 ended farther from the picture
STARTS, SCARCE = (
    4,
    64,
)  # starts that are tried, at most; and times the layers: below, chance decides how near they come
GRADED = 1.5  # times the steps where shapes have gradients: half as many numbers again
CROWDING = 0.35  # rates of layers fall with this power of their number

L1: Loss = (("l1", 1.0),)
MSE: Loss = (("mse", 1.0),)


@dataclass(frozen=True)
class Relocation:
    """Every so many steps a share of the layers, those that matter least, moves to where most is missing.

    `until`: the share of the phase after which everything stays.
    """

    every: int
    share: float
    until: float = 0.8

    def is_due(self, step: int, steps: int) -> bool:
        """Whether it happens before this step of so many."""
        return step % self.every == self.every // 2 and step < steps * self.until


@dataclass(frozen=True)
class Growth:
    """A fit begins with `first` layers, or half of all if that is fewer; every so many steps there are twice as many.

    Until all are there, after five times at most; sooner where the phase would end before that.
    """

    first: int
    every: int

    def count(self, step: int, steps: int, full: int) -> int:
        """How many layers of `full` there are to be at this step of a phase of so many."""
        first = max(1, min(self.first, full // 2), full >> DOUBLINGS)
        doublings = max(0, math.ceil(math.log2(full / first)))
        every = min(self.every, steps // (doublings + 1))
        return full if step >= doublings * every else first << step // every


@dataclass(frozen=True)
class Phase:
    """A stretch of the fit at one resolution.

    `resolution`: the picture is scaled down to about this many pixels squared; below 1, to this share of its
    sides. `rate` and `end_rate` scale all learning rates at the start and at the end, along half a cosine. With
    `batches`, the layers are trained in so many parts, one after the other, each for all steps, the others frozen.
    """

    name: str
    steps: int
    resolution: float
    rate: float = 1.0
    end_rate: float = 1.0
    loss: Loss = L1
    relocation: Relocation | None = None
    growth: Growth | None = None
    batches: int = 1

    @property
    def total(self) -> int:
        """Steps of all batches."""
        return self.steps * self.batches

    @property
    def slows(self) -> bool:
        """Whether its steps become short at its end."""
        return self.end_rate < 0.5 * self.rate

    def rates(self) -> Iterator[float]:
        """The factor on all rates at each step."""
        for step in range(self.steps):
            fall = 0.5 - 0.5 * math.cos(math.pi * step / max(1, self.steps - 1))
            yield self.rate + (self.end_rate - self.rate) * fall


@dataclass(frozen=True)
class Start:
    """How shapes start: where the picture has detail, or anywhere; in its colours, or in black (under additive).

    `falloff`: in scene units, or None for a share of each shape's size.
    """

    spread: Literal["detail", "uniform"] = "detail"
    colors: Literal["picture", "zero"] = "picture"
    falloff: float | None = None


@dataclass(frozen=True)
class Preset:
    """A whole fit. `compositing`: the only one that it is for; `falloff`: its range in scene units;
    `least_area`: of a shape, in shares of the canvas; smaller ones are pushed to grow; `sharpens`: whether the
    phases' resolution grows with the number of shapes; `searches`: whether those of a drawing are looked for where
    more than a few are told.
    """

    phases: tuple[Phase, ...]
    start: Start = Start()
    compositing: str | None = None
    falloff: tuple[float, float] = (0.0, SOFTEST)
    least_area: float = 0.0
    sharpens: bool = True
    searches: bool = True

    def resolution(self, phase: Phase, shapes: int) -> float:
        """A phase's resolution for so many shapes: what is drawn with many needs more pixels to tell them apart."""
        if not self.sharpens or phase.resolution < 1:
            return phase.resolution
        return phase.resolution * math.sqrt(math.sqrt(max(1.0, shapes / MANY)))

    def starts(self, layers: int) -> int:
        """From how many starts the first phase is tried: what few layers find is much of it chance."""
        return max(1, min(STARTS, SCARCE // max(1, layers))) if self.phases[0].growth else 1

    @property
    def steps(self) -> int:
        """Steps of all phases."""
        return sum(phase.total for phase in self.phases)

    def paced(self, steps: float = 1.0, rate: float = 1.0) -> Preset:
        """The same with so many times the steps, at so many times the rates."""

        def phase(of: Phase) -> Phase:
            count = max(1, round(of.steps * steps))
            growth = of.growth and replace(of.growth, every=max(1, round(of.growth.every * steps)))
            return replace(of, steps=count, rate=of.rate * rate, end_rate=of.end_rate * rate, growth=growth)

        return replace(self, phases=tuple(map(phase, self.phases)))


L1_MSE: Loss = (("l1", 1.0), ("mse", 10.0))
L1_MSE_FLIP: Loss = (("l1", 1.0), ("mse", 5.0), ("flip", 0.4))
OFTEN = Relocation(every=25, share=0.05)

PRESETS: dict[str, Preset] = {
    "fast": Preset(
        (
            Phase("coarse", 200, 80, relocation=OFTEN, growth=Growth(16, 25)),
            Phase("middle", 120, 144, rate=0.8, end_rate=0.6, relocation=OFTEN),
            Phase("fine", 60, 256, rate=0.6, end_rate=0.03, loss=L1_MSE),
        ),
        searches=False,
    ),
    "balanced": Preset(
        (
            Phase("coarse", 300, 96, relocation=OFTEN, growth=Growth(16, 40)),
            Phase("middle", 400, 176, rate=0.8, end_rate=0.6, loss=L1_MSE, relocation=OFTEN),
            Phase("fine", 110, 320, rate=0.6, end_rate=0.2, loss=L1_MSE),
            Phase("finish", 50, 512, rate=0.2, end_rate=0.02, loss=L1_MSE_FLIP),
        )
    ),
    "best": Preset(
        (
            Phase("coarse", 600, 96, relocation=OFTEN, growth=Growth(16, 40)),
            Phase("middle", 800, 192, rate=0.8, end_rate=0.6, loss=L1_MSE, relocation=OFTEN),
            Phase("fine", 300, 512, rate=0.6, end_rate=0.2, loss=L1_MSE),
            Phase("finish", 100, 512, rate=0.2, end_rate=0.02, loss=L1_MSE_FLIP),
        )
    ),
    # Of the thesis. It leaves open: where shapes start (anywhere), how soft they are then (a twentieth of the shortest
    # side: where wide ones all lie on each other, many never come apart), the size of a batch (a quarter of the
    # layers), the least area of its constraint (that of a disc of a hundredth of the canvas' side), and Adam's rates
    # (ours).
    "thesis": Preset(
        (
            Phase("global", 600, 128, loss=MSE),
            Phase("batches", 200, 0.5, rate=0.5, end_rate=0.05, loss=MSE, batches=4),
        ),
        Start("uniform", "zero", 0.05),
        compositing="additive",
        falloff=(0.01, 0.99),
        sharpens=False,
        least_area=3e-4,
    ),
}
DEFAULT = "balanced"

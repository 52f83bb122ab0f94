"""Where layers are cut into runs that are each blurred as one: where their softness changes most."""

from __future__ import annotations

import math

import numpy as np
import torch

from ..arrays import Float64Array
from ..blend import EDGE_DEVIATION
from ..grain import Run
from ..render.runs import NONE, Runs
from ..render.tensors import SceneTensors

RATE = 0.01  # of Adam, on logarithms of standard deviations
ALIKE = math.log(1.25)  # between two logarithms of standard deviations
LEAST = 0.95  # pixels: browsers draw narrower blurs each in its own way,
SHARP = 0.5 * (NONE + LEAST)  # or sharp, which these hardly are
WIDEST = 0.08  # scene units: librsvg draws nothing beyond the edge, and what is wider fades there


class Softening:
    """The runs of a scene while it descends; `is_free` while their standard deviations do so too."""

    def __init__(self, counts: list[int], deviations: list[float], pixel: float) -> None:
        self.counts, self.pixel, self.is_free = counts, pixel, True
        self.logs = torch.tensor(deviations).log()

    @classmethod
    def of(cls, tensors: SceneTensors, pixel: float, most: int) -> Softening:
        """At most so many runs of a scene's layers, by their falloffs; `pixel` in scene units."""
        order = torch.cat([group.order for group in tensors.groups]).argsort()
        falloffs = torch.cat([group.falloff[:, 0] for group in tensors.groups])[order]
        logs = (EDGE_DEVIATION * falloffs).clamp(NONE * pixel, WIDEST).log().double().numpy()
        counts = cut(logs, most)
        parts = np.split(logs, np.cumsum(counts)[:-1])
        return cls(counts, [float(np.exp(part.mean())) for part in parts], pixel)

    @property
    def sharpest(self) -> float:
        """The least standard deviation in pixels."""
        return float(self.logs.detach().exp().min()) / self.pixel

    @property
    def runs(self) -> Runs:
        """As they are now; differentiable in `logs`."""
        return Runs(self.counts, self.logs.exp())

    def settle(self) -> None:
        """Joins runs of about the same blur, and moves these to where renderers draw them about alike."""
        found = self.logs.tolist()
        counts, logs = self.counts[:1], found[:1]
        for count, log in zip(self.counts[1:], found[1:], strict=True):
            if abs(log - logs[-1]) < ALIKE:
                logs[-1] = (counts[-1] * logs[-1] + count * log) / (counts[-1] + count)
                counts[-1] += count
            else:
                counts, logs = [*counts, count], [*logs, log]
        pixels = torch.tensor(logs).exp() / self.pixel
        near = torch.where(pixels < SHARP, pixels, pixels.clamp(min=LEAST))
        near = torch.where(pixels < NONE, 0.0, near)
        self.counts, self.logs, self.is_free = counts, (near * self.pixel).log(), False

    @property
    def ended(self) -> tuple[Run, ...]:
        """What has come of them."""
        pairs = zip(self.counts, self.logs.exp().tolist(), strict=True)
        return tuple(Run(count, deviation) for count, deviation in pairs)


def cut(values: Float64Array, most: int) -> list[int]:
    """The lengths of at most so many runs of values [N], of which each is nearest to its mean: least squares, exactly.

    By dynamic programming (Fisher 1958).
    """
    count = len(values)
    sums, squares = (np.concatenate([[0.0], np.cumsum(power)]) for power in (values, values**2))
    first, last = np.arange(count + 1)[:, None], np.arange(count + 1)
    with np.errstate(divide="ignore", invalid="ignore"):
        off = (squares - squares[:, None]) - (sums - sums[:, None]) ** 2 / (last - first)
    off = np.where(last > first, np.maximum(off, 0.0), np.inf)  # of a run from one place to another
    best, begins = off[0], list[np.ndarray]()
    for _ in range(min(most, count) - 1):
        through = best[:, None] + off
        begins.append(through.argmin(axis=0))
        best = through.min(axis=0)
    ends = [count]
    for begin in reversed(begins):
        ends.append(int(begin[ends[-1]]))
    return np.diff([0, *reversed(ends)]).tolist() if count else []

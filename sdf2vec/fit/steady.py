"""What keeps a descent from running away: a step that would is taken back, and all that follow are smaller."""

from __future__ import annotations

import math
import warnings

import torch

from ..errors import Sdf2vecWarning
from ..render.tensors import SceneTensors
from .adam import Adam
from .losses import Objective

KEEP_EVERY = 10  # steps
RUNS_AWAY = 1.5  # times the least loss kept; at the presets' rates, 1.1 was the most seen
MATTERS = 0.1  # of a bare ground's loss: what is below it may rise and fall
HARDLY_SEEN = 0.03  # of white, by which all pixels are off: what is below that loss may, too
SLOWER = 0.5
AGREES = 0.15  # cosine; at the presets' rates 24 shapes and more never reached it, at a third of them all did
LATELY = 0.1  # share of the present step in what is known of the agreement
LONGER, LONGEST = 1.05, 10.0  # factors on the rates
SAID = 4  # steps taken back that are worth a word: the first with few shapes often is


class Steady:
    """The last good state of a scene, and by how much steps are to be smaller than planned."""

    def __init__(self) -> None:
        self.rate, self.taken_back, self.dropped = 1.0, 0, 0
        self.stride, self.longest, self.agreement = 1.0, LONGEST, 0.0
        self.begin(0.0)

    @property
    def factor(self) -> float:
        """On all rates."""
        return self.rate * self.stride

    def begin(self, small: float) -> None:
        """A stretch with a loss of its own: up to so much it may rise and fall."""
        self.small = small
        self.rate = min(1.0, self.rate / SLOWER)
        self.forget()

    def forget(self) -> None:
        """The layers are about to change: what was kept no longer fits them."""
        self.kept: list[tuple[torch.Tensor, torch.Tensor]] = []
        self.loss, self.age = math.inf, 0

    def holds(self, loss: float, scene: SceneTensors, optimizer: Adam) -> bool:
        """Whether a state with this loss may stay; else the scene is what it was, and steps become smaller."""
        if self._is_fine(loss):
            if self.age % KEEP_EVERY == 0 and loss <= self.loss:
                self._keep(loss, scene)
            self.age += 1
            return True
        self._go_back(optimizer)
        return False

    def _is_fine(self, loss: float) -> bool:
        if not math.isfinite(loss):
            return not self.kept
        small = self.small if self.stride == 1.0 else 0.0
        return loss <= max(RUNS_AWAY * self.loss, small)

    def _keep(self, loss: float, scene: SceneTensors) -> None:
        tensors = [scene.background, *(t for group in scene.groups for t in group.values.values())]
        self.loss, self.kept = loss, [(tensor, tensor.detach().clone()) for tensor in tensors]

    @torch.no_grad()
    def _go_back(self, optimizer: Adam) -> None:
        for tensor, good in self.kept:
            tensor.copy_(good)
        optimizer.forget()
        if self.stride > 1.0:
            self.stride, self.longest = 1.0, math.sqrt(self.stride)
            return
        self.rate *= SLOWER
        self.taken_back += 1

    def lengthen(self, agreement: float, rate: float) -> None:
        """Longer steps, where the slope hardly turns from one to the next (`Adam.agreement`); up to those at the units'
        own rates.

        Beyond them shapes vanish before they find what they are for: of letters, whose slopes agree at any rate.
        """
        self.agreement += LATELY * (agreement - self.agreement)
        if self.agreement > AGREES and self.stride * rate < 1.0:
            self.stride = min(self.longest, self.stride * LONGER)

    def say(self) -> None:
        """A warning, where much had to be done."""
        said = []
        if self.taken_back >= SAID:
            said.append(
                f"{self.taken_back} steps of the fit ran away: they were taken back, and smaller ones taken"
            )
        if self.dropped:
            said.append(f"{self.dropped} derivatives of the fit were no numbers and moved nothing")
        for line in said:
            warnings.warn(line, Sdf2vecWarning, stacklevel=2)


@torch.no_grad()
def small_loss(measure: Objective, target: torch.Tensor, ground: torch.Tensor) -> float:
    """What may rise and fall: a share of what the best ground [4] alone has, or an error that is hardly seen."""
    bare = ground[: len(target), None, None].expand_as(target).contiguous()
    off = target.clone()
    off[:3] += HARDLY_SEEN
    return max(MATTERS * float(measure(bare)), float(measure(off)))

"""A scene whose numbers are all such that an export can write them, fitted while they come to be so.

They are put on steps a share at a time while the others go on descending, so that the rest makes up for what one loses
by it (as in incremental network quantization, Zhou et al. 2017): places first, colours last.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from functools import cache

import torch

from ..image import Picture
from ..layer import Slot
from ..render.draw import composer
from ..render.tensors import Group, SceneTensors, from_scene, to_scene
from ..scene import Scene
from ..steps import Steps, StepsOf
from ..threads import threads_of_its_own
from .adam import Moving, adam_over
from .constraints import least_length, project, room_of
from .joining import detached
from .least_squares import SceneProblem, count_numbers, is_simple
from .levenberg import descend as down
from .losses import objective
from .presets import MSE, Phase
from .runs import RATE, Softening
from .surroundings import View
from .views import scaled

Views = Callable[[float], View]  # a picture at any resolution
Kept = Mapping[Slot, torch.Tensor]  # numbers [G, width] that stay where they are; NaN for what does not yet
PHASES = (
    Phase("settling", 100, 256, rate=0.075, end_rate=0.045, loss=MSE),
    Phase("settling", 100, 320, rate=0.045, end_rate=0.02, loss=MSE),
)
GOING_ON = PHASES[1:]  # from what has settled more coarsely
SOLVED = 700  # numbers of layers, at most, that settle by least squares
SHARES = 0.0, 0.2, 0.35, 0.5, 0.6, 0.75, 0.97  # of all, that have settled before so many of these steps
EACH = 6
DUE = {  # from which share of the steps on numbers of a precision settle, and when all have
    "place": (0.0, 0.6),
    "falloff": (0.4, 0.65),
    "opacity": (0.45, 0.75),
    "color": (0.5, 0.97),
}
LARGEST = 2048  # layers: more would take too long
MOST_PARTS = 16  # shapes of a layer
ALL_PARTS = 64  # of one layer of each sort: kernels for more take too long to compile


def views_of(picture: Picture) -> Views:
    """A picture at any resolution."""
    return cache(lambda resolution: View(scaled(picture.premultiplied, resolution), None))


class Settling:
    """The layers of a group, of which ever more numbers stay where they can be written.

    `mend` changes, in place, numbers that are on steps but can't be so together.
    """

    def __init__(
        self, group: Group, steps: Mapping[Slot, Steps], mend: Callable[[Kept], None] = lambda kept: None
    ) -> None:
        self.group, self.steps, self.mend = group, steps, mend
        order = torch.randperm(len(group), generator=torch.Generator().manual_seed(0))
        self.turns = torch.empty(len(group)).scatter_(0, order, torch.arange(len(group)) / len(group))
        self.kept = {slot: torch.full_like(group.values[slot], math.nan) for slot in steps}

    @torch.no_grad()
    def settle(self, share: float) -> None:
        """Puts what is due after a share of the steps where it stays."""
        for slot, steps in self.steps.items():
            unit, kept = slot.parameter.unit, self.kept[slot]
            first, last = DUE[unit.codec.precision]
            fresh = (self.turns < (share - first) / (last - first)) & kept[:, 0].isnan()
            if fresh.any():
                kept[fresh] = _legal(steps.nearest(self.group.values[slot].double(), unit), slot)[fresh].to(
                    kept
                )
        self.mend(self.kept)
        self.hold()

    @property
    def settled(self) -> torch.Tensor:
        """Which numbers of the layers' rows [G, U] stay where they are."""
        free = {slot: torch.full_like(values, math.nan) for slot, values in self.group.values.items()}
        return ~torch.cat(list((free | self.kept).values()), dim=1).isnan()

    @torch.no_grad()
    def hold(self) -> None:
        """Moves what stays back to where it stays."""
        for slot, kept in self.kept.items():
            values = self.group.values[slot]
            values.copy_(torch.where(kept.isnan(), values, kept))


def _legal(values: torch.Tensor, slot: Slot) -> torch.Tensor:
    """What a scene takes: a length that must be positive may have become 0."""
    unit = slot.parameter.unit
    least = unit.low + (10.0**-unit.decimals if slot.parameter.positive else 0.0)
    return values.clamp(least, unit.high)


def settled(scene: Scene, steps_of: StepsOf, views: Views) -> Scene:
    """The scene as it can be written, as near to a picture as it comes; only rounded where that is not tried."""
    tensors = from_scene(scene)
    settling = [Settling(group, steps_of(group)) for group in tensors.groups]
    descend(tensors, settling, views, scene)
    return to_scene(tensors, scene.width, scene.height)


def descend(
    tensors: SceneTensors,
    settling: Sequence[Settling],
    views: Views,
    scene: Scene,
    frozen: tuple[str, ...] = (),
    phases: Sequence[Phase] = PHASES,
    softening: Softening | None = None,
) -> None:
    """Goes down the difference from a picture while ever more numbers of a scene settle, until all have; in place.

    By least squares where they are few enough, by the phases of Adam else. `frozen`: names of units of which nothing
    moves. `softening`: layers are blurred in these runs, whose standard deviations are trained as well if free.
    """
    parts = [len(group.structure) for group in tensors.groups]
    pixel = least_length(tensors, scene.pixel)
    with threads_of_its_own():
        if 0 < count_numbers(tensors) <= SOLVED and max(parts) <= MOST_PARTS and not softening:
            _by_least_squares(tensors, settling, views(PHASES[-1].resolution), pixel, frozen)
        elif 0 < tensors.layer_count <= LARGEST and sum(parts) <= ALL_PARTS:
            _descend(tensors, settling, views, pixel, frozen, phases, softening)
    for group in settling:
        group.settle(1.0)


def _by_least_squares(
    tensors: SceneTensors, settling: Sequence[Settling], view: View, pixel: float, frozen: tuple[str, ...]
) -> None:
    def stays(slot: Slot, value: float) -> bool:
        return slot.parameter.unit.name in frozen or is_simple(slot, value)

    for share in SHARES:
        for group in settling:
            group.settle(share)
        problem = SceneProblem(detached(tensors), view)
        numbers = problem.numbers(room_of(tensors, pixel), stays).without(_settled_in(settling))
        if len(numbers.free):
            row, _ = down(problem.row(), problem, numbers, EACH, lambda error: None)
            tensors.take(problem.scene_of(row))
        for group in settling:
            group.hold()


def _settled_in(settling: Sequence[Settling]) -> torch.Tensor:
    """Which numbers of a scene's row have settled; of the ground's none."""
    return torch.cat([*(group.settled.flatten() for group in settling), torch.zeros(4, dtype=torch.bool)])


def _descend(
    tensors: SceneTensors,
    settling: Sequence[Settling],
    views: Views,
    pixel: float,
    frozen: tuple[str, ...],
    phases: Sequence[Phase],
    softening: Softening | None,
) -> None:
    optimizer = adam_over(tensors, frozen=frozen)
    if softening and softening.is_free:
        optimizer.moving.append(Moving.of(softening.logs, RATE))
    done, total = 0, sum(phase.steps for phase in phases)
    for phase in phases:
        view = views(phase.resolution)
        compose = _composer(tensors, view, total, softening)
        measure = objective(phase.loss, view.target, view.weights)
        for rate in phase.rates():
            for group in settling:
                group.settle(done / total)
            optimizer.zero_grad()
            measure(compose()).backward()
            optimizer.step(rate)
            project(tensors, pixel)
            for group in settling:
                group.hold()
            done += 1


def _composer(
    tensors: SceneTensors, view: View, times: int, softening: Softening | None
) -> Callable[[], torch.Tensor]:
    """What draws a scene, as it is then, at a view's size."""
    channels, height, width = view.target.shape
    if softening:
        return lambda: softening.runs.composite(tensors, width, height, channels, times)
    compose = composer(tensors, width, height, channels, times)
    return lambda: compose(tensors, width, height)

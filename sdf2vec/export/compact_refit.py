"""A scene fitted again to its own render while its numbers are put on the steps that they will be written in.

They are put there a share at a time, places first and colours last; those that are still free make up for it (Zhou et
al. 2017, incremental network quantization). All move in units of their steps, by Adam (Kingma and Ba 2015).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import torch

from ..arrays import Float32Array
from ..compact_file import Scale, Scales, is_said
from ..image import fitted_size
from ..layer import Slot
from ..render import fused, reference
from ..render.tensors import Group, SceneTensors, from_scene, to_scene
from ..scene import Scene
from ..threads import threads_of_its_own

SIDE = 256  # shortest side, in pixels, of what is looked at
ROUNDS = 25  # of Adam after each share
RATE, LAST_RATE = 0.1, 0.02  # steps of a number in one of Adam's
BETAS = (0.9, 0.95)
KERNELS = 1 << 20  # layers × pixels from which kernels pay
SORTS = 6  # of layers: kernels for more take too long to compile
FEW, LARGEST = 16, 2048  # layers: fewer take few bytes, more would take too long

Shares = Mapping[str, float]  # by precision: of its numbers, those that are on steps
PLACED = {"place": 1.0, "falloff": 1.0, "opacity": 1.0}
SCHEDULE: tuple[Shares, ...] = (
    *({"place": share} for share in (0.3, 0.6, 0.85, 1.0)),
    {"place": 1.0, "falloff": 1.0},
    *(PLACED | {"color": share} for share in (0.0, 0.5, 0.8, 1.0)),
)

Composite = Callable[[SceneTensors, int, int], torch.Tensor]


def drawn(scene: Scene) -> Float32Array:
    """The scene as it is looked at: on a small canvas, before clamping, [3 or 4, H, W]."""
    tensors = from_scene(scene)
    size = _size(scene)
    with torch.no_grad(), threads_of_its_own():
        compose = _composite(tensors, size) or reference.composite
        pixels: Float32Array = compose(tensors, *size)[: 3 if scene.opaque else 4].numpy()
    return pixels


def _size(scene: Scene) -> tuple[int, int]:
    return fitted_size(scene.width, scene.height, min(SIDE, scene.width, scene.height))


def refitted(scene: Scene, scales: Scales) -> Scene:
    """The scene with numbers on steps that draw nearer to it than the nearest ones; itself where that is not tried."""
    tensors = from_scene(scene)
    size = _size(scene)
    compose = _composite(tensors, size)
    if compose is None or not FEW <= len(scene.layers) <= LARGEST:
        return scene
    with threads_of_its_own():
        wanted = compose(tensors, *size).detach()
        numbers = list(_numbers(tensors, scales))
        for shares in SCHEDULE:
            for number in numbers:
                number.place(shares.get(number.precision, 0.0))
            if any(number.is_free for number in numbers):
                _descend(
                    numbers,
                    lambda: torch.mean((compose(_said(tensors, numbers), *size) - wanted) ** 2),
                )
        found = to_scene(_said(tensors, numbers), scene.width, scene.height)
    return replace(scene, layers=found.layers)


def _composite(tensors: SceneTensors, size: tuple[int, int]) -> Composite | None:
    """What draws a scene often; nothing for one with too many sorts of layers, or with none."""
    if tensors.layer_count * size[0] * size[1] < KERNELS:
        return reference.composite if tensors.groups else None
    return fused.composite if len(tensors.groups) <= SORTS else None


@dataclass
class _Number:
    """The numbers of one slot of a group in steps [G, width]; which of them stay where they are, and when each does."""

    group: Group
    slot: Slot
    scale: Scale
    steps: torch.Tensor
    placed: torch.Tensor
    turn: torch.Tensor  # 0..1

    @property
    def precision(self) -> str:
        return self.slot.parameter.unit.codec.precision

    @property
    def is_free(self) -> bool:
        return not bool(self.placed.all())

    @torch.no_grad()
    def place(self, share: float) -> None:
        """Puts a share of them on the nearest steps."""
        now = (self.turn < share) & ~self.placed
        self.steps[now] = self.steps[now].round()
        self.placed |= now

    @torch.no_grad()
    def keep(self, before: torch.Tensor) -> None:
        """Takes back what has moved those that are placed, and keeps to the scale."""
        self.steps.copy_(torch.where(self.placed, before, self.steps).clamp(0, self.scale.most))

    def values(self) -> torch.Tensor:
        unit = self.slot.parameter.unit
        value: torch.Tensor = self.scale.value(self.steps, unit)
        return value.float().clamp_min(unit.low)


def _numbers(tensors: SceneTensors, scales: Scales) -> Iterator[_Number]:
    generator = torch.Generator().manual_seed(0)
    for group in tensors.groups:
        for slot, values in group.values.items():
            if is_said(slot, group.structure):
                scale = scales[slot.parameter.unit.name]
                steps = scale.step(values.double(), slot.parameter.unit).clamp(0, scale.most)
                turn = torch.rand(values.shape, generator=generator)
                yield _Number(
                    group, slot, scale, steps.requires_grad_(), torch.zeros_like(steps).bool(), turn
                )


def _descend(numbers: Sequence[_Number], error: Callable[[], torch.Tensor]) -> None:
    """Some steps of Adam down an error."""
    optimizer = torch.optim.Adam([number.steps for number in numbers], RATE, BETAS)
    for done in range(ROUNDS):
        optimizer.param_groups[0]["lr"] = RATE + (LAST_RATE - RATE) * done / ROUNDS
        optimizer.zero_grad()
        error().backward()
        before = [number.steps.detach().clone() for number in numbers]
        optimizer.step()
        for number, old in zip(numbers, before, strict=True):
            number.keep(old)


def _said(tensors: SceneTensors, numbers: Sequence[_Number]) -> SceneTensors:
    """The scene that the numbers say."""
    groups = []
    for group in tensors.groups:
        said = {number.slot: number.values() for number in numbers if number.group is group}
        groups.append(Group(group.structure, group.order, group.values | said))
    return replace(tensors, groups=groups)

"""The fit: render, loss, backward, step. What happens when is data (`presets`)."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
import torch

from ..image import Picture, premultiply, resize, unpremultiply
from ..render.device import Device, choose
from ..render.fused import is_compiled, threads_of_its_own
from ..render.tensors import SceneTensors, on_device, to_scene
from ..scene import Scene
from .constraints import project
from .losses import Objective, objective
from .placing import place
from .presets import DEFAULT, LENGTHS, PRESETS, RATES, Loss, Phase


@dataclass(frozen=True)
class Settings:
    """What to fit and how. `kinds`: names in `shapes.KINDS`; `loss`: replaces the preset's, when given.

    `device`: auto, cpu, cuda or mps.
    """

    shapes: int = 256
    kinds: tuple[str, ...] = ("triangle",)
    compositing: str = "over"
    preset: str = DEFAULT
    loss: Loss | None = None
    seed: int = 0
    device: str = "auto"


@dataclass(frozen=True)
class Progress:
    """Where a fit stands, and on which device; `step` counts over all phases."""

    phase: str
    step: int
    steps: int
    loss: float
    device: str = "cpu"


Callback = Callable[[Progress], bool]  # returns True to stop


def fit_picture(picture: Picture, settings: Settings, callback: Callback = lambda progress: False) -> Scene:
    """Fits shapes to a picture. The same settings give the same scene.

    The callback runs after every step; when it returns True, the fit ends and what is there is returned.
    """
    device = choose(settings.device)
    generator = torch.Generator().manual_seed(settings.seed)
    phases = [_with_loss(phase, settings.loss) for phase in PRESETS[settings.preset]]
    pixels = premultiply(picture.pixels) if picture.has_alpha else picture.pixels
    shortest = min(picture.width, picture.height)
    size = (picture.width / shortest, picture.height / shortest)
    start = scaled(pixels, phases[0].resolution)
    tensors = place(start, size, settings.kinds, settings.shapes, settings.compositing, generator)
    with threads_of_its_own():
        if device.name == "cpu" and not is_compiled(tensors, start.shape[0]):
            callback(Progress("compiling kernels (once)", 0, sum(phase.steps for phase in phases), math.nan))
        tensors = on_device(tensors, device.name)
        optimise(tensors, pixels, phases, callback, device)
    return to_scene(tensors, picture.width, picture.height)


def optimise(
    tensors: SceneTensors, pixels: np.ndarray, phases: Sequence[Phase], callback: Callback, device: Device
) -> None:
    """Runs the phases on a scene in place. `pixels`: premultiplied [H, W, 3 or 4]."""
    optimizer = adam(tensors)
    pixel = 1.0 / min(pixels.shape[:2])
    steps = sum(phase.steps for phase in phases)
    done = 0
    for phase in phases:
        target = scaled(pixels, phase.resolution).to(device.name)
        measure = objective(phase.loss, target)
        channels, height, width = target.shape
        draw = partial(device.composite, tensors, width, height, channels)
        for rate in _rates(phase):
            loss = _step(draw, measure, optimizer, rate)
            project(tensors, pixel)
            done += 1
            if callback(Progress(phase.name, done, steps, loss, device.name)):
                return


def _step(
    draw: Callable[[], torch.Tensor], measure: Objective, optimizer: torch.optim.Optimizer, rate: float
) -> float:
    optimizer.zero_grad(set_to_none=True)
    value = measure(draw())
    value.backward()
    for group in optimizer.param_groups:
        group["lr"] = group["base_rate"] * rate
    optimizer.step()
    return float(value.detach())


def adam(tensors: SceneTensors) -> torch.optim.Adam:
    """Adam over all that may move, each tensor at the rate of what it means."""
    groups = [(name, tensor) for group in tensors.groups for name, tensor in group.tensors()]
    if tensors.transparent:
        free = groups
    else:
        free = [
            (name, tensor) for name, tensor in groups if name != "opacity" or tensors.compositing == "over"
        ]
        free.append(("background", tensors.background))
    scale = math.sqrt(tensors.size[0] * tensors.size[1])  # of the canvas, and so of what lies on it
    rates = (
        RATES | {name: RATES[name] * scale for name in LENGTHS} | {"frequency": RATES["frequency"] / scale}
    )
    return torch.optim.Adam(
        [{"params": [tensor.requires_grad_()], "lr": 0.0, "base_rate": rates[name]} for name, tensor in free],
        betas=(0.9, 0.99),
        eps=1e-12,
        fused=True,
    )


def _rates(phase: Phase) -> Iterator[float]:
    """The factor on all rates at each step of a phase."""
    for step in range(phase.steps):
        fall = 0.5 - 0.5 * math.cos(math.pi * step / max(1, phase.steps - 1))
        yield phase.rate + (phase.end_rate - phase.rate) * fall


def scaled(pixels: np.ndarray, resolution: int) -> torch.Tensor:
    """A picture, premultiplied [H, W, C], scaled down to about resolution² pixels, [C, H, W]; never up."""
    height, width, channels = pixels.shape
    factor = min(1.0, resolution / math.sqrt(width * height))
    size = max(1, round(width * factor)), max(1, round(height * factor))
    small = premultiply(resize(unpremultiply(pixels), *size)) if channels == 4 else resize(pixels, *size)
    return torch.from_numpy(np.ascontiguousarray(small.transpose(2, 0, 1)))


def _with_loss(phase: Phase, loss: Loss | None) -> Phase:
    return replace(phase, loss=loss) if loss else phase

"""What a shape may become during a fit: ranges that keep it visible and on the canvas."""

from __future__ import annotations

import torch

from ..render.tensors import Group, SceneTensors
from ..shapes import KINDS, Parameter

MARGIN = 0.3  # scene units that a position may leave the canvas by
LONGEST = 1.5  # longest sides of the canvas
HIGHEST_FREQUENCY = 60.0  # radians per scene unit
FAINTEST = 0.02  # opacity under `over`: below it a shape would stop learning


@torch.no_grad()
def project(tensors: SceneTensors, pixel: float) -> None:
    """Moves every value into its range, in place; `pixel` is the size of a pixel of the picture in scene units."""
    for group in tensors.groups:
        for parameter in KINDS[group.kind].parameters:
            _project_parameter(group.parameters[parameter.name], parameter, tensors.size, pixel)
        _project_look(group, tensors.compositing)
    tensors.background[:3].clamp_(0.0, 1.0)


def _project_parameter(
    values: torch.Tensor, parameter: Parameter, size: tuple[float, float], pixel: float
) -> None:
    match parameter.unit:
        case "position":
            for axis in (0, 1):
                values[..., axis].clamp_(-size[axis] / 2 - MARGIN, size[axis] / 2 + MARGIN)
        case "length":
            values.clamp_(pixel if parameter.positive else 0.0, LONGEST * max(size))
        case "frequency":
            values.clamp_(-HIGHEST_FREQUENCY, HIGHEST_FREQUENCY)
        case "angle":
            values.remainder_(2 * torch.pi)


def _project_look(group: Group, compositing: str) -> None:
    lowest = -1.0 if compositing == "additive" else 0.0
    group.colors.clamp_(lowest, 1.0)
    group.opacity.clamp_(-1.0 if compositing == "additive" else FAINTEST, 1.0)
    group.falloff.clamp_(0.0, LONGEST)
    group.smoothness.clamp_(1e-3, LONGEST)

"""What a shape may become during a fit: ranges that keep it visible, on the canvas, and no sliver."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache

import torch

from ..lower.torch import Tensors, compile_torch
from ..render.tensors import Group, SceneTensors
from ..shapes import KINDS, Parameter

MARGIN = 0.3  # scene units that a position may leave the canvas by
LONGEST = 1.5  # longest sides of the canvas
HIGHEST_FREQUENCY = 60.0  # radians per scene unit
FAINTEST = 0.02  # opacity under `over`: below it a shape would stop learning
NEWTON_STEPS = 6  # towards the least thickness, at most
FLAT = 0.1  # squared derivative of a thickness, which is 1 and more unless the shape is next to a point
GOLDEN = 2.39996  # radians; multiples of it never meet


@torch.no_grad()
def project(tensors: SceneTensors, pixel: float, falloff: tuple[float, float] = (0.0, LONGEST)) -> None:
    """Moves every value into its range, in place; `pixel` is the size of a pixel of the picture in scene units."""
    for group in tensors.groups:
        for parameter in KINDS[group.kind].parameters:
            _project_parameter(group.parameters[parameter.name], parameter, tensors.size, pixel)
        _project_look(group, tensors.compositing)
        group.falloff.clamp_(*falloff)
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
    group.smoothness.clamp_(1e-3, LONGEST)


def enforce_min_thickness(tensors: SceneTensors, least: float) -> None:
    """Makes shapes thinner than `least` (scene units) that thick, in place, by the shortest way."""
    for group in tensors.groups:
        for _ in range(NEWTON_STEPS):
            if not _thicken(group, least):
                break


def _thicken(group: Group, least: float) -> bool:
    """A Newton step along the gradient of the thickness; whether there was need."""
    columns = [column.requires_grad_() for column in _columns(group)]
    with torch.enable_grad():
        (thickness,) = _measures(group.kind)(*columns)[1:]
        thin = thickness < least
        if not bool(thin.any()):
            return False
        grads = torch.autograd.grad(thickness.sum(), columns, allow_unused=True, materialize_grads=True)
    slope = torch.stack(grads).square().sum(0)
    step = (least - thickness).detach() / slope.clamp(min=FLAT)
    numbers = iter(enumerate(grads))
    for parameter in KINDS[group.kind].parameters:
        for values in group.parameters[parameter.name].detach().unbind(2):
            index, grad = next(numbers)
            away = least * math.cos(GOLDEN * index)  # a point may grow in any way
            move = torch.where(slope < FLAT, away, grad * step)
            values += torch.where(thin, move, 0.0)
    return True


def too_small(tensors: SceneTensors, least_area: float) -> torch.Tensor:
    """The mean over all shapes of max(0, 1 − area/least_area)²; areas in scene units squared."""
    lacks = []
    for group in tensors.groups:
        columns = [part for p in KINDS[group.kind].parameters for part in group.parameters[p.name].unbind(2)]
        area = _measures(group.kind)(*columns)[0]
        lacks.append((1.0 - area / least_area).clamp(min=0.0).square().flatten())
    return torch.cat(lacks).mean()


def areas(group: Group) -> torch.Tensor:
    """The area of each shape of a group when sharp, [G, K], in scene units squared."""
    return _measures(group.kind)(*_columns(group))[0]


def _columns(group: Group) -> list[torch.Tensor]:
    """The numbers of a group's shapes, each [G, K]."""
    return [
        part.clone()
        for p in KINDS[group.kind].parameters
        for part in group.parameters[p.name].detach().unbind(2)
    ]


@cache
def _measures(kind: str) -> Callable[..., Tensors]:
    """Area and thickness of a shape from its numbers."""
    variables = KINDS[kind].variables()
    found = [KINDS[kind].area(*variables), KINDS[kind].thickness(*variables)]
    return compile_torch(found, KINDS[kind].scalars())

"""The ground of a picture: its colour, or a box over all of the canvas where it runs from one colour to another."""

from __future__ import annotations

from typing import NamedTuple

import torch

from ..layer import Part, Slot, slots
from ..paints import FLAT, PAINTS, Ramp
from ..render import fused
from ..render.tensors import Group, SceneTensors
from .initialization import FAINTEST_GROUND, background_of
from .jagged import ALIKE
from .joining import Search, inserted
from .laying import Points
from .offers import common_color
from .surroundings import Surroundings, View, layer_at, points_of

PAINT, KIND = "linear", "box"
ROUNDS = 8  # of a plane through the pixels that are nearest to it
NEAR = 4.0 / 255  # of the ramp, what is its own
EXPLAINED = (
    0.6  # least share of the variance that a plane takes away, where a ramp is tried though little is near it
)
SHARE, MORE = 0.3, 1.5  # least share of the canvas that is a ramp; and of what is one flat colour
MARGIN = 0.1  # scene units by which the box is larger than the canvas
LEAST_CHANGE = 0.02  # of a colour across the canvas
STEPS, TRIMS = 10, 4
DOMINANT = 0.15  # share of the most common colour, of a picture that has a ground


class Plane(NamedTuple):
    """A colour [C] at the middle, by how much it changes along x and y [2, C], and where the picture is near to it.

    `explains`: the share of all variance that such a plane takes away.
    """

    middle: torch.Tensor
    slopes: torch.Tensor
    near: torch.Tensor  # [P]
    explains: float


def ground_of(target: torch.Tensor) -> torch.Tensor:
    """A colour of a picture [C, H, W] that dominates, that of its rim before the most common, else the mean; none where
    it has holes.
    """
    if len(target) == 4:
        return background_of(target) if float(target[3].min()) >= FAINTEST_GROUND else torch.zeros(4)
    colors, rim = target.flatten(1).T, torch.ones(target.shape[1:])
    rim[1:-1, 1:-1] = 0.0
    for weights in (rim.flatten(), torch.ones(len(colors))):
        common = common_color(colors, weights)
        near = (colors - common).abs().amax(1) < ALIKE
        if float(near.float().mean()) >= DOMINANT:
            return torch.cat([common, torch.ones(1)])
    return torch.cat([colors.mean(0), torch.ones(1)])


def grounded(scene: SceneTensors, view: View, search: Search) -> SceneTensors:
    """The bare scene on a ramp, where much of the picture is one that no flat colour explains as well."""
    if KIND not in search.layers.kinds or len(view.target) != 3:
        return scene
    points = points_of(scene, view)
    plane = _plane(view.target.flatten(1).T, points)
    flat = _near(scene, view)
    if plane.explains < EXPLAINED and plane.near.float().mean() < max(SHARE, MORE * flat):
        return scene
    ramp = _on_ramp(scene, plane, points, view, search)
    changes = plane.slopes.norm() * max(scene.size) > LEAST_CHANGE
    explained = _near(ramp, view, _between(ramp.groups[0], points))
    return ramp if changes and explained > max(SHARE, MORE * flat) else scene


def lowest(scene: SceneTensors) -> int:
    """The lowest place in the draw order that is seen: above a ramp."""
    return int(scene.layer_count > 0 and layer_at(scene, 0).structure[0].paint != FLAT)


def _plane(colors: torch.Tensor, points: Points) -> Plane:
    """The plane through as many colours [P, C] as can be: least squares of the nearest half, again and again."""
    x, y, _ = points
    rows = torch.stack([torch.ones_like(x), x, y], dim=1)
    found = _solved(rows, colors)
    explains = 1.0 - float((rows @ found - colors).square().sum() / (colors - colors.mean(0)).square().sum())
    for _ in range(ROUNDS):
        wrong = (rows @ found - colors).abs().amax(1)
        chosen = wrong <= wrong.median().clamp_min(NEAR)
        found = _solved(rows[chosen], colors[chosen])
    wrong = (rows @ found - colors).abs().amax(1)
    near = wrong <= wrong.median().clamp_min(NEAR)
    return Plane(found[0], found[1:], near, explains)


def _solved(rows: torch.Tensor, colors: torch.Tensor) -> torch.Tensor:
    """The least squares solution [3, C], the shortest of many: across a picture a pixel wide there is no slope."""
    found: torch.Tensor = torch.linalg.lstsq(
        rows, colors, driver="gelsd"
    ).solution  # the usual driver fails there
    return found


def _near(scene: SceneTensors, view: View, where: torch.Tensor | None = None) -> float:
    """The share of the pixels that are near to a scene's, of some [P] only, if they are given."""
    near = (_wrong(scene, view) < NEAR).flatten()
    return float((near if where is None else near & where).float().mean())


def _between(layer: Group, points: Points) -> torch.Tensor:
    """Where the colour of a box that is not turned changes [P]: beyond its ends there are two flat colours."""
    values = {slot.parameter.name: value[0] for slot, value in layer.values.items()}
    paint = PAINTS[PAINT]
    assert paint.gradient is not None
    ramp = paint.gradient(*(p.values_from(values[p.name].tolist()) for p in paint.parameters))
    assert isinstance(ramp, Ramp)
    place = (torch.stack(points[:2], dim=1) - values["center"]) / values["half_size"]
    share = ramp.middle + place @ torch.tensor(ramp.slope)
    return (share > 0.0) & (share < 1.0)


@torch.no_grad()
def _wrong(scene: SceneTensors, view: View) -> torch.Tensor:
    """How far a scene is from the picture, the worst of its channels, [H, W]."""
    channels, height, width = view.target.shape
    return (fused.composite(scene, width, height, channels) - view.target).abs().amax(0)


def _on_ramp(scene: SceneTensors, plane: Plane, points: Points, view: View, search: Search) -> SceneTensors:
    """The scene with a box of two colours under everything, descended by its paint."""
    left, strengths, right = torch.linalg.svd(plane.slopes, full_matrices=False)
    axis, change = left[:, 0], strengths[0] * right[0]
    along = (torch.stack(points[:2], dim=1) @ axis)[plane.near]
    low, high = along.min(), along.max()
    center = axis * (low + high) / 2
    half = torch.tensor(scene.size) / 2 + center.abs() + MARGIN
    ends = [(plane.middle + change * end)[None].clamp(0.0, 1.0) for end in (low, high)]
    numbers = {
        "color": ends[0],
        "color_end": ends[1],
        "direction": (axis * half / (high - low).clamp_min(1e-6))[None],
        "center": center[None],
        "half_size": half[None],
        "opacity": torch.ones(1, 1),
    }
    structure = (Part(KIND, PAINT),)
    values: dict[Slot, torch.Tensor] = {
        slot: numbers.get(slot.parameter.name, torch.zeros(1, slot.parameter.width))
        for slot in slots(structure)
    }
    layer = Group(structure, torch.tensor([0]), values)
    mask = _nearest(inserted(scene, layer), view) if plane.explains < EXPLAINED else None
    for _ in range(TRIMS):
        around = Surroundings.of(scene, 0, View(view.target, mask))
        layer = search.trained(
            layer, around, STEPS, lambda slot: slot.parameter in PAINTS[PAINT].parameters
        ).layer
        mask = _nearest(inserted(scene, layer), view)  # what is far from it is of shapes that lie on it
    return inserted(scene, layer)


def _nearest(scene: SceneTensors, view: View) -> torch.Tensor:
    """Where the picture is near to a scene, at least the nearest half, [H, W]."""
    wrong = _wrong(scene, view)
    return (wrong <= wrong.median().clamp_min(NEAR)).float()

"""Strokes of one pen: long boxes that end in half discs, or may as well, and widths that hardly differ."""

from __future__ import annotations

from collections.abc import Sequence

import torch

from ..layer import Part
from ..paints import FLAT
from ..render.tensors import Group, SceneTensors
from .candidates import ARC
from .covering import BOX
from .joining import Search, detached, inserted
from .least_squares import improved, is_simple
from .simplify import UNSEEN, with_part
from .surroundings import Surroundings, View, error_of, layer_at

STEPS, SETTLING = 10, 3  # of a box whose corners have become round; of all after it
LONG = 1.5  # times as long as wide
ALIKE, SAME = 0.06, 1e-4  # logarithm of what widths of one pen differ by; of what they do when they are one
AS_GOOD = 1.1  # times the mean squared error, at most


def lined(scene: SceneTensors, view: View, search: Search, worst: float) -> SceneTensors:
    """The scene with long boxes as straight arcs, those with round corners or as wide as an arc where that is as good,
    others where it is better; in one width where theirs hardly differ.
    """
    if ARC not in search.kinds:
        return scene
    error = error_of(scene, view)
    limit = max(worst, AS_GOOD * error, error + 4.0 * UNSEEN)
    layers = [layer_at(scene, order) for order in range(scene.layer_count)]
    for layer in sorted((each for each in layers if _is_long_box(each)), key=_has_corners):
        made, most = _moved(scene, _stroke_of(layer), view, search), limit
        if _has_corners(layer) and not _has_pen(scene, layer):
            most = error_of(_moved(scene, layer, view, search), view) - UNSEEN
        scene = made if error_of(made, view) <= most else scene
    made = detached(scene)
    in_one_width(made.groups, made.groups, ALIKE)
    return made if error_of(made, view) <= limit else scene


def _is_long_box(layer: Group) -> bool:
    """Whether a layer is one box that is longer than wide, in one colour."""
    if layer.structure != (Part(BOX, FLAT),):
        return False
    sides = layer.of("half_size", 0)
    return bool(sides.amax() > LONG * sides.amin())


def _has_corners(box: Group) -> bool:
    """Whether a layer of a box is not rounded."""
    return not bool(box.of("corner_radius", 0).any())


def _has_pen(scene: SceneTensors, box: Group) -> bool:
    """Whether a scene has strokes that are about as wide as a box."""
    width = box.of("half_size", 0).amin()
    pens = (group.of("half_width", 0) for group in scene.groups if is_stroke(group))
    return any(bool(((widths / width).log().abs() < ALIKE).any()) for widths in pens)


def _stroke_of(box: Group) -> Group:
    """A layer of a box as one of a straight arc."""
    sides, (angle,) = box.of("half_size", 0), box.of("angle", 0).unbind(1)
    along = torch.stack([angle.cos(), angle.sin()], 1)
    if sides[0, 1] > sides[0, 0]:
        along = torch.stack([-along[:, 1], along[:, 0]], 1)
    half = sides.amin(1, keepdim=True)
    reach, center = along * (sides.amax(1, keepdim=True) - half), box.of("center", 0)
    arc = {"a": center - reach, "b": center + reach, "sagitta": torch.zeros_like(half), "half_width": half}
    made = with_part(box, 0, box.structure[0]._replace(kind=ARC), arc)
    return made.each(lambda tensor: tensor.detach().clone())


def _moved(scene: SceneTensors, layer: Group, view: View, search: Search) -> SceneTensors:
    """The scene with a layer nearer to what it should be, as straight as it is, or with the corners that it has.

    Where pixels are means of samples all numbers move a little, too: a layer descends by the pixels' middles.
    """
    around = Surroundings.of(scene, int(layer.order), view)
    still = {slot for slot, v in layer.values.items() if v.numel() == 1 and is_simple(slot, float(v))}
    still |= {slot for slot in layer.values if slot.parameter.name == "corner_radius"}
    made = inserted(scene, search.trained(layer, around, STEPS, lambda slot: slot not in still).layer)
    return made if view.samples == 1 else improved(made, view, search, SETTLING, simple=True)


def is_stroke(group: Group) -> bool:
    """Whether a group's layers are one arc each."""
    return [part.kind for part in group.structure] == [ARC]


@torch.no_grad()
def in_one_width(groups: Sequence[Group], before: Sequence[Group], alike: float = SAME) -> None:
    """Makes the widths of strokes, in place, those of others that were about as wide before."""
    pens = [index for index, group in enumerate(groups) if is_stroke(group)]
    if not pens:
        return
    own = [groups[index].of("half_width", 0) for index in pens]
    widths = torch.cat(own)
    old = torch.cat([before[index].of("half_width", 0) for index in pens])[:, 0].log()
    left = torch.arange(len(widths))
    while len(left):
        same = left[(old[left] - old[left[0]]).abs() < alike]
        widths[same] = widths[same].median()
        left = left[~torch.isin(left, same)]
    for width, new in zip(own, widths.split([len(each) for each in own]), strict=True):
        width.copy_(new)

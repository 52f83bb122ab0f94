"""How long the description of a picture by a scene is: the minimum description length (Rissanen 1978, Leclerc 1989).

A picture is told by the numbers of a scene, and by how far each of its values is from the render, in whole 8-bit
levels, as JPEG tells such differences (ITU-T T.81, F.1.2): a class, which is how many bits the difference has, at its
entropy; then these bits. So pixels that are right cost next to nothing, and no pattern is cheap that is far off.
"""

from __future__ import annotations

import torch

from ..layer import row_width
from ..render.tensors import SceneTensors
from .surroundings import View, residual_of

BITS = 10  # of a number
WHITE = 255  # levels


@torch.no_grad()
def description_length(scene: SceneTensors, view: View) -> float:
    """Bits for the scene and for what it leaves of a picture."""
    numbers = sum(len(group.order) * row_width(group.structure) for group in scene.groups)
    levels = (WHITE * residual_of(scene, view)).round()
    classes = levels.abs().add(1).log2().ceil()
    counts = classes.unique(return_counts=True)[1].double()
    entropy = -(counts * (counts / counts.sum()).log2()).sum()
    return BITS * numbers + float(entropy + classes.double().sum())


def is_longer(scene: SceneTensors, other: SceneTensors, view: View) -> bool:
    """Whether it takes more to tell a picture by a scene than by another."""
    return description_length(scene, view) > description_length(other, view)

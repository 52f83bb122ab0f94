"""How long the description of a picture by a scene is: the minimum description length (Rissanen 1978, Leclerc 1989).

A picture is told by the numbers of a scene, and by how far each of its values is from the render: in whole 8-bit
levels, at their entropy. So pixels that are right cost next to nothing, however wrong a few at an edge are.
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
    counts = levels.unique(return_counts=True)[1].double()
    return BITS * numbers - float((counts * (counts / counts.sum()).log2()).sum())

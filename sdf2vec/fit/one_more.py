"""What one more shape would gain: begun where the best soft disc would be, and descended."""

from __future__ import annotations

import math

import torch

from ..blend import COMPOSITING
from ..layer import LOOK, Part, Slot, slots
from ..render import fused
from ..render.tensors import Group, SceneTensors, from_scene
from ..scene import Scene
from ..units import COLOR, Placed
from .initialization import start_of
from .joining import Search
from .matching_pursuit import Discs, canvas_of, find_discs
from .surroundings import Surroundings, View

STEPS = 12
SOFT = 0.5  # falloff of a disc, in radii


def gain_of_one_more(scene: Scene, view: View, search: Search) -> float:
    """What a shape laid over a scene takes from the error of its render after some steps, in dB; others stay."""
    tensors = from_scene(scene)
    discs = _best_disc(tensors, view)
    if not len(discs.radii):
        return 0.0
    layer = _layer(discs, tensors, view, search)
    around = Surroundings.of(tensors, tensors.layer_count, view)
    before = float(around.residual.square().mean())
    after = search.trained(layer, around, STEPS, lambda slot: True).error
    return max(0.0, 10.0 * math.log10(before / max(after, 1e-12))) if before > 0 else 0.0


def _best_disc(scene: SceneTensors, view: View) -> Discs:
    """That of matching pursuit; none where nothing would help."""
    channels, height, width = view.target.shape
    image = fused.composite(scene, width, height, channels)
    return find_discs(canvas_of(image, view.target, view.weights, COMPOSITING[scene.compositing].signed), 1)


def _layer(discs: Discs, scene: SceneTensors, view: View, search: Search) -> Group:
    """A layer of one shape, of the first kind there may be, in the place of a disc."""
    _, height, width = view.target.shape
    centers, radii = discs.placed(width, height, scene.size)
    opacity, falloff = LOOK
    low, high = search.falloff
    looks = {
        opacity.unit.name: torch.ones(1, 1),
        falloff.unit.name: (SOFT * radii[:, None]).clamp(low, high),
        COLOR.name: discs.colors[:, :3],
    }
    placed = Placed(centers, radii, torch.zeros(1))
    structure = (Part(search.layers.kinds[0], search.layers.paint),)
    values: dict[Slot, torch.Tensor] = {
        slot: start_of(slot.parameter, placed, looks) for slot in slots(structure)
    }
    return Group(structure, torch.tensor([scene.layer_count]), values)

"""What textbooks say and where it fails: a dense reference whose options are the methods that the catalogue shows.

Discs under `over` or added up, every pixel of every shape in plain torch; and any scene of this program, descended by
the reference renderer with nothing that guards it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import torch

from ..fit.initialization import Layers, place
from ..fit.presets import Start
from ..render import reference
from ..render.tensors import SceneTensors

STEPS = 150


@dataclass(frozen=True)
class Discs:
    """Soft discs by hand. `edge`: the sigmoid, or smoothstep, which is flat outside its band. `clamped`: to 0..1 before
    the loss. `added`: colours add up, else each covers what is below."""

    edge: str = "sigmoid"
    clamped: bool = False
    added: bool = False
    band: float = 0.05  # scene units

    def render(self, rows: torch.Tensor, side: int) -> torch.Tensor:
        """[3, side, side] from rows [N, 6]: x, y, radius, red, green, blue."""
        at = (torch.arange(side) + 0.5) / side - 0.5
        y, x = torch.meshgrid(at, at, indexing="ij")
        image = torch.full((3, side, side), 0.0 if self.added else 0.5)
        for row in rows:
            distance = torch.hypot(x - row[0], y - row[1]) - row[2]
            cover = self._cover(distance)
            color = row[3:, None, None]
            image = image + color * cover if self.added else image + (color - image) * cover
        return image.clamp(0.0, 1.0) if self.clamped else image

    def _cover(self, distance: torch.Tensor) -> torch.Tensor:
        if self.edge == "sigmoid":
            return torch.sigmoid(-10.0 * distance / self.band)
        t = (0.5 - distance / self.band).clamp(0.0, 1.0)
        return t * t * (3.0 - 2.0 * t)

    def descend(self, rows: torch.Tensor, target: torch.Tensor, steps: int = STEPS) -> torch.Tensor:
        """The render after so many steps of Adam down the squared error."""
        rows = rows.clone().requires_grad_()
        adam = torch.optim.Adam([rows], lr=0.01)
        for _ in range(steps):
            adam.zero_grad()
            (self.render(rows, target.shape[2]) - target).square().mean().backward()
            adam.step()
        return self.render(rows.detach(), target.shape[2])


def unguarded(
    scene: SceneTensors, target: torch.Tensor, steps: int = STEPS, rate: float = 0.01, frozen: str = ""
) -> torch.Tensor:
    """The render [3, H, W] of a scene descended by Adam in plain torch: every number at one rate; in place.

    `frozen`: the name of a parameter that stays.
    """
    named = [(slot.parameter.name, t) for group in scene.groups for slot, t in group.values.items()]
    free = [scene.background, *(tensor for name, tensor in named if name != frozen)]
    for tensor in free:
        tensor.requires_grad_()
    adam = torch.optim.Adam(free, lr=rate)
    height, width = target.shape[1:]
    for step in range(steps):
        for choice in adam.param_groups:
            choice["lr"] = rate * (0.5 + 0.5 * math.cos(math.pi * step / steps))
        adam.zero_grad()
        (reference.composite(scene, width, height)[:3] - target).square().mean().backward()
        adam.step()
    with torch.no_grad():
        return reference.displayed(reference.composite(scene, width, height))[:3]


def anywhere(
    target: torch.Tensor, kind: str, count: int, seed: int, compositing: str = "over", union: int = 1
) -> SceneTensors:
    """Shapes at random places, small and large, in the picture's colours."""
    height, width = target.shape[1:]
    size = (width / min(width, height), height / min(width, height))
    generator = torch.Generator().manual_seed(seed)
    return place(target, size, Layers((kind,), compositing, union), count, Start("uniform"), generator)


def smooth_minimum(a: torch.Tensor, b: torch.Tensor, k: torch.Tensor) -> torch.Tensor:
    """−k·log(e^(−a/k) + e^(−b/k)) as it is written: e^(−a/k) overflows or underflows where a/k is large."""
    return -k * torch.log(torch.exp(-a / k) + torch.exp(-b / k))


def disc_distance(x: torch.Tensor, y: torch.Tensor, radius: torch.Tensor) -> torch.Tensor:
    """√(x² + y²) − r, whose derivative at the centre is 0/0."""
    return torch.sqrt(x * x + y * y) - radius


def segment_distance(p: torch.Tensor, a: torch.Tensor, b: torch.Tensor) -> torch.Tensor:
    """Distance to a segment [2]: 0/0 where its ends are one point, as in a degenerate triangle."""
    along = (((p - a) * (b - a)).sum() / (b - a).square().sum()).clamp(0.0, 1.0)
    return (p - a - along * (b - a)).square().sum().sqrt()


def half_cover(x: float, y: float, radius: float, side: int) -> torch.Tensor:
    """A disc's coverage [side, side] in half precision and pixel units, as `mediump` may have it: 300² is no number."""
    at = torch.arange(side, dtype=torch.float16) + 0.5
    rows, columns = torch.meshgrid(at, at, indexing="ij")
    across, down = columns - x * side, rows - y * side
    distance = (across * across + down * down).sqrt() - radius * side
    return (0.5 - distance).clamp(0.0, 1.0).float()


def eight_bits_at_a_time(covers: torch.Tensor, colors: torch.Tensor, opacity: float) -> torch.Tensor:
    """Layers [N, H, W] in colours [N] over black, rounded to 8 bits after each, as drawing programs do."""
    image = torch.zeros_like(covers[0])
    for cover, color in zip(covers, colors, strict=True):
        image = torch.round((image + (color - image) * cover * opacity) * 255.0) / 255.0
    return image

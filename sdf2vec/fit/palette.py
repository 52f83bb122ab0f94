"""Few colours: a given palette, or the best few for a scene, by distance in CIELAB."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import torch
from scipy.cluster.vq import kmeans2
from skimage.color import lab2rgb, rgb2lab

from ..arrays import Float64Array
from ..render.tensors import SceneTensors
from ..scene import Color
from .initialization import straight

SAMPLES = 4096  # colours drawn in proportion to what they cover
ROUNDS = 50  # of k-means
DECIMALS = 3  # of a found colour: 8 bits hold no more


def restrict(
    tensors: SceneTensors,
    cover: list[torch.Tensor],
    palette: Sequence[Color],
    count: int,
    generator: torch.Generator,
) -> None:
    """Replaces every colour by the nearest of a palette, in place; without one, of the best `count` (see `found`)."""
    snap(tensors, palette or found(tensors, cover, count, generator))


def found(
    tensors: SceneTensors, cover: list[torch.Tensor], count: int, generator: torch.Generator
) -> list[Color]:
    """At most `count` colours that stand for the scene's best: k-means, each weighted by what it covers ([G])."""
    colors, weights = _colors(tensors), _weights(tensors, cover)
    picked = torch.multinomial(weights, SAMPLES, replacement=True, generator=generator)
    lab = _lab(colors[picked])
    count = min(count, len(np.unique(lab, axis=0)))
    seed = int(torch.randint(2**31, (1,), generator=generator))
    centers, _ = kmeans2(lab, count, iter=ROUNDS, minit="++", seed=seed, missing="warn")
    rgb = np.clip(lab2rgb(centers[None])[0], 0.0, 1.0).round(DECIMALS)
    return [tuple(color) for color in rgb.tolist()]


@torch.no_grad()
def snap(tensors: SceneTensors, palette: Sequence[Color]) -> None:
    """Replaces every colour, the background's too, by the nearest of the palette, in place."""
    choices = torch.tensor(palette)
    for group in tensors.groups:
        for colors in group.colors:
            colors.copy_(_nearest(colors.cpu(), choices).to(colors.device))
    if not tensors.transparent:
        ground = straight(tensors.background[None])[:, :3].cpu()
        nearest = _nearest(ground, choices)[0].to(tensors.background.device)
        tensors.background[:3] = nearest * tensors.background[3]


def _nearest(colors: torch.Tensor, choices: torch.Tensor) -> torch.Tensor:
    if len(colors) == 0:
        return colors
    distances = torch.cdist(torch.from_numpy(_lab(colors)), torch.from_numpy(_lab(choices)))
    return choices[distances.argmin(dim=1)]


def _colors(tensors: SceneTensors) -> torch.Tensor:
    """All colours of a scene, [M, 3]; the background's last, unless it is transparent."""
    colors = [own.detach().cpu() for group in tensors.groups for own in group.colors]
    ground = [] if tensors.transparent else [straight(tensors.background.detach()[None]).cpu()[:, :3]]
    return torch.cat([*colors, *ground]).clamp(0.0, 1.0)


def _weights(tensors: SceneTensors, cover: list[torch.Tensor]) -> torch.Tensor:
    """A weight for each of `_colors`; the background counts as the mean of the layers together."""
    parts = [score for score, group in zip(cover, tensors.groups, strict=True) for _ in group.colors]
    weights = torch.cat(parts) + 1e-9
    return weights if tensors.transparent else torch.cat([weights, weights.mean()[None] * len(weights) * 0.1])


def _lab(colors: torch.Tensor) -> Float64Array:
    lab: Float64Array = rgb2lab(colors.double().numpy()[None])[0]
    return lab

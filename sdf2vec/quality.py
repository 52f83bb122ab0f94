"""How near a scene's render comes to a picture."""

from __future__ import annotations

from typing import NamedTuple

import torch

from .fit.views import planes, scaled
from .flip import flip
from .grain import Drawable
from .image import Picture
from .metrics import psnr
from .render.draw import draw_fast
from .render.runs import Runs
from .render.tensors import from_scene
from .scene import Scene
from .threads import threads_of_its_own

FLIP_RESOLUTION = 1000  # FLIP takes long: pictures of more pixels than the square are scaled down for it


class Quality(NamedTuple):
    """How near a scene's render comes to a picture."""

    psnr: float  # dB
    flip: float
    flip_size: tuple[int, int]  # width and height in pixels at which FLIP was computed


def quality(scene: Scene, picture: Picture) -> Quality:
    """PSNR and mean FLIP of the scene's render against the picture, premultiplied.

    FLIP is that of both scaled down to about a million pixels, where they have more.
    """
    drawn, target = _drawn_and_target(scene, picture)
    small = [scaled(image.permute(1, 2, 0).numpy(), FLIP_RESOLUTION) for image in (drawn, target)]
    height, width = small[0].shape[1:]
    return Quality(float(psnr(drawn, target)), float(flip(*small)), (width, height))


def psnr_of(scene: Scene, picture: Picture) -> float:
    """PSNR alone, in dB: FLIP takes long."""
    return float(psnr(*_drawn_and_target(scene, picture)))


def psnr_of_drawable(drawable: Drawable, picture: Picture) -> float:
    """PSNR of what a small drawing shows."""
    if not drawable.runs:
        return psnr_of(drawable.scene, picture)
    target = planes(picture.premultiplied)
    counts, deviations = zip(*drawable.runs, strict=True)
    runs, tensors = Runs(counts, torch.tensor(deviations)), from_scene(drawable.scene)
    with torch.no_grad(), threads_of_its_own():
        drawn = runs.composite(tensors, picture.width, picture.height, len(target))
    return float(psnr(drawn.clamp(0.0, 1.0), target))


def _drawn_and_target(scene: Scene, picture: Picture) -> tuple[torch.Tensor, torch.Tensor]:
    """The render and the picture, premultiplied, [C, H, W]."""
    target = planes(picture.premultiplied)
    return draw_fast(scene, picture.width, picture.height)[: len(target)], target

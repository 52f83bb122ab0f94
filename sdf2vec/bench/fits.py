"""Fits for the benchmarks: one measured, or the median of several."""

from __future__ import annotations

import resource
import time
from typing import Any, NamedTuple

import numpy as np
import torch

from ..fit.loop import fit_picture
from ..fit.settings import settings_of
from ..flip import flip
from ..image import Picture
from ..metrics import psnr, ssim
from ..render.draw import draw
from ..scene import Scene


class Fitted(NamedTuple):
    """How near a fit came, at the picture's own size, and what it took."""

    psnr: float  # dB
    ssim: float
    flip: float
    seconds: float  # wall clock
    cpu: float  # user + system, all threads


def measured(picture: Picture, shapes: int, **options: Any) -> tuple[Fitted, Scene]:
    """One fit; `options` as in `api.fit`."""
    settings = settings_of(shapes, **options)
    started, used = time.perf_counter(), _cpu()
    scene = fit_picture(picture, settings)
    seconds, cpu = time.perf_counter() - started, _cpu() - used
    target = tensor_of(picture)
    image = draw(scene, picture.width, picture.height)[: len(target)]
    near, alike, seen = (float(metric(image, target)) for metric in (psnr, ssim, flip))
    return Fitted(near, alike, seen, seconds, cpu), scene


def tensor_of(picture: Picture) -> torch.Tensor:
    """Its pixels [C, H, W], premultiplied where there is alpha."""
    return torch.from_numpy(np.ascontiguousarray(picture.premultiplied.transpose(2, 0, 1)))


def median(fits: list[Fitted]) -> Fitted:
    """The median of each figure."""
    return Fitted(*np.median(np.array(fits), axis=0).tolist())


def warm_up(picture: Picture, **options: Any) -> None:
    """Compiles the kernels, so that it isn't measured."""
    measured(picture, 8, **(options | {"preset": "fast"}))
    measured(picture, 8, **options)


def _cpu() -> float:
    usage = resource.getrusage(resource.RUSAGE_SELF)
    return usage.ru_utime + usage.ru_stime

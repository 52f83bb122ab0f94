"""Fits for the benchmarks, measured; and exports as engines draw them, against the picture."""

from __future__ import annotations

import resource
import time
from collections.abc import Collection
from typing import Any, NamedTuple

from ..arrays import Float32Array
from ..export.exported import Exported
from ..fit.loop import fit_picture
from ..fit.settings import settings_of
from ..fit.views import planes
from ..flip import flip
from ..image import Picture
from ..metrics import psnr, ssim
from ..render.draw import draw
from ..roundtrip import ROUND_TRIPS
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
    target = planes(picture.premultiplied)
    image = draw(scene, picture.width, picture.height)[: len(target)]
    near, alike, seen = (float(metric(image, target)) for metric in (psnr, ssim, flip))
    return Fitted(near, alike, seen, seconds, cpu), scene


def drawn(
    made: Exported, scene: Scene, target: str, engines: Collection[str], picture: Picture
) -> dict[str, Float32Array]:
    """An export as each of these engines draws it at the picture's size, [H, W, 4]."""
    return {
        trip.engine: trip.draw(made, scene, picture.width, picture.height)
        for trip in reversed(ROUND_TRIPS[target])  # of several forms the first one, which is the usual
        if trip.engine in engines
    }


def flip_of(image: Float32Array, picture: Picture) -> float:
    """FLIP of an opaque drawing."""
    return float(flip(*(planes(pixels[..., :3]) for pixels in (image, picture.pixels))))


def _cpu() -> float:
    usage = resource.getrusage(resource.RUSAGE_SELF)
    return usage.ru_utime + usage.ru_stime

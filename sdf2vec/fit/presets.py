"""What happens in a fit, as data: a preset is a tuple of phases."""

from __future__ import annotations

from dataclasses import dataclass

Loss = tuple[tuple[str, float], ...]  # name in `losses.LOSSES`, weight

L1_SSIM: Loss = (("l1", 0.8), ("ssim", 0.2))


@dataclass(frozen=True)
class Phase:
    """A stretch of the fit at one resolution.

    `resolution`: the picture is scaled down to about this many pixels squared. `rate` and `end_rate` scale all
    learning rates at the start and at the end, along half a cosine.
    """

    name: str
    steps: int
    resolution: int
    rate: float = 1.0
    end_rate: float = 1.0
    loss: Loss = L1_SSIM


PRESETS: dict[str, tuple[Phase, ...]] = {
    "fast": (
        Phase("coarse", 100, 40),
        Phase("fine", 80, 80, rate=0.8, end_rate=0.05),
    ),
    "balanced": (
        Phase("coarse", 200, 48),
        Phase("middle", 150, 96, rate=0.8, end_rate=0.5),
        Phase("fine", 120, 144, rate=0.5, end_rate=0.03),
    ),
    "best": (
        Phase("coarse", 400, 48),
        Phase("middle", 400, 96, rate=0.8, end_rate=0.5),
        Phase("fine", 400, 192, rate=0.5, end_rate=0.02),
    ),
}
DEFAULT = "balanced"

# Learning rates per step on a canvas of area 1, by what a tensor means (units as in `shapes.Parameter`).
RATES = {
    "position": 0.005,
    "length": 0.003,
    "angle": 0.03,
    "frequency": 0.3,
    "color": 0.02,
    "opacity": 0.02,
    "falloff": 0.003,
    "smoothness": 0.003,
    "background": 0.01,
}
LENGTHS = ("position", "length", "falloff", "smoothness")  # grow with the canvas

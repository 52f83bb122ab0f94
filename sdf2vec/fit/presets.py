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
        Phase("coarse", 120, 48),
        Phase("fine", 100, 112, rate=0.8, end_rate=0.05),
    ),
    "balanced": (
        Phase("coarse", 300, 64),
        Phase("middle", 250, 128, rate=0.8, end_rate=0.4),
        Phase("fine", 150, 256, rate=0.4, end_rate=0.02),
    ),
    "best": (
        Phase("coarse", 600, 64),
        Phase("middle", 700, 160, rate=0.8, end_rate=0.4),
        Phase("fine", 500, 320, rate=0.4, end_rate=0.01),
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

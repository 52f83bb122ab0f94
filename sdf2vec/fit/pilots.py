"""Which of several kinds serve a picture: a short fit of each alone says what share of the shapes it gets."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from msgspec import structs

from .presets import Phase, Preset, Relocation
from .settings import Settings

PHASE = Phase("kinds", 60, 64, end_rate=0.1, relocation=Relocation(every=20, share=0.05))
LAYERS = 64  # at most, of a pilot
TENTH = 0.5  # dB that a kind's pilot is worse by than the best for it to get a tenth of that one's share


def pilot_settings(settings: Settings, kind: str, layers: int) -> Settings:
    """Those of a fit, for a pilot with one kind alone."""
    shapes = min(LAYERS, layers) * settings.union
    return structs.replace(
        settings, kind=(kind,), shapes=shapes, palette=(), colors=None, trials=0, cuts=0, start=None
    )


def pilot_preset(preset: Preset) -> Preset:
    """A fit's preset, with the only phase of a pilot."""
    return replace(preset, phases=(PHASE,), sharpens=False)


def shares_of(decibels: Sequence[float]) -> tuple[float, ...]:
    """How much of the shapes each kind gets, summing to 1, by how near its pilot came to the picture."""
    best = max(decibels)
    shares = [10.0 ** ((near - best) / TENTH) for near in decibels]
    return tuple(share / sum(shares) for share in shares)

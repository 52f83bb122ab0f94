"""Fits of few steps."""

from dataclasses import replace

import pytest

from sdf2vec.fit.presets import PRESETS, Phase, Preset, Relocation


@pytest.fixture
def short_fits(monkeypatch):
    """Fits of 60 steps, with relocation early and often; the thesis' with four batches, too."""
    often = Relocation(every=10, share=0.25)
    fast = Preset((Phase("coarse", 40, 32, relocation=often), Phase("fine", 20, 48, rate=0.5, end_rate=0.05)))
    monkeypatch.setitem(PRESETS, "fast", fast)
    phases = tuple(replace(phase, steps=12) for phase in PRESETS["thesis"].phases)
    monkeypatch.setitem(PRESETS, "thesis", replace(PRESETS["thesis"], phases=phases))

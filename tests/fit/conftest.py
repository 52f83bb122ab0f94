"""Fits of few steps; pictures that resvg draws."""

from dataclasses import replace

import numpy as np
import pytest

from sdf2vec.engines import resvg
from sdf2vec.fit.presets import DEFAULT, PRESETS, Phase, Preset, Relocation
from sdf2vec.image import Picture


@pytest.fixture
def short_fits(monkeypatch):
    """Fits of 60 steps, with relocation early and often; the thesis' with four batches, too."""
    often = Relocation(every=10, share=0.25)
    fast = Preset((Phase("coarse", 40, 32, relocation=often), Phase("fine", 20, 48, rate=0.5, end_rate=0.05)))
    monkeypatch.setitem(PRESETS, "fast", fast)
    phases = tuple(replace(phase, steps=12) for phase in PRESETS["thesis"].phases)
    monkeypatch.setitem(PRESETS, "thesis", replace(PRESETS["thesis"], phases=phases))


@pytest.fixture
def few_steps(monkeypatch):
    """A tenth of the steps of two presets, for what does not depend on how near a fit comes in the end."""
    for name in ("fast", DEFAULT):
        monkeypatch.setitem(PRESETS, name, PRESETS[name].paced(0.1))


@pytest.fixture
def drawn(require_engine):
    """The picture that resvg draws of SVG elements."""
    require_engine("resvg")

    def draw(shapes, width=96, height=96):
        text = f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}">{shapes}</svg>'
        pixels = resvg.render(text, width, height)
        opaque = bool((pixels[..., 3] == 1.0).all())
        return Picture(np.ascontiguousarray(pixels[..., : 3 if opaque else 4], dtype=np.float32))

    return draw

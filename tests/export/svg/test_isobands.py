"""Bands of a soft edge: no gaps, not too many."""

import numpy as np
import pytest

from sdf2vec import Layer, Scene, Shape
from sdf2vec.render.reference import render
from tests.export.svg.drawings import BLURRING, Parameters, off_in, text_of


@pytest.mark.parametrize(
    ("engine", "profile"), [*((e, "filters") for e in BLURRING), ("cairosvg", "portable")]
)
def test_bands_leave_no_gaps(engine, profile, require_engine):
    """No pixel is in two rings (but in cairo, where a hole is one pixel wide) or in none."""
    require_engine(engine)
    numbers: Parameters = {"center": (0.4, 0), "radius": 0.3, "amplitude": 0.1, "frequency": (12, 9)}
    layer = Layer((Shape.of("displaced", (1, 1, 1), **numbers),), 0.4, 0.8)
    scene = Scene(150, 100, (layer,), (0, 0, 0))
    assert ("crispEdges" in text_of(scene, svg_profile=profile)) == (profile == "filters")
    for size in ((150, 100), (300, 200), (450, 300), (615, 410)):
        off = off_in(engine, scene, size, svg_profile=profile)
        wrong = np.count_nonzero(255 * np.abs(off).max(axis=2) > 16)
        assert wrong <= (6 if engine == "librsvg" else 0)
        assert abs(off.mean()) <= (0.5 if profile == "filters" else 2.0) / 255


@pytest.mark.parametrize("engine", ["resvg", "librsvg", "chromium", "firefox", "cairosvg"])
@pytest.mark.parametrize("falloff", [3.0, 5.0, 8.0])
def test_the_bands_of_a_narrow_edge_are_not_too_many(engine, falloff, require_engine):
    """Two dozen within five pixels lose eleven levels in browsers, and where they overlap they are too dense."""
    require_engine(engine)
    look: Parameters = {
        "center": (0.013, -0.021),
        "radius": 0.2,
        "amplitude": 0.004,
        "frequency": (50.0, 60.0),
    }
    shape = Shape.of("displaced", (1.0, 1.0, 1.0), **look)
    scene = Scene(512, 512, (Layer((shape,), falloff / 512),), (0.0, 0.0, 0.0))
    wanted = render(scene).permute(1, 2, 0).numpy()[..., 0]
    edge = (wanted > 0.1) & (wanted < 0.9)
    off = off_in(engine, scene, svg_profile="portable")[..., 0][edge]
    assert abs(off.mean()) <= 4.0 / 255
    assert off.std() <= 11.0 / 255

"""Bands of a soft edge: no gaps, not too many."""

import numpy as np
import pytest

from sdf2vec import Layer, Scene, Shape
from sdf2vec.export.svg.canvas import Canvas
from sdf2vec.export.svg.isobands import (
    FEWEST_BANDS,
    MOST_BANDS,
    Band,
    band_count,
    band_edges,
    cover_bands,
    edge_distance,
    layer_contours,
    stacked,
    trace_grid,
)
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


def test_inkscape_sees_no_seams_in_its_profile(require_engine):
    """It smooths the edges of slices, too, whatever they ask for: light shines through where they meet."""
    require_engine("inkscape")
    box = Shape.of(
        "box", (0.1, 0.1, 0.1), center=(0.02, 0.01), half_size=(0.4, 0.3), angle=0.4, corner_radius=0
    )
    scene = Scene(150, 100, (Layer((box,), 0.06),), (1.0, 1.0, 1.0))
    assert "crispEdges" not in text_of(scene, svg_profile="inkscape")
    seen = {
        profile: 255 * np.abs(off_in("inkscape", scene, svg_profile=profile)).max()
        for profile in ("portable", "inkscape")
    }
    assert seen["inkscape"] <= 10
    assert seen["portable"] >= 20, "it is fit for Inkscape now: README and docs/svg.md may say so"


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


def test_rings_are_their_own_coverage_and_steps_add_what_is_missing():
    """A quarter, then a third of what is left makes a half, then all."""
    outer, middle, core = ([np.full((3, 2), float(i))] for i in range(3))
    bands = [Band(0.25, outer), Band(0.5, middle), Band(1.0, core)]
    rings = [(outer + middle, 0.25), (middle + core, 0.5), (core, 1.0)]
    assert list(stacked(bands, True)) == rings
    assert list(stacked(bands, False)) == [
        (outer, 0.25),
        (middle, pytest.approx(1 / 3)),
        (core, 1.0),
    ]


def test_bands_begin_half_way_between_their_coverages():
    assert band_edges(3) == [0.125, 0.375, 0.625, 0.875]
    assert edge_distance(0.5) == pytest.approx(0.5, abs=1e-3)
    assert edge_distance(0.125) > 0.5 > edge_distance(0.875)


def test_the_number_of_bands():
    """Steps of 1 / n of 255 levels are off by that over the root of 12; an edge of 5 pixels takes 6 bands."""
    assert band_count(0.0, 1.0) == FEWEST_BANDS
    assert band_count(1.0, 1e-3) == MOST_BANDS
    assert band_count(1.0, 255 / 12**0.5 / 10.5) == 10
    assert band_count(1.0, 1e-3, 5.0) == 6


def test_contours_of_a_disc_lie_on_its_edge():
    canvas = Canvas.of(Scene(300, 200, (), None))
    disc = Layer((Shape.of("circle", (1, 1, 1), center=(0, 0), radius=0.25),), 0.1)
    outer, inner = layer_contours(disc, [1.0, 0.0], canvas)
    assert [band.cover for band in (outer, inner)] == [0.5, 1.0]
    for band, radius in ((outer, 70.0), (inner, 50.0)):
        (contour,) = band.contours
        assert np.abs(np.hypot(*(contour - (150.0, 100.0)).T) - radius).max() < 0.02
    grid = trace_grid(disc, canvas)
    assert grid is not None
    bands = cover_bands(np.clip(0.75 - np.hypot(grid.x[None], grid.y[:, None]), 0, 1), 1, grid, canvas)
    assert [band.cover for band in bands] == [0.5, 1.0]

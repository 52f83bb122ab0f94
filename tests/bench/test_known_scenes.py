"""Known scenes: areas by hand, resvg against numpy, and that shapes lie as their mode says."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.ndimage import binary_dilation

from sdf2vec.bench.known_drawing import Figure, KnownScene, KnownShape, grid, sampled
from sdf2vec.bench.known_scenes import COUNTS, MODES, known_scene

SIDE = 64
DISC = Figure("circle", (30.3, 33.1, 20.0))
TURNED_BOX = Figure("box", (33.0, 30.0, 22.0, 11.0, 0.5))
FIGURES = [
    (DISC, math.pi * 400),
    (Figure("ellipse", (31.0, 30.0, 24.0, 10.0, 2.0)), math.pi * 240),
    (TURNED_BOX, 4 * 22 * 11),
    (Figure("triangle", (8.0, 9.0, 55.0, 20.0, 20.0, 58.0)), 0.5 * (47 * 49 - 11 * 12)),
]


def scene_of(*shapes):
    return KnownScene(SIDE, (0.0, 0.0, 0.0), shapes)


@pytest.mark.parametrize(("figure", "area"), FIGURES)
def test_a_sharp_figure_covers_its_area(require_engine, figure, area):
    """By resvg and by samples: white on black sums up to the area by the school's formula."""
    require_engine("resvg")
    known = scene_of(KnownShape(figure, (1.0, 1.0, 1.0)))
    assert known.pixels[..., 0].sum() == pytest.approx(area, rel=0.008)
    assert sampled(known)[..., 0].sum() == pytest.approx(area, rel=0.004)


def test_a_soft_disc_covers_more():
    """The integral of the logistic edge: π (R² + π² s² / 3), half-way at R = r + f / 2, s = f / 10."""
    falloff = 6.0
    known = scene_of(KnownShape(DISC, (1.0, 0.5, 0.0), falloff=falloff))
    area = math.pi * ((20 + falloff / 2) ** 2 + (math.pi * falloff / 10) ** 2 / 3)
    drawn = sampled(known).sum(axis=(0, 1))
    np.testing.assert_allclose(drawn, (area, 0.5 * area, 0), rtol=0.001)


def test_what_is_cut_away_and_what_shines_through():
    ring = KnownShape(DISC, (1.0, 1.0, 1.0), opacity=0.4, cut=DISC.scaled(0.5))
    for drawn in (sampled(scene_of(ring)), scene_of(ring).pixels):
        assert drawn[..., 0].sum() == pytest.approx(0.4 * math.pi * (400 - 100), rel=0.005)
        assert drawn[33, 30, 0] == 0


@pytest.mark.parametrize(("figure", "area"), FIGURES)
def test_resvg_and_samples_draw_the_same(require_engine, figure, area):
    """Turned shapes and cut-outs over each other: nothing but the antialiasing differs."""
    require_engine("resvg")
    below = KnownShape(TURNED_BOX, (0.2, 0.9, 0.4), 0.7, cut=TURNED_BOX.scaled(0.5))
    known = scene_of(below, KnownShape(figure, (0.9, 0.1, 0.6), 0.5, cut=figure.scaled(0.6)))
    difference = np.abs(known.pixels - sampled(known))
    assert difference.max() < 0.12
    assert difference.mean() < 0.002


@pytest.mark.parametrize(("figure", "area"), FIGURES)
def test_sizes_and_scaling(figure, area):
    """The circles in and around a figure, about its middle, by its coverage; half of it has a quarter of the area."""
    x, y = grid(SIDE)
    mask = KnownShape(figure, (1, 1, 1)).cover(x, y) > 0.5
    away = np.hypot(x - figure.center[0], y - figure.center[1])
    inner, outer = figure.sizes
    assert away[~mask].min() == pytest.approx(inner, abs=0.8)
    assert away[mask].max() == pytest.approx(outer, abs=2)
    smaller = KnownShape(figure.scaled(0.5), (1, 1, 1)).cover(x, y)
    assert smaller.sum() == pytest.approx(area / 4, rel=0.03)
    assert not (smaller > mask).any()


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("count", COUNTS[:-1])
def test_as_many_shapes_as_asked_for_and_the_same_again(mode, count):
    known = known_scene(count, mode, soft=bool(count % 3), seed=5)
    assert len(known.shapes) == count
    assert known == known_scene(count, mode, soft=bool(count % 3), seed=5)
    assert not count or known != known_scene(count, mode, soft=bool(count % 3), seed=6)


def masks_of(known):
    x, y = grid(known.side)
    return [shape.cover(x, y) >= 0.5 for shape in known.shapes]


@pytest.mark.parametrize("soft", [False, True])
def test_shapes_that_are_apart_do_not_touch(soft):
    """Grown by a pixel, no pixel is in two of them."""
    grown = [binary_dilation(mask, iterations=1) for mask in masks_of(known_scene(16, "apart", soft, 1))]
    assert np.sum(grown, axis=0).max() == 1


@pytest.mark.parametrize("mode", MODES)
def test_no_shape_is_cut_off_by_the_edge(mode):
    """Two pixels around the canvas are free, even where shapes are large."""
    for seed in range(16):
        covered = np.any(masks_of(known_scene(2, mode, bool(seed % 2), seed)), axis=0)
        assert not covered[[0, 1, -2, -1]].any()
        assert not covered[:, [0, 1, -2, -1]].any()


@pytest.mark.parametrize("soft", [False, True])
def test_shapes_that_overlap_stay_in_sight(soft):
    known = known_scene(16, "overlap", soft, 1)
    masks = masks_of(known)
    assert known.is_sharp != soft
    for index, own in enumerate(masks):
        if index % 2:
            assert (own & np.any(masks[:index], axis=0)).sum() >= 0.1 * own.sum()
        above = [
            m for s, m in zip(known.shapes[index + 1 :], masks[index + 1 :], strict=True) if s.opacity == 1
        ]
        hidden = np.any(above, axis=0) if above else np.zeros_like(own)
        assert (own & ~hidden).sum() >= 0.6 * own.sum()


@pytest.mark.parametrize("mode", MODES)
def test_every_shape_can_be_seen(mode):
    """Laid on those before it, it changes nine in ten of its pixels by 0.15 in some channel."""
    for seed in range(3):
        known = known_scene(12, mode, False, seed)
        steps = [sampled(replace(known, shapes=known.shapes[:n]), samples=1) for n in range(13)]
        for before, after, mask in zip(steps, steps[1:], masks_of(known), strict=False):
            change = np.abs(after - before).max(axis=2)[mask]
            assert np.quantile(change, 0.1) >= 0.15 - 1e-9


def test_holes_can_be_seen():
    """A cut-out takes three tenths of a figure at least, whatever its edge; there are some."""
    x, y = grid(SIDE * 3)
    cut = [s for seed in range(8) for s in known_scene(4, "apart", bool(seed % 2), seed).shapes if s.cut]
    assert len(cut) >= 3
    for shape in cut:
        whole, own = (one.cover(x, y) >= 0.5 for one in (replace(shape, cut=None), shape))
        assert own.sum() <= 0.7 * whole.sum()

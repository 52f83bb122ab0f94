"""Radial gradients told from pictures, which are drawn in numpy by their formula."""

from __future__ import annotations

import numpy as np
import pytest

from sdf2vec.fit.color_stops import MIDDLES, NO_MIDDLE, Samples
from sdf2vec.fit.rings import Around
from tests.fit.drawn import HALF, RISE, everywhere, shown

FIRST = HALF - 0.5 * RISE


def rings_of(inside, pixels, middles=NO_MIDDLE):
    return Around(Samples.of(inside, pixels)).rings(middles)


def picture(middle, radii, span=(0.0, 1.0), size=(80, 120)):
    """Pixels [H, W, 3] of ellipses around a middle, in 8 bits: `FIRST` there, `RISE` more at their rim."""
    y, x = np.mgrid[: size[0], : size[1]] + 0.5
    away = np.hypot((x - middle[0]) / radii[0], (y - middle[1]) / radii[1])
    share = ((away - span[0]) / (span[1] - span[0])).clip(0.0, 1.0)
    return (np.rint((FIRST + share[..., None] * RISE) * 255) / 255).astype(np.float32)


@pytest.mark.parametrize("middle", [(60.0, 40.0), (20.0, 70.0), (-30.0, 100.0)])
@pytest.mark.parametrize("radii", [(150.0, 150.0), (200.0, 120.0)], ids=["round", "squeezed"])
def test_its_middle_its_form_and_its_colours(middle, radii):
    pixels = picture(middle, radii)
    rings = rings_of(everywhere(pixels), pixels)
    assert rings is not None
    assert rings.place * (120, 80) == pytest.approx(middle, abs=1.0)
    assert rings.squeeze == pytest.approx(radii[0] / radii[1], rel=0.02)
    assert np.abs(shown(rings, pixels) - pixels).max() < 0.008
    assert rings.axis == pytest.approx(np.sign(rings.axis @ RISE) * RISE / np.linalg.norm(RISE), abs=0.01)


def test_where_it_begins_and_ends():
    pixels = picture((60.0, 40.0), (60.0, 60.0), (0.3, 0.8))
    rings = rings_of(everywhere(pixels), pixels)
    assert rings is not None
    assert rings.stops.values * 80 == pytest.approx([18.0, 48.0], abs=0.5)
    assert np.abs(shown(rings, pixels) - pixels).max() < 0.008


def test_of_a_part_of_a_picture():
    """What is outside has no part in it."""
    pixels = picture((50.0, 30.0), (90.0, 90.0))
    inside = everywhere(pixels)
    inside[:, 70:] = inside[:12] = False
    elsewhere = np.where(inside[..., None], pixels, np.float32(0.5))
    rings = rings_of(inside, elsewhere)
    assert rings is not None
    assert rings.place * (120, 80) == pytest.approx([50.0, 30.0], abs=0.5)


def test_a_few_pixels_tell_none():
    pixels = picture((60.0, 40.0), (60.0, 60.0))
    inside = np.zeros(pixels.shape[:2], bool)
    inside[:10, :10] = True
    assert rings_of(inside, pixels) is None


def test_of_three_colours():
    y, x = np.mgrid[:80, :120] + 0.5
    away = np.hypot(x - 50, y - 30)
    colors = np.array([[1.0, 0.9, 0.8], [0.4, 0.7, 1.0], [0.1, 0.2, 0.4]])
    levels = np.stack([np.interp(away, (0, 35, 80), channel) for channel in colors.T], axis=2)
    pixels = (np.rint(levels * 255) / 255).astype(np.float32)
    rings = rings_of(everywhere(pixels), pixels, MIDDLES)
    assert rings is not None
    assert rings.place * (120, 80) == pytest.approx([50.0, 30.0], abs=0.5)
    assert rings.stops.values[1] * 80 == pytest.approx(35.0, abs=0.5)
    assert np.abs(shown(rings, pixels) - pixels).max() < 0.008
    two = rings_of(everywhere(pixels), pixels)
    assert two is None or np.abs(shown(two, pixels) - pixels).max() > 0.05

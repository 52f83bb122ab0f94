"""Parts of a picture at its own size and at smaller ones; against means by hand."""

from __future__ import annotations

import numpy as np
import pytest

from sdf2vec.fit.windows import NOWHERE, extent, larger, means, moved, smaller, widened

SIDES, SMALL = (17, 23), (5, 7)


def test_what_something_is_in():
    mask = np.zeros(SIDES, bool)
    assert extent(mask) == NOWHERE
    mask[3:6, 10], mask[4, 12] = True, True
    assert extent(mask) == np.s_[3:6, 10:13]
    assert moved(np.s_[1:2, 0:3], np.s_[3:6, 10:13]) == np.s_[4:5, 10:13]
    assert widened(np.s_[3:6, 10:13], 5, SIDES) == np.s_[0:11, 5:18]


def fine(mask):
    """The means of blocks that are no whole pixels, by samples that are."""
    (height, width), (rows, columns) = SIDES, SMALL
    samples = mask.repeat(rows, axis=0).repeat(columns, axis=1)
    return samples.reshape(rows, height, columns, width).mean(axis=(1, 3))


@pytest.mark.parametrize("part", [np.s_[0:17, 0:23], np.s_[2:9, 5:6], np.s_[16:17, 20:23]])
def test_means_are_those_of_the_blocks_and_nothing_is_missed(part):
    mask = np.random.default_rng(0).random(SIDES) < 0.5
    kept = np.zeros(SIDES, bool)
    kept[part] = mask[part]
    expected = fine(kept)
    window = smaller(part, SIDES, SMALL)
    inside = np.zeros(SMALL, bool)
    inside[window] = True
    assert not expected[~inside].any()
    found = means(kept[larger(window, SIDES, SMALL)], window, SIDES, SMALL)
    assert found == pytest.approx(expected[window], abs=1e-6)


def test_at_its_own_size_a_pixel_is_itself():
    mask = np.random.default_rng(0).random(SIDES) < 0.5
    part = np.s_[2:9, 5:16]
    assert smaller(part, SIDES, SIDES) == larger(part, SIDES, SIDES) == part
    assert (means(mask[part], part, SIDES, SIDES) == mask[part]).all()

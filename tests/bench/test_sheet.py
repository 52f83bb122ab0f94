"""Pictures beside and below each other."""

import numpy as np
import pytest

from sdf2vec.bench.sheet import over_white, spaced


def test_white_between_and_after_a_shorter_row():
    black = np.zeros((2, 3, 3), np.float32)
    row = spaced([black, black], across=True, gutter=1)
    assert row[..., 0].tolist() == [[0, 0, 0, 1, 0, 0, 0]] * 2
    sheet = spaced([row, black], across=False, gutter=2)
    assert sheet[..., 0].tolist() == [[0, 0, 0, 1, 0, 0, 0]] * 2 + [[1] * 7] * 2 + [[0, 0, 0, 1, 1, 1, 1]] * 2


def test_over_white():
    half = np.array([[[0.5, 0.0, 1.0, 0.5]]], np.float32)
    assert over_white(half)[0, 0].tolist() == pytest.approx([0.75, 0.5, 1.0])

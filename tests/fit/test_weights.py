"""Fits that look at some parts of a picture more than at others."""

from dataclasses import replace

import numpy as np
import pytest

from sdf2vec.fit.presets import PRESETS
from sdf2vec.fit.weights import weights_for, weights_of
from sdf2vec.metrics import mse
from sdf2vec.render.reference import render
from tests.fit.fitting import (
    as_tensor,
    busy,
    error,
    fitted,
)

pytestmark = pytest.mark.usefixtures("short_fits")


def test_weights_draw_the_fit_to_the_bright_part():
    pic, mask = busy(), np.zeros((8, 12), dtype=np.float32)
    mask[:, :6] = 1.0
    plain, weighted = fitted(pic, 10), fitted(pic, 10, weights=mask)
    left = slice(None), slice(None), slice(0, 24)
    errors = [float(mse(render(s)[:3][left], as_tensor(pic)[left])) for s in (plain, weighted)]
    assert errors[1] < 0.8 * errors[0]
    assert error(weighted, pic) > error(plain, pic)


def test_steps_follow_the_weights(monkeypatch):
    """Without relocation, too: the losses themselves see them."""
    phases = tuple(replace(phase, relocation=None) for phase in PRESETS["fast"].phases)
    monkeypatch.setitem(PRESETS, "fast", replace(PRESETS["fast"], phases=phases))
    pic, mask = busy(), np.zeros((8, 12), dtype=np.float32)
    mask[:, :6] = 1.0
    left = slice(None), slice(None), slice(0, 24)
    errors = [
        float(mse(render(fitted(pic, 10, weights=w))[:3][left], as_tensor(pic)[left])) for w in (None, mask)
    ]
    assert errors[1] < 0.9 * errors[0]


def test_weights_all_white_change_nothing():
    assert fitted(weights=np.ones((5, 5), dtype=np.float32)) == fitted()


def test_weights_by_hand():
    """A mean of channels; times alpha; at another size by area."""
    assert weights_of(np.array([[[0.3, 0.6, 0.9]]]))[0, 0] == pytest.approx(0.6, abs=1e-6)  # type: ignore[index]
    half = weights_of(np.array([[[1.0, 1.0, 1.0, 0.5]]]))
    assert half is not None
    assert half[0, 0] == pytest.approx(0.5)
    assert weights_for(np.array([[0.0, 1.0]], np.float32), 1, 1).tolist() == [[pytest.approx(0.5)]]
    assert weights_for(np.ones((3, 3), np.float32), 7, 5).shape == (5, 7)

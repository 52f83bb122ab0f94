"""Kinds are dealt in shares that short fits of each find."""

import numpy as np
import pytest
import torch
from PIL import Image, ImageDraw

from sdf2vec.fit.initialization import Layers, Places, groups_at
from sdf2vec.fit.loop import Fit
from sdf2vec.fit.pilots import shares_of
from sdf2vec.fit.settings import settings_of
from sdf2vec.image import load


def test_half_a_decibel_worse_is_a_tenth_of_the_share():
    assert shares_of([20.0, 19.5, 20.0]) == pytest.approx((10 / 21, 1 / 21, 10 / 21))
    assert shares_of([80.0]) == (1.0,)


def test_layers_are_dealt_in_shares():
    count = 2000
    places = Places(torch.zeros(count, 2), torch.ones(count), torch.ones(count, 4))
    layers = Layers(("circle", "box", "triangle"), "over", shares=(0.7, 0.0, 0.3))
    groups = groups_at(places, layers, torch.Generator().manual_seed(1))
    assert [len(group) for group in groups] == pytest.approx([1400, 0, 600], abs=80)
    assert torch.cat([group.order for group in groups]).unique().numel() == count


def stripes():
    """Thin dark lines, turned: boxes, and nothing round."""
    picture = Image.new("RGB", (48, 48), "white")
    draw = ImageDraw.Draw(picture)
    for left in range(-40, 48, 10):
        draw.line([(left, 0), (left + 40, 48)], "black", 3)
    return np.asarray(picture)


def test_what_serves_gets_the_shapes():
    fit = Fit(load(stripes()), settings_of(16, kind="circle,box", preset="fast"), lambda progress: False)
    fit.run()
    kinds = [shape.kind for layer in fit.scene().layers for shape in layer.shapes]
    assert kinds.count("box") >= 14


def test_a_callback_stops_a_pilot_too():
    seen = []

    def callback(progress):
        seen.append(progress)
        return len(seen) >= 5

    fit = Fit(load(stripes()), settings_of(16, kind="circle,box", preset="fast"), callback)
    fit.run()
    assert fit.stopped
    assert len(seen) <= 10
    assert fit.scene().shape_count == 8  # it begins with half of them
    assert all(0 <= progress.step <= progress.steps == 2 * 60 + 4 * 200 + 180 for progress in seen)

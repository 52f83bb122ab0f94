"""Presets, and settings that are refused."""

from dataclasses import replace

import numpy as np
import pytest
import torch

import sdf2vec
from sdf2vec import Layer, Scene, Sdf2vecError, Shape
from sdf2vec.fit.adam import adam_over
from sdf2vec.fit.loop import Fit, Progress
from sdf2vec.fit.presets import MANY, Phase, Preset
from sdf2vec.fit.settings import Settings, preset_of, settings_of
from sdf2vec.image import Picture
from tests.fit.fitting import AS_NUMBERS, PALETTE, RED, START, fitted, picture, remember

pytestmark = pytest.mark.usefixtures("short_fits")
CIRCLE = ("circle",)


def test_phases_grow_with_the_number_of_shapes():
    """By hand: with 16 times as many shapes, twice as many pixels a side."""
    phase, share = Phase("any", 1, 64), Phase("any", 1, 0.5)
    preset = Preset((phase, share))
    assert preset.resolution(phase, 1) == preset.resolution(phase, MANY) == 64
    assert preset.resolution(phase, 16 * MANY) == pytest.approx(128)
    assert preset.resolution(share, 16 * MANY) == 0.5
    assert replace(preset, sharpens=False).resolution(phase, 16 * MANY) == 64


def test_the_preset_takes_what_is_set():
    settings = settings_of(preset="fast", loss="mse", min_area=0.01)
    assert {phase.loss for phase in preset_of(settings).phases} == {(("mse", 1.0),)}
    assert preset_of(settings).least_area == 0.01
    assert preset_of(settings_of(preset="thesis")).least_area == 3e-4
    assert preset_of(settings_of(preset="thesis", min_area=0)).least_area == 0
    assert preset_of(settings_of(preset="thesis", max_falloff=0.5)).falloff == (0.01, 0.5)
    assert preset_of(settings_of(preset="thesis", max_falloff=0)).falloff == (0, 0)
    assert preset_of(settings_of(paint="linear")).steps == 1.5 * preset_of(settings_of()).steps
    assert preset_of(settings_of(preset="thesis", max_falloff=1.2)).falloff == (0.01, 0.99)


def thesis_picture():
    return picture(64, 48)


@pytest.mark.usefixtures("kernels_there")
def test_the_thesis_preset_keeps_its_ranges(monkeypatch):
    def never(*arguments):
        pytest.fail("a layer was relocated")

    monkeypatch.setattr(Fit, "_relocate", never)
    seen: list[Progress] = []
    scene = fitted(thesis_picture(), 10, kind="ellipse", preset="thesis", callback=remember(seen))
    assert scene.compositing == "additive"
    assert len(seen) == 12 + 4 * 12
    for layer in scene.layers:
        assert 0.01 - 1e-6 <= layer.falloff <= 0.99 + 1e-6
        assert all(-1 <= value <= 1 for value in layer.shapes[0].color)
    assert any(value < 0 for layer in scene.layers for value in layer.shapes[0].color)


def test_the_thesis_falloffs_are_held_against_a_sharp_picture():
    pixels = np.zeros((32, 32, 3), dtype=np.float32)
    pixels[8:24, 8:24] = 1.0
    for start in (0.0001, 1.4):
        circle = Layer((Shape.of("circle", RED, center=(0, 0), radius=0.3),), start)
        begin = Scene(32, 32, (circle,), (0, 0, 0), "additive")
        kinds = ["circle", "ellipse"]
        (layer,) = fitted(Picture(pixels), 1, kind=kinds, preset="thesis", start=begin).layers
        assert 0.01 - 1e-6 <= layer.falloff <= 0.99 + 1e-6


def test_a_batch_leaves_the_others_alone():
    fit = Fit(
        thesis_picture(),
        Settings(8, ("circle", "ellipse"), "additive", "thesis", min_area=0.0),
        lambda progress: False,
    )
    batches = fit.phases[1]
    stage = fit._stage(batches)

    def state():
        return {
            int(order): torch.cat([t.detach()[row] for t in group.values.values()])
            for group in fit.tensors.groups
            for row, order in enumerate(group.order)
        }

    ground = fit.tensors.background.detach().clone()
    fit._train(replace(stage, phase=replace(batches, steps=1)), lambda group: group.order < 0)
    before = state()
    fit.optimizer = adam_over(fit.tensors)
    fit._train(stage, lambda group: group.order % 4 == 1)
    moved = {order for order, values in state().items() if not torch.equal(values, before[order])}
    assert moved == {1, 5}
    assert torch.equal(fit.tensors.background.detach(), ground)


OVER = Scene(48, 32, (), (0.0, 0.0, 0.0))
ADDITIVE = Scene(48, 32, (), (0.0, 0.0, 0.0), "additive")


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"preset": "thesis", "compositing": "over"}, "preset thesis is for --compositing additive"),
        ({"preset": "thesis", "start": OVER}, "preset thesis is for --compositing additive"),
        ({"start": ADDITIVE, "compositing": "over"}, "start scene is additive, not over"),
        ({"start": "missing.json"}, "missing.json: cannot read the scene"),
        ({"start": 3}, "a scene or the path of its file, got int"),
        ({"start": b"{}"}, "a scene or the path of its file, got bytes"),
        ({"union": 0}, r"number of shapes joined \(union\) .* got 0"),
        ({"union": 10**6}, "got 1000000"),
        ({"union": None}, "got None"),
        ({"union": 3}, "8 shapes can't be joined by 3: choose a multiple of 3"),
        ({"trials": -1}, "number of trials .* got -1"),
        ({"trials": 1.5}, "number of trials .* got 1.5"),
        ({"min_area": -0.1}, "least area .* between 0 and 0.1, got -0.1"),
        ({"min_area": 0.11}, "least area .* got 0.11"),
        ({"min_area": float("nan")}, "least area .* got nan"),
        ({"min_area": "much"}, "least area .* got 'much'"),
        ({"max_falloff": -0.01}, "largest falloff .* between 0 and 1.5, got -0.01"),
        ({"max_falloff": 1.6}, "largest falloff .* got 1.6"),
        ({"max_falloff": float("nan")}, "largest falloff .* got nan"),
        ({"max_falloff": "soft"}, "largest falloff .* got 'soft'"),
        ({"palette": ""}, "#rgb or #rrggbb, got ''"),
        ({"palette": []}, "at least one colour"),
        ({"palette": 3}, "unknown palette 3"),
        ({"palette": "#12"}, "#rgb or #rrggbb, got '#12'"),
        ({"palette": "red"}, "got 'red'"),
        ({"palette": "#123,"}, "got ''"),
        ({"palette": [(0, 0)]}, r"three numbers 0..1, got \(0, 0\)"),
        ({"palette": [(0, 0, 1.5)]}, "three numbers 0..1"),
        ({"palette": [(0, 0, float("nan"))]}, "three numbers 0..1"),
        ({"palette": [None]}, "three numbers 0..1, got None"),
        ({"palette": "#123", "colors": 2}, "either a palette or a number of colours"),
        ({"palette": "#123", "compositing": "additive"}, "a palette needs --compositing over"),
        ({"colors": 2, "preset": "thesis"}, "a palette needs --compositing over"),
        ({"colors": 2, "start": ADDITIVE}, "a palette needs --compositing over"),
        ({"colors": 0}, "number of colours .* 1 and 256, got 0"),
        ({"colors": 257}, "number of colours .* got 257"),
        ({"weights": np.zeros((3, 3))}, "weights are black all over"),
        ({"weights": np.dstack([np.ones((3, 3, 3)), np.zeros((3, 3))])}, "weights are black all over"),
        ({"weights": "missing.png"}, "missing.png: no such file"),
        ({"weights": 3}, "cannot read a picture from int"),
        ({"kind": 3}, "unknown kind 3"),
        ({"loss": 3}, "unknown loss 3"),
    ],
    ids=lambda value: ",".join(value) if isinstance(value, dict) else None,
)
def test_impossible_options(options, words):
    with pytest.raises(Sdf2vecError, match=words) as caught:
        settings_of(8, **options)
    assert "\n" not in str(caught.value)


def test_compositing_follows_the_start_and_the_preset():
    assert settings_of().compositing == "over"
    assert settings_of(start=ADDITIVE).compositing == "additive"
    assert settings_of(preset="thesis").compositing == "additive"
    assert settings_of(preset="thesis", start=ADDITIVE).compositing == "additive"


def test_palettes_as_text_and_as_numbers():
    assert set(settings_of(palette=PALETTE).palette) == AS_NUMBERS
    assert settings_of(palette=[(0, 0.5, 1), "#fff"]).palette == ((0.0, 0.5, 1.0), (1.0, 1.0, 1.0))
    assert settings_of(palette=" #000 , #FFFFFF ").palette == ((0.0, 0.0, 0.0), (1.0, 1.0, 1.0))


def test_a_start_may_be_a_file(tmp_path):
    path = tmp_path / "start.scene.json"
    path.write_text(sdf2vec.dumps(START))
    assert settings_of(start=path) == settings_of(start=START)
    assert settings_of(start=str(path)).start == START

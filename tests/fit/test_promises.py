"""What a fit keeps whatever else is asked: trials, least areas, largest falloffs, unions; the same twice."""

import os
from typing import Any

import numpy as np
import pytest

from sdf2vec import Layer, Scene, Shape
from sdf2vec.fit import loop
from sdf2vec.fit.loop import Fit, Progress
from sdf2vec.image import Picture
from sdf2vec.render.fused import composite
from sdf2vec.units import MARGIN
from tests.fit.fitting import (
    PALETTE,
    RED,
    START,
    as_tensor,
    busy,
    error,
    fitted,
    picture,
    remember,
)
from tests.fit.test_constraints import measured

pytestmark = pytest.mark.usefixtures("short_fits")


def watched_trials(monkeypatch) -> list[tuple[float, float]]:
    """Losses before and after each trial."""
    losses = []

    def loss(fit, stage):
        drawn = composite(fit.tensors, 48, 32, 3)
        return float(stage.measure(drawn).detach())

    plain = Fit._try

    def watched(fit, stage):
        before = loss(fit, stage)
        try:
            plain(fit, stage)
        finally:
            losses.append((before, loss(fit, stage)))

    monkeypatch.setattr(Fit, "_try", watched)
    return losses


@pytest.mark.usefixtures("kernels_there")
def test_trials_never_make_it_worse(monkeypatch):
    losses = watched_trials(monkeypatch)
    seen: list[Progress] = []
    scene = fitted(trials=3, callback=remember(seen))
    assert scene.shape_count == 8
    assert len(losses) == 3
    assert all(after <= before + 1e-7 for before, after in losses)
    assert [p.step for p in seen] == list(range(1, 60 + 3 * loop.TRIAL_STEPS + 1))
    assert {p.steps for p in seen} == {len(seen)}
    assert {p.phase for p in seen} == {"coarse", "fine", "trial"}


def test_trials_help_where_shapes_are_of_no_use(monkeypatch):
    losses = watched_trials(monkeypatch)
    useless = Layer((Shape.of("circle", RED, center=(0.7, 0.45), radius=0.035),), 0.01, 0.1)
    scene = fitted(start=Scene(48, 32, (useless,) * 8, (0.5, 0.5, 0.5)), trials=2)
    assert scene.shape_count == 8
    assert min(after / before for before, after in losses) < 0.9


@pytest.mark.parametrize("stop", [61, 63])
def test_a_trial_that_is_stopped_does_no_harm(monkeypatch, stop):
    losses = watched_trials(monkeypatch)
    scene = fitted(trials=2, callback=lambda progress: progress.step == stop)
    ((before, after),) = losses
    assert after <= before + 1e-7
    assert scene.shape_count == 8


def test_shapes_grow_to_the_least_area():
    canvas = 48 * 32 / 32**2

    def smallest(scene: Scene) -> float:
        return min(measured("circle", layer.shapes[0].parameters)[0] for layer in scene.layers) / canvas

    assert smallest(fitted(busy(), 20)) < 0.03
    assert smallest(fitted(busy(), 20, min_area=0.06)) > 0.045


def falloffs(scene: Scene) -> list[float]:
    return [layer.falloff for layer in scene.layers]


@pytest.mark.parametrize("softest", [0.0, 0.03])
def test_no_edge_is_softer_than_the_largest_falloff(softest):
    free = fitted()
    assert max(falloffs(free)) > 0.1
    for options in ({}, {"trials": 2}, {"start": free}, {"colors": 2}, {"callback": lambda _: True}):
        assert max(falloffs(fitted(max_falloff=softest, **options))) <= softest + 1e-6


def test_sharp_shapes_learn_where_their_edges_are():
    y, x = np.mgrid[:64, :64] + 0.5
    disc = np.clip(18.5 - np.hypot(x - 28, y - 36), 0.0, 1.0).astype(np.float32)
    begin = Scene(64, 64, (Layer((Shape.of("circle", RED, center=(0, 0), radius=0.2),), 0.0),), (0, 0, 0))
    (layer,) = fitted(Picture(np.repeat(disc[..., None], 3, 2)), 1, max_falloff=0, start=begin).layers
    assert np.allclose(layer.shapes[0].parameters, (28 / 64 - 0.5, 36 / 64 - 0.5, 18 / 64), atol=0.01)


def test_unions():
    scene = fitted(shapes=6, union=2)
    assert [len(layer.shapes) for layer in scene.layers] == [2, 2, 2]
    assert all(joint.smoothness > 0 for layer in scene.layers for joint in layer.joints)
    flat = Scene(48, 32, (), tuple(as_tensor(picture()).mean(dim=(1, 2)).tolist()))
    assert error(scene, picture()) < 0.3 * error(flat, picture())


EVERYTHING: dict[str, dict[str, Any]] = {
    "plain": {},
    "weights": {"weights": np.eye(9, dtype=np.float32)},
    "palette": {"palette": PALETTE, "trials": 1},
    "colors": {"colors": 3, "union": 2},
    "area": {"min_area": 0.02},
    "start": {"start": START, "kind": "triangle", "trials": 1},  # which are turned at random
}


@pytest.mark.parametrize("name", EVERYTHING)
def test_the_same_settings_give_the_same_scene(monkeypatch, name):
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else 2
    scenes = []
    for threads in (1, max(2, cores), 1):
        monkeypatch.setenv("SDF2VEC_THREADS", str(threads))
        scenes.append(fitted(shapes=12, **EVERYTHING[name]))
    assert scenes[0] == scenes[1] == scenes[2]
    assert fitted(shapes=12, seed=1, **EVERYTHING[name]) != scenes[0]


@pytest.mark.parametrize("kind", ["circle", "triangle"])
@pytest.mark.parametrize("size", [(1, 1), (37, 2), (24, 30)])
@pytest.mark.parametrize("stop", [None, 6, 15])
def test_no_shape_is_lost_or_thinner_than_a_pixel(kind, size, stop):
    noise = np.random.default_rng(3).random((size[1], size[0], 3), dtype=np.float32)
    pixel = 1 / min(size)
    for seed in range(4):
        scene = fitted(
            Picture(noise), 9, kind=kind, seed=seed, callback=lambda progress: progress.step == stop
        )
        assert scene.shape_count == 9
        for layer in scene.layers:
            (shape,) = layer.shapes
            assert measured(kind, shape.parameters)[1] >= pixel * (1 - 1e-3)
            points = np.array(shape.parameters[:2] if kind == "circle" else shape.parameters).reshape(-1, 2)
            beyond = np.abs(points) - np.array(scene.extent) / 2
            assert beyond.max() <= MARGIN + 2 * pixel

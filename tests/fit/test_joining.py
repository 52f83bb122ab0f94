"""Shapes joined to layers by trial, on pictures that are made without this project's formulas."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import torch

import sdf2vec
from sdf2vec.fit import joining
from sdf2vec.fit.candidates import cut_from
from sdf2vec.fit.initialization import Layers
from sdf2vec.fit.loop import fit_picture
from sdf2vec.fit.settings import Settings, settings_of
from sdf2vec.fit.surroundings import Surroundings, View, layer_at
from sdf2vec.fit.views import scaled
from sdf2vec.image import Picture
from sdf2vec.metrics import psnr
from sdf2vec.render.reference import render
from sdf2vec.render.tensors import from_scene, to_scene
from sdf2vec.scene import Layer, Scene, Shape

SIDE, FINER = 96, 8


def sampled(inside):
    """White where `inside(x, y)`, x and y −1..1: the mean of many samples a pixel."""
    places = (np.arange(SIDE * FINER) + 0.5) / (SIDE * FINER) * 2 - 1
    x, y = np.meshgrid(places, places)
    white = inside(x, y).astype(np.float32).reshape(SIDE, FINER, SIDE, FINER).mean(axis=(1, 3))
    return np.repeat(white[..., None], 3, axis=2)


PICTURES = {
    "disc": sampled(lambda x, y: np.hypot(x - 0.1, y) < 0.6),
    "ring": sampled(lambda x, y: (np.hypot(x, y) < 0.7) & (np.hypot(x, y) > 0.4)),
    "frame": sampled(
        lambda x, y: (
            (np.maximum(abs(x) / 0.75, abs(y) / 0.6) < 1) & (np.maximum(abs(x) / 0.5, abs(y) / 0.35) > 1)
        )
    ),
    "spoked": sampled(
        lambda x, y: ((np.hypot(x, y) < 0.6) | ((abs(x) < 0.15) & (abs(y) < 0.85))) & (np.hypot(x, y) > 0.3)
    ),
}


def started(kind="circle"):
    """A small grey shape somewhere on black."""
    known: dict[str, dict[str, Any]] = {
        "circle": {"radius": 0.1},
        "gaussian": {"radii": (0.1, 0.1), "angle": 0.0},
    }
    values = known[kind]
    shape = Shape.of(kind, (0.5, 0.5, 0.5), center=(0.2, -0.1), **values)
    return Scene(SIDE, SIDE, (Layer((shape,), 0.1),), (0.0, 0.0, 0.0))


def joined(pixels, kinds, scene=None, seed=0, most=3):
    """What joining makes of a scene, as a scene again, and how near that is."""
    target = torch.from_numpy(np.ascontiguousarray(pixels.transpose(2, 0, 1)))
    search = joining.Search(
        Layers(kinds, "over"), (0.0, 1.5), torch.Generator().manual_seed(seed), lambda error: None, 1.0 / SIDE
    )
    tensors = from_scene(scene or started())
    sizes = scaled(pixels, joining.RESOLUTIONS[0]), target
    *_, tensors = joining.join(tensors, [View(size, None) for size in sizes], search, most)
    found = to_scene(tensors, SIDE, SIDE)
    return found, float(psnr(render(found)[:3], target))


def test_what_promises_too_little_is_not_refined():
    """A hole in a disc: its error falls far below what the disc's was, so a bound just above that refines it."""
    target = torch.from_numpy(np.ascontiguousarray(PICTURES["ring"].transpose(2, 0, 1)))
    search = joining.Search(
        Layers(("circle",), "over"),
        (0.0, 1.5),
        torch.Generator().manual_seed(0),
        lambda error: None,
        1.0 / SIDE,
    )
    around = Surroundings.of(from_scene(started()), 0, View(target, None))
    disc = search.refined(layer_at(from_scene(started()), 0), around)
    opening = cut_from(disc.layer, around)
    found = search.filled(opening, around, around, disc.error)
    assert found is not None
    assert found.error < disc.error
    assert search.filled(opening, around, around, 1e-9 * disc.error) is None


@pytest.mark.parametrize(("name", "kind"), [("ring", "circle"), ("frame", "box")])
def test_a_hole_is_cut_out(name, kind):
    scene, near = joined(PICTURES[name], (kind,))
    (layer,) = scene.layers
    assert near >= 38.0
    assert [shape.kind for shape in layer.shapes] == [kind, kind]
    assert [joint.join for joint in layer.joints] == ["subtraction"]


def test_a_bar_is_united_with_a_disc_before_the_hole_is_cut():
    scene, near = joined(PICTURES["spoked"], ("circle", "box"), most=6)
    (layer,) = scene.layers
    assert near >= 38.0
    assert [joint.join for joint in layer.joints] == ["union", "subtraction"]


def test_a_disc_stays_one_circle():
    scene, near = joined(PICTURES["disc"], ("circle", "box"))
    assert near >= 38.0
    assert [shape.kind for shape in scene.layers[0].shapes] == ["circle"]


def test_what_does_not_help_is_not_kept():
    """No circle takes noise away."""
    noise = np.random.default_rng(0).normal(0.0, 0.05, PICTURES["disc"].shape).astype(np.float32)
    scene, _ = joined(PICTURES["disc"] + noise, ("circle",))
    assert len(scene.layers[0].shapes) == 1


def test_no_more_is_joined_than_asked_for():
    (layer,) = joined(PICTURES["frame"], ("circle",), most=1)[0].layers
    assert len(layer.shapes) == 2


def test_a_patch_gives_way_to_what_can_be_joined():
    (layer,) = joined(PICTURES["ring"], ("circle", "gaussian"), started("gaussian"))[0].layers
    assert [shape.kind for shape in layer.shapes] == ["circle", "circle"]


def test_the_layer_at_fault_is_changed_below_another():
    """The ring lies below a red disc, which stays."""
    red = Shape.of("circle", (1.0, 0.0, 0.0), center=(0.3, 0.3), radius=0.15)
    scene = Scene(SIDE, SIDE, (*started().layers, Layer((red,), 0.0)), (0.0, 0.0, 0.0))
    covered = render(Scene(SIDE, SIDE, (Layer((red,), 0.0),), None)).permute(1, 2, 0).numpy()
    pixels = np.ascontiguousarray(PICTURES["ring"] * (1.0 - covered[..., 3:]) + covered[..., :3])
    found, near = joined(pixels, ("circle",), scene)
    assert near >= 38.0
    assert [len(layer.shapes) for layer in found.layers] == [2, 1]


def test_the_same_seed_gives_the_same_scene():
    options = Settings(1, ("circle",), preset="fast", cuts=1, seed=3, device="cpu")
    scenes = [fit_picture(Picture(PICTURES["ring"]), options) for _ in range(2)]
    assert scenes[0] == scenes[1]
    assert len(scenes[0].layers[0].shapes) == 2


def test_a_fit_can_be_stopped_while_it_joins():
    seen = []

    def callback(progress):
        seen.append(progress)
        return progress.phase == "joining"

    scene = fit_picture(Picture(PICTURES["ring"]), Settings(1, ("circle",), preset="fast", cuts=5), callback)
    assert [progress.phase for progress in seen].count("joining") == 1
    assert seen[-1].step <= seen[-1].steps
    assert len(scene.layers[0].shapes) == 1


@pytest.mark.parametrize("cuts", [-1, 1.5, True, 10_001])
def test_a_bad_number_of_cuts_is_refused(cuts):
    with pytest.raises(sdf2vec.Sdf2vecError, match="number of cuts must be a whole number"):
        settings_of(1, cuts=cuts)


def test_cuts_need_a_kind_that_can_be_joined():
    with pytest.raises(sdf2vec.Sdf2vecError, match="cuts need a kind"):
        settings_of(1, kind=["gaussian", "gabor"], cuts=2)
    assert settings_of(1, kind=["gaussian", "box"], cuts=2).cuts == 2

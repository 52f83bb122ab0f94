"""What can be asked of a fit, and what it then keeps: start scenes, palettes, weights, trials, presets."""

import os
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import torch

import sdf2vec
from sdf2vec import Layer, Scene, Sdf2vecError, Shape
from sdf2vec.fit import loop, palette
from sdf2vec.fit.loop import Fit, Progress, fit_picture
from sdf2vec.fit.presets import MANY, PRESETS, Phase, Preset, Relocation
from sdf2vec.fit.settings import Settings, preset_of, settings_of
from sdf2vec.fit.weights import weights_for, weights_of
from sdf2vec.image import Picture
from sdf2vec.metrics import mse
from sdf2vec.render.fused import composite
from sdf2vec.render.reference import render
from sdf2vec.render.tensors import from_scene
from sdf2vec.units import MARGIN

from .test_constraints import measured
from .test_fit import as_tensor, picture, remember

CIRCLE = ("circle",)
RED, GREEN, BLUE = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)


@pytest.fixture(autouse=True)
def short_fits(monkeypatch):
    """Fits of 60 steps, with relocation early and often; the thesis' with four batches, too."""
    often = Relocation(every=10, share=0.25)
    fast = Preset((Phase("coarse", 40, 32, relocation=often), Phase("fine", 20, 48, rate=0.5, end_rate=0.05)))
    monkeypatch.setitem(PRESETS, "fast", fast)
    phases = tuple(replace(phase, steps=12) for phase in PRESETS["thesis"].phases)
    monkeypatch.setitem(PRESETS, "thesis", replace(PRESETS["thesis"], phases=phases))


def fitted(pic: Picture | None = None, shapes: int = 8, callback=lambda progress: False, **options) -> Scene:
    settings = settings_of(shapes, **{"kind": "circle", "preset": "fast", **options})
    return fit_picture(pic or picture(), settings, callback)


def error(scene: Scene, pic: Picture) -> float:
    target = as_tensor(pic)
    return float(mse(render(scene, pic.width, pic.height)[: len(target)], target))


def colors_of(scene: Scene) -> set[tuple[float, ...]]:
    """All colours, in 1/1000."""
    colors = [shape.color for layer in scene.layers for shape in layer.shapes]
    colors += [scene.background] if scene.background else []
    return {tuple(round(value, 3) for value in color) for color in colors}


# --- start scenes ------------------------------------------------------------------------------------------


def test_a_start_is_refined():
    pic = picture()
    start = fitted(pic)
    finer = fitted(pic, start=start)
    assert error(finer, pic) < error(start, pic)
    assert finer.shape_count == 8


def test_a_start_says_how_many_shapes():
    start = fitted(shapes=5)
    assert settings_of(start=start).shapes == 5
    assert settings_of(7, start=start).shapes == 7
    assert settings_of(start=Scene(48, 32, ())).shapes == settings_of().shapes == 256


def test_a_fit_that_goes_on_leaves_the_first_phase_out():
    seen: list[Progress] = []
    fitted(start=fitted(), callback=remember(seen))
    assert {(p.phase, p.steps) for p in seen} == {("fine", 20)}


def test_a_start_of_another_size_draws_the_same():
    """The first loss is that of the start: measured by the reference renderer at the phase's size."""
    start = fitted(picture(24, 16))
    seen: list[Progress] = []
    scene = fitted(picture(48, 32), start=start, callback=remember(seen))
    assert (scene.width, scene.height) == (48, 32)
    target = loop.scaled(picture(48, 32).pixels, 48)
    drawn = render(start, target.shape[2], target.shape[1])[:3]
    assert seen[0].loss == pytest.approx(float((drawn - target).abs().mean()), rel=1e-3)


def test_fewer_shapes_leave_out_what_matters_least():
    big = [Layer((Shape.of("circle", RED, center=(x, 0), radius=0.2),), 0.02) for x in (-0.5, 0.0, 0.5)]
    hidden = Layer((Shape.of("circle", GREEN, center=(0, 0), radius=0.05),), 0.02)
    small = Layer((Shape.of("circle", BLUE, center=(0.6, 0.4), radius=0.03),), 0.02)
    start = Scene(48, 32, (big[0], hidden, *big[1:], small), (0.0, 0.0, 0.0))
    pic = Picture(np.ascontiguousarray(sdf2vec.render(start)))
    fit = Fit(pic, settings_of(3, kind="circle", preset="fast", start=start), lambda progress: False)
    (group,) = fit.tensors.groups
    assert group.order.tolist() == [0, 1, 2]
    assert group.of("center", 0)[:, 0].tolist() == [-0.5, 0.0, 0.5]
    assert group.colors[0].tolist() == [list(RED)] * 3


def test_more_shapes_come_on_top_and_help():
    pic, start = picture(), fitted(shapes=3)
    fit = Fit(pic, settings_of(9, kind="circle", preset="fast", start=start), lambda progress: False)
    (group,) = fit.tensors.groups
    assert group.order.tolist() == list(range(9))
    assert fit.tensors.layer_count == 9
    kept = [layer.shapes[0].parameters[2] for layer in start.layers]
    assert group.of("radius", 0)[:3].flatten().tolist() == pytest.approx(kept)
    assert error(fitted(pic, 9, start=start), pic) < error(fitted(pic, 3, start=start), pic)


@pytest.mark.parametrize(
    ("shapes", "union", "expected"), [(4, 2, 3), (5, 1, 5), (1, 1, 1), (8, 2, 7), (2, 2, 2)]
)
def test_a_start_with_other_unions_never_gives_more_shapes_than_asked(shapes, union, expected):
    """Three shapes of which none is a union; what no union of two fits into stays free."""
    start = fitted(shapes=3)
    scene = fitted(shapes=shapes, union=union, start=start)
    assert scene.shape_count == expected


def test_relocation_and_trials_keep_the_number_of_shapes(monkeypatch):
    """A union of two can't go where single shapes come."""
    phases = PRESETS["fast"].phases
    monkeypatch.setitem(PRESETS, "fast", replace(PRESETS["fast"], phases=(phases[0],)))
    monkeypatch.setattr(loop, "TRIAL_STEPS", 3)
    unions = fitted(shapes=12, union=2)
    assert {len(layer.shapes) for layer in unions.layers} == {2}
    assert unions.shape_count == 12
    mixed = fitted(shapes=20, start=unions, trials=1)
    assert mixed.shape_count == 20
    assert {len(layer.shapes) for layer in mixed.layers} == {1, 2}


def test_a_single_union_larger_than_what_is_asked_gives_way():
    start = fitted(shapes=2, union=2)
    assert len(start.layers) == 1
    assert [len(layer.shapes) for layer in fitted(shapes=1, start=start).layers] == [1]


def test_a_start_of_another_kind_keeps_its_shapes_and_gets_the_new_kind():
    start = fitted(shapes=4)
    scene = fitted(shapes=6, kind="ellipse", start=start)
    assert sorted(layer.shapes[0].kind for layer in scene.layers) == ["circle"] * 4 + ["ellipse"] * 2


def test_an_empty_start():
    empty = Scene(48, 32, (), (0.0, 0.0, 0.0))
    scene = fitted(shapes=4, start=empty)
    assert scene.shape_count == 4
    assert error(scene, picture()) < error(empty, picture())


@pytest.mark.parametrize("alpha", [False, True])
def test_a_start_takes_the_transparency_of_the_picture(alpha):
    start = fitted(picture(alpha=not alpha))
    assert (start.background is None) != alpha
    scene = fitted(picture(alpha=alpha), start=start)
    assert (scene.background is None) == alpha


def test_a_start_for_another_picture_shape_is_refused():
    with pytest.raises(Sdf2vecError, match=r"^the start scene has another shape .* 1.5 to 1, not 1 to 1$"):
        fitted(picture(32, 32), start=fitted())


def test_a_start_of_nearly_the_same_shape_is_trained_as_it_will_be_drawn():
    """61 × 40 against 600 × 396 pixels: 0.6 % of the scale, which is two pixels at the edges."""
    start = replace(fitted(), width=61, height=40)
    large = Picture(np.full((396, 600, 3), 0.5, dtype=np.float32))
    fit = Fit(large, settings_of(8, kind="circle", preset="fast", start=start), lambda progress: False)
    assert fit.tensors.size == pytest.approx((600 / 396, 1.0))


# --- palettes ----------------------------------------------------------------------------------------------

PALETTE = "#134,#fa0b1c,#2e2eff"
AS_NUMBERS = {(17 / 255, 51 / 255, 68 / 255), (250 / 255, 11 / 255, 28 / 255), (46 / 255, 46 / 255, 1.0)}


@pytest.mark.parametrize("alpha", [False, True])
@pytest.mark.parametrize("stop", [None, 7, 75])
def test_a_palette_is_kept_even_when_stopped(alpha, stop):
    scene = fitted(picture(alpha=alpha), palette=PALETTE, callback=lambda progress: progress.step == stop)
    assert colors_of(scene) <= {tuple(round(v, 3) for v in color) for color in AS_NUMBERS}
    assert len(colors_of(scene)) > 1


def test_refitting_helps_a_palette(monkeypatch):
    pic = picture()
    refitted = fitted(pic, palette=PALETTE)
    monkeypatch.setattr(loop, "REFIT_STEPS", 0)
    assert error(refitted, pic) < error(fitted(pic, palette=PALETTE), pic)


@pytest.mark.parametrize("count", [1, 2, 4])
@pytest.mark.parametrize("stop", [None, 5])
def test_so_many_colors(count, stop, recwarn):
    scene = fitted(colors=count, union=2, callback=lambda progress: progress.step == stop)
    assert 1 <= len(colors_of(scene)) <= count
    assert not recwarn.list


def test_more_colors_than_there_are(recwarn):
    grey = Picture(np.full((16, 24, 3), 0.5, dtype=np.float32))
    assert 1 <= len(colors_of(fitted(grey, colors=200))) <= 9
    assert not recwarn.list


def test_found_colors_are_those_that_cover_most():
    """Exactly the scene's where there are no more; of three for two, the rarer two near each other are one."""
    colors = (RED, RED, (0.0, 0.0, 0.9), BLUE)
    layers = tuple(Layer((Shape("circle", (0, 0, 0.2), color),), 0.1) for color in colors)
    tensors = from_scene(Scene(48, 32, layers, None))
    generator = torch.Generator().manual_seed(0)
    cover = [torch.tensor([1.0, 1.0, 1.0, 0.0])]
    assert sorted(palette.found(tensors, cover, 2, generator)) == [(0.0, 0.0, 0.9), RED]
    red, blue = sorted(palette.found(tensors, [torch.ones(4)], 2, generator), reverse=True)
    assert red == RED
    assert 0.9 < blue[2] < 1.0
    assert len(palette.found(tensors, [torch.ones(4)], 9, generator)) == 3


def test_snapping_takes_what_looks_nearest():
    layers = tuple(
        Layer((Shape("circle", (0, 0, 0.2), color),), 0.1) for color in ((0.9, 0.1, 0.1), (0.2, 0.2, 0.9))
    )
    tensors = from_scene(Scene(48, 32, layers, (0.9, 0.9, 0.8)))
    palette.snap(tensors, [RED, BLUE, (1.0, 1.0, 1.0)])
    assert tensors.groups[0].colors[0].tolist() == [list(RED), list(BLUE)]
    assert tensors.background.tolist() == [1.0, 1.0, 1.0, 1.0]


# --- weights -----------------------------------------------------------------------------------------------


def busy() -> Picture:
    """Coarse noise: too much for few shapes."""
    noise = np.random.default_rng(0).random((4, 6, 3), dtype=np.float32)
    return Picture(np.ascontiguousarray(noise.repeat(8, axis=0).repeat(8, axis=1)))


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


# --- trials, areas, unions ---------------------------------------------------------------------------------


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


# --- promises ----------------------------------------------------------------------------------------------

EVERYTHING: dict[str, dict[str, Any]] = {
    "plain": {},
    "weights": {"weights": np.eye(9, dtype=np.float32)},
    "palette": {"palette": PALETTE, "trials": 1},
    "colors": {"colors": 3, "union": 2},
    "area": {"min_area": 0.02},
    "start": {"start": Scene(48, 32, (Layer((Shape("circle", (0, 0, 0.2), RED),), 0.1),), RED), "trials": 1},
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


# --- presets -----------------------------------------------------------------------------------------------


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
    assert preset_of(settings_of(preset="thesis", max_falloff=1.2)).falloff == (0.01, 0.99)


def thesis_picture():
    return picture(64, 48)


def test_the_thesis_preset_keeps_its_ranges(monkeypatch):
    def never(*arguments):
        pytest.fail("a layer was relocated")

    monkeypatch.setattr(Fit, "_relocate", never)
    seen: list[Progress] = []
    scene = fitted(thesis_picture(), 10, kind=["circle", "ellipse"], preset="thesis", callback=remember(seen))
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
    fit.optimizer = loop.adam(fit.tensors)
    fit._train(stage, lambda group: group.order % 4 == 1)
    moved = {order for order, values in state().items() if not torch.equal(values, before[order])}
    assert moved == {1, 5}
    assert torch.equal(fit.tensors.background.detach(), ground)


# --- refusals ----------------------------------------------------------------------------------------------

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
    path.write_text(sdf2vec.dumps(EVERYTHING["start"]["start"]))
    assert settings_of(start=path) == settings_of(start=EVERYTHING["start"]["start"])
    assert settings_of(start=str(path)).start == EVERYTHING["start"]["start"]

"""Fits that go on from a scene."""

from dataclasses import replace

import numpy as np
import pytest

import sdf2vec
from sdf2vec import Layer, Scene, Sdf2vecError, Shape
from sdf2vec.fit import loop
from sdf2vec.fit.loop import Fit, Progress
from sdf2vec.fit.presets import PRESETS
from sdf2vec.fit.settings import settings_of
from sdf2vec.fit.views import scaled
from sdf2vec.image import Picture
from sdf2vec.render.reference import render
from tests.fit.fitting import (
    BLUE,
    GREEN,
    RED,
    error,
    fitted,
    picture,
    remember,
)

pytestmark = pytest.mark.usefixtures("short_fits")
CIRCLE = ("circle",)


def test_a_start_is_refined():
    pic = picture()
    start = replace(fitted(pic), background=(0.0, 0.0, 0.0))
    finer = fitted(pic, start=start)
    assert error(finer, pic) < 0.7 * error(start, pic)
    assert finer.shape_count == 8


def test_a_start_says_how_many_shapes():
    start = fitted(shapes=5)
    assert settings_of(start=start).shapes == 5
    assert settings_of(7, start=start).shapes == 7
    assert settings_of(start=Scene(48, 32, ())).shapes == settings_of().shapes == "auto"


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
    target = scaled(picture(48, 32).pixels, 48)
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

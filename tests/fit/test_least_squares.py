"""All numbers of a scene by least squares: against autograd through the reference renderer, and on known scenes."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from sdf2vec.fit.constraints import project, room_of
from sdf2vec.fit.initialization import Layers
from sdf2vec.fit.joining import Search
from sdf2vec.fit.least_squares import SceneProblem, improved, is_simple
from sdf2vec.fit.surroundings import View
from sdf2vec.render.reference import canvas, composite_points
from sdf2vec.render.tensors import SceneTensors, from_scene, to_scene
from sdf2vec.scene import Joint, Layer, Scene, Shape

WIDTH, HEIGHT = 61, 50  # no whole tiles
DISC = Layer((Shape("circle", (-0.1, 0.0, 0.3), (0.9, 0.2, 0.1)),), 0.1, 0.8)
RAMP = Layer(
    (
        Shape(
            "box", (0.1, 0.1, 0.2, 0.1, 0.3, 0.02), (0.1, 0.5, 0.7), "linear", (0.9, 0.8, 0.1, 0.5, 0.2, 0.1)
        ),
    ),
    0.05,
    0.7,
)
RING = Layer(
    (Shape("ellipse", (-0.2, 0.1, 0.2, 0.15, 0.3), (0.2, 0.7, 0.3)), Shape("circle", (-0.15, 0.1, 0.1))),
    0.03,
    0.9,
    (Joint("subtraction", 0.01),),
)


def scene_of(*layers: Layer, compositing: str = "over", dtype=torch.float32) -> SceneTensors:
    return from_scene(Scene(WIDTH, HEIGHT, layers, (0.4, 0.5, 0.6), compositing), dtype)


@pytest.mark.parametrize("compositing", ["over", "additive"])
@pytest.mark.parametrize(("channels", "samples"), [(3, 1), (4, 1), (3, 2), (4, 4)])
def test_normal_equations_are_those_of_finite_differences(compositing, channels, samples):
    """In float64, by the reference renderer; of more samples across a pixel the mean is seen."""
    layers = DISC, RING, DISC, RAMP
    draw = torch.Generator().manual_seed(1)
    target = torch.rand(channels, HEIGHT, WIDTH, generator=draw)
    weights = torch.rand(HEIGHT, WIDTH, generator=draw)
    problem = SceneProblem(scene_of(*layers, compositing=compositing), View(target, weights, samples))
    row = problem.row()
    free = np.array([n for n in range(row.shape[1] - 1) if n != 2])
    precise = scene_of(*layers, compositing=compositing, dtype=torch.float64)

    def wrong(moved):
        made = problem.scene_of(moved[None])
        x, y, pixel = canvas(precise, samples * WIDTH, samples * HEIGHT)
        drawn = composite_points(made, x, y, pixel)[:channels]
        seen = drawn.view(channels, HEIGHT, samples, WIDTH, samples).mean((2, 4))
        return ((seen - target) * weights).flatten()

    here = SceneProblem(precise, problem.view).row()[0]
    steps = 1e-6 * torch.eye(len(here), dtype=torch.float64)[free]
    slopes = torch.stack([(wrong(here + step) - wrong(here - step)) / 2e-6 for step in steps], dim=1)
    normal, right = problem.normal(row, free)
    scale = float((slopes.T @ slopes).abs().max())
    assert normal[0] == pytest.approx((slopes.T @ slopes).numpy(), rel=2e-3, abs=1e-6 * scale)
    assert right[0] == pytest.approx((slopes.T @ wrong(here)).numpy(), rel=2e-3, abs=1e-5 * scale)
    assert float(problem.errors(row)[0]) == pytest.approx(float(wrong(here).square().mean()), rel=1e-5)


def test_a_row_is_held_in_its_ranges_as_the_scene_is():
    """By the projection that fits take; no channel of the ground is more than its alpha."""
    problem = SceneProblem(scene_of(DISC, RING, DISC, RAMP), View(torch.rand(4, HEIGHT, WIDTH), None))
    for seed in range(20):
        row = torch.randn(problem.row().shape, generator=torch.Generator().manual_seed(seed))
        wanted = problem.scene_of(row.clone())
        project(wanted, 0.02, (0.001, 0.5))
        problem.numbers(room_of(wanted, 0.02, (0.001, 0.5)), is_simple).ranges.hold(row)
        held = SceneProblem(wanted, problem.view).row()
        assert row.numpy() == pytest.approx(held.numpy(), abs=1e-6)


def search(falloff=(0.0, 1.0)) -> Search:
    return Search(Layers(("circle", "box"), "over"), falloff, torch.Generator(), lambda loss: None, 1 / 50)


def picture_of(*layers: Layer) -> View:
    scene = scene_of(*layers)
    drawn = composite_points(scene, *canvas(scene, WIDTH, HEIGHT))
    return View(drawn[:3].reshape(3, HEIGHT, WIDTH), None)


def rows_of(scene: SceneTensors) -> list[list[float]]:
    return [list(layer.numbers) for layer in to_scene(scene, WIDTH, HEIGHT).layers]


def test_all_layers_and_the_ground_arrive_together():
    """Two soft discs that overlap and are off in every number; the ground, too."""
    other = Layer((Shape("circle", (0.15, 0.1, 0.25), (0.1, 0.4, 0.8)),), 0.08, 0.9)
    view = picture_of(DISC, other)
    begun = (
        Layer((Shape("circle", (-0.15, 0.05, 0.25), (0.8, 0.3, 0.2)),), 0.15, 0.7),
        Layer((Shape("circle", (0.2, 0.05, 0.3), (0.2, 0.5, 0.6)),), 0.1, 0.8),
    )
    scene = from_scene(Scene(WIDTH, HEIGHT, begun, (0.5, 0.5, 0.5)))
    before = [tensor.clone() for group in scene.groups for tensor in group.values.values()]
    made = improved(scene, view, search(), 25)
    end = SceneProblem(made, view)
    assert float(end.errors(end.row())[0]) < 1e-7
    assert made.background.tolist() == pytest.approx([0.4, 0.5, 0.6, 1.0], abs=1e-3)
    for found, wanted in zip(rows_of(made), rows_of(scene_of(DISC, other)), strict=True):
        assert found[5:] == pytest.approx(wanted[5:], abs=0.002)  # opacity and colour are alike
    after = [tensor for group in scene.groups for tensor in group.values.values()]
    assert all(torch.equal(old, new) for old, new in zip(before, after, strict=True))  # it was a copy


def test_what_is_simple_stays_only_where_told():
    view = picture_of(DISC)  # translucent and soft
    sharp = scene_of(Layer((Shape("circle", (-0.12, 0.02, 0.28), (0.8, 0.3, 0.2)),)))
    (free,), (kept,) = (rows_of(improved(sharp, view, search(), 12, simple)) for simple in (False, True))
    assert kept[:2] == [1.0, 0.0]
    assert free[1] > 0.05
    assert kept[2:5] != free[2:5]


def test_a_scene_without_layers_is_what_it_was():
    bare = scene_of()
    assert improved(bare, picture_of(DISC), search(), 3) is bare


def test_what_is_simple():
    (group,) = scene_of(RAMP).groups
    kinds = {slot.parameter.name for slot in group.values if is_simple(slot, 0.0)}
    assert kinds == {"opacity", "falloff", "shift", "angle", "corner_radius"}
    assert not any(is_simple(slot, 0.5) for slot in group.values)

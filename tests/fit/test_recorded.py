"""Steps that are recorded: as CUDA graphs on a GPU; without one, what would be recorded is done anew each time."""

from functools import partial
from types import SimpleNamespace

import pytest
import torch

from sdf2vec import Layer, Scene, Shape
from sdf2vec.fit import recorded
from sdf2vec.fit.adam import adam_over
from sdf2vec.fit.constraints import project
from sdf2vec.fit.recorded import Recorded
from sdf2vec.fit.steps import Plain
from sdf2vec.render.tensors import from_scene
from sdf2vec.render.triton_fused import composite
from tests.triton_device import DEVICE, MARKS

WIDTH, HEIGHT = 48, 32
pytestmark = MARKS


def repeated(work):
    """In place of a graph: does what would be recorded."""
    return SimpleNamespace(replay=work)


@pytest.fixture(autouse=True)
def recording(monkeypatch):
    """Without a GPU nothing is recorded."""
    if DEVICE != "cuda":
        monkeypatch.setattr(recorded, "_graph_of", repeated)
        monkeypatch.setattr(recorded, "_aside", lambda work: work())


def circle(x, radius, color):
    return Layer((Shape.of("circle", color, center=(x, 0.0), radius=radius),), 0.05, 0.8)


def begun(make, radius=0.1, spoilt=False):
    """Steps of two discs that ought to be one large one, and the scene."""
    layers = (circle(-0.2, radius, (0.9, 0.2, 0.1)), circle(0.2, radius, (0.1, 0.5, 0.9)))
    scene = from_scene(Scene(WIDTH, HEIGHT, layers, (0.5, 0.5, 0.5)), device=DEVICE)
    optimizer = adam_over(scene)
    wanted = Scene(WIDTH, HEIGHT, (circle(0.0, 0.5, (0.2, 0.8, 0.3)),), (0.1, 0.1, 0.1))
    target = composite(from_scene(wanted, device=DEVICE), WIDTH, HEIGHT, 3)

    def value(renderer):
        error = (renderer(scene, WIDTH, HEIGHT, 3) - target).square().mean()
        if spoilt:
            error = error + torch.sqrt((scene.groups[0].of("radius", 0) * 0.0).sum())
        return error

    keep = partial(project, scene, 1.0 / HEIGHT)
    return make(value, composite, optimizer, keep), scene


def numbers(scene):
    return torch.cat([scene.groups[0].rows().flatten(), scene.background]).detach()


def test_recorded_steps_are_those_of_torch():
    (plain, ours), (made, theirs) = begun(Plain), begun(Recorded)
    for factor in (1.0, 0.5, 2.0, 0.1):
        assert made.slope() == pytest.approx(plain.slope(), rel=1e-5)
        assert made.drop_what_is_not_finite() == plain.drop_what_is_not_finite() == 0
        assert made.agreement() == pytest.approx(plain.agreement(), abs=1e-4)
        for steps in (plain, made):
            steps.move(factor)
        assert torch.allclose(numbers(ours), numbers(theirs), atol=1e-5)
    assert plain.agreement() > 0.1


def test_shapes_that_grow_beyond_the_room_are_recorded_anew(monkeypatch):
    monkeypatch.setattr(recorded, "ROOMY", 1.0)
    monkeypatch.setattr(recorded, "SPARE", 0)
    before = begun(Recorded)[0].most
    made, _, value = outgrown(Recorded)
    plain, _ = begun(Plain, radius=0.6)
    assert value == pytest.approx(plain.slope(), rel=1e-5)
    assert made.most > before
    for moving, other in zip(made.optimizer.moving, plain.optimizer.moving, strict=True):
        assert torch.allclose(moving.tensor.grad, other.tensor.grad, rtol=1e-4, atol=1e-7)


def test_derivatives_that_are_no_numbers_are_counted_and_move_nothing():
    (plain, _), (made, scene) = begun(Plain, spoilt=True), begun(Recorded, spoilt=True)
    for steps in (plain, made):
        steps.slope()
        assert steps.drop_what_is_not_finite() == 1
        steps.move(1.0)
    assert numbers(scene).isfinite().all()
    assert scene.groups[0].of("radius", 0).flatten().tolist() == pytest.approx([0.1, 0.1])


def outgrown(make):
    """Steps of discs that have grown since they were begun, the scene, and what is descended."""
    made, scene = begun(make)
    with torch.no_grad():
        scene.groups[0].of("radius", 0).fill_(0.6)
    return made, scene, made.slope()


def test_what_cannot_be_recorded_is_done_as_usual(monkeypatch):
    """At first, and where there is room for more no longer."""

    left = iter(range(0))

    def refused(work):
        if next(left, None) is None:
            raise RuntimeError("not permitted\nwhile recording")
        return repeated(work)

    monkeypatch.setattr(recorded, "_graph_of", refused)
    monkeypatch.setattr(recorded, "ROOMY", 1.0)
    monkeypatch.setattr(recorded, "SPARE", 0)
    for count in (0, 2):
        left = iter(range(count))
        with pytest.warns(RuntimeWarning, match=r"can't be recorded.*\(not permitted\)$"):
            made, scene, value = outgrown(Recorded)
        plain, other = begun(Plain, radius=0.6)
        assert value == pytest.approx(plain.slope(), rel=1e-5)
        assert made.drop_what_is_not_finite() == 0
        assert made.agreement() == plain.agreement() == 0.0
        for steps in (made, plain):
            steps.move(0.5)
        assert torch.allclose(numbers(scene), numbers(other), atol=1e-5)


@pytest.mark.skipif(DEVICE != "cuda", reason="needs an NVIDIA GPU")
def test_what_waits_for_the_gpu_cannot_be_recorded():
    def value(renderer):
        error = scene.background.square().sum()
        return error * float(error.detach())

    scene = from_scene(Scene(8, 8, (), (0.5, 0.5, 0.5)), device=DEVICE)
    with pytest.warns(RuntimeWarning, match="can't be recorded"):
        steps = Recorded(value, composite, adam_over(scene), lambda: None)
    assert steps.slope() == pytest.approx(1.75**2)

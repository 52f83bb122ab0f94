"""The fit: it lowers its losses, keeps its promises, and is the same twice."""

import math
from dataclasses import replace

import numpy as np
import pytest
import torch

import sdf2vec
from sdf2vec.blend import COMPOSITING
from sdf2vec.fit import backends, constraints, loop, losses
from sdf2vec.fit.adam import adam_over
from sdf2vec.fit.initialization import Layers, detail, place
from sdf2vec.fit.loop import Fit, Progress, fit_picture
from sdf2vec.fit.presets import Start
from sdf2vec.fit.settings import Settings, settings_of
from sdf2vec.fit.views import scaled
from sdf2vec.layer import Part
from sdf2vec.metrics import mse, psnr
from sdf2vec.render import culled, kernels, triton_fused
from sdf2vec.render.reference import render
from sdf2vec.render.tensors import from_scene
from sdf2vec.shapes import KINDS
from tests.fit.fitting import as_tensor, busy, error, fitted, picture, remember
from tests.scenes import random_scene


@pytest.mark.parametrize("compositing", ["over", "additive"])
@pytest.mark.parametrize("alpha", [False, True])
def test_a_fit_is_near_the_picture(compositing, alpha):
    pic = picture(alpha=alpha)
    scene = fit_picture(pic, Settings(8, ("circle", "ellipse"), compositing, "fast"))
    target = as_tensor(pic)
    assert float(psnr(render(scene)[: len(target)], target)) > 25.0
    assert (scene.background is None) == alpha
    assert scene.shape_count == 8
    assert (scene.width, scene.height) == (48, 32)


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_fits(kind):
    pic = picture()
    scene = fit_picture(pic, Settings(6, (kind,), preset="fast"))
    flat = as_tensor(pic).mean(dim=(1, 2), keepdim=True).expand(3, 32, 48)
    assert float(mse(render(scene)[:3], as_tensor(pic))) < 0.25 * float(mse(flat, as_tensor(pic)))
    assert {layer.structure for layer in scene.layers} == {(Part(kind),)}


@pytest.mark.parametrize("loss", losses.LOSSES)
def test_every_loss_is_zero_when_equal_and_falls_in_a_fit(loss):
    target = as_tensor(picture())
    assert float(losses.LOSSES[loss](target)(target)) == pytest.approx(0.0, abs=1e-5)
    seen: list[Progress] = []
    settings = Settings(6, ("circle",), preset="fast", loss=((loss, 1.0),))
    fit_picture(picture(), settings, remember(seen))
    coarse = [p.loss for p in seen if p.phase == "coarse"]
    assert coarse[-1] < 0.5 * coarse[0]


@pytest.mark.parametrize("loss", backends.CPU.losses)
def test_what_a_backend_computes_faster_is_the_same_loss(loss):
    target, render = as_tensor(picture()), as_tensor(picture()).flip(2) * 0.9
    render.requires_grad_()
    values = [maker[loss](target)(render) for maker in (losses.LOSSES, backends.CPU.losses)]
    exact, fast = (torch.autograd.grad(value, render)[0] for value in values)
    assert values[1].item() == pytest.approx(values[0].item(), abs=1e-5)
    assert float((fast - exact).abs().max()) <= 1e-3 * float(exact.abs().max())


@pytest.mark.parametrize(("loss", "power"), [("l1", 1), ("mse", 2)])
@pytest.mark.parametrize("channels", [3, 4])
def test_fast_differences_are_those_on_black_and_on_white(loss, power, channels):
    """Written out anew, in float64; more rows than a thread takes at a time."""
    render, target = torch.rand(2, channels, 45, 23, generator=torch.Generator().manual_seed(0))
    double = render.double().requires_grad_()
    wrong = double - target
    grounds = [wrong[:3]] if channels == 3 else [wrong[:3], wrong[:3] - wrong[3]]
    value = torch.stack(grounds).abs().pow(power).mean()
    (exact,) = torch.autograd.grad(value, double)
    found = backends.CPU.losses[loss](target)(render.requires_grad_())
    (fast,) = torch.autograd.grad(found, render)
    assert found.item() == pytest.approx(value.item(), rel=1e-6)
    assert fast.numpy() == pytest.approx(exact.numpy(), rel=1e-4, abs=1e-9)


def test_a_backends_losses_take_the_place_of_those_of_their_names():
    target = as_tensor(picture())
    found = losses.objective(
        (("mse", 2.0), ("l1", 1.0)), target, faster={"mse": lambda _: lambda _: target.max() * 0 + 3}
    )
    assert float(found(target)) == 6.0


def test_where_nothing_should_be_black_is_as_wrong_as_white():
    """On black, opaque black is not seen; on white it is 1 off. A grey is off on both."""
    nothing = torch.zeros(4, 2, 2)
    black, white, grey = (torch.tensor([c, c, c, 1.0])[:, None, None].expand(4, 2, 2) for c in (0, 1, 0.8))
    for loss, wanted in (("l1", 0.5), ("mse", 0.5)):
        measure = losses.LOSSES[loss](nothing)
        assert float(measure(black)) == float(measure(white)) == pytest.approx(wanted)
    assert float(losses.LOSSES["mse"](nothing)(grey)) == pytest.approx((0.8**2 + 0.2**2) / 2)


@pytest.mark.usefixtures("few_steps")
def test_the_same_seed_gives_the_same_scene_and_another_another():
    scenes = [fit_picture(picture(), Settings(5, tuple(KINDS), preset="fast", seed=s)) for s in (1, 1, 2)]
    assert scenes[0] == scenes[1] != scenes[2]


@pytest.mark.usefixtures("kernels_there")
def test_progress_and_stopping():
    seen = []

    def callback(progress):
        seen.append(progress)
        return progress.step == 7

    scene = fit_picture(picture(), Settings(4, ("box",), preset="fast"), callback)
    assert [p.step for p in seen] == list(range(1, 8))
    assert {p.steps for p in seen} == {4 * 200 + 180}  # the first phase from four starts
    assert all(math.isfinite(p.loss) for p in seen)
    assert scene.shape_count == 2  # it begins with half of them


@pytest.mark.parametrize(("shapes", "starts"), [(1, 4), (16, 4), (24, 2), (32, 2), (64, 1), (1024, 1)])
def test_few_shapes_are_tried_from_several_starts(shapes, starts):
    assert Fit(picture(), settings_of(shapes, kind="circle", preset="fast"), lambda _: True).starts == starts
    assert Fit(picture(), settings_of(shapes, kind="circle", preset="thesis"), lambda _: True).starts == 1


def first_phase(pic, until, **options):
    """The scene after so many steps of the first phase, and the squared error at the end of each start."""
    errors = []

    def callback(progress):
        if progress.step % 200 == 0:
            errors.append(progress.loss)  # of the start under way, of which there may be a nearer one
        return progress.step == until

    return fitted(pic, 6, callback, **options), errors


def test_the_nearest_start_goes_on():
    """Whichever of four it is: for one seed at least, not the last."""
    last = 0
    for seed in range(2):
        scene, errors = first_phase(busy(), 800, seed=seed, loss="mse")
        assert len(errors) == 4 == len(set(errors))
        assert error(scene, busy()) == pytest.approx(min(errors), rel=0.02)
        last += min(errors) == errors[-1]
    assert last < 2


def test_a_fit_stopped_in_its_second_start_keeps_the_first():
    first, errors = first_phase(busy(), 200, loss="mse")
    scene, _ = first_phase(busy(), 203, loss="mse")
    assert scene == first
    assert error(scene, busy()) == pytest.approx(errors[0], rel=0.02)


@pytest.mark.usefixtures("few_steps")
@pytest.mark.parametrize("size", [(1, 1), (1, 500), (37, 2)])
def test_odd_pictures(size):
    pixels = np.full((size[1], size[0], 3), 0.4, dtype=np.float32)
    scene = sdf2vec.fit(pixels, 3, preset="fast", kind="mixed")
    assert float((render(scene)[:3] - 0.4).abs().max()) < 0.05


@pytest.mark.parametrize("there", [True, False])
def test_it_is_said_before_kernels_are_compiled(there, monkeypatch):
    monkeypatch.setattr(kernels, "is_compiled", lambda *arguments: there)
    seen = []

    def callback(progress):
        seen.append(progress)
        return progress.step == 1

    fit_picture(picture(), Settings(4, ("box",), preset="fast", device="cpu"), callback)
    assert [p.step for p in seen] == ([1] if there else [0, 1])
    assert seen[0].phase.startswith("compiling kernels") == (not there)
    assert math.isnan(seen[0].loss) == (not there)


def test_shapes_start_where_the_picture_has_detail():
    pixels = torch.zeros(3, 64, 64)
    pixels[:, :16, :16] = torch.rand(3, 16, 16, generator=torch.Generator().manual_seed(0))
    density = detail(pixels)
    assert float(density.sum()) == pytest.approx(1.0)
    assert float(density[:17, :17].sum()) > 0.6
    generator = torch.Generator().manual_seed(0)
    tensors = place(pixels, (1.0, 1.0), Layers(("circle",), "over"), 100, Start(), generator)
    centers = tensors.groups[0].of("center", 0)
    radii = tensors.groups[0].of("radius", 0)[:, 0]
    corner = (centers < -0.25).all(dim=1)
    assert int(corner.sum()) > 50
    assert float(radii[corner].mean()) < 0.5 * float(radii[~corner].mean())
    assert (radii[:-1] >= radii[1:]).all()  # large ones lie below


def test_constraints_hold_after_anything():
    for compositing in ("over", "additive"):
        tensors = from_scene(random_scene(compositing=compositing, layers=20))
        with torch.no_grad():
            for group in tensors.groups:
                for tensor in group.values.values():
                    tensor.add_(torch.randn(tensor.shape, generator=torch.Generator().manual_seed(1)) * 200)
        constraints.project(tensors, 0.01)
        for group in tensors.groups:
            for slot, values in group.values.items():
                parameter = slot.parameter
                assert float(values.min()) >= parameter.unit.low
                assert float(values.max()) <= parameter.unit.high
                if parameter.positive:
                    assert float(values.min()) >= 0.01 - 1e-6
            assert float(group.opacity.abs().max()) <= 1.0
            assert min(float(colors.min()) for colors in group.colors) >= COMPOSITING[compositing].lowest


def test_pictures_are_scaled_down_only():
    pixels = np.zeros((100, 400, 3), dtype=np.float32)
    assert scaled(pixels, 100).shape == (3, 50, 200)
    assert scaled(pixels, 1000).shape == (3, 100, 400)


def test_a_premultiplied_picture_stays_so_when_scaled():
    """Half of the pixel is opaque, the other half is not there: half of everything is left."""
    pixels = np.array([[[0.8, 0.4, 0.2, 1], [0, 0, 0, 0]]], dtype=np.float32)
    assert scaled(pixels, 1)[:, 0, 0].tolist() == pytest.approx([0.4, 0.2, 0.1, 0.5], abs=1e-6)


@pytest.mark.parametrize(
    ("compositing", "transparent", "still"),
    [("over", False, 0), ("over", True, 1), ("additive", False, 1), ("additive", True, 1)],
)
def test_all_that_is_seen_moves(compositing, transparent, still):
    """Not: a background that there is none of; an opacity that adds to the alpha of an opaque ground."""
    scene = random_scene(("circle",), compositing, 4, joins=(), paints=("flat",), transparent=transparent)
    tensors = from_scene(scene)
    everything = [tensor for group in tensors.groups for tensor in group.values.values()]
    assert len(adam_over(tensors).moving) == len([*everything, tensors.background]) - still


def test_a_device_that_is_not_there_is_refused_in_one_line():
    if torch.cuda.is_available():
        pytest.skip("this machine has a CUDA device")
    with pytest.raises(sdf2vec.Sdf2vecError, match=r"^no cuda device here.*use --device cpu$"):
        sdf2vec.fit(picture().pixels, 2, preset="fast", device="cuda")


@pytest.fixture
def torch_with_cuda(monkeypatch):
    """A torch that claims to have CUDA; tensors made for it land on the CPU."""
    backends._cuda_works.cache_clear()
    monkeypatch.setattr(torch.cuda, "is_available", lambda: True)
    monkeypatch.setattr(backends, "from_scene", lambda scene, device: from_scene(scene))
    yield
    backends._cuda_works.cache_clear()


def test_auto_takes_cuda_where_its_kernels_run(monkeypatch, torch_with_cuda):
    monkeypatch.setattr(triton_fused, "composite", culled.composite)
    assert backends.choose("auto") is backends.CUDA


def test_auto_takes_the_cpu_and_says_why_where_cudas_kernels_fail(monkeypatch, torch_with_cuda):
    def fails(*arguments):
        raise RuntimeError("no kernel image is available\nlong story")

    monkeypatch.setattr(triton_fused, "composite", fails)
    with pytest.warns(
        RuntimeWarning, match=r"CUDA's kernels don't run here \(no kernel image is available\)$"
    ):
        assert backends.choose("auto") is backends.CPU
    assert backends.choose("cuda") is backends.CUDA_BY_TORCH


@pytest.mark.usefixtures("few_steps")
def test_the_dense_renderer_serves_other_devices(monkeypatch):
    """What `mps` runs, run on the CPU: nearly the same scene as the fused kernels give."""
    monkeypatch.setattr(loop, "choose", {"mps": replace(backends.MPS, device="cpu")}.__getitem__)
    pic = picture()
    scene = fit_picture(pic, Settings(4, ("circle",), preset="fast", device="mps"))
    monkeypatch.undo()
    fused = fit_picture(pic, Settings(4, ("circle",), preset="fast"))
    assert float(psnr(render(scene)[:3], render(fused)[:3])) > 30.0

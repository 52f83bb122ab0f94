"""FLIP against NVIDIA's own implementation; the loss against finite differences, at its kinks, and in fits."""

import flip_evaluator
import numpy as np
import pytest
import torch
from msgspec.structs import replace

from sdf2vec import flip as module
from sdf2vec.fit.flip import Flip
from sdf2vec.fit.loop import fit_picture
from sdf2vec.fit.presets import PRESETS, Phase, Preset
from sdf2vec.fit.settings import Settings
from sdf2vec.flip import SMOOTH, Softness, appearance, error, flip, flip_map
from sdf2vec.image import Picture, load, resize
from sdf2vec.render.draw import draw
from sdf2vec.threads import threads_of_its_own


@pytest.fixture(autouse=True)
def one_thread():
    """The pictures are too small to be worth sharing; waiting for each other takes longer."""
    with threads_of_its_own():
        yield


def by_nvidia(image, reference):
    """The error map and its mean, of [3, H, W]."""
    arrays = (np.ascontiguousarray(p.permute(1, 2, 0).float().numpy()) for p in (reference, image))
    error_map, mean, _ = flip_evaluator.evaluate(*arrays, "LDR", applyMagma=False)
    return error_map[..., 0], mean


def noise(*shape, seed=0, dtype=torch.float32):
    return torch.rand(shape, generator=torch.Generator().manual_seed(seed), dtype=dtype)


def coffee(side=160):
    pixels = load("examples/coffee.png").pixels[100 : 100 + side, 200 : 200 + side]
    return torch.from_numpy(pixels.transpose(2, 0, 1).copy())


def flat(*color):
    return torch.tensor(color).view(3, 1, 1).expand(3, 9, 12)


def smooth_loss(render, target):
    """The loss in torch."""
    return error(appearance(render, SMOOTH), appearance(target, SMOOTH), SMOOTH).mean()


def differentiated(function, image, *others):
    """The function's value and its derivative by the image, by torch."""
    image = image.detach().clone().requires_grad_()
    value = function(image, *others)
    value.backward()
    assert image.grad is not None
    return value.item(), image.grad


PAIRS = {
    "noise": lambda: (noise(3, 40, 57), noise(3, 40, 57, seed=1)),
    "odd size": lambda: (noise(3, 33, 5), noise(3, 33, 5, seed=1)),
    "narrower than the filters": lambda: (noise(3, 3, 30), noise(3, 3, 30, seed=1)),
    "one pixel": lambda: (noise(3, 1, 1), noise(3, 1, 1, seed=1)),
    "one row": lambda: (noise(3, 1, 9), noise(3, 1, 9, seed=1)),
    "grey": lambda: (flat(0.5, 0.5, 0.5), flat(0.6, 0.6, 0.6)),
    "black and white": lambda: (flat(0.0, 0.0, 0.0), flat(1.0, 1.0, 1.0)),
    "dark": lambda: (flat(0.0, 0.0, 0.0), flat(0.03, 0.0, 0.01)),
    "green and blue": lambda: (flat(0.0, 1.0, 0.0), flat(0.0, 0.0, 1.0)),
    "photo with noise": lambda: ((coffee() + 0.1 * noise(3, 160, 160) - 0.05).clamp(0, 1), coffee()),
    "photo with a little noise": lambda: ((coffee() + 0.01 * noise(3, 160, 160)).clamp(0, 1), coffee()),
    "blurred photo": lambda: (torch.nn.functional.avg_pool2d(coffee(), 5, 1, 2), coffee()),
    "shifted photo": lambda: (coffee().roll(3, dims=2), coffee()),
    "photo upside down": lambda: (coffee().flip(1), coffee()),
}


@pytest.mark.parametrize("dtype", [torch.float32, torch.float64])
@pytest.mark.parametrize("pair", PAIRS)
def test_flip_agrees_with_nvidia(pair, dtype):
    image, reference = PAIRS[pair]()
    expected_map, expected = by_nvidia(image, reference)
    image, reference = image.to(dtype), reference.to(dtype)
    # On flat pictures the rounding of NVIDIA's own features shows: the root of 1e-8 is 1e-4.
    is_flat = image.numel() == 3 or float(image.std(dim=(1, 2)).max()) == 0
    tolerance = 1e-4 if is_flat else 5e-6
    assert flip(image, reference).item() == pytest.approx(expected, abs=tolerance)
    assert flip_map(image, reference).dtype == dtype
    np.testing.assert_allclose(flip_map(image, reference).numpy(), expected_map, atol=5e-4)


def test_equal_pictures():
    picture = noise(3, 20, 30)
    assert flip_map(picture, picture).abs().max() == 0


def test_the_extremes_are_0_and_1():
    assert flip(flat(0.0, 1.0, 0.0), flat(0.0, 0.0, 1.0)).item() == pytest.approx(1, abs=1e-6)
    values = flip_map(noise(3, 30, 30).round(), noise(3, 30, 30, seed=1).round())
    assert 0 <= float(values.min()) < float(values.max()) <= 1


def test_flip_looks_at_what_a_screen_shows():
    image = noise(3, 20, 20) * 2 - 0.5
    assert torch.equal(flip_map(image, noise(3, 20, 20)), flip_map(image.clamp(0, 1), noise(3, 20, 20)))


def test_pictures_with_alpha_are_seen_over_black_and_white():
    image, reference = noise(4, 20, 25), noise(4, 20, 25, seed=1)
    for picture in (image, reference):
        picture[:3] *= picture[3:]
    over_black = by_nvidia(image[:3], reference[:3])
    over_white = by_nvidia(*(p[:3] + 1 - p[3:] for p in (image, reference)))
    assert flip(image, reference).item() == pytest.approx((over_black[1] + over_white[1]) / 2, abs=1e-5)
    expected = (over_black[0] + over_white[0]) / 2
    np.testing.assert_allclose(flip_map(image, reference).numpy(), expected, atol=5e-4)


def test_alpha_of_an_opaque_picture_changes_nothing():
    image, reference = noise(3, 20, 25), noise(3, 20, 25, seed=1)
    opaque = [torch.cat([picture, torch.ones(1, 20, 25)]) for picture in (image, reference)]
    assert flip(*opaque).item() == pytest.approx(flip(image, reference).item(), abs=1e-6)


@pytest.mark.parametrize("dtype", [torch.float16, torch.bfloat16])
def test_half_precision_is_computed_in_float32(dtype):
    image, reference = (noise(3, 20, 20, seed=seed).to(dtype) for seed in (0, 1))
    assert flip(image, reference).item() == pytest.approx(
        flip(image.double(), reference.double()).item(), abs=1e-5
    )


@pytest.mark.parametrize(
    "shapes", [((3, 8, 8), (4, 8, 8)), ((1, 8, 8), (1, 8, 8)), ((5, 8, 8), (5, 8, 8)), ((3, 0, 8), (3, 0, 8))]
)
def test_other_shapes_are_refused(shapes):
    with pytest.raises(ValueError, match="need"):
        flip(*map(torch.zeros, shapes))


# --- the loss -----------------------------------------------------------------------------------------------


def loss_and_gradient(render, target):
    """What fits use: float32, by the kernels."""
    return differentiated(Flip(target.float()), render.float())


@pytest.mark.parametrize("pair", PAIRS)
def test_the_loss_is_near_the_metric(pair):
    image, reference = PAIRS[pair]()
    value, _ = loss_and_gradient(image, reference)
    assert value == pytest.approx(flip(image, reference).item(), abs=4e-4)


@pytest.mark.parametrize("shape", [(3, 33, 300), (3, 40, 21), (4, 20, 20), (3, 1, 1), (3, 1, 7), (3, 50, 2)])
def test_the_kernels_compute_what_torch_does(shape):
    target, render = noise(*shape), noise(*shape, seed=1) * 1.4 - 0.2
    if len(target) == 4:
        target[:3] *= target[3:]
    expected, exact = differentiated(smooth_loss, render.double(), target.double())
    value, gradient = loss_and_gradient(render, target)
    assert value == pytest.approx(expected, abs=1e-6)
    np.testing.assert_allclose(gradient, exact, atol=1e-4 * float(exact.abs().max()))


def test_the_kernels_compute_what_torch_does_below_the_softness(monkeypatch):
    """With so large a softness that most errors lie below it."""
    softness = Softness(20, 0.1)
    monkeypatch.setattr(module, "SMOOTH", softness)
    target, render = noise(3, 40, 21), noise(3, 40, 21, seed=1)

    def soft_loss(image):
        return error(appearance(image, softness), appearance(target.double(), softness), softness).mean()

    expected, exact = differentiated(soft_loss, render.double())
    value, gradient = differentiated(Flip(target), render)
    assert value == pytest.approx(expected, abs=1e-6)
    np.testing.assert_allclose(gradient, exact, atol=1e-4 * float(exact.abs().max()))


def pale(*shape, seed):
    """A soft picture without bright or saturated colours, so that nothing is clamped."""
    coarse = 0.35 + 0.3 * noise(1, *shape, seed=seed, dtype=torch.float64)
    return torch.nn.functional.interpolate(coarse, (16, 13), mode="bicubic", align_corners=False)[0]


@pytest.mark.parametrize("alpha", [False, True])
def test_gradients_match_finite_differences(alpha):
    render, target = pale(3, 4, 4, seed=0), pale(3, 4, 4, seed=1)
    if alpha:
        render, target = (torch.cat([0.9 * p, 0.9 + 0.1 * p[:1]]) for p in (render, target))
    inputs = (render.clone().requires_grad_(),)
    assert torch.autograd.gradcheck(lambda r: smooth_loss(r, target), inputs, eps=1e-7, fast_mode=True)
    direction = noise(*render.shape, seed=2, dtype=torch.float64) - 0.5
    step = 1e-5 * direction
    slope = (smooth_loss(render + step, target) - smooth_loss(render - step, target)).item() / 2e-5
    _, gradient = loss_and_gradient(render, target)
    assert float((gradient * direction).sum()) == pytest.approx(slope, rel=1e-3)


KINKS = {
    "black": (flat(0.0, 0.0, 0.0), flat(0.5, 0.4, 0.3)),
    "white": (flat(1.0, 1.0, 1.0), flat(0.5, 0.4, 0.3)),
    "above the range": (flat(1.3, 1.5, 2.0), flat(0.5, 0.4, 0.3)),
    "below the range": (flat(-0.2, -1.0, -0.1), flat(0.5, 0.4, 0.3)),
    "nearly equal": (flat(0.5, 0.4, 0.3), flat(0.5, 0.4, 0.3) + 1e-6),
    "the end of the root's line": (flat(0.09, 0.09, 0.09), flat(0.2, 0.2, 0.2)),
    "the end of the code's line": (flat(0.04045, 0.04045, 0.04045), flat(0.0, 0.0, 0.0)),
    "as far as it can be": (flat(0.0, 1.0, 0.0), flat(0.0, 0.0, 1.0)),
    "of one lightness": (flat(0.5, 0.5, 0.5), flat(0.6, 0.4644, 0.5)),
    "one pixel": (torch.zeros(3, 1, 1), torch.ones(3, 1, 1)),
}


@pytest.mark.parametrize("through", ["kernels", "torch"])
@pytest.mark.parametrize("kink", KINKS)
def test_there_is_a_gradient_at_every_kink(kink, through):
    """Finite, at every pixel, and a step against it brings the pictures nearer."""
    render, target = KINKS[kink]
    if through == "kernels":
        _, gradient = loss_and_gradient(render, target)
    else:
        _, gradient = differentiated(smooth_loss, render.double(), target.double())
    assert gradient.isfinite().all()
    assert (gradient.abs().amax(dim=0) > 0).all()
    inside = render.clamp(0, 1).double()
    step = 1e-7 * gradient / gradient.abs().max()
    assert smooth_loss(inside - step, target.double()) < smooth_loss(inside, target.double())


@pytest.mark.parametrize(
    "picture", [flat(0.0, 0.0, 0.0), flat(1.0, 1.0, 1.0), flat(0.2, 0.9, 0.1), noise(3, 20, 20)]
)
def test_equal_pictures_are_at_rest(picture):
    value, gradient = loss_and_gradient(picture, picture)
    assert value == pytest.approx(0, abs=1e-5)
    assert gradient.isfinite().all()
    _, exact = differentiated(smooth_loss, picture.double(), picture.double())
    assert exact.abs().max() == 0


def test_the_exact_metric_has_finite_gradients():
    for image, reference in (*KINKS.values(), (noise(3, 9, 9), noise(3, 9, 9))):
        _, gradient = differentiated(flip, image, reference)
        assert gradient.isfinite().all()


def test_fits_by_flip_lower_it_more_than_fits_by_mse(monkeypatch):
    """From the same start scenes, rough fits, by nothing but steps on one loss; measured by NVIDIA's FLIP."""
    monkeypatch.setitem(PRESETS, "plain", Preset((Phase("all", 100, 96, rate=0.8, end_rate=0.03),)))
    picture = Picture(resize(load("examples/coffee.png").pixels[:400, 100:500], 96, 96))
    target = torch.from_numpy(picture.pixels.transpose(2, 0, 1).copy())

    def lowered(loss, seed):
        settings = Settings(24, ("circle",), preset="plain", seed=seed)
        start = fit_picture(picture, settings, lambda progress: progress.step == 40)
        scene = fit_picture(picture, replace(settings, start=start, loss=((loss, 1.0),)))
        return by_nvidia(draw(start)[:3], target)[1] - by_nvidia(draw(scene)[:3], target)[1]

    by_flip, by_mse = ([lowered(loss, seed) for seed in range(3)] for loss in ("flip", "mse"))
    assert min(by_flip) > 0
    assert sum(by_flip) > 1.3 * sum(by_mse)


def test_the_number_of_threads_does_not_change_the_loss(monkeypatch):
    target, render = noise(3, 50, 40), noise(3, 50, 40, seed=1)
    results = []
    for threads in ("1", "3"):
        monkeypatch.setenv("SDF2VEC_THREADS", threads)
        results.append(loss_and_gradient(render, target))
    assert results[0][0] == results[1][0]
    assert torch.equal(results[0][1], results[1][1])


def test_constants_follow_from_the_viewing_distance():
    """The paper's default: 67 pixels per degree; filters reach 10 pixels, and their sums are what they should be."""
    assert pytest.approx(67.0206, abs=1e-4) == module.PIXELS_PER_DEGREE
    filters = module.filters_for(torch.float64, torch.device("cpu"))
    assert filters.across.shape == (8, 1, 1, 21)
    sums = filters.across.sum(dim=(1, 2, 3)) * filters.down.sum(dim=(1, 2, 3))
    assert sums.tolist() == pytest.approx([1, 1, sums[2].item(), 1 - sums[2].item(), 0, 0, 0, 0], abs=1e-12)


def test_beyond_its_edges_a_picture_goes_on_as_it_ends():
    planes = torch.rand(2, 3, 4, 5, generator=torch.Generator().manual_seed(0))
    padded = module._edged(module._edged(planes, 3, 2), 3, 3)
    assert torch.equal(padded, torch.nn.functional.pad(planes, (3, 3, 3, 3), mode="replicate"))

"""The reference renderer against a second one in numpy, finite differences, and itself in chunks."""

import math

import numpy as np
import pytest
import torch

from sdf2vec import Layer, Scene, Shape
from sdf2vec.render import reference
from sdf2vec.render.reference import composite, render
from sdf2vec.render.tensors import from_scene, to_scene
from tests.scenes import random_scene


def numpy_coverage(d, falloff, pixel):
    softness = max(falloff, 1.6 * pixel)
    s = 1 / (1 + np.exp(-(10 * (falloff / 2 - d) / softness)))
    return np.clip((s - 1 / 512) / (1 - 2 / 512), 0, 1)


def numpy_grid(scene, width, height):
    unit = min(
        width / (scene.width / min(scene.width, scene.height)),
        height / (scene.height / min(scene.width, scene.height)),
    )
    x = (np.arange(width) + 0.5 - width / 2) / unit
    y = (np.arange(height) + 0.5 - height / 2) / unit
    return *np.meshgrid(x, y), 1 / unit


TWO_CIRCLES = Scene(
    12,
    8,
    (
        Layer((Shape.of("circle", (1.0, 0.2, 0.0), center=(-0.2, 0.1), radius=0.3),), 0.2, 0.75),
        Layer((Shape.of("circle", (0.0, 0.4, 1.0), center=(0.2, -0.1), radius=0.25),), 0.0),
    ),
    (0.9, 0.8, 0.7),
)


@pytest.mark.parametrize("size", [(12, 8), (31, 17), (8, 40), (1, 1)])
def test_two_circles_over_a_background(size):
    x, y, pixel = numpy_grid(TWO_CIRCLES, *size)
    want = np.broadcast_to(np.array([0.9, 0.8, 0.7, 1.0])[:, None, None], (4, size[1], size[0])).copy()
    for center, radius, falloff, opacity, color in (
        ((-0.2, 0.1), 0.3, 0.2, 0.75, (1.0, 0.2, 0.0)),
        ((0.2, -0.1), 0.25, 0.0, 1.0, (0.0, 0.4, 1.0)),
    ):
        a = opacity * numpy_coverage(np.hypot(x - center[0], y - center[1]) - radius, falloff, pixel)
        want = want * (1 - a) + np.array([*color, 1.0])[:, None, None] * a
    got = render(TWO_CIRCLES, size[0], size[1], dtype=torch.float64).numpy()
    np.testing.assert_allclose(got, want, atol=1e-12)


def test_additive_smooth_union_on_a_transparent_ground():
    shapes = tuple(
        Shape.of("circle", c, center=p, radius=0.2)
        for c, p in (((0.8, 0, 0), (-0.1, 0)), ((0, 0, 0.6), (0.1, 0)))
    )
    scene = Scene(20, 20, (Layer.union(shapes, 0.05, 0.1, 0.9),), None, "additive")
    x, y, pixel = numpy_grid(scene, 20, 20)
    d = np.stack([np.hypot(x + 0.1, y) - 0.2, np.hypot(x - 0.1, y) - 0.2])
    weights = np.exp(-d / 0.05)
    cover = numpy_coverage(-0.05 * np.log(weights.sum(axis=0)), 0.1, pixel)
    red, blue = 0.8 * weights[0] / weights.sum(axis=0), 0.6 * weights[1] / weights.sum(axis=0)
    want = np.stack([red * cover, 0 * cover, blue * cover, 0.9 * cover])
    np.testing.assert_allclose(render(scene, dtype=torch.float64).numpy(), want, atol=1e-12)


def test_a_scene_without_layers_is_its_background():
    scene = Scene(3, 2, (), (0.25, 0.5, 0.75))
    assert render(scene)[:, 1, 2].tolist() == [0.25, 0.5, 0.75, 1.0]
    assert render(Scene(3, 2, (), None)).abs().max() == 0.0


@pytest.mark.parametrize("compositing", ["over", "additive"])
def test_chunks_change_neither_values_nor_derivatives(compositing, monkeypatch):
    scene = random_scene(compositing=compositing, seed=4)
    results = []
    for chunk in (1 << 22, 700):
        monkeypatch.setattr(reference, "CHUNK", chunk)
        tensors = from_scene(scene, torch.float64)
        leaves = [tensor.requires_grad_() for group in tensors.groups for tensor in group.values.values()]
        image = composite(tensors, 23, 17)
        results.append([image.detach(), *torch.autograd.grad(image.square().sum(), leaves)])
    for one, other in zip(*results, strict=True):
        torch.testing.assert_close(one, other, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("compositing", ["over", "additive"])
@pytest.mark.parametrize("transparent", [False, True])
def test_derivatives_of_the_whole_render(compositing, transparent):
    tensors = from_scene(
        random_scene(compositing=compositing, seed=7, layers=10, transparent=transparent), torch.float64
    )
    weights = torch.rand((4, 11, 16), generator=torch.Generator().manual_seed(0), dtype=torch.float64)

    def loss():
        return (composite(tensors, 16, 11) * weights).sum()

    leaves = [tensor for group in tensors.groups for tensor in group.values.values()] + [tensors.background]
    for leaf in leaves:
        leaf.requires_grad_()
    grads = torch.autograd.grad(loss(), leaves)
    with torch.no_grad():
        for leaf, grad in zip(leaves, grads, strict=True):
            index = int(grad.abs().flatten().argmax())
            flat, before = leaf.view(-1), float(leaf.view(-1)[index])
            values = []
            for step in (1e-6, -1e-6):
                flat[index] = before + step
                values.append(float(loss()))
            flat[index] = before
            central = (values[0] - values[1]) / 2e-6
            assert float(grad.reshape(-1)[index]) == pytest.approx(central, rel=1e-4, abs=1e-5)


def test_a_scene_survives_the_way_through_tensors():
    for seed in range(3):
        scene = random_scene(seed=seed, compositing=("over", "additive")[seed % 2], transparent=seed == 2)
        assert to_scene(from_scene(scene, torch.float64), scene.width, scene.height) == scene


def test_float32_is_near_float64():
    scene = random_scene(layers=30, seed=11)
    difference = render(scene, 90, 60).double() - render(scene, 90, 60, dtype=torch.float64)
    assert float(difference.abs().max()) * 255 < 0.05


def test_the_picture_of_a_huge_scene_is_finite():
    layer = Layer(
        (Shape.of("box", (1, 1, 1), center=(0, 0), half_size=(64, 64), angle=0, corner_radius=0),), 64
    )
    assert math.isclose(float(render(Scene(5, 5, (layer,), (0, 0, 0)))[0, 2, 2]), 1.0)

"""The renderer in blocks, each with the layers that touch it, against the reference."""

import pytest
import torch

from sdf2vec import Layer, Scene, Shape
from sdf2vec.render import culled, reference
from sdf2vec.render.tensors import from_scene
from tests.scenes import random_scene


@pytest.mark.parametrize("compositing", ["over", "additive"])
@pytest.mark.parametrize("size", [(70, 130), (1, 1), (64, 65)])
def test_culled_is_the_same_function(compositing, size, monkeypatch):
    monkeypatch.setattr(culled, "BLOCK", 16)
    scene = random_scene(compositing=compositing, layers=20, seed=31)
    results = []
    for draw in (reference.composite, culled.composite):
        tensors = from_scene(scene, torch.float64)
        leaves = [tensor.requires_grad_() for group in tensors.groups for tensor in group.values.values()]
        image = draw(tensors, *size)
        weights = torch.randn(image.shape, generator=torch.Generator().manual_seed(1), dtype=torch.float64)
        results.append((image, *torch.autograd.grad((image * weights).sum(), leaves)))
    for want, got in zip(*results, strict=True):
        assert float((want - got).detach().abs().max()) <= 1e-12 * max(1.0, float(want.detach().abs().max()))


def test_culled_evaluates_only_what_touches_a_block(monkeypatch):
    circles = tuple(
        Layer((Shape.of("circle", (1, 0, 0), center=(x, 0.0), radius=0.1),), 0.05) for x in (-0.4, 0.4)
    )
    counts = []
    whole = reference.composite_points

    def counting(part, *rest):
        counts.append(part.layer_count)
        return whole(part, *rest)

    monkeypatch.setattr(culled, "composite_points", counting)
    with torch.no_grad():
        image = culled.composite(from_scene(Scene(128, 128, circles)), 128, 128)
    assert counts == [1, 1, 1, 1]
    assert float(image[0, 64, 12]) == float(image[0, 64, 115]) == pytest.approx(1.0, abs=0.01)

"""Layers blurred in runs, against SciPy's filter of a finer render, and against finite differences."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from scipy.ndimage import gaussian_filter
from scipy.stats import norm

from sdf2vec import Layer, Scene, Shape
from sdf2vec.render.reference import render
from sdf2vec.render.runs import Runs
from sdf2vec.render.tensors import from_scene

FINER = 4


def scene_of(width, height, background=(0.2, 0.3, 0.4)):
    """Sharp shapes of two kinds, well within the canvas, some on others."""
    shapes = (
        Shape.of("triangle", (0.9, 0.1, 0.2), a=(-0.3, -0.15), b=(0.2, -0.2), c=(-0.1, 0.2)),
        Shape.of("circle", (0.1, 0.8, 0.3), center=(0.12, 0.05), radius=0.14),
        Shape.of("triangle", (0.9, 0.9, 0.1), a=(-0.2, 0.15), b=(0.1, 0.2), c=(0.0, -0.1)),
    )
    layers = tuple(
        Layer((shape,), 0.0, opacity) for shape, opacity in zip(shapes, (1.0, 0.7, 0.8), strict=True)
    )
    return Scene(width, height, layers, background)


def filtered(scene, runs, width, height):
    """The same by a finer render of each run, SciPy's filter, and means of squares."""
    image = np.zeros((4, height * FINER, width * FINER))
    image += from_scene(scene).background.numpy()[:, None, None]
    first = 0
    for count, deviation in runs:
        layers = scene.layers[first : first + count]
        run = Scene(scene.width, scene.height, layers, (0, 0, 0, 0))
        light = render(run, width * FINER, height * FINER).double().numpy()
        sides = deviation * min(width, height) * FINER
        light = np.stack([gaussian_filter(plane, sides, truncate=6) for plane in light])
        image = light + image * (1 - light[3])
        first += count
    return image.reshape(4, height, FINER, width, FINER).mean(axis=(2, 4))


@pytest.mark.parametrize("size", [(150, 100), (64, 96)])
@pytest.mark.parametrize("deviations", [(0.01, 0.03), (0.08, 0.0), (0.0, 0.0)])
@pytest.mark.parametrize("background", [(0.2, 0.3, 0.4), (0.2, 0.3, 0.4, 0.0)])
def test_it_is_what_a_filter_makes_of_a_group(size, deviations, background):
    scene = scene_of(size[0], size[1], background)
    runs = list(zip((1, 2), deviations, strict=True))
    found = Runs((1, 2), torch.tensor(deviations)).composite(from_scene(scene), size[0], size[1], 4)
    off = 255 * (found.numpy() - filtered(scene, runs, *size))
    edges = 0.9 if min(deviations) else 1.6  # levels: where a pixel's own softness is all there is
    assert np.sqrt(np.mean(off**2)) < edges
    assert abs(off.mean()) < 0.05


def test_what_is_beyond_the_edge_is_blurred_into_the_picture():
    box = Shape.of("box", (1, 1, 1), center=(-0.8, 0), half_size=(0.3, 5), angle=0, corner_radius=0)
    scene = Scene(64, 64, (Layer((box,), 0.0),), (0, 0, 0))  # its edge is the canvas'
    found = Runs((1,), torch.tensor([4 / 64])).composite(from_scene(scene), 64, 64, 3)
    assert found[:, 32, 0] == pytest.approx(0.45, abs=0.02)  # half a pixel from the middle of a soft edge


@pytest.mark.parametrize(("pixels", "step"), [(1.2, 1), (7.0, 4), (20.0, 13)])
def test_an_edge_is_as_wide_as_asked_for(pixels, step):
    """The normal distribution's, of the blur and a square pixel together, in the mean of where the edge lies between
    samples, which are so many pixels wide: a lone one is off by up to a tenth of a sample, as antialiasing is.
    """
    at, off = np.arange(240) + 0.5 - 120, []
    for moved in (np.arange(16) + 0.5) / 16 * step:
        box = Shape.of(
            "box", (1, 1, 1), center=(moved / 60 - 2, 0), half_size=(2, 9), angle=0, corner_radius=0
        )
        scene = Scene(240, 60, (Layer((box,), 0.0),), (0, 0, 0))
        found = Runs((1,), torch.tensor([pixels / 60])).composite(from_scene(scene), 240, 60, 3)[0, 30]
        wrong = found.numpy() - norm.cdf((moved - at) / np.sqrt(pixels**2 + 1 / 12))
        off.append(255 * np.interp(at, at - moved, wrong))
    assert np.abs(np.mean(off, axis=0)).max() < 0.4


@pytest.mark.parametrize("deviation", [0.03, 0.08])
def test_derivatives(deviation):
    """By the standard deviations and by corners, of samples as wide as a pixel and wider."""
    width, height = 48, 32
    tensors = from_scene(scene_of(width, height))
    weights = torch.rand(3, height, width, generator=torch.Generator().manual_seed(0))
    ramp = torch.linspace(-1, 1, width) * weights
    other, triangles = tensors.groups
    slot = next(slot for slot in triangles.values if slot.parameter.name == "a")

    def total(deviations, corners):
        group = replace(triangles, values=triangles.values | {slot: corners})
        scene = replace(tensors, groups=[other, group])
        return (Runs((1, 2), deviations).composite(scene, width, height, 3) * ramp).sum()

    at = (
        torch.tensor([deviation, deviation]).requires_grad_(),
        triangles.values[slot].clone().requires_grad_(),
    )
    grads = torch.autograd.grad(total(*at), at)
    for index, step in ((0, 1e-3), (1, 4e-3)):
        moved = torch.zeros_like(at[index])
        moved.flatten()[0] = step
        ends = [
            [x.detach() + sign * moved if i == index else x.detach() for i, x in enumerate(at)]
            for sign in (1, -1)
        ]
        slope = float(total(*ends[0]) - total(*ends[1])) / (2 * step)
        assert float(grads[index].flatten()[0]) == pytest.approx(slope, rel=0.06)

"""Areas, thickness, and what is done to shapes that have too little of them."""

import math

import numpy as np
import pytest
import torch

from sdf2vec import Layer, Scene, Shape
from sdf2vec.expr import var
from sdf2vec.fit.constraints import areas_of, enforce_min_thickness, project, too_small
from sdf2vec.graph import components_of
from sdf2vec.lower.torch import compile_torch
from sdf2vec.operation import VEC2
from sdf2vec.render.tensors import SceneTensors, from_scene
from sdf2vec.shapes import KINDS

SHAPES = {
    "circle": (0.1, -0.1, 0.3),
    "ellipse": (0.1, 0.0, 0.4, 0.15, 0.7),
    "box": (0.0, 0.1, 0.4, 0.2, 1.1, 0.1),
    "box, corners cut to its size": (0.0, 0.1, 0.4, 0.2, 1.1, 0.9),
    "triangle": (-0.4, -0.3, 0.5, -0.1, 0.1, 0.45),
    "triangle, turned over": (0.5, -0.1, -0.4, -0.3, 0.1, 0.45),
    "rounded_triangle": (-0.4, -0.3, 0.5, -0.1, 0.1, 0.45, 0.1),
    "arc": (-0.4, -0.1, 0.4, -0.1, 0.0, 0.1),
    "displaced": (0.0, 0.0, 0.35, 0.02, 12.0, 9.0),
}
DEVIATIONS = (0.1, 0.0, 0.4, 0.15, 0.7)  # of a patch, which has no edge


def tensors_of(*shapes: tuple[str, tuple[float, ...]], dtype: torch.dtype = torch.float32) -> SceneTensors:
    layers = tuple(Layer((Shape(kind, numbers, (1, 0, 0)),), 0.0) for kind, numbers in shapes)
    return from_scene(Scene(64, 64, layers, (0, 0, 0)), dtype)


def measured(kind: str, numbers: tuple[float, ...]) -> tuple[float, float]:
    """The formulas' area and thickness, in float64."""
    variables = KINDS[kind].variables()
    formulas = [KINDS[kind].area(*variables), KINDS[kind].thickness(*variables)]
    values = compile_torch(formulas, KINDS[kind].scalars())(*torch.tensor(numbers, dtype=torch.float64))
    return float(values[0]), float(values[1])


def inside(kind: str, numbers: tuple[float, ...], count: int) -> torch.Tensor:
    """The points [M, 2] of a grid over 2 × 2 scene units that lie within a shape, by its distance."""
    p = var("p", VEC2)
    axis = (torch.arange(count, dtype=torch.float64) + 0.5) * (2 / count) - 1
    y, x = torch.meshgrid(axis, axis, indexing="ij")
    inputs = [*components_of(p), *KINDS[kind].scalars()]
    distance = compile_torch([KINDS[kind].distance(p, *KINDS[kind].variables())], inputs)
    (d,) = distance(x.flatten(), y.flatten(), *torch.tensor(numbers, dtype=torch.float64))
    return torch.stack([x.flatten(), y.flatten()], dim=1)[d < 0]


@pytest.mark.parametrize("name", SHAPES)
def test_areas_and_thickness_are_those_of_the_distance(name):
    """The area by counting points; the thickness as the least width over all directions."""
    kind, numbers = name.partition(",")[0], SHAPES[name]
    area, thickness = measured(kind, numbers)
    points = inside(kind, numbers, 1200)
    rough = 0.02 if kind == "displaced" else 0.003  # said to be those of its circle
    assert len(points) * 4 / 1200**2 == pytest.approx(area, rel=rough)
    turns = torch.arange(0, math.pi, math.pi / 180, dtype=torch.float64)
    along = points @ torch.stack([turns.cos(), turns.sin()])
    width = float((along.amax(dim=0) - along.amin(dim=0)).min())
    assert width == pytest.approx(thickness, rel=0.06 if kind == "displaced" else 0.01)


@pytest.mark.parametrize("sagitta", [-0.1, 0.3])
def test_an_arc_has_about_the_area_of_a_pen_along_it(sagitta):
    """Up to nearly half a circle."""
    numbers = (-0.35, 0.0, 0.35, 0.0, sagitta, 0.08)
    assert len(inside("arc", numbers, 1200)) * 4 / 1200**2 == pytest.approx(
        measured("arc", numbers)[0], rel=0.02
    )


def test_every_kind_is_measured():
    assert {name.partition(",")[0] for name in SHAPES} == {
        n for n, kind in KINDS.items() if kind.patch is None
    }


def test_the_area_of_a_gaussian_is_its_integral():
    """2π·σx·σy, by a sum over pixels, and the width of its middle, two standard deviations."""
    x, y = np.meshgrid(*[np.linspace(-3, 3, 1201)] * 2)
    bell = np.exp(-0.5 * ((x / 0.4) ** 2 + (y / 0.15) ** 2)).sum() * 0.005**2
    assert measured("gaussian", DEVIATIONS) == pytest.approx((bell, 0.3))
    assert measured("gabor", (*DEVIATIONS, 9.0, 1.0)) == pytest.approx((bell, 0.3))


def test_areas_by_hand():
    """A right triangle with legs 0.3 and 0.4: area 0.06, and 0.24 above its long side 0.5."""
    assert measured("triangle", (0, 0, 0.3, 0, 0, 0.4)) == pytest.approx((0.06, 0.24))
    assert measured("circle", (9, 9, 0.5)) == pytest.approx((math.pi / 4, 1.0))
    assert measured("box", (0, 0, 0.5, 0.25, 1, 0)) == pytest.approx((0.5, 0.5))
    tensors = tensors_of(("triangle", (0, 0, 0.3, 0, 0, 0.4)), ("triangle", (0, 0, 0.3, 0, 0, 0.2)))
    assert areas_of(tensors.groups[0])[0].tolist() == pytest.approx([0.06, 0.03])


def test_too_small_by_hand():
    """Areas 0.06 and 0.03 where 0.12 is wanted: (0.5² + 0.75²) / 2, and nothing for the large circle."""
    triangles = [("triangle", (0, 0, 0.3, 0, 0, leg)) for leg in (0.4, 0.2)]
    assert float(too_small(tensors_of(*triangles), 0.12)) == pytest.approx((0.25 + 0.5625) / 2)
    with_circle = tensors_of(*triangles, ("circle", (0, 0, 0.3)))
    assert float(too_small(with_circle, 0.12)) == pytest.approx((0.25 + 0.5625) / 3)
    assert float(too_small(with_circle, 0.03)) == pytest.approx(0.0, abs=1e-12)


def test_too_small_pushes_small_ones_only():
    tensors = tensors_of(("circle", (0, 0, 0.05)), ("circle", (0, 0, 0.4)))
    radius = tensors.groups[0].of("radius", 0).requires_grad_()
    too_small(tensors, 0.1).backward()
    assert radius.grad is not None
    assert float(radius.grad[0]) < 0 == float(radius.grad[1])


def heights(group) -> torch.Tensor:
    """The smallest height of triangles, by Heron's formula in float64."""
    a, b, c = (group.of(name, 0).detach().double() for name in "abc")
    u, v, w = (b - a).norm(dim=1), (c - b).norm(dim=1), (a - c).norm(dim=1)
    s = (u + v + w) / 2
    area = (s * (s - u).clamp(min=0) * (s - v).clamp(min=0) * (s - w).clamp(min=0)).sqrt()
    height: torch.Tensor = 2 * area / torch.stack([u, v, w]).amax(dim=0)
    return height


def flat(group) -> torch.Tensor:
    return torch.cat([group.of(name, 0).detach() for name in "abc"], dim=1)


def slivers() -> torch.Tensor:
    """Triangles [N, 6] of every length and thickness, some of them lines, points and almost points."""
    r = torch.Generator().manual_seed(0)
    a, edge, side = (
        torch.rand(500, 2, generator=r) - 0.5,
        torch.randn(500, 2, generator=r),
        torch.randn(500, 2, generator=r),
    )
    edge *= 10 ** (-3 * torch.rand(500, 1, generator=r))
    c = a + torch.rand(500, 1, generator=r) * edge + side * 10 ** (-5 * torch.rand(500, 1, generator=r))
    hard = [
        [0.2] * 6,
        [0.8, 0.1, 0.8, 0.3, 0.8, -0.2],
        [0.8, 0.1, 0.8, 0.1, 0.8, -0.2],
        [0.1, 0.1, 0.1 + 1e-7, 0.1, 0.1, 0.1 - 1e-7],
        [0.0, 0.0, 1e-5, 0.0, 0.0, 1e-5],
        [-0.8, -0.8, 0.0, 0.0, 0.8, 0.8],
    ]
    return torch.cat([torch.cat([a, a + edge, c], dim=1), torch.tensor(hard)])


def test_thin_triangles_become_as_thick_as_asked_and_others_stay():
    rows, least = slivers(), 1 / 64
    tensors = tensors_of(*(("triangle", tuple(row)) for row in rows.tolist()), ("circle", (0.1, 0.2, 0.3)))
    circle, group = sorted(tensors.groups, key=lambda group: group.structure)
    before, thick, others = flat(group), heights(group) >= least * (1 + 1e-5), circle.each(torch.clone)
    assert 50 < int(thick.sum()) < 450
    enforce_min_thickness(tensors, least)
    after = flat(group)
    assert torch.equal(after[thick], before[thick])
    assert float(heights(group).min()) >= least * (1 - 1e-3)
    assert float((after - before).abs().max()) < 3 * least  # by the shortest way
    assert float((after - before)[: len(rows) - 6].abs().max()) < 1.5 * least
    assert torch.equal(circle.rows(), others.rows())


def test_round_shapes_are_thickened_too():
    tensors = tensors_of(
        ("circle", (0, 0, 0.001)), ("ellipse", (0, 0, 0.3, 0.001, 1)), ("box", (0, 0, 0.001, 0.001, 1, 0))
    )
    enforce_min_thickness(tensors, 0.02)
    circle, ellipse, box = tensors.groups
    enough = pytest.approx(0.01, rel=2e-4)  # a little more than asked for
    assert float(circle.of("radius", 0)) == enough
    assert ellipse.of("radii", 0).flatten().tolist() == [pytest.approx(0.3), enough]
    assert box.of("half_size", 0).flatten().tolist() == [enough, enough]


def test_corners_are_no_rounder_than_a_box_is_large():
    """Beyond that the distance does not change with the radius, so that no descent would lead back."""
    x, y, half_width, half_height, angle, radius = SHAPES["box"]
    tensors = tensors_of(
        ("box", (x, y, half_width, half_height, angle, 0.9)), ("box", (x, y, 0.05, 0.2, angle, radius))
    )
    project(tensors, 1 / 64)
    assert tensors.groups[0].of("corner_radius", 0)[:, 0].tolist() == pytest.approx([0.2, 0.05], rel=2e-3)

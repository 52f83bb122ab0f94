"""Shapes: hand-computed distances, unit slope, extents, outlines, and no NaN anywhere."""

import math

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from sdf2vec.expr import const, var
from sdf2vec.graph import components_of, gradient, scalarize
from sdf2vec.lower.torch import compile_torch
from sdf2vec.operation import VEC2
from sdf2vec.outlines import ArcOutline, EllipseOutline, PolygonOutline, RectangleOutline
from sdf2vec.scene import Shape
from sdf2vec.shapes import KINDS

P = var("p", VEC2)
DIAGONAL = math.sqrt(0.5)

# kind, parameters, point, distance worked out by hand
BY_HAND = [
    ("circle", (0.1, 0.2, 0.5), (0.4, 0.6), 0.0),
    ("circle", (0.1, 0.2, 0.5), (0.1, 0.2), -0.5),
    ("circle", (0.0, 0.0, 1.0), (3.0, -4.0), 4.0),
    ("ellipse", (0.0, 0.0, 2.0, 1.0, 0.0), (0.0, 3.0), 2.0),  # along the shorter axis: exact
    ("ellipse", (0.0, 0.0, 2.0, 1.0, 0.0), (2.0, 0.0), 0.0),
    ("ellipse", (0.0, 0.0, 2.0, 1.0, math.pi / 2), (0.0, 2.0), 0.0),  # turned a quarter
    ("ellipse", (0.3, 0.0, 2.0, 1.0, 0.7), (0.3, 0.0), -1.0),
    ("box", (0.0, 0.0, 2.0, 1.0, 0.0, 0.0), (0.0, 0.0), -1.0),
    ("box", (0.0, 0.0, 2.0, 1.0, 0.0, 0.0), (5.0, 5.0), 5.0),
    ("box", (0.0, 0.0, 2.0, 1.0, 0.0, 0.0), (1.5, 0.0), -0.5),
    ("box", (0.0, 0.0, 2.0, 1.0, math.pi / 2, 0.0), (0.0, 3.0), 1.0),
    ("box", (0.0, 0.0, 1.0, 1.0, math.pi / 4, 0.0), (2.0, 0.0), 2.0 - math.sqrt(2.0)),
    ("box", (0.0, 0.0, 1.0, 1.0, 0.0, 0.5), (1.0, 1.0), 0.5 * math.sqrt(2.0) - 0.5),
    ("box", (0.0, 0.0, 2.0, 1.0, 0.0, 9.0), (2.0, 1.0), math.sqrt(2.0) - 1.0),  # corner radius held to 1
    ("triangle", (0.0, 0.0, 4.0, 0.0, 0.0, 3.0), (1.0, 1.0), -1.0),  # the incircle of 3-4-5
    ("triangle", (0.0, 0.0, 4.0, 0.0, 0.0, 3.0), (2.0, -2.0), 2.0),
    ("triangle", (0.0, 0.0, 4.0, 0.0, 0.0, 3.0), (7.0, -4.0), 5.0),
    ("triangle", (0.0, 3.0, 4.0, 0.0, 0.0, 0.0), (1.0, 1.0), -1.0),  # the other way round
    ("triangle", (0.0, 0.0, 2.0, 0.0, 1.0, 0.0), (1.0, 3.0), 3.0),  # flat: the distance to a line
    ("triangle", (1.0, 1.0, 1.0, 1.0, 1.0, 1.0), (4.0, 5.0), 5.0),  # a point
    ("rounded_triangle", (0.0, 0.0, 4.0, 0.0, 0.0, 3.0, 0.5), (1.0, 1.0), -1.5),
    ("rounded_triangle", (0.0, 0.0, 4.0, 0.0, 0.0, 3.0, 0.5), (7.0, -4.0), 4.5),  # from a corner's circle
    ("rounded_triangle", (0.0, 0.0, 4.0, 0.0, 0.0, 3.0, 0.5), (2.0, -0.5), 0.0),
    ("rounded_triangle", (0.3, 0.3, 0.3, 0.3, 0.3, 0.3, 0.1), (3.3, 4.3), 4.9),  # a dot
    ("arc", (-1.0, 0.0, 1.0, 0.0, -1.0, 0.1), (0.0, -3.0), 1.9),  # the upper half of the unit circle
    ("arc", (-1.0, 0.0, 1.0, 0.0, -1.0, 0.1), (0.0, 0.0), 0.9),
    ("arc", (-1.0, 0.0, 1.0, 0.0, -1.0, 0.1), (0.6, -0.8), -0.1),
    ("arc", (-1.0, 0.0, 1.0, 0.0, -1.0, 0.1), (1.0, 2.0), 1.9),  # below an end
    ("arc", (1.0, 0.0, -1.0, 0.0, -1.0, 0.1), (0.0, 3.0), 1.9),  # from the other end it is the lower half
    ("arc", (0.0, -1.0, -1.0, 0.0, -1.0 - DIAGONAL, 0.0), (3.0, 4.0), 4.0),  # three quarters of the circle
    ("arc", (0.0, -1.0, -1.0, 0.0, -1.0 - DIAGONAL, 0.0), (-3.0, -3.0), math.hypot(3.0, 2.0)),  # the gap
    ("arc", (0.0, -0.2, 0.0, 0.2, 0.0, 0.1), (0.3, 0.6), 0.4),  # straight
    ("arc", (0.3, 0.3, 0.3, 0.3, 0.0, 0.1), (3.3, 4.3), 4.9),  # a dot
    ("arc", (0.0, 0.0, 0.0, 0.0, 2.0, 0.0), (0.0, 5.0), 3.0),  # both ends are one: a ring around (0, 1)
    ("displaced", (0.0, 0.0, 1.0, 0.25, math.pi, math.pi), (0.5, 0.5), DIAGONAL - 1.25),
    ("displaced", (0.0, 0.0, 1.0, 0.25, math.pi, math.pi), (3.0, 4.0), 4.0),
    ("displaced", (0.2, 0.0, 1.0, 0.0, 9.0, 7.0), (0.2, 2.0), 1.0),
    ("gaussian", (0.0, 0.0, 2.0, 1.0, 0.0), (0.0, 3.0), 2.0),  # to where one standard deviation ends
    ("gaussian", (0.3, 0.0, 2.0, 1.0, 0.7), (0.3, 0.0), -1.0),
    ("gabor", (0.0, 0.0, 2.0, 1.0, math.pi / 2, 9.0, 1.0), (0.0, 2.0), 0.0),
]

TYPICAL = {
    "circle": (0.1, -0.2, 0.3),
    "ellipse": (0.1, -0.2, 0.4, 0.15, 0.6),
    "box": (0.1, -0.2, 0.4, 0.2, 0.6, 0.05),
    "triangle": (0.0, -0.3, 0.4, 0.2, -0.3, 0.1),
    "rounded_triangle": (0.0, -0.3, 0.4, 0.2, -0.3, 0.1, 0.08),
    "arc": (0.0, -0.3, 0.4, 0.2, 0.25, 0.08),
    "displaced": (0.1, -0.2, 0.3, 0.05, 12.0, 9.0),
    "gaussian": (0.1, -0.2, 0.4, 0.15, 0.6),
    "gabor": (0.1, -0.2, 0.4, 0.15, 0.6, 12.0, 1.0),
}


def distance(kind, parameters, x, y, dtype=torch.float64):
    """Distances at points, and their derivatives by x, y and every parameter, all lowered to torch."""
    scalars = KINDS[kind].scalars()
    inputs = [*components_of(P), *scalars]
    root = scalarize(KINDS[kind].distance(P, *KINDS[kind].variables()))[0]
    lowered = compile_torch([root, *gradient(root, inputs)], inputs)
    columns = [torch.as_tensor(v, dtype=dtype) for v in (x, y, *parameters)]
    d, *slopes = (part.expand(columns[0].shape) for part in lowered(*columns))
    return d, torch.stack(slopes)


def points(count=4000, spread=1.0, seed=1):
    generator = torch.Generator().manual_seed(seed)
    return (torch.rand((2, count), generator=generator, dtype=torch.float64) * 2 - 1) * spread


@pytest.mark.parametrize(("kind", "parameters", "point", "value"), BY_HAND)
def test_distance_by_hand(kind, parameters, point, value):
    d, _ = distance(kind, parameters, *point)
    assert float(d) == pytest.approx(value, abs=1e-9)


def test_every_kind_has_hand_computed_distances():
    assert {row[0] for row in BY_HAND} == set(KINDS) == set(TYPICAL)


@pytest.mark.parametrize("kind", KINDS)
def test_slope_is_one_where_the_field_is_exact_and_bounded_elsewhere(kind):
    x, y = points()
    _, slopes = distance(kind, TYPICAL[kind], x, y)
    steepness = torch.hypot(slopes[0], slopes[1])
    if KINDS[kind].exact:
        torch.testing.assert_close(steepness, torch.ones_like(steepness), rtol=0, atol=1e-9)
    else:
        most = {"displaced": 1.0 + 0.05 * math.hypot(12.0, 9.0)}.get(kind, 1.0)
        assert float(steepness.max()) <= most + 1e-9


@pytest.mark.parametrize("kind", KINDS)
def test_derivatives_match_finite_differences(kind):
    x, y = points(200, seed=3)
    _, slopes = distance(kind, TYPICAL[kind], x, y)
    values = [x, y, *TYPICAL[kind]]
    for index, slope in enumerate(slopes):
        up, down = list(values), list(values)
        up[index], down[index] = values[index] + 1e-6, values[index] - 1e-6
        central = (distance(kind, up[2:], *up[:2])[0] - distance(kind, down[2:], *down[:2])[0]) / 2e-6
        torch.testing.assert_close(slope, central, rtol=0, atol=1e-6)


def hard_points(kind, parameters):
    """Centres, corners, edge midpoints, the medial axis, and far away."""
    outlines = {"triangle": np.array(parameters).reshape(3, 2)} if kind == "triangle" else {}
    center = outlines[kind].mean(axis=0) if outlines else np.array(parameters[:2])
    size = max(abs(np.array(parameters[2:])).max(), 1e-3)
    offsets = [(0, 0), (size, 0), (0, size), (-size, -size), (1e-12, 0), (60, -60)]
    spots = [np.add(center, offset) for offset in offsets]
    if outlines:
        corners = outlines[kind]
        spots += [*corners, *((corners + np.roll(corners, 1, axis=0)) / 2)]
    return np.array(spots, dtype=np.float64).T


def sizes_of(kind, factor):
    units = [p.unit.name for p in KINDS[kind].parameters for _ in p.start]
    return tuple(v * (factor if u != "angle" else 1.0) for v, u in zip(TYPICAL[kind], units, strict=True))


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("factor", [0.0, 1e-30, 1e-6, 1.0, 1e3])
@pytest.mark.parametrize("dtype", [torch.float32, torch.float64])
def test_no_nan_in_values_or_derivatives(kind, factor, dtype):
    parameters = sizes_of(kind, factor)
    x, y = torch.as_tensor(hard_points(kind, parameters), dtype=dtype)
    d, slopes = distance(kind, parameters, x, y, dtype)
    assert torch.isfinite(d).all()
    assert torch.isfinite(slopes).all()
    leaves = [torch.full_like(x, v).requires_grad_() for v in parameters]
    xy = [x.clone().requires_grad_(), y.clone().requires_grad_()]
    scalars = [*components_of(P), *KINDS[kind].scalars()]
    (value,) = compile_torch([KINDS[kind].distance(P, *KINDS[kind].variables())], scalars)(*xy, *leaves)
    for grad in torch.autograd.grad(value.sum(), [*xy, *leaves], allow_unused=True):
        assert grad is None or torch.isfinite(grad).all()


def random_parameters(kind, numbers):
    """Any shape of moderate size, from numbers in 0..1."""
    lowest = {"position": -0.8, "length": 0.01, "offset": -0.5, "angle": -7.0, "frequency": -40.0}
    highest = {"position": 0.8, "length": 0.5, "offset": 0.5, "angle": 7.0, "frequency": 40.0}
    units = [p.unit.name for p in KINDS[kind].parameters for _ in p.start]
    return tuple(lowest[u] + n * (highest[u] - lowest[u]) for n, u in zip(numbers, units, strict=False))


@given(
    st.sampled_from(list(KINDS)),
    st.lists(st.floats(0, 1), min_size=7, max_size=7),
    st.sampled_from([0.0, 0.02, 0.3]),
    st.integers(0, 1000),
)
@settings(max_examples=150, deadline=None)
def test_extent_holds_every_point_within_the_margin(kind, numbers, margin, seed):
    parameters = random_parameters(kind, numbers)
    variables = KINDS[kind].variables()
    lowered = compile_torch([KINDS[kind].extent(const(margin), *variables)], KINDS[kind].scalars())
    low_x, low_y, high_x, high_y = (float(v) for v in lowered(*torch.tensor(parameters, dtype=torch.float64)))
    x, y = points(6000, 4.0, seed)
    near = torch.tensor(np.random.default_rng(seed).normal(0, 0.6, (2, 6000)))
    x, y = torch.cat([x, near[0]]), torch.cat([y, near[1]])
    d, _ = distance(kind, parameters, x, y)
    inside = d <= margin
    tolerance = 1e-9
    assert (x[inside] >= low_x - tolerance).all()
    assert (x[inside] <= high_x + tolerance).all()
    assert (y[inside] >= low_y - tolerance).all()
    assert (y[inside] <= high_y + tolerance).all()


@pytest.mark.parametrize("kind", [k for k in KINDS if k != "displaced"])
def test_extent_is_tight(kind):
    lowered = compile_torch([KINDS[kind].extent(const(0.1), *KINDS[kind].variables())], KINDS[kind].scalars())
    box = [float(v) for v in lowered(*torch.tensor(TYPICAL[kind], dtype=torch.float64))]
    x, y = points(400000, 1.0)
    d, _ = distance(kind, TYPICAL[kind], x, y)
    inside = d <= 0.1
    found = [x[inside].min(), y[inside].min(), x[inside].max(), y[inside].max()]
    np.testing.assert_allclose(box, found, atol=0.01)


def outline_points(outline):
    """Points on an outline's curve."""
    match outline:
        case EllipseOutline(center, radii, angle):
            t = np.linspace(0, 2 * np.pi, 50)
            local = np.stack([radii[0] * np.cos(t), radii[1] * np.sin(t)])
        case RectangleOutline(center, half, angle, radius):
            straight = np.linspace(-1, 1, 9)
            long, wide = half[0] - radius, half[1] - radius
            local = np.concatenate(
                [
                    np.stack([straight * long, np.full(9, -half[1])]),
                    np.stack([np.full(9, half[0]), straight * wide]),
                    [[long + radius * DIAGONAL], [-wide - radius * DIAGONAL]],
                ],
                axis=1,
            )
        case ArcOutline(start, end, sagitta, half):
            angle, center = 0.0, (0.0, 0.0)
            local = np.concatenate([arc_points(start, end, sagitta, off) for off in (half, -half)]).T
        case PolygonOutline(corners, rounding):
            angle, center = 0.0, (0.0, 0.0)
            ends = zip(corners, corners[1:] + corners[:1], strict=True)
            sides = [
                np.array([np.add(np.multiply(a, 1 - t), np.multiply(b, t)) for t in (0, 0.3, 1)])
                for a, b in ends
            ]
            local = np.concatenate([side + _outward(side, corners) * rounding for side in sides]).T
    c, s = math.cos(angle), math.sin(angle)
    return np.stack([c * local[0] - s * local[1] + center[0], s * local[0] + c * local[1] + center[1]])


def arc_points(start, end, sagitta, off):
    """Points so far beside an arc, by its circle's middle and angles."""
    a, b = np.array(start), np.array(end)
    middle, half = (a + b) / 2, np.linalg.norm(b - a) / 2
    out = np.array([a[1] - b[1], b[0] - a[0]]) / (2 * half)
    circle = middle + out * (sagitta**2 - half**2) / (2 * sagitta)
    first, top, last = (np.arctan2(*(p - circle)[::-1]) for p in (a, middle + out * sagitta, b))
    turns = np.concatenate(
        [np.linspace(top, top + math.remainder(side - top, math.tau), 9) for side in (first, last)]
    )
    return circle + (np.linalg.norm(a - circle) + off) * np.stack([np.cos(turns), np.sin(turns)], axis=1)


def _outward(side, corners):
    along = side[-1] - side[0]
    normal = np.array([along[1], -along[0]]) / np.hypot(*along)
    middle = np.mean(corners, axis=0)
    return normal if (side[0] - middle) @ normal > 0 else -normal


@pytest.mark.parametrize("kind", [k for k in KINDS if KINDS[k].outline])
@pytest.mark.parametrize("offset", [0.0, 0.07])
def test_outline_lies_where_the_distance_is_the_offset(kind, offset):
    shape = Shape(kind, TYPICAL[kind], (0, 0, 0))
    outline = KINDS[kind].outline
    assert outline is not None
    x, y = outline_points(outline(offset, *shape.named().values()))
    d, _ = distance(kind, TYPICAL[kind], x, y)
    np.testing.assert_allclose(d.numpy(), offset, atol=1e-9)


@pytest.mark.parametrize("kind", KINDS)
def test_start_values_are_within_range(kind):
    for parameter in KINDS[kind].parameters:
        assert len(parameter.start) in (1, 2)
        for value in parameter.start:
            assert parameter.unit.low <= value <= parameter.unit.high
            assert not (parameter.positive and value <= parameter.unit.low)

"""Falloff, smooth union, compositing, the canvas: against hand-computed values and numpy."""

import math

import numpy as np
import pytest
import torch
from scipy.special import logsumexp

from sdf2vec.blend import (
    CUTOFF,
    JOINS,
    MIN_FALLOFF_PIXELS,
    additive,
    coverage,
    display,
    over,
    pixel_size,
    reach,
    scene_point,
    union_reach,
)
from sdf2vec.expr import Expr, const, constant, var, vec3, vec4
from sdf2vec.graph import components_of, gradient, scalarize
from sdf2vec.lower.torch import compile_torch
from sdf2vec.operation import VEC2, VEC3, VEC4

d, falloff, pixel, k = var("d"), var("falloff"), var("pixel"), var("k")


def value(expr, **values):
    """An expression's components as numbers; arguments are floats or tuples."""
    inputs: list[Expr] = []
    numbers: list[torch.Tensor] = []
    for name, number in values.items():
        parts = number if isinstance(number, tuple) else (number,)
        inputs += components_of(var(name, {1: d.type, 2: VEC2, 3: VEC3, 4: VEC4}[len(parts)]))
        numbers += [torch.tensor(part, dtype=torch.float64) for part in parts]
    got = [float(part) for part in compile_torch([expr], inputs)(*numbers)]
    return got if len(got) > 1 else got[0]


def cover(distance, width, size=0.0):
    return value(coverage(d, falloff, pixel), d=distance, falloff=width, pixel=size)


@pytest.mark.parametrize("place", [-0.05, 0.0, 0.3, 0.5, 0.8, 1.0, 1.05])
def test_coverage_is_the_thesis_sigmoid_within_the_cutoff(place):
    thesis = 1.0 / (1.0 + math.exp(-(5.0 - 10.0 * place)))
    assert cover(0.2 * place, 0.2) == pytest.approx(thesis, abs=CUTOFF)
    assert cover(0.2 * place, 0.2) == pytest.approx((thesis - CUTOFF) / (1 - 2 * CUTOFF), abs=1e-12)


def test_coverage_is_exactly_zero_and_one_outside_its_band():
    far = value(reach(falloff, pixel), falloff=0.2, pixel=0.0)
    assert far == pytest.approx(0.2 * (0.5 + 0.1 * math.log(511.0)))
    assert cover(far + 1e-9, 0.2) == 0.0
    assert cover(far - 1e-3, 0.2) > 0.0
    assert cover(0.2 - far - 1e-9, 0.2) == 1.0
    assert cover(1e4, 0.2) == 0.0
    assert cover(-1e4, 0.2) == 1.0


def test_coverage_is_continuous_and_falls():
    x = torch.linspace(-0.1, 0.4, 200001, dtype=torch.float64)
    (c,) = compile_torch([coverage(d, const(0.2), const(0.0))], [d])(x)
    steps = c[1:] - c[:-1]
    assert float(steps.max()) <= 0.0
    assert float(steps.abs().max()) < 2.5 / 0.2 * 2.5e-6 * 1.01  # the steepest slope is 2.5 / falloff


def test_a_sharp_edge_is_as_soft_as_the_pixels_and_stays_in_place():
    for size in (0.001, 0.01, 0.1):
        assert cover(0.0, 0.0, size) == pytest.approx(0.5)
        assert cover(MIN_FALLOFF_PIXELS * size / 2, 0.0, size) == pytest.approx(cover(1.0, 1.0), abs=1e-9)
        assert cover(0.05, 0.1, size) == pytest.approx(0.5)  # half a falloff out, whatever the resolution
    assert cover(0.03, 0.1, 0.01) == cover(0.03, 0.1, 0.001)  # wider than the pixels: no difference


def test_the_floor_has_the_variance_of_a_pixel():
    logistic = MIN_FALLOFF_PIXELS / 10.0 * math.pi / math.sqrt(3.0)
    assert logistic == pytest.approx(math.sqrt(1.0 / 12.0), rel=0.01)


@pytest.mark.parametrize(
    ("distance", "width", "size"), [(0.0, 0.0, 0.01), (1e4, 1e-6, 1e-6), (-1e4, 64.0, 1.0)]
)
def test_coverage_has_finite_derivatives(distance, width, size):
    root = scalarize(coverage(d, falloff, pixel))[0]
    lowered = compile_torch(gradient(root, [d, falloff]), [d, falloff, pixel])
    parts = lowered(*(torch.tensor(v, dtype=torch.float32) for v in (distance, width, size)))
    assert all(torch.isfinite(part) for part in parts)


# --- joins --------------------------------------------------------------------------------------------------


def joined(name, rows, smoothness):
    """Rows (r, g, b, d) joined one after the other, with the same smoothness."""
    found = vec4(*map(const, rows[0]))
    for row in rows[1:]:
        found = JOINS[name].formula(found, vec4(*map(const, row)), k)
    return value(found, k=smoothness)


def rows_of(distances):
    return [(0.1 * i, 1.0 - 0.2 * i, 0.5, distance) for i, distance in enumerate(distances)]


DISTANCES = [[0.3, 0.1], [0.2, 0.2, 0.2], [-0.4, 0.1, 0.05, 2.0], [-0.3, -0.25, -0.2]]


@pytest.mark.parametrize("distances", DISTANCES)
@pytest.mark.parametrize("smoothness", [0.01, 0.1, 1.0])
def test_unions_one_after_the_other_are_the_exponential_minimum_of_all(distances, smoothness):
    d = np.array(distances)
    weights = np.exp(-d / smoothness - logsumexp(-d / smoothness))
    rows = np.array(rows_of(distances))
    *color, distance = joined("union", rows.tolist(), smoothness)
    assert distance == pytest.approx(-smoothness * logsumexp(-d / smoothness), abs=1e-12)
    assert color == pytest.approx(list(weights @ rows[:, :3]), abs=1e-12)


@pytest.mark.parametrize("smoothness", [0.01, 0.1, 1.0])
@pytest.mark.parametrize(
    "distances", [row for row in DISTANCES if len(row) == 2] + [[-0.2, -0.1], [-0.3, 0.3]]
)
def test_subtraction_and_intersection_are_exponential_maxima_in_the_first_colour(distances, smoothness):
    a, b = distances
    for name, other in (("subtraction", -b), ("intersection", b)):
        *color, distance = joined(name, rows_of(distances), smoothness)
        assert distance == pytest.approx(
            smoothness * logsumexp([a / smoothness, other / smoothness]), abs=1e-12
        )
        assert color == list(rows_of(distances)[0][:3])


@pytest.mark.parametrize(
    ("name", "sharp"),
    [("union", min), ("subtraction", lambda a, b: max(a, -b)), ("intersection", max)],
)
def test_without_smoothness_joins_are_sharp(name, sharp):
    for a in (-0.7, -0.1, 0.0, 0.1, 0.4):
        for b in (-0.5, -0.1, 0.0, 0.2):
            assert joined(name, rows_of([a, b]), 0.0)[3] == pytest.approx(sharp(a, b), abs=1e-6)


@pytest.mark.parametrize("name", JOINS)
def test_joins_are_stable_where_the_plain_formula_overflows(name):
    one, other = joined(name, [(1, 0, 0, -50.0), (0, 1, 0, 900.0)], 1e-3), (1.0, 0.0, 0.0)
    assert one[:3] == list(other)
    assert one[3] == {"union": -50.0, "subtraction": -50.0, "intersection": 900.0}[name]
    assert np.isfinite(joined(name, [(1, 0, 0, 1e4), (0, 1, 0, -1e4)], 0.0)).all()


def test_union_reaches_no_farther_than_it_says():
    for count in (2, 3, 4):
        distance = joined("union", [(0, 0, 0, 0.25)] * count, 0.1)[3]
        assert 0.25 - distance == pytest.approx(0.1 * math.log(count))
        assert 0.25 - distance == pytest.approx(constant(union_reach(count, const(0.1))))
    assert constant(union_reach(1, const(0.1))) == 0.0


# --- compositing -------------------------------------------------------------------------------------------


def blended(function, below, color, opacity, covered):
    channels = (const(v) for v in (*below,))
    root = function(vec4(*channels), vec3(*map(const, color)), const(opacity), const(covered))
    return [constant(part) for part in scalarize(root)]


def test_over_by_hand():
    assert blended(over, (0.2, 0.4, 0.6, 1.0), (1.0, 0.0, 0.5), 0.5, 0.5) == pytest.approx(
        [0.4, 0.3, 0.575, 1.0]
    )
    assert blended(over, (0.0, 0.0, 0.0, 0.0), (1.0, 0.5, 0.0), 0.5, 1.0) == pytest.approx(
        [0.5, 0.25, 0.0, 0.5]
    )
    assert blended(over, (0.3, 0.3, 0.3, 1.0), (0.7, 0.1, 0.2), 1.0, 1.0) == pytest.approx(
        [0.7, 0.1, 0.2, 1.0]
    )


def test_additive_by_hand():
    assert blended(additive, (0.2, 0.4, 0.6, 1.0), (-0.4, 0.2, 1.0), 0.0, 0.5) == pytest.approx(
        [0.0, 0.5, 1.1, 1.0]
    )
    assert blended(additive, (0.0, 0.0, 0.0, 0.0), (0.2, 0.2, 0.2), -0.5, 1.0) == pytest.approx(
        [0.2, 0.2, 0.2, -0.5]
    )


def test_display_keeps_colours_premultiplied():
    root = display(vec4(*map(const, (1.5, -0.2, 0.3, 0.5))))
    assert [constant(part) for part in scalarize(root)] == [0.5, 0.0, 0.3, 0.5]


# --- the canvas --------------------------------------------------------------------------------------------


def place(x, y, resolution, size):
    root = scene_point(var("pixel", VEC2), var("resolution", VEC2), var("size", VEC2))
    return value(root, pixel=(x, y), resolution=resolution, size=size)


def test_the_middle_is_the_origin_and_the_shortest_side_is_one():
    assert place(300.0, 200.0, (600.0, 400.0), (1.5, 1.0)) == [0.0, 0.0]
    assert place(600.0, 400.0, (600.0, 400.0), (1.5, 1.0)) == pytest.approx([0.75, 0.5])
    assert place(0.5, 0.5, (2.0, 2.0), (1.0, 1.0)) == [-0.25, -0.25]


def test_a_scene_fits_into_a_canvas_of_another_shape():
    assert value(pixel_size(var("r", VEC2), var("s", VEC2)), r=(800.0, 200.0), s=(1.5, 1.0)) == 0.005
    assert place(400.0, 200.0, (800.0, 200.0), (1.5, 1.0)) == pytest.approx([0.0, 0.5])
    assert place(0.0, 400.0, (300.0, 800.0), (1.5, 1.0)) == pytest.approx([-0.75, 0.0])

"""The expression language: structure, folding, the table, and derivatives against finite differences."""

import math

import numpy as np
import pytest
import torch

from sdf2vec.expr import (
    OPERATIONS,
    clamp,
    component,
    const,
    constant,
    fixed,
    length,
    maximum,
    mix,
    operation,
    select,
    sin,
    var,
    vec2,
    vec3,
    vec4,
)
from sdf2vec.function import function, let
from sdf2vec.graph import called_once, gradient, hoist, opened, scalarize, substitute, walk
from sdf2vec.lower.torch import compile_torch
from sdf2vec.operation import BOOL, FLOAT, VEC2, VEC3
from tests.operations import MEANINGS, SMOOTH, expected

a, b, p = var("a"), var("b"), var("p", VEC2)
ARGUMENTS = [var(name) for name in ("x0", "x1", "x2", "x3", "x4")]


@function("double", x=FLOAT)
def _double(x):
    """Twice x."""
    return x + x


def test_equal_expressions_are_one_object():
    assert (a + b) * a is (a + b) * a
    assert a + b is not b + a
    assert var("a", VEC2) is not a


def test_trivial_operations_fold():
    assert a + 0.0 is a
    assert 1.0 * a is a
    assert operation("neg", -a) is a
    assert a / 1.0 is a
    assert constant(a * 0.0) == 0.0
    assert constant(const(2.0) * 3.0 - 1.0) == 5.0
    assert vec2(a, b).y is b
    assert select(a < b, a, a) is a


def test_a_component_of_what_is_joined_is_that_part():
    a, b, c = (var(name) for name in "abc")
    v = var("v", VEC2)
    assert component(vec4(v, a, b), 2) is a
    assert component(vec4(a, v, b), 2) is component(v, 1)
    assert component(vec3(a), 2) is a
    assert vec4(vec3(a, b, c), 1.0) is vec4(a, b, c, 1.0)
    assert vec4(vec3(a), b).args == (vec3(a), b)  # repeated, not joined


def test_what_is_called_at_one_place_is_written_there():
    @function("once", x=FLOAT)
    def once(x):
        root = let("root", x + 1.0)
        return root * root

    @function("twice", x=FLOAT)
    def twice(x):
        return let("y", x * 2.0) + once(x)

    a, b = var("a"), var("b")
    roots = [twice(a) + b, twice(b)]
    assert called_once(roots) == {once}
    assert called_once([twice(a)]) == {once, twice}
    assert opened(roots[0], {once}) is roots[0]  # functions that stay are looked at from outside
    assert opened(roots[0], {once, twice}) is (a * 2.0 + (a + 1.0) * (a + 1.0)) + b


def test_zero_times_a_vector_stays_a_vector():
    assert (p * 0.0).type is VEC2


def test_constants_are_finite_and_zero_has_no_sign():
    assert math.copysign(1.0, constant(const(-0.0))) == 1.0
    for bad in (math.nan, math.inf):
        with pytest.raises(ValueError, match="finite"):
            const(bad)


@pytest.mark.parametrize(
    "build",
    [
        lambda: operation("min", p, a),
        lambda: p < a,
        lambda: p + var("q", VEC3),
        lambda: select(a, a, b),
        lambda: mix(p, p, p),
        lambda: length(a),
        lambda: vec2(a, b, a),
        lambda: p.z,
        lambda: a.x,
        lambda: (a < b) + a,
        lambda: _double(p),
    ],
)
def test_types_that_do_not_fit_are_refused(build):
    with pytest.raises(TypeError):
        build()


def test_walk_gives_arguments_first_and_every_node_once():
    root = (a + b) * (a + b) - sin(a + b)
    nodes = list(walk([root]))
    assert len(nodes) == len(set(nodes)) == 6
    places = {node: i for i, node in enumerate(nodes)}
    assert all(places[arg] < places[node] for node in nodes for arg in node.args)


def test_scalarize_leaves_neither_vectors_nor_calls_nor_lets():
    root = vec2(length(let("q", p * a)), _double(p.y))
    parts = scalarize(root)
    assert len(parts) == 2
    for node in walk(parts):
        assert node.type in (FLOAT, BOOL)
        assert node.op not in ("call", "let", "component", "vec2")


def test_substitute_folds_anew():
    assert constant(substitute(_double(a) * b, {a: const(3.0), b: const(0.0)})) == 0.0
    assert substitute(vec2(a, b), {a: b}) is vec2(b, b)
    assert scalarize(substitute(p.x + a, {p: vec2(a, b)}))[0] is a + a


def test_hoist_finds_the_largest_constant_parts():
    root = length(p - vec2(a, b)) - sin(a * 2.0) * p.x
    assert set(hoist(root, {p})) == {vec2(a, b), sin(a * 2.0)}


def test_every_row_is_complete_and_every_operation_has_a_meaning():
    assert set(MEANINGS) == set(OPERATIONS)
    assert len(OPERATIONS) <= 30
    for name, row in OPERATIONS.items():
        assert row.glsl.text, name
        assert row.wgsl.text, name
        own = (row.torch, row.python, row.triton, row.value, row.partials)
        assert all(own) != bool(row.expand), name
        assert any(own) == all(own), name


def test_the_check_for_missing_cells_can_fail():
    del (broken := dict(OPERATIONS))["sqrt"]
    assert set(MEANINGS) != set(broken)


@pytest.mark.parametrize("name", [n for n in OPERATIONS if OPERATIONS[n].value])
def test_folding_constants_means_the_same(name):
    meaning = MEANINGS[name]
    for case in meaning.cases:
        folded = meaning.build(*map(const, case))
        assert constant(folded) == pytest.approx(
            float(expected(meaning, np.array([case]))[0, 0]), rel=1e-12, abs=1e-12
        )


# --- derivatives -------------------------------------------------------------------------------------------


def symbolic(meaning, cases):
    """Partial derivatives, [components, arguments, cases]."""
    inputs = ARGUMENTS[: meaning.arity]
    outputs = scalarize(meaning.build(*inputs))
    columns = [torch.tensor(column) for column in cases.T]
    rows = []
    for output in outputs:
        lowered = compile_torch(gradient(output, inputs), inputs)(*columns)
        rows.append([part.expand(len(cases)).numpy() for part in lowered])
    return np.array(rows)


def by_autograd(meaning, cases):
    inputs = ARGUMENTS[: meaning.arity]
    lowered = compile_torch([meaning.build(*inputs)], inputs)
    rows = []
    for index in range(meaning.build(*inputs).type.width):
        columns = [torch.tensor(column, requires_grad=True) for column in cases.T]
        total = lowered(*columns)[index].sum()
        parts = (
            torch.autograd.grad(total, columns, allow_unused=True, materialize_grads=True)
            if total.requires_grad
            else [torch.zeros(len(cases))] * len(columns)
        )
        rows.append([part.numpy() for part in parts])
    return np.array(rows)


def differences(meaning, cases, argument, step):
    moved = cases.copy()
    moved[:, argument] += step
    return (expected(meaning, moved) - expected(meaning, cases)) / step


def smooth_cases(arity):
    return np.array([[SMOOTH[(start + 2 * i) % 5] + 0.01 * i for i in range(arity)] for start in range(5)])


def test_fixed_counts_as_constant():
    assert [constant(part) for part in gradient(fixed(a) * b, [a])] == [0.0]
    assert gradient(fixed(a) * b, [b]) == (fixed(a),)


@pytest.mark.parametrize("name", [n for n in OPERATIONS if n != "fixed"])
def test_derivatives_match_central_differences(name):
    meaning = MEANINGS[name]
    cases = smooth_cases(meaning.arity)
    if name in ("sqrt", "log"):
        cases = np.abs(cases)
    if name == "clamp":
        cases[:, 1:] = [0.0, 1.0]
    got = symbolic(meaning, cases)
    for argument in range(meaning.arity):
        step = 1e-6
        central = (
            differences(meaning, cases, argument, step) + differences(meaning, cases, argument, -step)
        ) / 2
        np.testing.assert_allclose(got[:, argument], central, rtol=1e-7, atol=1e-7)


@pytest.mark.parametrize("name", [n for n in OPERATIONS if MEANINGS[n].kinks and n not in ("less", "select")])
def test_derivatives_at_kinks_and_ties_lie_between_the_one_sided_ones(name):
    meaning = MEANINGS[name]
    cases = np.array([case for case in meaning.cases if all(abs(v) < 1e3 for v in case)])
    cases[np.abs(cases) < 1e-6] = 0.0
    got = symbolic(meaning, cases)
    for argument in range(meaning.arity):
        sides = [differences(meaning, cases, argument, step) for step in (1e-6, -1e-6)]
        low, high = np.minimum(*sides), np.maximum(*sides)
        assert (got[:, argument] >= low - 1e-6).all()
        assert (got[:, argument] <= high + 1e-6).all()


@pytest.mark.parametrize("name", OPERATIONS)
def test_derivatives_are_finite_and_agree_with_autograd_on_hard_inputs(name):
    meaning = MEANINGS[name]
    cases = np.array(meaning.cases, dtype=np.float64)
    got = symbolic(meaning, cases)
    assert np.isfinite(got).all()
    np.testing.assert_allclose(got, by_autograd(meaning, cases), rtol=1e-9, atol=1e-12)


def test_gradient_of_a_composed_expression():
    root = scalarize(length(maximum(p * a, 0.1)) * clamp(sin(a), -0.5, 0.5))[0]
    x, y = scalarize(p)
    point = [0.3, 0.7, 0.2]
    lowered = compile_torch(gradient(root, [x, y, a]), [x, y, a])
    got = [float(part) for part in lowered(*(torch.tensor(v, dtype=torch.float64) for v in point))]

    def value(px, py, s):
        return np.hypot(max(px * s, 0.1), max(py * s, 0.1)) * np.clip(np.sin(s), -0.5, 0.5)

    for i in range(3):
        up, down = list(point), list(point)
        up[i] += 1e-6
        down[i] -= 1e-6
        assert got[i] == pytest.approx((value(*up) - value(*down)) / 2e-6, abs=1e-8)

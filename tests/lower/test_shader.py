"""Every operation in shader text, on hard inputs and real engines, against numpy; text as a person would write it."""

import re

import numpy as np
import pytest
import torch

from sdf2vec.engines import ENGINES
from sdf2vec.expr import OPERATIONS, select, sigmoid, var
from sdf2vec.function import function, let
from sdf2vec.lower.shader import GLSL, WGSL, definition, expression, literal, statements, used_functions
from sdf2vec.lower.torch import compile_torch
from sdf2vec.operation import FLOAT, VEC2
from tests.operations import MEANINGS, expected

ARGUMENTS = [var(name) for name in ("x0", "x1", "x2", "x3", "x4")]
a, b, p = var("a"), var("b"), var("p", VEC2)


GLSL_FRAME = """#version 300 es
precision highp float;
uniform highp sampler2D data;
out vec4 color;
void main() {{
  int i = int(gl_FragCoord.x);
  vec4 u = texelFetch(data, ivec2(i, 0), 0), v = texelFetch(data, ivec2(i, 1), 0);
  float x0 = u.x, x1 = u.y, x2 = u.z, x3 = u.w, x4 = v.x;
  {0} r = {1};
  color = {2};
}}
"""
WGSL_FRAME = """
@group(0) @binding(1) var<storage, read> data: array<vec4f>;
@fragment fn fragment_main(@builtin(position) position: vec4f) -> @location(0) vec4f {{
  let i = i32(position.x);
  let u = data[i]; let v = data[i + {3}];
  let x0 = u.x; let x1 = u.y; let x2 = u.z; let x3 = u.w; let x4 = v.x;
  let r: {0} = {1};
  return {2};
}}
"""
PADDED = {1: "{v}4(r, 0.0, 0.0, 0.0)", 2: "{v}4(r, 0.0, 0.0)", 3: "{v}4(r, 0.0)", 4: "r"}


def on_engine(engine, dialect, expr, cases):
    """The expression's value for every case, [components, cases], computed by a shader."""
    frame, vector = (GLSL_FRAME, "vec") if dialect is GLSL else (WGSL_FRAME, "vec4f(")
    width = expr.type.width
    padded = PADDED[width].replace("{v}4(", "vec4(" if dialect is GLSL else vector)
    text = frame.format(dialect.types[expr.type], expression(expr, dialect), padded, len(cases))
    texture = np.zeros((2, len(cases), 4), dtype=np.float32)
    flat = np.zeros((len(cases), 8), dtype=np.float32)
    flat[:, : cases.shape[1]] = cases
    texture[0], texture[1] = flat[:, :4], flat[:, 4:]
    return ENGINES[engine].render(text, len(cases), 1, texture=texture)[0, :, :width].T


@pytest.mark.parametrize(("engine", "dialect"), [("opengl", GLSL), ("webgpu", WGSL)])
@pytest.mark.parametrize("name", OPERATIONS)
def test_shader_on_a_real_engine(name, engine, dialect, require_engine):
    require_engine(engine)
    meaning = MEANINGS[name]
    cases = np.array(meaning.cases, dtype=np.float32)
    got = on_engine(engine, dialect, meaning.build(*ARGUMENTS[: meaning.arity]), cases)
    want = expected(meaning, cases)
    size = np.abs(cases).max(axis=1) if name in ("add", "sub", "mix", "dot") else 1.0
    scale = np.maximum(np.abs(want), size**2 if name == "dot" else size)
    # the engines promise 2⁻¹¹ for sine and cosine, and do far better
    assert (np.abs(got - want) <= 1e-5 * scale).all()


def test_negative_constants_and_precedence_survive(require_engine):
    exprs = [
        a - (b - a),
        a - (b + a),
        a / (b * a),
        a * (b / a),
        -(a + b) * -a,
        -(a * -2.5) - -3.0,
        select(a < b, a, b) * 2.0,
        (a + b) * (a - b),
        a - (-b),
        sigmoid(-3.0 * a),
        sigmoid(-a),
        sigmoid(a + b) - 1.0,
        2.0 / sigmoid(b),
        select(select(a < b, a, 1.0) < 0.5, a - 1.0, b),
    ]
    values = np.array([[0.3, 0.7], [-1.2, 0.4], [2.0, -0.5]], dtype=np.float32)
    renamed = {"a": "x0", "b": "x1"}
    for engine, dialect in (("opengl", GLSL), ("webgpu", WGSL)):
        require_engine(engine)
        for expr in exprs:
            text = re.sub(r"\b[ab]\b", lambda m: renamed[m[0]], expression(expr, dialect))
            got = on_engine(engine, dialect, var(f"({text})"), values)
            (want,) = compile_torch([expr], [a, b])(*torch.tensor(values.T.astype(np.float64)))
            np.testing.assert_allclose(got[0], want.numpy(), rtol=1e-5, atol=1e-6, err_msg=text)


# --- readability -------------------------------------------------------------------------------------------


@function("sdRing", p=VEC2, radius=FLOAT)
def sd_ring(p, radius):
    """Distance to a ring."""
    q = let("q", p * 2.0)
    return (q.x + q.y) * (q.x + q.y) - radius


def test_functions_read_as_a_person_would_write_them():
    assert definition(sd_ring, GLSL) == (
        "// Distance to a ring.\n"
        "float sdRing(vec2 p, float radius) {\n"
        "  vec2 q = p * 2.0;\n"
        "  float t1 = q.x + q.y;\n"
        "  return t1 * t1 - radius;\n"
        "}"
    )
    assert definition(sd_ring, WGSL) == (
        "// Distance to a ring.\n"
        "fn sdRing(p: vec2f, radius: f32) -> f32 {\n"
        "  let q = p * 2.0;\n"
        "  let t1 = q.x + q.y;\n"
        "  return t1 * t1 - radius;\n"
        "}"
    )


def test_functions_come_before_their_callers():
    @function("outer", p=VEC2)
    def outer(p):
        """Calls."""
        return sd_ring(p, 1.0) + 1.0

    assert [f.name for f in used_functions([outer(p)])] == ["sdRing", "outer"]


def test_statements_declare_locals_first():
    shared = a + b
    assert statements("c = {};", shared * shared, GLSL) == ["float t1 = a + b;", "c = t1 * t1;"]


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.1, "0.1"),
        (1.0, "1.0"),
        (-2.0, "-2.0"),
        (1 / 3, "0.33333334"),
        (1e-20, "1e-20"),
        (0.0, "0.0"),
        (3e10, "3e+10"),
    ],
)
def test_literals_are_short_and_exact(value, text):
    assert literal(value) == text
    assert np.float32(literal(value)) == np.float32(value)
    assert "." in text or "e" in text

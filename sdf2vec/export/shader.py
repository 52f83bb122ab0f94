"""Shader exports. The formulas come lowered from expressions; the templates add loops, tables and comments."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from ..blend import (
    COMPOSITING,
    coverage,
    display,
    pixel_size,
    scene_point,
    smooth_union,
    union_distance,
    union_weight,
)
from ..expr import (
    VEC2,
    VEC4,
    Expr,
    component,
    const,
    constant,
    hoist,
    scalarize,
    substitute,
    var,
    vec2,
    vec3,
    vec4,
)
from ..lower.shader import GLSL, WGSL, Dialect, definition, expression, literal, statements, used_functions
from ..scene import Layer, Scene, Shape
from ..shapes import KINDS
from ..templating import template
from .constants import constants
from .options import GLSL_VERSIONS, Options

MAX_READABLE = 256  # shapes; beyond, "auto" writes a table

P, BELOW, PIXEL = var("p", VEC2), var("c", VEC4), var("pixel")


def glsl(scene: Scene, options: Options) -> str:
    """A complete fragment shader with one uniform, `resolution`."""
    return _render("glsl.jinja", GLSL, scene, options, version=GLSL_VERSIONS[options.glsl])


def shadertoy(scene: Scene, options: Options) -> str:
    """A `mainImage` that needs nothing but what Shadertoy supplies."""
    return _render("shadertoy.jinja", GLSL, scene, options)


def wgsl(scene: Scene, options: Options) -> str:
    """A WGSL module with the fragment entry point `fragment_main` and one uniform, `resolution`."""
    return _render("wgsl.jinja", WGSL, scene, options)


def _render(name: str, dialect: Dialect, scene: Scene, options: Options, **more: str) -> str:
    # WGSL never gets a table: indexing a constant array by a variable hangs some of its compilers
    table = dialect is GLSL and (
        options.layout == "table" or (options.layout == "auto" and scene.shape_count > MAX_READABLE)
    )
    body = _table(scene) if table and scene.layers else _lines(scene, dialect)
    size = vec2(*(const(side) for side in scene.extent))
    return template(name).render(
        scene=scene,
        title="".join(c if c.isprintable() and c != "\\" else " " for c in options.title),
        size=expression(size, dialect),
        background=expression(_background(scene), dialect),
        **body,
        **more,
    )


def _background(scene: Scene) -> Expr:
    values = (*scene.background, 1.0) if scene.background else (0.0,) * 4
    return vec4(*(const(value) for value in values))


def _definitions(roots: list[Expr], dialect: Dialect) -> str:
    resolution, size = var("resolution", VEC2), var("size", VEC2)
    frame = [display(BELOW), scene_point(P, resolution, size), pixel_size(resolution, size)]
    return "\n\n".join(definition(function, dialect) for function in used_functions([*roots, *frame]))


# --- readable: a line for every shape ----------------------------------------------------------------------


def _lines(scene: Scene, dialect: Dialect) -> dict[str, Any]:
    layers = [_layer(layer, scene.compositing) for layer in scene.layers]
    return {
        "table": None,
        "functions": _definitions(layers, dialect),
        "layers": [statements("c = {};", layer, dialect) for layer in layers],
    }


def _layer(layer: Layer, compositing: str) -> Expr:
    """The colour after this layer is laid on `c`."""
    distances = [_distance(shape) for shape in layer.shapes]
    colors = [vec3(*(const(channel) for channel in shape.color)) for shape in layer.shapes]
    distance, color = smooth_union(distances, colors, const(layer.smoothness))
    cover = coverage(distance, const(layer.falloff), PIXEL)
    return COMPOSITING[compositing](BELOW, color, const(layer.opacity), cover)


def _distance(shape: Shape) -> Expr:
    return KINDS[shape.kind].distance(P, *constants(shape))


# --- table: a loop over records ----------------------------------------------------------------------------


def _table(scene: Scene) -> dict[str, Any]:
    """Records of `stride` vec4 each: (kind, union size, falloff, smoothness), (colour, opacity), parameters.

    What a distance computes from its parameters alone (the cosine of an angle, say) is in the table.
    """
    kinds = sorted({layer.kind for layer in scene.layers}, key=list(KINDS).index)
    entries = {kind: _entry(kind) for kind in kinds}
    stride = 2 + max(-(-entry.width // 4) for entry in entries.values())
    rows = [
        _vec4_rows(_record(layer, shape, kinds, entries), stride)
        for layer in scene.layers
        for shape in layer.shapes
    ]
    union = any(len(layer.shapes) > 1 for layer in scene.layers)
    d, k = var("d"), var("smoothness")
    unions = [union_weight(d, d, k), union_distance(d, d, k)] if union else []
    blend = COMPOSITING[scene.compositing](BELOW, vec3(0.0), d, coverage(d, d, PIXEL))
    roots = [*(entry.distance for entry in entries.values()), blend, *unions]
    return {
        "layers": [],
        "functions": _definitions(roots, GLSL),
        "table": {
            "count": scene.shape_count,
            "stride": stride,
            "rows": rows,
            "union": union,
            "blend": COMPOSITING[scene.compositing].name,
            "kinds": [(kind, expression(entry.distance, GLSL)) for kind, entry in entries.items()],
        },
    }


class _Entry:
    """How a kind's distance reads its record: `parts` are the tabulated expressions, in order."""

    def __init__(self, parts: list[Expr], distance: Expr, width: int) -> None:
        self.parts = parts
        self.distance = distance
        self.width = width


def _entry(kind: str) -> _Entry:
    symbolic = KINDS[kind].distance(P, *KINDS[kind].variables())
    parts = hoist(symbolic, P)
    slots: Iterator[Expr] = (component(var(f"r{i // 4}", VEC4), i % 4) for i in range(64))
    replaced = {part: _take(part, slots) for part in parts}
    return _Entry(parts, substitute(symbolic, replaced), sum(part.type.width for part in parts))


def _take(part: Expr, slots: Iterator[Expr]) -> Expr:
    if part.type is VEC2:
        return vec2(next(slots), next(slots))
    return next(slots)


def _record(layer: Layer, shape: Shape, kinds: list[str], entries: dict[str, _Entry]) -> list[float]:
    head = [kinds.index(shape.kind), len(layer.shapes), layer.falloff, layer.smoothness]
    values = dict(zip(KINDS[shape.kind].scalars(), map(const, shape.parameters), strict=True))
    scalars = [scalar for part in entries[shape.kind].parts for scalar in scalarize(part)]
    return [*head, *shape.color, layer.opacity, *(constant(substitute(scalar, values)) for scalar in scalars)]


def _vec4_rows(values: list[float], stride: int) -> str:
    padded = values + [0.0] * (4 * stride - len(values))
    quads = (padded[i : i + 4] for i in range(0, len(padded), 4))
    return ", ".join(f"vec4({', '.join(literal(value) for value in quad)})" for quad in quads)

"""`<sdf-image>`: a web component that shows any scene file. Its formulas are lowered like all others."""

from __future__ import annotations

import json
from collections.abc import Iterable

from ..blend import (
    COMPOSITING,
    FRAMINGS,
    coverage,
    display,
    grid_point,
    reach,
    union_distance,
    union_reach,
    union_weight,
)
from ..expr import VEC2, VEC4, Expr, scalarize, var, vec3
from ..lower.javascript import function_text
from ..lower.shader import GLSL, definition, expression, used_functions
from ..scene import FORMAT, MAX_UNION, VERSION, Scene
from ..shapes import KINDS
from ..templating import template
from .exported import Exported
from .options import Options
from .records import Form, P, record_scalars
from .shader import DATA_WIDTH
from .tiles import COARSEST

FORM = Form(tuple(KINDS), unions=True)


def component(scene: Scene, options: Options) -> Exported:
    """An ES module that defines the element; it is the same for every scene."""
    text = template("component.js.jinja").render(
        format=FORMAT,
        version=VERSION,
        coarsest=COARSEST,
        parameters=json.dumps({kind.name: [p.name for p in kind.parameters] for kind in KINDS.values()}),
        kinds=list(KINDS),
        formulas="\n\n".join(_formulas()),
        stride=FORM.stride,
        size="vec2(${size})",
        **_shader_parts(),
        width=DATA_WIDTH,
    )
    return Exported(text)


def _formulas() -> Iterable[str]:
    """What the element computes itself: records, and boxes to make lists from."""
    for kind in KINDS.values():
        yield function_text(f"{kind.name}Record", record_scalars(kind.name), kind.scalars())
        margin = var("margin")
        box = scalarize(kind.extent(margin, *kind.variables()))
        yield function_text(f"{kind.name}Box", box, [margin, *kind.scalars()])
    falloff, pixel, smoothness = (var(name) for name in ("falloff", "pixel", "smoothness"))
    farthest = reach(falloff, pixel) + union_reach(MAX_UNION, smoothness)
    yield function_text("layerReach", scalarize(farthest), [falloff, pixel, smoothness])


def _shader_parts() -> dict[str, object]:
    """What the templates of shaders take, with JavaScript's `${…}` where the scene decides."""
    resolution, c, d = var("resolution", VEC2), var("c", VEC4), var("d")
    place, pixel_size = FRAMINGS["fit"]
    cell = grid_point(P, var("vec2(${low})", VEC2), var("vec2(${perUnit})", VEC2))
    blends = [blend(c, vec3(0.0), d, coverage(d, d, d)) for blend in COMPOSITING.values()]
    frame = [display(c), place(P, resolution, P), pixel_size(resolution, P), cell]
    distances = FORM.distances()
    roots: list[Expr] = [*(distance for _, distance in distances), *blends, union_weight(d, d, d), *frame]
    functions = used_functions([*roots, union_distance(d, d, d)])
    return {
        "functions": "\n\n".join(definition(function, GLSL) for function in functions),
        "background": "vec4(${background})",
        "motion": "",
        "packed": None,
        "layers": [],
        "data": {"width": DATA_WIDTH, "lists": "${lists}"},
        "tiles": {
            "columns": "${columns}",
            "last_column": "${columns - 1}",
            "last_row": "${rows - 1}",
            "after": "${columns * rows + 1}",
            "place": expression(cell, GLSL),
            "coarsest": COARSEST,
        },
        "table": {
            "count": "${count}",
            "stride": FORM.stride,
            "union": True,
            "blend": "${blend}",
            "kind": FORM.slot(FORM.kind_place),
            "kinds": [(kind, expression(distance, GLSL)) for kind, distance in distances],
        },
        "compositing": json.dumps({name: blend.name for name, blend in COMPOSITING.items()}),
    }

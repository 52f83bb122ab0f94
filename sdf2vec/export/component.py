"""`<sdf-image>`: a web component that shows any scene file. Its formulas are lowered like all others."""

from __future__ import annotations

import json
from collections.abc import Iterable

from ..blend import COMPOSITING, FRAMINGS, JOINS, display, grid_point, union_reach
from ..expr import Expr, var
from ..graph import scalarize
from ..layer import JOIN, LOOK, PIXEL, Formula, P, Part
from ..limits import CANVAS_SIDE
from ..lower.javascript import function_text
from ..lower.shader import GLSL, definition, expression, used_functions
from ..operation import VEC2, VEC4
from ..paints import FLAT, PAINTS
from ..scene import GROUND, MAX_JOINED, MAX_SHAPES, OPTIONAL, SHEER, Scene
from ..scene_file import FORMAT, VERSION
from ..shapes import KINDS
from ..templating import template
from ..units import COLOR, OPACITY, Parameter
from .exported import Exported
from .options import Options
from .records import Form, Variant, record_scalars
from .shader import DATA_WIDTH, table_part
from .tiles import COARSEST

SLACK = var("slack")


def component(scene: Scene, options: Options) -> Exported:
    """An ES module that defines the element; it is the same for every scene."""
    variants = tuple(
        Variant(kind, paint)
        for kind in sorted(KINDS, key=lambda name: KINDS[name].patch is not None)
        for paint in PAINTS
    )
    forms = {name: Form(variants, tuple(JOINS), name) for name in COMPOSITING}
    text = template("component.js.jinja").render(
        format=FORMAT,
        version=VERSION,
        coarsest=COARSEST,
        kinds=json.dumps({kind.name: list(map(_told, kind.parameters)) for kind in KINDS.values()}),
        paints=json.dumps({paint.name: list(map(_told, paint.parameters)) for paint in PAINTS.values()}),
        look=json.dumps(list(map(_told, LOOK))),
        join=json.dumps(_told(JOIN)),
        ground=json.dumps(_told(GROUND)),
        sheer=json.dumps(_told(SHEER)),
        patches=json.dumps([kind.name for kind in KINDS.values() if kind.patch is not None]),
        most_pixels=CANVAS_SIDE,
        most_shapes=MAX_SHAPES,
        most_joined=MAX_JOINED,
        joins=json.dumps(list(JOINS)),
        adds=json.dumps([join.adds for join in JOINS.values()]),
        variants=json.dumps([" ".join(variant) for variant in variants]),
        flat=FLAT,
        formulas="\n\n".join(_formulas(variants)),
        drawn=json.dumps({name: expression(form.drawn(), GLSL) for name, form in forms.items()}),
        head=forms["over"].head,
        stride=forms["over"].stride,
        width=DATA_WIDTH,
        **_shader_parts(list(forms.values())),
    )
    return Exported(text)


def _told(parameter: Parameter) -> dict[str, object]:
    """What the element must know of a parameter to check the numbers of a file."""
    unit = parameter.unit
    told = {"name": parameter.name, "width": parameter.width, "low": unit.low, "high": unit.high}
    usual = {"usual": parameter.values_from(parameter.start)} if parameter in OPTIONAL else {}
    return told | {"positive": parameter.positive, "light": unit in (COLOR, OPACITY)} | usual


def _formulas(variants: Iterable[Variant]) -> Iterable[str]:
    """What the element computes itself: records, and boxes to make lists from."""
    yield "const RECORDS = {};\nconst BOXES = {};"
    for variant in variants:
        record = function_text(f'RECORDS["{" ".join(variant)}"]', record_scalars(variant), variant.scalars)
        yield record.removeprefix("const ")
    for kind in KINDS.values():
        formula = Formula.of((Part(kind.name),))
        inputs = [SLACK, PIXEL, formula.row.of(None, "falloff")]
        inputs += [scalar for parameter in kind.parameters for scalar in parameter.scalars("_0")]
        box = function_text(f"BOXES.{kind.name}", formula.bounds(SLACK)[:4], inputs)
        yield box.removeprefix("const ")
    smoothness = var("smoothness")
    yield function_text("unionReach", scalarize(union_reach(MAX_JOINED, smoothness)), [smoothness])


def _shader_parts(forms: list[Form]) -> dict[str, object]:
    """What the templates of shaders take, with uniforms where the scene decides; `${…}` is JavaScript's."""
    resolution, c = var("resolution", VEC2), var("c", VEC4)
    place, pixel_size = FRAMINGS["fit"]
    cell = grid_point(P, var("low", VEC2), var("vec2(perUnit)", VEC2))
    frame = [display(c), place(P, resolution, P), pixel_size(resolution, P), cell]
    drawn = [form.drawn() for form in forms]
    roots: list[Expr] = [*(field for _, field in forms[0].fields()), *drawn, forms[0].joined(), *frame]
    return {
        "functions": "\n\n".join(definition(function, GLSL) for function in used_functions(roots)),
        "background": "ground",
        "packed": None,
        "layers": [],
        "data": {"width": DATA_WIDTH, "lists": "listsAt"},
        "tiles": {
            "columns": "columns",
            "last_column": "columns - 1",
            "last_row": "rows - 1",
            "after": "columns * rows + 1",
            "place": expression(cell, GLSL),
            "coarsest": COARSEST,
        },
        "table": table_part(forms[0], GLSL) | {"count": "count", "drawn": "${drawn}"},
    }

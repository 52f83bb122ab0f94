"""What a browser needs to read a scene and to draw it: tables, formulas lowered to JavaScript, the shader."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence

from .. import compact_file, entropy
from ..blend import FRAMINGS, JOINS, OVER, display, grid_point, union_reach
from ..expr import Expr, var
from ..graph import scalarize
from ..layer import JOIN, LOOK, PIXEL, Formula, P, Part
from ..limits import CANVAS_SIDE
from ..lower.javascript import function_text
from ..lower.shader import GLSL, definition, expression, used_functions
from ..operation import VEC2, VEC4
from ..paints import FLAT, PAINTS
from ..scene import GROUND, MAX_JOINED, MAX_SHAPES, SHEER
from ..shapes import KINDS
from ..units import COLOR, COLOR_DECIMALS, OPACITY, Parameter
from .records import Form, Variant, record_scalars
from .shader import table_part
from .table_text import DATA_WIDTH
from .tiles import COARSEST

SLACK = var("slack")


# What a page bears of files from anywhere: bytes, layers, entries of its lists in all and in a cell, cells.
BEARS = {"bytes": 1 << 26, "layers": 1 << 14, "listed": 1 << 21, "deep": 1 << 12, "cells": 1 << 16}
BEARS_ITS_OWN = BEARS | {"listed": 1 << 26}


def script_parts(forms: Sequence[Form], own: bool = False) -> dict[str, object]:
    """What `scene.js.jinja` takes for scenes of these forms, which differ in nothing but the compositing.

    `own`: for a page that holds its scene, as this program has written it; checks of files are left out there.
    """
    form = forms[0]
    kinds = {variant.kind: KINDS[variant.kind] for variant in form.variants}
    paints = {variant.paint: PAINTS[variant.paint] for variant in (*form.variants, Variant("", FLAT))}
    joins = form.joins or tuple(JOINS)[:1]
    told = _needed if own else _told
    return {
        "own": own,
        "kinds": _json({name: list(map(told, kind.parameters)) for name, kind in kinds.items()}),
        "paints": _json({name: list(map(told, paint.parameters)) for name, paint in paints.items()}),
        "look": _json(list(map(told, LOOK))),
        "join": _json(told(JOIN)),
        "ground": _json(told(GROUND)),
        "sheer": _json(told(SHEER)),
        "patches": _json([name for name, kind in kinds.items() if kind.patch is not None]),
        "bears": BEARS_ITS_OWN if own else BEARS,
        "most_pixels": CANVAS_SIDE,
        "most_shapes": MAX_SHAPES,
        "most_joined": MAX_JOINED,
        "joins": _json(joins),
        "adds": _json([JOINS[name].adds for name in joins]),
        "variants": _json([" ".join(variant) for variant in form.variants]),
        "flat": FLAT,
        "over": OVER,
        "coarsest": COARSEST,
        "formulas": "\n\n".join(_formulas(form)),
        "drawn": _json({form.compositing: expression(form.drawn(), GLSL) for form in forms}),
        "stride": form.stride,
        "width": DATA_WIDTH,
        **_compact_parts(form.variants),
        **_shader_parts(forms),
    }


def _told(parameter: Parameter) -> dict[str, object]:
    """What a script must know of a parameter to check the numbers of a file."""
    usual = {"usual": parameter.usual} if parameter.optional else {}
    light = {"light": True} if parameter.unit in (COLOR, OPACITY) else {}
    return {"name": parameter.name} | _needed(parameter) | light | usual


def _needed(parameter: Parameter) -> dict[str, object]:
    """What it must know to read the numbers of a compact file."""
    unit = parameter.unit
    low, high = (int(end) if end.is_integer() else end for end in (unit.low, unit.high))
    told = {"unit": unit.name, "width": parameter.width, "low": low, "high": high}
    since = {"since": parameter.since} if parameter.since > 1 else {}
    return told | since | ({"positive": True} if parameter.positive else {})


def _compact_parts(variants: Iterable[Variant]) -> dict[str, object]:
    """What the reader of compact files takes."""
    units = compact_file.units_of([Part(*variant, join) for variant in variants for join in ("", *JOINS)])
    root = var("root")
    formulas = {unit.name: unit.codec.formula(root) for unit in units}
    codecs = {
        unit.name: {"precision": unit.codec.precision, "stride": unit.codec.stride, "decimals": unit.decimals}
        for unit in units
    }
    return {
        "units": _json(codecs),
        "values": "\n".join(
            function_text(f"VALUES.{name}", scalarize(formula), [root]).removeprefix("const ")
            for name, formula in formulas.items()
            if formula is not root
        ),
        "magic": list(compact_file.MAGIC),
        "compact_version": compact_file.VERSION,
        "precisions": _json(compact_file.PRECISIONS),
        "bits_of_bits": compact_file.BITS_OF_BITS,
        "most_bits": compact_file.MOST_BITS,
        "most_parts": compact_file.MOST_PARTS,
        "ground_bits": compact_file.GROUND_BITS,
        "thousandths": compact_file.THOUSANDTHS,
        "word": compact_file.LONGEST_WORD,
        "color_decimals": COLOR_DECIMALS,
        "ahead": entropy.AHEAD,
        "even": entropy.EVEN,
        "kept": entropy.KEPT,
        "used": entropy.USED,
        "least": entropy.LEAST,
        "sure": entropy.SURE,
        "settled": entropy.SETTLED,
        "slowness": entropy.SLOWNESS,
        "longest": entropy.LONGEST,
        "foreseen": entropy.FORESEEN,
        "class": entropy.CLASS,
    }


def _formulas(form: Form) -> Iterable[str]:
    """What a script computes itself: records, and boxes to make lists from."""
    variants = form.variants
    yield "const RECORDS = {};\nconst BOXES = {};"
    for variant in variants:
        record = function_text(f'RECORDS["{" ".join(variant)}"]', record_scalars(variant), variant.scalars)
        yield record.removeprefix("const ")
    for kind in dict.fromkeys(KINDS[variant.kind] for variant in variants):
        formula = Formula.of((Part(kind.name),))
        inputs = [SLACK, PIXEL, formula.row.of(None, "falloff")]
        inputs += [scalar for parameter in kind.parameters for scalar in parameter.scalars("_0")]
        box = function_text(f"BOXES.{kind.name}", formula.bounds(SLACK)[:4], inputs)
        yield box.removeprefix("const ")
    if form.joins:
        smoothness = var("smoothness")
        yield function_text("unionReach", scalarize(union_reach(MAX_JOINED, smoothness)), [smoothness])


def _shader_parts(forms: Sequence[Form]) -> dict[str, object]:
    """What the templates of shaders take, with uniforms where the scene decides; `${…}` is JavaScript's."""
    resolution, c = var("resolution", VEC2), var("c", VEC4)
    place, pixel_size = FRAMINGS["fit"]
    cell = grid_point(P, var("low", VEC2), var("vec2(perUnit)", VEC2))
    frame = [display(c), place(P, resolution, P), pixel_size(resolution, P), cell]
    drawn = [form.drawn() for form in forms]
    joined = [forms[0].joined()] if forms[0].joins else []
    roots: list[Expr] = [*(field for _, field in forms[0].fields()), *drawn, *joined, *frame]
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


def _json(value: object) -> str:
    return json.dumps(value, separators=(",", ":"))

"""Scenes as JSON: what is written comes back, and what is malformed is refused with the path of the field."""

import json
import math
import re
from itertools import product
from pathlib import Path

import numpy as np
import pytest
import torch
from hypothesis import example, given, settings
from hypothesis import strategies as st

import sdf2vec.scene
from sdf2vec import (
    KINDS,
    Joint,
    Layer,
    Scene,
    SceneError,
    Sdf2vecError,
    Shape,
    dumps,
    export,
    load,
    loads,
    save,
)
from sdf2vec.blend import COMPOSITING, JOINS
from sdf2vec.layer import Part, row_width
from sdf2vec.paints import PAINTS, Paint
from sdf2vec.render.reference import render
from sdf2vec.scene import MAX_JOINED, MAX_SHAPES
from sdf2vec.shapes import Kind
from sdf2vec.units import COLOR, DIRECTION, LENGTH, OPACITY, POSITION, Parameter

from .scenes import PATCHES, SOFT, random_scene

# --- random scenes -----------------------------------------------------------------------------------------


def numbers(low, high):
    return st.floats(low, high, allow_nan=False)


def rows(parameters, lowest):
    """A strategy for the flat row of some parameters; what must be > 0 stays so when it is rounded."""
    scalars = []
    for parameter in parameters:
        low = 1e-5 if parameter.positive else parameter.unit.low
        scalars += [
            numbers(lowest if parameter.unit is COLOR else low, parameter.unit.high)
        ] * parameter.width
    return st.tuples(*scalars)


def shapes(kinds, lowest):
    def of(names):
        kind, paint = names
        row = rows(KINDS[kind].parameters, lowest)
        own = rows(PAINTS[paint].own, lowest)
        color = st.tuples(*[numbers(lowest, 1.0)] * 3)
        return st.builds(Shape, st.just(kind), row, color, st.just(paint), own)

    return st.tuples(st.sampled_from(sorted(kinds)), st.sampled_from(sorted(PAINTS))).flatmap(of)


def layers(lowest):
    look = numbers(0.0, 64.0), st.one_of(st.just(1.0), numbers(lowest, 1.0))
    joint = st.builds(Joint, st.sampled_from(sorted(JOINS)), st.just(0.0) | numbers(0.0, 64.0))

    def joined(several):
        joints = st.tuples(*[joint] * (len(several) - 1))
        return st.builds(Layer, st.just(tuple(several)), *look, joints)

    one = st.builds(Layer, st.tuples(shapes(KINDS, lowest)), *look)
    return one | st.lists(shapes(SOFT, lowest), min_size=2, max_size=4).flatmap(joined)


def scenes_of(compositing):
    side = st.integers(1, 65536)
    drawn = st.lists(layers(COMPOSITING[compositing].lowest), max_size=5).map(tuple)
    background = st.none() | st.tuples(*[numbers(0.0, 1.0)] * 3)
    return st.builds(Scene, side, side, drawn, background, st.just(compositing))


scenes = st.sampled_from(sorted(COMPOSITING)).flatmap(scenes_of)


@given(scenes)
@settings(max_examples=60, deadline=None)
def test_what_is_written_comes_back(scene):
    text = dumps(scene)
    assert loads(text) == scene
    assert loads(text.encode()) == scene
    assert dumps(loads(text)) == text


@pytest.mark.parametrize("compositing", COMPOSITING)
@pytest.mark.parametrize("paint", PAINTS)
def test_every_kind_paint_and_join_comes_back(paint, compositing):
    alone = [random_scene((kind,), compositing, 1, paints=(paint,)).layers[0] for kind in KINDS]
    for layer in alone:
        assert layer.structure == (Part(layer.shapes[0].kind, paint),)
    joined = [
        Layer((first.shapes[0], second.shapes[0]), 0.1, 0.5, (Joint(join, smoothness),))
        for first, second in product(alone, alone)
        for join in JOINS
        for smoothness in (0.0, 0.125)
        if {first.shapes[0].kind, second.shapes[0].kind} <= set(SOFT)
    ]
    scene = Scene(30, 20, (*alone, *joined), None, compositing)
    assert loads(dumps(scene)) == scene


@given(scenes)
@settings(max_examples=30, deadline=None)
def test_text_has_one_line_a_layer_in_draw_order(scene):
    lines = dumps(scene).splitlines()
    assert len(lines) == 9 + (len(scene.layers) + 1 if scene.layers else 0)
    for layer, line in zip(scene.layers, lines[8:-2] if scene.layers else [], strict=True):
        item = json.loads(line.rstrip(","))
        assert item.get("falloff", 0) == layer.falloff
        assert item.get("opacity", 1) == layer.opacity
        for index, (shape, told) in enumerate(zip(layer.shapes, item.get("shapes", [item]), strict=True)):
            assert (told["kind"], told.get("paint", "flat")) == (shape.kind, shape.paint)
            joint = (Joint(), *layer.joints)[index]
            assert (told.get("join", "union"), told.get("smoothness", 0)) == joint
            painted = shape.painted() if JOINS[joint.join].adds else {}
            values = {n: list(v) if isinstance(v, tuple) else v for n, v in (shape.named() | painted).items()}
            words = {"kind", "paint", "join", "smoothness", "falloff", "opacity"}
            assert {name: told[name] for name in told if name not in words} == values


def test_text_is_what_a_person_would_write():
    sun = Layer((Shape.of("circle", (1, 0.5, 0), center=(0.25, -0.1), radius=0.2),), falloff=0.05)
    hills = Layer(
        (
            Shape.of("circle", (0, 1, 0), center=(0, 0.5), radius=1 / 3),
            Shape.of("circle", (0, 0, 1), center=(-0.0, 0.5), radius=2),
            Shape.of("ellipse", center=(0, 1), radii=(0.25, 0.5), angle=0),
        ),
        opacity=0.5,
        joints=(Joint("union", 0.1), Joint("subtraction")),
    )
    sky = Shape.of(
        "gaussian",
        (0, 0, 1),
        "linear",
        color_end=(1, 1, 1),
        direction=(0, 0.5),
        center=(0, 0),
        radii=(1, 2),
        angle=0,
    )
    assert dumps(Scene(300, 200, (sun, hills, Layer((sky,))), background=None)) == (
        "{\n"
        '  "format": "sdf2vec scene",\n'
        '  "version": 2,\n'
        '  "width": 300,\n'
        '  "height": 200,\n'
        '  "compositing": "over",\n'
        '  "background": null,\n'
        '  "layers": [\n'
        '    {"kind": "circle", "color": [1, 0.5, 0], "center": [0.25, -0.1], "radius": 0.2, "falloff": 0.05},\n'
        '    {"shapes": [{"kind": "circle", "color": [0, 1, 0], "center": [0, 0.5], "radius": 0.333333}, '
        '{"kind": "circle", "smoothness": 0.1, "color": [0, 0, 1], "center": [0, 0.5], "radius": 2}, '
        '{"join": "subtraction", "kind": "ellipse", "center": [0, 1], "radii": [0.25, 0.5], "angle": 0}], '
        '"opacity": 0.5},\n'
        '    {"kind": "gaussian", "paint": "linear", "color": [0, 0, 1], "color_end": [1, 1, 1], '
        '"direction": [0, 0.5], "center": [0, 0], "radii": [1, 2], "angle": 0}\n'
        "  ]\n"
        "}\n"
    )


def test_the_first_version_is_read():
    circle = '{"kind": "circle", "center": [0.5, 0], "radius": 0.25, "color": [1, 0, 0]'
    text = (
        '{"format": "sdf2vec scene", "version": 1, "width": 30, "height": 20, "compositing": "additive",'
        ' "background": [0, 0.5, 1], "layers": ['
        f'{circle}, "falloff": 0.125, "opacity": -0.5}}, '
        f'{{"union": [{circle}}}, {circle}}}, {circle}}}], "smoothness": 0.75, "falloff": 0.125}}]}}'
    )
    shape = Shape("circle", (0.5, 0.0, 0.25), (1.0, 0.0, 0.0))
    joints = (Joint("union", 0.75), Joint("union", 0.75))
    layers = (Layer((shape,), 0.125, -0.5), Layer((shape,) * 3, 0.125, 1.0, joints))
    assert loads(text) == Scene(30, 20, layers, (0.0, 0.5, 1.0), "additive")
    assert loads(dumps(loads(text))) == loads(text)
    assert refusal(text.replace("0.25", "0")) == "layers[0].radius: must be > 0, got 0"
    assert (
        refusal(text.replace("}], ", ', "radius": 1}], '))
        == "layers[1].union[2].radius: appears twice in one object"
    )
    assert refusal(text.replace("0.75", "-1")) == "layers[1].smoothness: must be >= 0, got -1"
    assert refusal(text.replace('"version": 1', '"version": 2')).startswith("layers[1].kind: must be one of")


def test_no_layers():
    scene = Scene(1, 1, ())
    assert loads(dumps(scene)) == scene
    assert scene.shape_count == 0


def test_files(tmp_path):
    scene = Scene(3, 2, (Layer((Shape.of("circle", (1, 1, 1), center=(0, 0), radius=1),), 0),))
    save(scene, tmp_path / "a.scene.json")
    assert load(tmp_path / "a.scene.json") == scene
    assert load(str(tmp_path / "a.scene.json")) == scene


@pytest.mark.parametrize("name", ["none.json", "", "two\nlines.json", "a\0b"])
def test_unreadable_files_are_named_in_one_line(tmp_path, name):
    with pytest.raises(Sdf2vecError) as caught:
        load(f"{tmp_path}/{name}")
    assert "\n" not in str(caught.value)
    assert str(caught.value).startswith(str(tmp_path))


def test_malformed_file_is_named_with_the_field(tmp_path):
    path = tmp_path / "bad.scene.json"
    path.write_text(dumps(Scene(3, 2, ())).replace('"width": 3', '"width": -3'))
    with pytest.raises(Sdf2vecError, match=r"bad\.scene\.json: width: must be >= 1, got -3$"):
        load(path)


def test_rounding_costs_no_visible_quality():
    """A soft and a sharp circle from unrounded numbers, by hand, against the scene's render."""
    width, height, falloff = 160, 128, 0.0213579135791
    unit = min(width, height)
    rng = np.random.default_rng(5)
    x, y = np.meshgrid((np.arange(width) + 0.5 - width / 2) / unit, (np.arange(height) + 0.5) / unit - 0.5)
    expected = np.full((3, height, width), 1 / 3)
    drawn = []
    for soft in (falloff, 1 / 700, 0.3):
        center, radius, color, opacity = rng.normal(0, 0.2, 2), rng.uniform(0.1, 0.4), rng.random(3), 2 / 3
        drawn.append(Layer((Shape("circle", (*center, radius), tuple(color)),), soft, opacity))
        distance = np.hypot(x - center[0], y - center[1]) - radius
        softness = max(soft, 1.6 / unit)
        sigmoid = 1 / (1 + np.exp(-(5 * soft - 10 * distance) / softness))
        cover = np.clip((sigmoid - 1 / 512) / (1 - 2 / 512), 0, 1) * opacity
        expected += cover * (color[:, None, None] - expected)
    scene = Scene(width, height, tuple(drawn), background=(1 / 3, 1 / 3, 1 / 3))
    got = render(scene, dtype=torch.float64).numpy()[:3]
    assert 255 * np.abs(got - expected).max() < 0.1


def test_the_example_of_the_documentation_is_drawn_by_its_formulas():
    """Layers of docs/scene.md in numpy: a join of three with a linear paint, and a Gaussian."""
    text = (Path(__file__).parent.parent / "docs" / "scene.md").read_text()
    (example,) = re.findall(r"```json\n(.*?)```", text, re.DOTALL)
    scene = loads(example)
    width, height = scene.width, scene.height
    x, y = np.meshgrid(
        (np.arange(width) + 0.5 - width / 2) / height, (np.arange(height) + 0.5) / height - 0.5
    )

    def turned(px, py, angle):
        return px * np.cos(angle) + py * np.sin(angle), py * np.cos(angle) - px * np.sin(angle)

    qx, qy = turned(x, y, 0.1)
    ox, oy = np.abs(qx) - 0.3 + 0.02, np.abs(qy) - 0.2 + 0.02
    box = np.hypot(np.maximum(ox, 0), np.maximum(oy, 0)) + np.minimum(np.maximum(ox, oy), 0) - 0.02
    t = np.clip(0.5 + 0.5 * qy / 0.2, 0, 1)
    circle, k = np.hypot(x - 0.2, y) - 0.1, 0.05
    weight = 1 / (1 + np.exp((circle - box) / k))
    distance = np.minimum(box, circle) - k * np.log(1 + np.exp(-np.abs(box - circle) / k))
    distance = np.maximum(distance, 0.1 - np.hypot(x, y))
    color = np.stack([t, t, np.ones_like(t)]) * (1 - weight) + np.array([0, 1, 0])[:, None, None] * weight
    cover = np.clip((1 / (1 + np.exp(-10 * (0.01 - distance) / 0.02)) - 1 / 512) / (1 - 2 / 512), 0, 1)
    picture = np.array([0.9, 0.9, 0.8])[:, None, None] * (1 - cover) + color * cover
    px, py = turned(x + 0.2, y - 0.1, 0.5)
    wx, wy = np.sqrt(0.1**2 + height**-2 / 12), np.sqrt(0.05**2 + height**-2 / 12)
    patch = (
        np.maximum(np.exp(-((px / wx) ** 2 + (py / wy) ** 2) / 2) - 1 / 512, 0)
        * 512
        / 511
        * 0.005
        / (wx * wy)
    )
    picture = picture * (1 - patch) + patch
    shown = Scene(width, height, scene.layers[1:], scene.background)
    assert np.abs(render(shown, dtype=torch.float64).numpy()[:3] - picture).max() < 1e-5


# --- refusals ----------------------------------------------------------------------------------------------

CIRCLE = {"kind": "circle", "center": [0, 0], "radius": 0.5, "color": [1, 0.5, 0], "falloff": 0.1}
BOX = {
    "kind": "box",
    "center": [0, 0],
    "half_size": [0.5, 0.25],
    "angle": 0,
    "corner_radius": 0,
    "paint": "linear",
    "color": [1, 0, 0],
    "color_end": [0, 0, 1],
    "direction": [0.5, 0],
}
BLOB = {key: value for key, value in CIRCLE.items() if key != "falloff"}
HOLE = {"join": "subtraction", "smoothness": 0.1, "kind": "circle", "center": [0, 0], "radius": 0.5}
JOINED = {"shapes": [BLOB, BOX | {"join": "union"}, HOLE], "falloff": 0.1, "opacity": 0.5}
PATCH = {
    "kind": "gabor",
    "center": [0, 0],
    "radii": [0.5, 0.25],
    "angle": 0,
    "frequency": 20,
    "phase": 0,
    "color": [1, 1, 1],
}
VALID = {
    "format": "sdf2vec scene",
    "version": 2,
    "width": 40,
    "height": 30,
    "compositing": "over",
    "background": [0, 0, 0],
    "layers": [CIRCLE, BOX, JOINED, PATCH],
}
ABSENT = object()


def refusal(text):
    with pytest.raises(SceneError) as caught:
        loads(text)
    message = str(caught.value)
    assert message.isprintable(), "one line, without control characters"
    assert len(message) < 300
    return message


def changed(path, value, valid=VALID):
    """Valid JSON text with the value at a path replaced, or deleted where it is ABSENT."""
    data = json.loads(json.dumps(valid))  # a copy that shares nothing
    *parents, last = path
    place = data
    for step in parents:
        place = place[step]
    if value is ABSENT:
        del place[last]
    else:
        place[last] = value
    return json.dumps(data)


def spelled(path):
    """The path as a message spells it."""
    text = "".join(f"[{step}]" if isinstance(step, int) else f".{step}" for step in path)
    return text.removeprefix(".")


NUMBERS = [
    ("layers", 0, "radius"),
    ("layers", 0, "center", 1),
    ("layers", 0, "color", 2),
    ("layers", 0, "falloff"),
    ("layers", 1, "half_size", 0),
    ("layers", 1, "color_end", 0),
    ("layers", 2, "shapes", 1, "angle"),
    ("layers", 2, "shapes", 1, "color", 0),
    ("layers", 2, "shapes", 2, "radius"),
    ("layers", 2, "shapes", 2, "smoothness"),
    ("layers", 2, "opacity"),
    ("layers", 3, "frequency"),
    ("background", 1),
]
NO_NUMBERS = {
    True: "must be a number, got True",
    "1": "must be a number, got '1'",
    None: "must be a number, got None",
    (): "must be a number, got []",
    math.nan: "must be finite, got nan",
    math.inf: "must be finite, got inf",
    -math.inf: "must be finite, got -inf",
    10**400: "must be finite, got inf",
    -(10**4000): "must be finite, got -inf",
}


def test_the_valid_scene_is_valid():
    assert loads(json.dumps(VALID)).shape_count == 6


@pytest.mark.parametrize("path", NUMBERS, ids=spelled)
@pytest.mark.parametrize("value", NO_NUMBERS, ids=lambda value: str(value)[:12])
def test_numbers_must_be_numbers(path, value):
    assert refusal(changed(path, value)) == f"{spelled(path)}: {NO_NUMBERS[value]}"


@pytest.mark.parametrize("literal", ["1e999", "-1e999", "9" * 5000, "-" + "9" * 5000])
def test_numbers_too_large_for_any_machine(literal):
    text = json.dumps(VALID).replace('"radius": 0.5', f'"radius": {literal}', 1)
    sign = "-" if literal[0] == "-" else ""
    assert refusal(text) == f"layers[0].radius: must be finite, got {sign}inf"


@pytest.mark.parametrize(
    ("path", "value", "problem"),
    [
        (("layers", 0, "radius"), -3, "must be > 0, got -3"),
        (("layers", 0, "radius"), 0, "must be > 0, got 0"),
        (("layers", 0, "radius"), 1e-9, "must be > 0, got 0"),
        (("layers", 0, "radius"), 1e9, "must be <= 65536, got 1e+09"),
        (("layers", 0, "center", 1), -1e9, "must be >= -65536, got -1e+09"),
        (("layers", 1, "corner_radius"), -0.1, "must be >= 0, got -0.1"),
        (("layers", 1, "direction", 0), 1001, "must be <= 1000, got 1001"),
        (("layers", 0, "falloff"), -1, "must be >= 0, got -1"),
        (("layers", 0, "color", 0), 1.1, "must be <= 1, got 1.1"),
        (("layers", 0, "color", 2), -0.1, "must be >= 0, got -0.1"),
        (("layers", 1, "color_end", 1), -0.1, "must be >= 0, got -0.1"),
        (("layers", 2, "shapes", 1, "color", 0), 7, "must be <= 1, got 7"),
        (("layers", 2, "shapes", 1, "color_end", 2), -1, "must be >= 0, got -1"),
        (("layers", 2, "shapes", 2, "radius"), -1, "must be > 0, got -1"),
        (("layers", 2, "shapes", 2, "smoothness"), -1, "must be >= 0, got -1"),
        (("layers", 2, "opacity"), 1.5, "must be <= 1, got 1.5"),
        (("layers", 2, "opacity"), -0.5, "must be >= 0, got -0.5"),
        (("background", 0), -0.5, "must be >= 0, got -0.5"),
        (("width",), 0, "must be >= 1, got 0"),
        (("height",), 65537, "must be <= 65536, got 65537"),
        (("height",), 40.0, "must be a whole number, got 40"),
        (("height",), True, "must be a whole number, got True"),
        (("height",), math.nan, "must be finite, got nan"),
        (("format",), "other", "must be 'sdf2vec scene', got 'other'; not a scene file"),
        (("version",), 3, "this program reads versions 1 to 2, got 3"),
        (("version",), True, "this program reads versions 1 to 2, got True"),
        (("version",), "1", "this program reads versions 1 to 2, got '1'"),
        (("compositing",), "multiply", "must be one of over, additive, got 'multiply'"),
        (("compositing",), [], "must be one of over, additive, got []"),
        (("compositing",), {}, "must be one of over, additive, got {}"),
        (("background",), "black", "must be a list, got 'black'"),
        (("background",), {}, "must be a list, got {}"),
        (("background",), False, "must be a list, got False"),
        (("layers",), {}, "must be a list, got {}"),
        (("layers",), None, "must be a list, got None"),
        (("layers", 0), [], "must be an object, got []"),
        (("layers", 1), None, "must be an object, got None"),
        (("layers", 2, "shapes"), {}, "must be a list, got {}"),
        (("layers", 2, "shapes"), [], "must be a list of length >= 1, got []"),
        (("layers", 2, "shapes", 1), 5, "must be an object, got 5"),
        (("layers", 2, "shapes", 1, "join"), "xor", f"must be one of {', '.join(JOINS)}, got 'xor'"),
        (("layers", 0, "center"), 0.5, "must be a list, got 0.5"),
        (("layers", 0, "center"), [1], "must be a list of length 2, got [1]"),
        (("layers", 0, "center"), [1, 2, 3], "must be a list of length 2, got [1, 2, 3]"),
        (("layers", 0, "color"), [1, 1], "must be a list of length 3, got [1, 1]"),
        (("layers", 0, "kind"), "star", f"must be one of {', '.join(KINDS)}, got 'star'"),
        (("layers", 0, "kind"), [], f"must be one of {', '.join(KINDS)}, got []"),
        (("layers", 1, "paint"), "radial", f"must be one of {', '.join(PAINTS)}, got 'radial'"),
        (
            ("layers", 0, "radii"),
            1,
            "unknown; known are kind, paint, opacity, falloff, color, center, radius",
        ),
        (
            ("layers", 0, "join"),
            "union",
            "unknown; known are kind, paint, opacity, falloff, color, center, radius",
        ),
        (
            ("layers", 2, "shapes", 0, "join"),
            "union",
            "unknown; known are kind, paint, color, center, radius",
        ),
        (("layers", 2, "shapes", 2, "color"), 1, "unknown; known are kind, join, smoothness, center, radius"),
        (
            ("layers", 2, "shapes", 2, "paint"),
            "linear",
            "unknown; known are kind, join, smoothness, center, radius",
        ),
        (("layers", 2, "color"), 1, "unknown; known are shapes, opacity, falloff"),
        (("layers", 2, "smoothness"), 1, "unknown; known are shapes, opacity, falloff"),
    ],
    ids=lambda item: spelled(item) if isinstance(item, tuple) else None,
)
def test_values_out_of_range_and_of_wrong_type(path, value, problem):
    assert refusal(changed(path, value)) == f"{spelled(path)}: {problem}"


def test_the_issues_own_example():
    many = VALID | {"layers": [CIRCLE] * 12 + [CIRCLE | {"radius": -3}]}
    assert refusal(json.dumps(many)) == "layers[12].radius: must be > 0, got -3"


@pytest.mark.parametrize(
    "path",
    [
        ("width",),
        ("background",),
        ("compositing",),
        ("layers",),
        ("layers", 0, "color"),
        ("layers", 0, "radius"),
        ("layers", 1, "angle"),
        ("layers", 1, "direction"),
        ("layers", 2, "shapes", 1, "center"),
        ("layers", 2, "shapes", 1, "color"),
    ],
    ids=spelled,
)
def test_missing_fields(path):
    assert refusal(changed(path, ABSENT)) == f"{spelled(path)}: missing"


def test_a_shape_needs_a_kind():
    problem = f"must be one of {', '.join(KINDS)}, got None"
    assert (
        refusal(changed(("layers", 2, "shapes", 1, "kind"), ABSENT)) == f"layers[2].shapes[1].kind: {problem}"
    )


@pytest.mark.parametrize(
    ("path", "usual"),
    [
        (("layers", 0, "falloff"), 0),
        (("layers", 2, "opacity"), 1),
        (("layers", 2, "shapes", 1, "join"), "union"),
        (("layers", 2, "shapes", 2, "smoothness"), 0),
    ],
    ids=lambda item: spelled(item) if isinstance(item, tuple) else None,
)
def test_what_is_as_usual_may_be_left_out(path, usual):
    assert loads(changed(path, ABSENT)) == loads(changed(path, usual))


@pytest.mark.parametrize("kind", PATCHES)
def test_patches_are_not_joined(kind):
    patch = dumps(random_scene((kind,), layers=1)).splitlines()[8]
    for shapes in ([BLOB, json.loads(patch)], [json.loads(patch), BLOB]):
        plain = [{k: v for k, v in shape.items() if k not in ("falloff", "opacity")} for shape in shapes]
        assert refusal(changed(("layers", 2, "shapes"), plain)) == (
            f"layers[2].shapes: a {kind} can't be joined with others"
        )


def test_additive_scenes_have_signed_colors_and_opacity_but_no_signed_background():
    additive = VALID | {"compositing": "additive"}
    for path in (
        ("layers", 0, "color", 0),
        ("layers", 1, "color_end", 0),
        ("layers", 2, "shapes", 1, "color", 2),
        ("layers", 2, "opacity"),
    ):
        assert loads(changed(path, -1, additive)).compositing == "additive"
        assert refusal(changed(path, -1.01, additive)) == f"{spelled(path)}: must be >= -1, got -1.01"
    assert refusal(changed(("background", 2), -1, additive)).startswith("background[2]: ")


def test_repeated_fields():
    text = json.dumps(VALID)
    again = text.replace('"radius": 0.5', '"radius": 0.5, "radius": 0.6', 1)
    assert refusal(again) == "layers[0].radius: appears twice in one object"
    joined = text.replace('"shapes": [{', '"shapes": [{"kind": "box", ')
    assert refusal(joined) == "layers[2].shapes[0].kind: appears twice in one object"
    assert refusal(text.replace('"width"', '"height"')) == "height: appears twice in one object"


# --- toys --------------------------------------------------------------------------------------------------


def test_kinds_and_paints_of_tests_own_are_read(monkeypatch):
    """What a file may hold is what is registered when it is read."""
    circle = KINDS["circle"]
    sizes = tuple(Parameter(f"size_{i}", LENGTH, (1.0,), positive=True) for i in range(9))
    middle = Parameter("middle", POSITION, (0.0, 0.0))
    toy = Kind(
        "toy", (middle, *sizes), circle.distance, circle.extent, circle.area, circle.thickness, exact=False
    )
    own = (
        Parameter("color_far", COLOR, (0.0, 0.0, 0.0)),
        Parameter("share", OPACITY),
        Parameter("way", DIRECTION),
    )
    shape = {"kind": "toy", "middle": [1, 2], **{p.name: 3 for p in sizes}, "color": [1, 0, 0]}
    shape |= {"paint": "veil", "color_far": [0, 1, 0], "share": 0.5, "way": 0.25}
    text = json.dumps(VALID | {"layers": [shape, {"shapes": [BLOB, shape | {"join": "union"}]}]})
    assert "layers[0].kind: must be one of" in refusal(text)
    monkeypatch.setitem(KINDS, "toy", toy)
    assert "layers[0].paint: must be one of" in refusal(text)
    monkeypatch.setitem(PAINTS, "veil", Paint("veil", PAINTS["flat"].color, own))
    scene = loads(text)
    expected = Shape("toy", (1, 2, *[3] * 9), (1, 0, 0), "veil", (0, 1, 0, 0.5, 0.25))
    assert scene.layers[0].shapes[0] == scene.layers[1].shapes[1] == expected
    assert loads(dumps(scene)) == scene
    assert refusal(text.replace('"size_8": 3', '"size_8": 0')) == "layers[0].size_8: must be > 0, got 0"
    narrower = Kind(
        "toy", (middle,), circle.distance, circle.extent, circle.area, circle.thickness, exact=False
    )
    monkeypatch.setitem(KINDS, "toy", narrower)
    assert refusal(text).startswith("layers[0].size_0: unknown; known are kind, paint, opacity")


# --- files from anywhere -----------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["", "two\nlines", "\x1b[31m", "\ud800", "[0]", "a" * 10**6, "\u2028"])
def test_strange_names_of_fields(name):
    assert refusal(json.dumps(VALID | {name: 1})).endswith("unknown; known are " + ", ".join(VALID))
    assert refusal(changed(("layers", 1, name), 1)).startswith("layers[1].")


def test_absurd_counts(monkeypatch):
    many = [CIRCLE] * (MAX_SHAPES + 1)
    assert refusal(json.dumps(VALID | {"layers": many})).startswith(
        "layers: must be a list of length <= 65536, got ["
    )
    joined = {"shapes": [BLOB] * (MAX_JOINED + 1)}
    text = json.dumps(VALID | {"layers": [CIRCLE, joined]})
    assert refusal(text).startswith(f"layers[1].shapes: must be a list of length <= {MAX_JOINED}, got [")
    monkeypatch.setattr(sdf2vec.scene, "MAX_SHAPES", 5)
    full = [CIRCLE, {"shapes": [BLOB] * 4}]
    assert loads(json.dumps(VALID | {"layers": full})).shape_count == 5
    assert refusal(json.dumps(VALID | {"layers": [*full, CIRCLE]})) == "layers: at most 5 shapes, got 6"


def test_the_largest_layer_can_be_exported_and_drawn():
    shapes = [BLOB | {"center": [i / MAX_JOINED, 0]} for i in range(MAX_JOINED)]
    scene = loads(json.dumps(VALID | {"layers": [{"shapes": shapes}], "width": 3, "height": 2}))
    for target in ("glsl", "shadertoy", "wgsl", "png"):
        assert export(scene, target)
    assert export(scene, "glsl", layout="readable")


@pytest.mark.parametrize("depth", [10, 900, 950, 970, 980, 990, 1000, 100_000])
@pytest.mark.parametrize("brackets", ["[]", ("{" + '"a": ', "}")])
def test_deep_nests(depth, brackets):
    opening, closing = brackets
    nest = opening * depth + "1" + closing * depth
    refusal(nest)
    refusal(json.dumps(VALID).replace('"radius": 0.5', f'"radius": {nest}', 1))
    refusal(json.dumps(VALID).replace('"kind": "circle"', f'"kind": {nest}', 1))


@pytest.mark.parametrize(
    "text",
    [
        "",
        " ",
        "{",
        "null",
        "[]",
        "3",
        '"sdf2vec scene"',
        "NaN",
        "{}",
        "{'format': 1}",
        "<svg/>",
        b"\xff\xfe\xfa",
        b"\x80abc",
        b"\x89PNG\r\n\x1a\n\0\0",
        "\ufeff{}",
        b'{"format": "\xff"}',
    ],
)
def test_no_scene_at_all(text):
    refusal(text)


def test_not_utf8():
    text = dumps(Scene(3, 2, ())).replace("over", "över").encode("latin-1")
    assert refusal(text) == "not valid JSON: not UTF-8 text"


def test_every_truncation_is_refused():
    text = dumps(loads(json.dumps(VALID))).rstrip()
    for end in range(len(text)):
        assert "not valid JSON" in refusal(text[:end])


# --- fuzzing -----------------------------------------------------------------------------------------------

any_text = st.text(max_size=8) | st.sampled_from(
    ["kind", "radius", "shapes", "join", "linear", "circle", "additive", "a\nb"]
)
any_number = st.floats() | st.integers() | st.sampled_from([0, -1, 1, 10**400, -(10**30), 1e308, 5e-324])
any_json = st.recursive(
    st.none() | st.booleans() | any_number | any_text,
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(any_text, inner, max_size=4),
    max_leaves=8,
)


def all_paths(data, path=()):
    yield path
    items = data.items() if isinstance(data, dict) else enumerate(data) if isinstance(data, list) else ()
    for key, value in items:
        yield from all_paths(value, (*path, key))


PATHS = [path for path in all_paths(VALID) if path]


@given(st.sampled_from(PATHS), st.just(ABSENT) | any_json, st.sampled_from(["over", "additive"]))
@example(("compositing",), {}, "over")
@example(("layers", 0), {"a\nb": 1}, "over")
@settings(max_examples=400, deadline=None)
def test_a_changed_scene_is_read_or_refused(path, value, compositing):
    text = changed(path, value, VALID | {"compositing": compositing})
    try:
        scene = loads(text)
    except SceneError:
        refusal(text)
    else:
        assert loads(dumps(scene)) == scene


@given(st.binary(max_size=40) | any_json.map(json.dumps))
@settings(max_examples=150, deadline=None)
def test_anything_else_is_refused(text):
    refusal(text)


# --- made in Python ----------------------------------------------------------------------------------------


def test_layers_and_shapes_refuse_the_same_in_python():
    with pytest.raises(SceneError, match=r"^radius: must be > 0, got -3$"):
        Shape.of("circle", (0, 0, 0), center=(0, 0), radius=-3)
    with pytest.raises(SceneError, match=r"^parameters: a circle has 3 numbers, got 2$"):
        Shape("circle", (0, 0), (0, 0, 0))
    with pytest.raises(SceneError, match=r"^shapes: must be a list of length >= 1, got \(\)$"):
        Layer((), 0.1)
    with pytest.raises(SceneError, match=r"^joints: must be 1, got 0$"):
        Layer((SPOT, SPOT), 0.1)
    with pytest.raises(SceneError, match=r"^shapes\[1\].smoothness: must be >= 0, got -1$"):
        Layer.union((SPOT, SPOT), -1, 0.1)
    with pytest.raises(SceneError, match=r"^paint_parameters: the paint linear has 5 numbers, got 1$"):
        Shape("circle", (0, 0, 1), (0, 0, 0), "linear", (1,))
    with pytest.raises(SceneError, match=r"^width: must be <= 65536"):
        Scene(10**4000, 1, ())
    with pytest.raises(SceneError, match=r"^radius: must be finite"):
        Shape("circle", (0, 0, 10**400))
    with pytest.raises(SceneError, match=r"^kind: must be one of"):
        Shape.of("\n", (0, 0, 0))


SPOT = Shape.of("circle", (1, 0, 0), center=(0, 0), radius=1)


def test_numbers_of_numpy_are_numbers():
    shape = Shape("circle", tuple(np.array([0.1, 0.2, 0.3])), (np.float64(1.0),) * 3)
    assert shape == Shape("circle", (0.1, 0.2, 0.3), (1.0, 1.0, 1.0))
    assert {type(number) for number in (*shape.parameters, *shape.color)} == {float}


def test_what_takes_away_has_no_colour():
    for join in JOINS:
        layer = Layer((SPOT, SPOT), joints=(Joint(join, 0.5),))
        assert layer.shapes[1].color[0] == (1 if join == "union" else 0)
        assert len(layer.numbers) == row_width(layer.structure)
        assert Layer.from_numbers(layer.structure, layer.numbers) == layer


def test_scenes_are_frozen():
    scene = Scene(3, 2, ())
    with pytest.raises(AttributeError):
        scene.width = 5  # type: ignore[misc]
    assert hash(scene) == hash(Scene(3, 2, ()))

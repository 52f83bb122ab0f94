"""Scenes as JSON: what is written comes back, and what is malformed is refused with the path of the field."""

import json
import math

import numpy as np
import pytest
import torch
from hypothesis import example, given, settings
from hypothesis import strategies as st

import sdf2vec
from sdf2vec import KINDS, Layer, Scene, SceneError, Sdf2vecError, Shape, dumps, load, loads, save
from sdf2vec.render.reference import render
from sdf2vec.scene import MAX_SHAPES, MAX_SIDE, MAX_UNION

# --- random scenes -----------------------------------------------------------------------------------------


def numbers(low, high, exclude_min=False):
    return st.floats(low, high, exclude_min=exclude_min, allow_nan=False)


def scalars_of(kind):
    """A strategy for each float of a shape of this kind; what must be > 0 stays so when it is rounded."""
    return [
        numbers(1e-5 if parameter.positive else parameter.minimum, parameter.maximum)
        for parameter in KINDS[kind].parameters
        for _ in parameter.start
    ]


def shapes(kind, lowest):
    color = st.tuples(*[numbers(lowest, 1.0)] * 3)
    return st.builds(Shape, st.just(kind), st.tuples(*scalars_of(kind)), color)


def layers(lowest):
    length = numbers(0.0, 64.0)
    opacity = st.one_of(st.just(1.0), numbers(lowest, 1.0))

    def of_kind(kind):
        one = st.tuples(shapes(kind, lowest))
        several = st.lists(shapes(kind, lowest), min_size=2, max_size=4).map(tuple)
        return st.one_of(
            st.builds(Layer, one, length, opacity),
            st.builds(Layer, several, length, opacity, numbers(1e-5, 64.0)),
        )

    return st.sampled_from(sorted(KINDS)).flatmap(of_kind)


def scenes_of(compositing):
    side = st.integers(1, MAX_SIDE)
    drawn = st.lists(layers(-1.0 if compositing == "additive" else 0.0), max_size=5).map(tuple)
    background = st.none() | st.tuples(*[numbers(0.0, 1.0)] * 3)
    return st.builds(Scene, side, side, drawn, background, st.just(compositing))


scenes = st.sampled_from(["over", "additive"]).flatmap(scenes_of)


@given(scenes)
@settings(max_examples=60, deadline=None)
def test_what_is_written_comes_back(scene):
    text = dumps(scene)
    assert loads(text) == scene
    assert loads(text.encode()) == scene
    assert dumps(loads(text)) == text


@given(scenes)
@settings(max_examples=30, deadline=None)
def test_text_has_one_line_a_layer_in_draw_order(scene):
    lines = dumps(scene).splitlines()
    assert len(lines) == 9 + (len(scene.layers) + 1 if scene.layers else 0)
    for layer, line in zip(scene.layers, lines[8:-2] if scene.layers else [], strict=True):
        item = json.loads(line.rstrip(","))
        first = item["union"][0] if len(layer.shapes) > 1 else item
        assert first["kind"] == layer.kind
        assert item["falloff"] == layer.falloff
        named = layer.shapes[0].named().items()
        assert {name: list(v) if isinstance(v, tuple) else v for name, v in named}.items() <= first.items()


def test_text_is_what_a_person_would_write():
    sun = Layer((Shape.of("circle", (1, 0.5, 0), center=(0.25, -0.1), radius=0.2),), falloff=0.05)
    hills = Layer(
        (
            Shape.of("circle", (0, 1, 0), center=(0, 0.5), radius=1 / 3),
            Shape.of("circle", (0, 0, 1), center=(-0.0, 0.5), radius=2),
        ),
        falloff=0,
        opacity=0.5,
        smoothness=0.1,
    )
    assert dumps(Scene(300, 200, (sun, hills), background=None)) == (
        "{\n"
        '  "format": "sdf2vec scene",\n'
        '  "version": 1,\n'
        '  "width": 300,\n'
        '  "height": 200,\n'
        '  "compositing": "over",\n'
        '  "background": null,\n'
        '  "layers": [\n'
        '    {"kind": "circle", "center": [0.25, -0.1], "radius": 0.2, "color": [1, 0.5, 0], "falloff": 0.05},\n'
        '    {"union": [{"kind": "circle", "center": [0, 0.5], "radius": 0.333333, "color": [0, 1, 0]}, '
        '{"kind": "circle", "center": [0, 0.5], "radius": 2, "color": [0, 0, 1]}], '
        '"smoothness": 0.1, "falloff": 0, "opacity": 0.5}\n'
        "  ]\n"
        "}\n"
    )


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
    with pytest.raises(Sdf2vecError, match=r"bad\.scene\.json: width: must be between 1 and 65536, got -3$"):
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


# --- refusals ----------------------------------------------------------------------------------------------

CIRCLE = {"kind": "circle", "center": [0, 0], "radius": 0.5, "color": [1, 0.5, 0], "falloff": 0.1}
BLOB = {key: value for key, value in CIRCLE.items() if key != "falloff"}
BOX = {
    "kind": "box",
    "center": [0, 0],
    "half_size": [0.5, 0.25],
    "angle": 0,
    "corner_radius": 0,
    "color": [1, 0, 0],
    "falloff": 0,
}
UNION = {"union": [BLOB, BLOB, BLOB], "smoothness": 0.1, "falloff": 0.1, "opacity": 0.5}
VALID = {
    "format": "sdf2vec scene",
    "version": 1,
    "width": 40,
    "height": 30,
    "compositing": "over",
    "background": [0, 0, 0],
    "layers": [CIRCLE, BOX, UNION],
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
    ("layers", 2, "union", 1, "radius"),
    ("layers", 2, "union", 1, "color", 0),
    ("layers", 2, "smoothness"),
    ("layers", 2, "opacity"),
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
    assert loads(json.dumps(VALID)).shape_count == 5


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
        (("layers", 0, "radius"), 1e9, "must be <= 65536, got 1e+09"),
        (("layers", 0, "center", 1), -1e9, "must be >= -65536, got -1e+09"),
        (("layers", 1, "corner_radius"), -0.1, "must be >= 0, got -0.1"),
        (("layers", 0, "falloff"), -1, "must be between 0 and 65536, got -1"),
        (("layers", 0, "color", 0), 1.1, "must be between 0 and 1, got 1.1"),
        (("layers", 0, "color", 2), -0.1, "must be between 0 and 1, got -0.1"),
        (("layers", 2, "union", 1, "color", 0), 7, "must be between 0 and 1, got 7"),
        (("layers", 2, "union", 2, "radius"), -1, "must be > 0, got -1"),
        (("layers", 2, "smoothness"), 0, "must be > 0, got 0"),
        (("layers", 2, "smoothness"), -1, "must be between 0 and 65536, got -1"),
        (("layers", 2, "opacity"), 1.5, "must be between -1 and 1, got 1.5"),
        (("layers", 2, "opacity"), -0.5, "must be between 0 and 1, got -0.5"),
        (("background", 0), -0.5, "must be between 0 and 1, got -0.5"),
        (("width",), 0, "must be between 1 and 65536, got 0"),
        (("height",), 65537, "must be between 1 and 65536, got 65537"),
        (("height",), 40.0, "must be a whole number, got 40.0"),
        (("height",), True, "must be a whole number, got True"),
        (("height",), math.nan, "must be a whole number, got nan"),
        (("format",), "other", "must be 'sdf2vec scene', got 'other'; not a scene file"),
        (("version",), 2, "this program reads version 1, got 2"),
        (("version",), True, "this program reads version 1, got True"),
        (("version",), "1", "this program reads version 1, got '1'"),
        (("compositing",), "multiply", "must be one of over, additive, got 'multiply'"),
        (("compositing",), [], "must be one of over, additive, got []"),
        (("compositing",), {}, "must be one of over, additive, got {}"),
        (("background",), "black", "must be a list of 3 numbers, got 'black'"),
        (("background",), {}, "must be a list of 3 numbers, got {}"),
        (("background",), False, "must be a list of 3 numbers, got False"),
        (("layers",), {}, "must be a list, got {}"),
        (("layers",), None, "must be a list, got None"),
        (("layers", 0), [], "must be an object, got []"),
        (("layers", 1), None, "must be an object, got None"),
        (("layers", 2, "union"), {}, "must be a list, got {}"),
        (("layers", 2, "union"), [], "must hold at least 1 shape, got 0"),
        (("layers", 2, "union", 1), 5, "must be an object, got 5"),
        (("layers", 0, "center"), 0.5, "must be a list of 2 numbers, got 0.5"),
        (("layers", 0, "center"), [1], "must be a list of 2 numbers, got [1]"),
        (("layers", 0, "center"), [1, 2, 3], "must be a list of 2 numbers, got [1, 2, 3]"),
        (("layers", 0, "color"), [1, 1], "must be a list of 3 numbers, got [1, 1]"),
        (("layers", 0, "kind"), "star", f"must be one of {', '.join(KINDS)}, got 'star'"),
        (("layers", 0, "kind"), [], f"must be one of {', '.join(KINDS)}, got []"),
        (("layers", 0, "radii"), 1, "unknown; a circle has center, radius"),
        (("layers", 0, "smoothness"), 1, "unknown; a circle has center, radius"),
        (("layers", 2, "color"), 1, "unknown field; known are falloff, opacity, smoothness, union"),
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
        ("layers", 0, "kind"),
        ("layers", 0, "falloff"),
        ("layers", 0, "color"),
        ("layers", 0, "radius"),
        ("layers", 1, "angle"),
        ("layers", 2, "union", 1, "kind"),
        ("layers", 2, "union", 1, "center"),
    ],
    ids=spelled,
)
def test_missing_fields(path):
    assert refusal(changed(path, ABSENT)).startswith(f"{spelled(path)}: missing")


def test_a_union_needs_a_smoothness():
    assert refusal(changed(("layers", 2, "smoothness"), ABSENT)) == "layers[2].smoothness: must be > 0, got 0"


def test_a_union_of_several_kinds():
    box = {key: value for key, value in BOX.items() if key != "falloff"}
    text = changed(("layers", 2, "union", 1), box)
    assert refusal(text) == "layers[2].union: shapes must be of one kind, got circle and box"


def test_additive_scenes_have_signed_colors_and_opacity_but_no_signed_background():
    additive = VALID | {"compositing": "additive"}
    for path in (("layers", 0, "color", 0), ("layers", 2, "union", 1, "color", 2), ("layers", 2, "opacity")):
        assert loads(changed(path, -1, additive)).compositing == "additive"
        problem = "must be between -1 and 1, got -1.01"
        assert refusal(changed(path, -1.01, additive)) == f"{spelled(path)}: {problem}"
    assert refusal(changed(("background", 2), -1, additive)).startswith("background[2]: ")


def test_repeated_fields():
    text = json.dumps(VALID)
    again = text.replace('"radius": 0.5', '"radius": 0.5, "radius": 0.6')
    assert refusal(again) == "layers[0].radius: appears twice in one object"
    in_union = '"union": [{"kind": "circle", "kind": "circle",'
    assert (
        refusal(text.replace('"union": [{"kind": "circle",', in_union))
        == "layers[2].union[0].kind: appears twice in one object"
    )
    assert refusal(text.replace('"width"', '"height"')) == "height: appears twice in one object"


@pytest.mark.parametrize("name", ["", "two\nlines", "\x1b[31m", "\ud800", "[0]", "a" * 10**6, "\u2028"])
def test_strange_names_of_fields(name):
    assert refusal(json.dumps(VALID | {name: 1})).endswith(
        "unknown field; known are " + ", ".join(sorted(VALID))
    )
    assert refusal(changed(("layers", 1, name), 1)).startswith("layers[1].")


def test_absurd_counts():
    many = [CIRCLE] * (MAX_SHAPES + 1)
    assert refusal(json.dumps(VALID | {"layers": many})) == "layers: at most 65536 shapes, got 65537"
    union = UNION | {"union": [BLOB] * (MAX_UNION + 1)}
    text = json.dumps(VALID | {"layers": [CIRCLE, union]})
    assert refusal(text) == f"layers[1].union: at most {MAX_UNION} shapes, got {MAX_UNION + 1}"
    unions = [UNION | {"union": [BLOB] * MAX_UNION}] * (MAX_SHAPES // MAX_UNION)
    assert loads(json.dumps(VALID | {"layers": unions})).shape_count == MAX_SHAPES
    text = json.dumps(VALID | {"layers": [*unions, CIRCLE]})
    assert refusal(text) == "layers: at most 65536 shapes, got 65537"


def test_the_largest_union_can_be_exported_and_drawn():
    union = UNION | {"union": [BLOB | {"center": [i / MAX_UNION, 0]} for i in range(MAX_UNION)]}
    scene = loads(json.dumps(VALID | {"layers": [union], "width": 3, "height": 2}))
    for target in ("glsl", "shadertoy", "wgsl", "png"):
        assert sdf2vec.export(scene, target)
    assert sdf2vec.export(scene, "glsl", layout="readable")


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

any_text = st.text(max_size=8) | st.sampled_from(["kind", "radius", "union", "circle", "additive", "a\nb"])
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
    with pytest.raises(SceneError, match=r"^union: must hold at least 1 shape, got 0$"):
        Layer((), 0.1)
    with pytest.raises(SceneError, match=r"^width: must be between 1 and 65536"):
        Scene(10**4000, 1, ())
    with pytest.raises(SceneError, match=r"^kind: must be one of"):
        Shape.of("\n", (0, 0, 0))


def test_a_single_shape_has_no_smoothness_to_disagree_about():
    shape = Shape.of("circle", (0, 0, 0), center=(0, 0), radius=1)
    assert Layer((shape,), 0.1, 1.0, 0.5) == Layer((shape,), 0.1)


def test_scenes_are_frozen():
    scene = Scene(3, 2, ())
    with pytest.raises(AttributeError):
        scene.width = 5  # type: ignore[misc]
    assert hash(scene) == hash(Scene(3, 2, ()))

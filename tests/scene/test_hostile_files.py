"""Scene files from anywhere: strange names, absurd counts, nests, fuzzing; and kinds of the tests' own."""

import json

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

import sdf2vec.scene
from sdf2vec import (
    KINDS,
    Scene,
    SceneError,
    Shape,
    dumps,
    export,
    loads,
)
from sdf2vec.kind import Kind
from sdf2vec.paints import PAINTS, Paint
from sdf2vec.scene import MAX_JOINED, MAX_SHAPES
from sdf2vec.units import COLOR, DIRECTION, LENGTH, OPACITY, POSITION, Parameter
from tests.scene.malformed import (
    ABSENT,
    BLOB,
    CIRCLE,
    VALID,
    changed,
    refusal,
)


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

"""What no scene is: refused with the path of the field, in a file and in Python."""

import json
import math

import numpy as np
import pytest

from sdf2vec import (
    KINDS,
    Joint,
    Layer,
    Scene,
    SceneError,
    Shape,
    dumps,
    loads,
)
from sdf2vec.blend import JOINS
from sdf2vec.layer import row_width
from sdf2vec.paints import PAINTS
from tests.scene.malformed import (
    ABSENT,
    BLOB,
    CIRCLE,
    VALID,
    changed,
    refusal,
    spelled,
)
from tests.scenes import PATCHES, random_scene

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
        (("layers", 1, "paint"), "spiral", f"must be one of {', '.join(PAINTS)}, got 'spiral'"),
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
    with pytest.raises(SceneError, match=r"^paint_parameters: the paint linear has 6 numbers, got 1$"):
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

"""A valid scene file as data, ways to spoil it, and what is said then."""

import json

import pytest

from sdf2vec import (
    SceneError,
    loads,
)

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

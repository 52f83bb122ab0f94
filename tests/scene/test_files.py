"""Scenes as JSON: what is written comes back, and is what a person would write."""

import json
import re
from itertools import product
from pathlib import Path

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from sdf2vec import (
    KINDS,
    Joint,
    Layer,
    Scene,
    Sdf2vecError,
    Shape,
    dumps,
    load,
    loads,
    save,
)
from sdf2vec.blend import COMPOSITING, JOINS
from sdf2vec.layer import Part
from sdf2vec.paints import PAINTS
from sdf2vec.render.reference import render
from sdf2vec.units import COLOR
from tests.scene.malformed import refusal
from tests.scenes import SOFT, random_scene


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
    channel = numbers(0.0, 1.0)
    background = st.none() | st.tuples(*[channel] * 3) | st.tuples(*[channel] * 4)
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
            if values.get("shift") == 0.0:
                del values["shift"]
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
        shift=0,
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
    text = (Path(__file__).parents[2] / "docs" / "scene.md").read_text()
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

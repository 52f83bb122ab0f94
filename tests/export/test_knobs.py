"""What a pasted shader offers to change does what its remark says."""

import re
import sys
from dataclasses import replace

import numpy as np
import pytest

import sdf2vec
from sdf2vec import Layer, Scene, Shape
from sdf2vec.engines import opengl
from sdf2vec.export import packing
from sdf2vec.export.options import Options
from sdf2vec.export.shader import shader
from sdf2vec.render import reference
from sdf2vec.roundtrip import SHADERTOY_HEAD, SHADERTOY_TAIL
from tests.scenes import random_scene

SIZE = (120, 80)
SAME = 0.1  # levels


def one_circle(radius=0.3, falloff=0.1):
    circle = Shape.of("circle", (1, 0.5, 0), center=(0.1, 0), radius=radius)
    return Scene(*SIZE, (Layer((circle,), falloff, 0.9),), background=(0.2, 0.3, 0.4))


def drawn(scene, changed=None, seconds=0.0, mouse=(0.0,) * 4):
    """The default text, with other values for its names, at a time, under a mouse."""
    text = str(sdf2vec.export(scene, "shadertoy", framing="fit"))
    for name, value in (changed or {}).items():
        text, count = re.subn(rf"(#define {name}) \S.*?( //)", rf"\1 {value}\2", text)
        assert count == 1
    uniforms = {"iResolution": (*map(float, SIZE), 1.0), "iTime": seconds, "iMouse": mouse}
    return opengl.render(SHADERTOY_HEAD + text + SHADERTOY_TAIL, *SIZE, uniforms)


def rendered(scene):
    return reference.render(scene, *SIZE).permute(1, 2, 0).numpy()


def levels(one, other):
    return 255 * np.abs(one - other).max()


@pytest.fixture(autouse=True)
def _engine(require_engine):
    require_engine("opengl")


def test_unless_changed_it_is_the_picture_at_any_time():
    scene = random_scene(layers=9, seed=12, width=SIZE[0], height=SIZE[1])
    for seconds in (0.0, 7.5):
        assert levels(drawn(scene, seconds=seconds), rendered(scene)) <= SAME


def test_the_ground():
    found = drawn(one_circle(), {"GROUND": "vec4(0.9, 0.1, 0.0, 1.0)"})
    assert levels(found, rendered(replace(one_circle(), background=(0.9, 0.1, 0.0)))) <= SAME


def test_the_softness_of_edges_that_stay_where_they_are():
    """Three times as soft: as of a circle whose coverage is 1/2 at the same distance."""
    softer = one_circle(0.3 - 0.1, 3 * 0.1)
    assert levels(drawn(one_circle(), {"SOFTNESS": "3.0"}), rendered(softer)) <= SAME
    sharp = one_circle(0.3 + 0.05, 0.0)
    assert levels(drawn(one_circle(), {"SOFTNESS": "0.0"}), rendered(sharp)) <= SAME


def test_shapes_breathe_so_far_and_so_fast():
    """The first shape's edge moves by AMPLITUDE · sin(SPEED · seconds)."""
    moved = drawn(one_circle(), {"AMPLITUDE": "0.05", "SPEED": "2.0"}, seconds=0.7)
    assert levels(moved, rendered(one_circle(0.3 - 0.05 * np.sin(2.0 * 0.7)))) <= SAME
    assert levels(drawn(one_circle(), {"AMPLITUDE": "0.05"}), rendered(one_circle())) <= SAME


def test_the_mouse_drags_the_picture():
    """By as many pixels as it has moved since it went down; not once it is up again."""
    still = drawn(one_circle())
    dragged = drawn(one_circle(), mouse=(30.0, 50.0, 20.0, -46.0))  # 10 to the right, 4 up
    assert levels(dragged, np.roll(still, (-4, 10), (0, 1))) <= SAME
    half = drawn(one_circle(), {"DRAG": "0.5"}, mouse=(30.0, 50.0, 20.0, -46.0))
    assert levels(half, np.roll(still, (-2, 5), (0, 1))) <= SAME
    assert levels(drawn(one_circle(), mouse=(30.0, 50.0, -20.0, -46.0)), still) == 0


def test_each_shape_has_its_number_and_its_kind():
    scene = random_scene(("box", "circle", "gaussian"), layers=12, seed=12)
    text = str(sdf2vec.export(scene, "shadertoy"))
    number = 0
    for layer in scene.layers:
        (remark,) = re.findall(rf"// {number} (.*)", text)
        assert [
            next(k for k in ("box", "circle", "gaussian") if k in part) for part in remark.split(", ")
        ] == [shape.kind for shape in layer.shapes]
        number += len(layer.shapes)


@pytest.mark.parametrize(("count", "layout"), [(9, "readable"), (40, "packed")])
def test_it_is_readable_while_hosts_take_so_much_text(monkeypatch, count, layout):
    """With a limit of 6 KiB in place of 64."""
    monkeypatch.setattr(packing, "SAMPLE", 1 << 14)
    monkeypatch.setattr(sys.modules["sdf2vec.export.shader"], "TEXT_LIMIT", 6 << 10)
    circle = one_circle().layers[0]
    made = shader(replace(one_circle(), layers=(circle,) * count), "shadertoy", Options())
    assert made.choice.layout == layout
    assert len(made.text) <= 6 << 10
    asked = shader(one_circle(), "shadertoy", Options(layout="packed"))
    assert asked.choice.layout == "packed"

"""Compact scene files: every sort of scene is read as it was written, in steps; hostile files are refused in a line."""

import base64
import random
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sdf2vec import Layer, Scene, SceneError, Shape, load, loads
from sdf2vec.compact_file import MAGIC, MOST_BITS, PRECISIONS, VERSION, Numbering, _word, written
from sdf2vec.entropy import Writer
from sdf2vec.layer import slots
from sdf2vec.units import ANGLE
from tests.scenes import FIRST_COMPACT, random_scene

FINE = dict.fromkeys(PRECISIONS, 16)
SCENES = [
    random_scene(layers=16, seed=seed, compositing=compositing, transparent=bool(seed % 2))
    for seed in range(3)
    for compositing in ("over", "additive")
]


@pytest.mark.parametrize(
    "scene", [*SCENES, Scene(3, 2, (), None), Scene(65536, 1, (), (0.5, 0.25, 1.0, 0.5))]
)
def test_all_that_a_scene_says_is_read(scene):
    """Each number within half a step of its scale, which reaches from the least to the largest of its unit."""
    found = loads(written(scene, FINE))
    assert (found.width, found.height, found.compositing) == (scene.width, scene.height, scene.compositing)
    np.testing.assert_allclose(found.ground, scene.ground, atol=0.5 / 4095 + 1e-5)
    scales = Numbering.of(scene, FINE).scales
    for one, other in zip(scene.layers, found.layers, strict=True):
        assert one.structure == other.structure
        numbers = iter(zip(one.numbers, other.numbers, strict=True))
        for slot in slots(one.structure):
            unit = slot.parameter.unit
            for _ in range(slot.parameter.width):
                was, now = (scales[unit.name].step(value, unit) for value in next(numbers))
                turn = scales[unit.name].most if unit is ANGLE else 0
                assert min(abs(was - now), abs(abs(was - now) - turn)) < 0.7 + 10.0**-unit.decimals * 1e4


def test_coarse_steps_take_few_bytes_and_fine_ones_are_the_scene():
    scene = random_scene(("triangle",), layers=60, seed=2, paints=("flat",), joins=())
    sizes = [len(written(scene, dict.fromkeys(PRECISIONS, bits))) for bits in (4, 8, 16, MOST_BITS)]
    assert sizes == sorted(sizes)
    assert sizes[0] < 60 * 45 / 8 + 60
    finest = loads(written(scene, dict.fromkeys(PRECISIONS, MOST_BITS)))
    assert np.abs(np.array(finest.layers[7].numbers) - scene.layers[7].numbers).max() < 3e-5


def test_grey_shapes_say_their_colour_once():
    r = random.Random(4)
    colored = random_scene(("circle",), layers=200, seed=4, paints=("flat",), joins=())
    layers = []
    for layer in colored.layers:
        grey = r.random()
        layers.append(replace(layer, shapes=(replace(layer.shapes[0], color=(grey, grey, grey)),)))
    bits = dict(zip(PRECISIONS, (9, 6, 6, 6), strict=True))
    saved = len(written(colored, bits)) - len(written(replace(colored, layers=tuple(layers)), bits))
    assert saved > 200 * 10 / 8


def test_a_file_of_the_first_version_is_read():
    """Gradients had no shift."""
    found = loads(base64.b64decode(FIRST_COMPACT))
    disc, box = (layer.shapes[0] for layer in found.layers)
    assert (disc.kind, disc.paint, box.kind, box.paint) == ("circle", "linear", "box", "flat")
    assert disc.painted() == {
        "color": (1.0, 0.0, 0.0),
        "color_end": (0.0, 0.0, 1.0),
        "direction": pytest.approx((0.5, -0.25), abs=1e-3),
        "shift": 0.0,
    }
    assert disc.parameters == pytest.approx((0.125, -0.0625, 0.375), abs=1e-3)
    assert box.parameters == pytest.approx((-0.25, 0.125, 0.25, 0.125, 0.5, 0.0625), abs=1e-3)


@pytest.mark.parametrize(("paint", "version"), [("flat", 1), ("linear", 2)])
def test_a_file_is_of_the_first_version_that_has_all_its_numbers(paint, version):
    data = written(random_scene(("circle",), paints=(paint,)), FINE)
    assert data[len(MAGIC)] == version
    assert loads(data).layers[0].shapes[0].paint == paint


def test_a_file_is_loaded_whatever_it_is_called(tmp_path):
    path = tmp_path / "a.scene.json"
    path.write_bytes(written(SCENES[0], FINE))
    assert load(path) == loads(written(SCENES[0], FINE))


# --- hostile files ---------------------------------------------------------------------------------------------


def refusal(data):
    with pytest.raises(SceneError) as caught:
        loads(data)
    assert "\n" not in str(caught.value)
    return str(caught.value)


def head(*, width=1, compositing="", channels=0, kinds=("circle",), bits=(8, 8, 8, 8), layers=1):
    """The beginning of a file, up to its layers."""
    coder = Writer()
    coder.count(width - 1)
    coder.count(0)
    _word(coder, compositing)
    coder.count(channels)
    for _ in range(channels):
        coder.raw(0, 12)
    coder.count(len(kinds))
    for kind in kinds:
        for name in (kind, "", ""):
            _word(coder, name)
    for count in bits:
        coder.raw(count, 5)
    for _ in range(5):
        coder.signed(0)
        coder.count(1000)
    coder.count(layers)
    return MAGIC + bytes([VERSION]) + coder.done()


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (MAGIC, "no compact scene"),
        (MAGIC + b"\x00rest", "versions 1 to 2, got 0"),
        (MAGIC + b"\x03rest", "versions 1 to 2, got 3"),
        (MAGIC + bytes([VERSION]), "ends too early"),
        (head(width=65537), "width: must be at most 65535, got 65536"),
        (head(compositing="multiply"), "compositing: must be one of over, additive"),
        (head(channels=2), "background"),
        (head(channels=5), "background"),
        (head(kinds=("__class__",)), "parts.kind: must be one of"),
        (head(kinds=("circle",) * 1025), "parts: must be at most 1024"),
        (head(bits=(8, 0, 8, 8)), "bits: must be 1 to 24"),
        (head(bits=(8, 25, 8, 8)), "bits: must be 1 to 24"),
        (head(layers=65537), "layers: must be at most 65536"),
        (head(layers=1 << 35), "layers: must be at most 65536"),
        (head(layers=65536), "ends too early"),
        (written(SCENES[0], FINE)[:-9], "ends too early"),
        (written(SCENES[0], FINE) + b"and more", "goes on after its end"),
    ],
)
def test_what_a_file_may_not_say_is_refused(data, words):
    assert words in refusal(data)


def test_a_name_without_end_is_refused():
    coder = Writer()
    for _ in range(2):
        coder.count(0)
    for _ in range(60):
        coder.raw(120, 7)
    assert "too long" in refusal(MAGIC + bytes([VERSION]) + coder.done())


def test_a_name_that_no_file_can_hold_is_not_written():
    with pytest.raises(SceneError, match="can't be in a compact scene"):
        _word(Writer(), "Blüte")


def _said_of(data):
    """What is refused about a file; nothing where it is a scene."""
    try:
        return loads(data).compositing
    except SceneError as error:
        return str(error)


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 10**6), st.integers(0, 255), st.binary(max_size=60))
def test_any_bytes_are_a_scene_or_refused_in_one_line(place, byte, noise):
    good = written(SCENES[1], dict.fromkeys(PRECISIONS, 6))
    changed = bytearray(good)
    changed[len(MAGIC) + 1 + place % (len(good) - len(MAGIC) - 1)] = byte
    for data in (bytes(changed), MAGIC + bytes([VERSION]) + noise):
        assert "\n" not in _said_of(data)


def test_signs_that_a_compositing_has_not_are_refused():
    """A scale may reach below 0, and under `over` no colour may."""
    shape = Shape.of("circle", (-0.5, 0, 0), center=(0, 0), radius=0.2)
    scene = Scene(4, 4, (Layer((shape,), 0.1),), None, "additive")
    assert loads(written(scene, FINE)).layers[0].shapes[0].color[0] == pytest.approx(-0.5, abs=1e-3)
    object.__setattr__(scene, "compositing", "over")
    assert "layers[0].color[0]: must be >= 0" in refusal(written(scene, FINE))

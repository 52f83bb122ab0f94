"""Strokes and frames of a region: on drawings whose lines are known."""

import math
from itertools import pairwise

import numpy as np
import pytest
import torch

import sdf2vec
from sdf2vec.fit.frames import Frame, framed
from sdf2vec.fit.peeling import peeled
from sdf2vec.fit.strokes import Bow, Line, strokes
from sdf2vec.fit.surroundings import View
from sdf2vec.fit.views import scaled
from sdf2vec.render.tensors import SceneTensors, to_scene
from tests.fit.drawn import search_of, view_of
from tests.fit.stroked import FINER, bow, frame, line, seen, x, y


def ends_of(stroke):
    return sorted(map(tuple, stroke.ends.round(1).tolist()))


def of_kind(found, kind):
    return [stroke for stroke in found if isinstance(stroke, kind)]


@pytest.mark.parametrize("hard", [False, True])
def test_lines_that_meet_in_a_corner(hard):
    coverage = seen(line((20, 50), (45, 75), 5) | line((45, 75), (95, 25), 5))
    found = strokes((coverage > 0.5).astype(np.float64) if hard else coverage)
    assert [ends_of(stroke) for stroke in found] == [
        [pytest.approx((45, 75), abs=1.2), pytest.approx((95, 25), abs=1.2)],
        [pytest.approx((20, 50), abs=1.2), pytest.approx((45, 75), abs=1.2)],
    ]
    assert [stroke.half for stroke in found] == pytest.approx([5, 5], abs=0.4 if hard else 0.2)
    assert not any(stroke.square for stroke in found)


def test_lines_that_cross_are_whole():
    found = strokes(seen(line((20, 20), (80, 80), 4) | line((20, 80), (80, 20), 4)))
    assert len(found) == 2
    assert sorted(ends_of(stroke)[0] for stroke in found) == [
        pytest.approx((20, 80), abs=1.2),
        pytest.approx((20, 20), abs=1.2),
    ]
    assert [stroke.length for stroke in found] == pytest.approx([60 * math.sqrt(2)] * 2, abs=1.0)


def test_a_line_that_ends_squarely():
    (found,) = strokes(seen(line((20, 50), (90, 50), 6, square=True)))
    assert found.square
    assert found.length == pytest.approx(70, abs=1.0)


@pytest.mark.parametrize("square", [False, True])
def test_a_bow_with_both_kinds_of_ends(square):
    (found,) = strokes(seen(bow((55, 60), 35, 200, 150, 5, square)))
    assert isinstance(found, Bow)
    assert found.square == square
    assert (*found.middle, found.radius) == pytest.approx((55, 60, 35), abs=0.3)
    assert found.sector[1] == pytest.approx(math.radians(150), abs=0.06)


def test_a_ring_is_closed():
    (found,) = strokes(seen(bow((55, 50), 35, 0, 360, 5)))
    assert isinstance(found, Bow)
    assert found.is_closed
    assert (*found.middle, found.radius, found.half) == pytest.approx((55, 50, 35, 5), abs=0.2)


def test_where_a_line_becomes_a_bow_both_end():
    """A hook: round by a quarter turn around (70, 30)."""
    hook = line((20, 50), (70, 50), 4) | bow((70, 30), 20, 0, 90, 4) | line((90, 10), (90, 30), 4)
    found = strokes(seen(hook))
    (arc,) = of_kind(found, Bow)
    assert (*arc.middle, arc.radius, arc.span) == pytest.approx((70, 30, 20, math.pi / 2), abs=0.4)
    joints = [pytest.approx((70, 50), abs=0.6), pytest.approx((90, 30), abs=0.6)]
    assert ends_of(arc) == joints
    lines = of_kind(found, Line)
    assert ends_of(lines[0])[1] == joints[0]
    assert ends_of(lines[1])[1] == joints[1]


@pytest.mark.parametrize(
    "inside",
    [np.hypot(x - 50, y - 50) < 30, (y > 20) & (y < 80) & (x > 30) & (x < 30 + 0.7 * (y - 20)), x < 0],
    ids=["a disc", "a triangle", "nothing"],
)
def test_what_is_of_no_width_has_no_strokes(inside):
    assert strokes(seen(inside)) == []


def test_a_ring_that_gets_wider_has_no_strokes():
    inside = (np.hypot(x - 50, y - 50) < 40) & (np.hypot(x - 60, y - 50) > 25)
    assert strokes(seen(inside)) == []


# --- frames -------------------------------------------------------------------------------------------------


def frames(inside):
    coverage = seen(inside)
    return framed(strokes(coverage), coverage > 0.5)


@pytest.mark.parametrize("radius", [0, 8])
def test_a_frame_with_a_line_across(radius):
    found, *rest = frames(frame((60, 50), (45, 38), radius, 4) | line((15, 50), (105, 50), 4))
    assert isinstance(found, Frame)
    quarters = round(found.angle / (math.pi / 2))
    sides = found.sides[::-1] if quarters % 2 else found.sides
    assert found.angle == pytest.approx(quarters * math.pi / 2, abs=0.01)
    assert (*found.middle, *sides, found.half) == pytest.approx((60, 50, 45, 38, 4), abs=0.4)
    assert found.radius == pytest.approx(radius, abs=0.8)
    assert len(rest) == 1
    assert ends_of(rest[0]) == [pytest.approx((15, 50), abs=1.0), pytest.approx((105, 50), abs=1.0)]


def test_three_sides_are_no_frame():
    sides = line((20, 20), (20, 80), 4) | line((20, 80), (90, 80), 4) | line((90, 80), (90, 20), 4)
    assert len(of_kind(frames(sides), Line)) == 3


def test_four_lines_that_cross_are_no_frame():
    """Of a hash sign, whose lines go on beyond the corners."""
    hash_sign = [line((30, 10), (30, 90), 3), line((70, 10), (70, 90), 3)]
    hash_sign += [line((10, 30), (100, 30), 3), line((10, 70), (100, 70), 3)]
    assert len(of_kind(frames(np.any(hash_sign, axis=0)), Line)) == 4


# --- scenes -------------------------------------------------------------------------------------------------


def drawn(inside, finer=FINER):
    """Black on white [H, W, 3], so many samples a pixel's side."""
    height, width = (side // finer for side in inside.shape)
    cover = inside.reshape(height, finer, width, finer).mean(axis=(1, 3))
    return np.repeat(1.0 - cover[..., None], 3, axis=2)


def off(scene, pixels):
    """PSNR of a scene, drawn at the size of a picture [H, W, 3], and its signed mean error."""
    wrong = sdf2vec.render(scene, pixels.shape[1], pixels.shape[0])[..., :3] - pixels
    return -10.0 * np.log10(np.mean(wrong**2)), float(wrong.mean())


PULSE = [(15, 50), (40, 50), (55, 20), (70, 80), (85, 50), (105, 50)]
DRAWINGS = {
    "pulse": (np.any([line(a, b, 4) for a, b in pairwise(PULSE)], axis=0), [["arc"]] * 5),
    "hook": (
        line((20, 60), (60, 60), 4) | bow((60, 40), 20, 0, 90, 4) | line((80, 15), (80, 40), 4),
        [["arc"]] * 3,
    ),
    "horseshoe": (bow((60, 55), 30, 150, 240, 5), [["arc"]]),
    "crossed out": (
        frame((60, 50), (45, 38), 12, 4) | line((45, 35), (75, 65), 4) | line((45, 65), (75, 35), 4),
        [["arc"], ["arc"], ["box", "box"]],
    ),
}


def taken_apart(pixels):
    """What is told by its outline, before any descent of all."""
    height, width = pixels.shape[:2]
    size = (width / min(height, width), height / min(height, width))
    bare = SceneTensors([], torch.ones(4), "over", size)
    views = [View(scaled(pixels.astype(np.float32), 56), None), view_of(pixels)]
    return to_scene(peeled(bare, views, search_of()), width, height)


@pytest.mark.parametrize("name", DRAWINGS)
def test_a_drawing_of_strokes_is_a_layer_for_each(name):
    inside, kinds = DRAWINGS[name]
    pixels = drawn(inside)
    scene = taken_apart(pixels)
    assert sorted([shape.kind for shape in layer.shapes] for layer in scene.layers) == kinds
    assert off(scene, pixels)[0] > 26


def test_a_whole_fit_of_them_is_near_at_any_size():
    inside, kinds = DRAWINGS["crossed out"]
    scene = sdf2vec.fitted(drawn(inside)).scene
    assert sorted([shape.kind for shape in layer.shapes] for layer in scene.layers) == kinds
    for finer, least in ((FINER, 40), (FINER // 2, 36)):
        near, lighter = off(scene, drawn(inside, finer))
        assert near > least
        assert abs(lighter) < 0.001

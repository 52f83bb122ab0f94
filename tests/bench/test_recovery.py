"""What an answer is worth: a perfect one, one with one mistake, an empty one."""

from dataclasses import replace

import numpy as np
import pytest

from sdf2vec import Scene
from sdf2vec.bench.known_drawing import svg_of
from sdf2vec.bench.known_scenes import MODES, known_scene
from sdf2vec.bench.recovery import (
    BEST,
    ENOUGH,
    Answer,
    Found,
    Verdict,
    f1,
    judged,
    overlaps,
    pairs,
    psnr,
    scene_answer,
    svg_answer,
    visible,
)


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("soft", [False, True])
@pytest.mark.parametrize("count", [0, 1, 8])
def test_the_true_scene_is_found_whole(mode, soft, count):
    """As this program draws it: two independent drawings agree where shapes are, and nearly in their pixels."""
    known = known_scene(count, mode, soft, 3)
    verdict = judged(known, scene_answer(known.scene, 1.5))
    assert verdict[:4] == (count,) * 4
    assert verdict.ratio == f1([verdict]) == 1
    assert verdict.psnr >= ENOUGH
    assert verdict.seconds == 1.5


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("count", [0, 1, 8])
def test_the_true_svg_is_found_whole(require_engine, mode, count):
    require_engine("resvg")
    known = known_scene(count, mode, False, 4)
    verdict = judged(known, svg_answer(svg_of(known), known.side))
    assert verdict[:5] == (count, count, count, count, BEST)


@pytest.fixture
def known():
    return known_scene(8, "apart", False, 7)


def test_a_shape_of_another_kind_is_one_less(known):
    answer = scene_answer(known.scene)
    wrong = replace(answer, shapes=(answer.shapes[0]._replace(kind="displaced"), *answer.shapes[1:]))
    verdict = judged(known, wrong)
    assert verdict[:4] == (8, 8, 7, 8)
    assert f1([verdict]) == pytest.approx(7 / 8)
    assert f1([verdict], of_kind=False) == 1


def test_a_shape_elsewhere_is_one_less(known):
    """By half of its size, upwards; then it is nothing's outline either."""
    answer = scene_answer(known.scene)
    half = int(known.shapes[0].figure.sizes[0])
    moved = answer.shapes[0]._replace(cover=np.roll(answer.shapes[0].cover, half, axis=0))
    assert judged(known, replace(answer, shapes=(moved, *answer.shapes[1:])))[:4] == (8, 8, 7, 7)


def test_a_shape_too_many_and_one_too_few(known):
    layers = known.scene.layers
    more = judged(known, scene_answer(replace(known.scene, layers=(*layers, layers[2]))))
    assert more[:3] == (8, 9, 8)
    assert more.ratio == 9 / 8
    assert f1([more]) == pytest.approx(16 / 17)
    fewer = judged(known, scene_answer(replace(known.scene, layers=layers[1:])))
    assert fewer[:3] == (8, 7, 7)
    assert fewer.psnr < ENOUGH


def test_nothing_found(known):
    verdict = judged(known, scene_answer(Scene(known.side, known.side, (), known.background)))
    assert verdict[:4] == (8, 0, 0, 0)
    assert verdict.ratio == f1([verdict]) == 0


def test_a_flat_picture():
    flat = known_scene(0, "apart", False, 0)
    nothing = judged(flat, scene_answer(flat.scene))
    assert (nothing.ratio, f1([nothing]), nothing.psnr) == (1, 1, BEST)
    one = Found("box", np.ones((flat.side, flat.side)), 0.5)
    something = judged(flat, Answer(flat.pixels, (one,)))
    assert (something.ratio, f1([something])) == (2, 0)


def test_f1_is_that_of_all_shapes_together():
    one, many = Verdict(1, 1, 1, 1, 50, 0), Verdict(9, 9, 0, 9, 50, 0)
    assert f1([one, many]) == pytest.approx(0.1)
    assert f1([one, many], of_kind=False) == 1


def half(top, opacity=1.0, value=1.0):
    """Covers the upper or the lower three quarters of four rows."""
    cover = np.zeros((4, 2))
    cover[slice(0, 3) if top else slice(1, 4)] = value
    return Found("box", cover, opacity)


@pytest.mark.parametrize(("opacity", "rows"), [(1.0, 1), (0.8, 1), (0.7, 3), (0.1, 3)])
def test_what_is_hidden_is_not_seen(opacity, rows):
    """The lower of two: one row of three is its own where what lies above lets less than a quarter through."""
    below, above = visible([half(True), half(False, opacity)])
    assert (below.sum(), above.sum()) == (2 * rows, 6)


def test_half_covered_is_covered():
    assert [mask.sum() for mask in visible([half(True, value=0.49)])] == [0]
    assert [mask.sum() for mask in visible([half(True, value=0.5)])] == [6]


def test_intersection_over_union():
    a, b = (found.cover > 0 for found in (half(True), half(False)))
    np.testing.assert_array_equal(overlaps([a, b], [a, b, a & False]), [[1, 0.5, 0], [0.5, 1, 0]])
    assert overlaps([a], []).shape == (1, 0)


def test_pairs_are_chosen_together():
    """The first could take either; only if it leaves the first one over can the second have any."""
    assert pairs(np.array([[True, True], [True, False]])) == 2
    assert pairs(np.array([[True, False], [True, False]])) == 1
    assert pairs(np.zeros((0, 3), bool)) == 0


def test_psnr_by_hand():
    """One level of ten off in one channel of three: 20 log10(10) + 10 log10(3)."""
    black, red = np.zeros((2, 2, 3), np.float32), np.zeros((2, 2, 3), np.float32)
    red[..., 0] = 26 / 255
    assert psnr(black, red) == pytest.approx(20 * np.log10(255 / 26) + 10 * np.log10(3), abs=1e-4)
    assert psnr(black, black) == BEST


def test_an_answer_is_seen_at_eight_bits():
    flat = known_scene(0, "apart", False, 0)
    assert judged(flat, Answer(flat.pixels + np.float32(0.4 / 255), ())).psnr == BEST
    assert 48 < judged(flat, Answer(flat.pixels + np.float32(0.6 / 255), ())).psnr < 49

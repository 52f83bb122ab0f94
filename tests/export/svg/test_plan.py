"""Which construction each layer gets."""

from itertools import pairwise

import pytest

from sdf2vec import Layer, Scene, Shape
from sdf2vec.export.svg.plan import DETAILS, Planner

ELLIPSE = Shape.of("ellipse", (1, 0, 0), center=(0, 0), radii=(0.3, 0.2), angle=0)
DISC = Shape.of("circle", (1, 1, 1), center=(0, 0), radius=0.3)
BOX = Shape.of("box", (0.25, 0.25, 0.25), center=(0, 0), half_size=(0.3, 0.1), angle=0.5, corner_radius=0.0)


def planner(*layers, filters=True, side=200):
    return Planner(Scene(side, side, layers, (0.2, 0.2, 0.2)), filters)


@pytest.mark.parametrize(
    ("falloff", "side", "soft"), [(0.0, 200, False), (0.0095, 200, False), (0.011, 200, True)]
)
def test_an_edge_softer_than_two_pixels_is_soft(falloff, side, soft):
    assert planner(Layer((DISC,), falloff), side=side).soft == [soft]


def test_blurs_are_for_what_no_gradient_says_and_need_filters():
    faint = Shape("circle", DISC.parameters, (0.25, 0.25, 0.25))
    layers = (Layer((faint,), 0.2), Layer((BOX,), 0.2), Layer((faint,), 0.0))
    assert list(planner(*layers).plan(DETAILS[0]).blurred) == [1]
    assert planner(*layers, filters=False).plan(DETAILS[0]).blurred == {}


def test_a_target_that_no_blur_reaches_leaves_none():
    contrast = Shape("box", BOX.parameters, (1.0, 1.0, 1.0))
    plan = planner(Layer((contrast,), 0.2)).plan(DETAILS[0])
    assert plan.blurred == {}
    assert plan.is_rounded_down(0, Layer((contrast,), 0.2)) is False


def test_coarser_details_have_no_more_stops_and_bands():
    made = planner(Layer((DISC,), 0.2), Layer((BOX,), 0.2))
    plans = [made.plan(detail) for detail in DETAILS]
    for finer, coarser in pairwise(plans):
        assert all(a >= b for a, b in zip(finer.stops, coarser.stops, strict=True))
        assert all(a >= b for a, b in zip(finer.bands, coarser.bands, strict=True))


def test_only_what_can_be_blurred_has_a_small_drawing():
    assert planner(Layer((ELLIPSE,), 0.2)).can_be_small
    assert not planner(Layer((ELLIPSE,), 0.2), filters=False).can_be_small
    assert planner(Layer((ELLIPSE,), 0.0), filters=False).can_be_small

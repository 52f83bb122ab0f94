import math

import numpy as np
import pytest

from sdf2vec.export.svg.display import Drawing, Figure
from sdf2vec.export.svg.filter_regions import Region, region_of, shared_regions
from sdf2vec.outlines import ArcOutline, EllipseOutline, PolygonOutline

BLACK = (0.0, 0.0, 0.0)
SIZE = (200.0, 100.0)


def polygon(width: float, height: float) -> PolygonOutline:
    return PolygonOutline(((50.0, 50.0), (50.0 + width, 50.0), (50.0, 50.0 + height)), 0.0)


def regions(*figures: Figure, worth: float = 0.1) -> list[Region]:
    drawing = Drawing(*SIZE, scale=1.0, digits=0, ground=None, items=figures)
    found = shared_regions(drawing, worth)
    return [found[figure] for figure in figures]


@pytest.mark.parametrize("box", [(40.0, 20.0), (100.0, 3.0), (7.0, 90.0)])
def test_a_region_holds_what_a_blur_reaches_and_hardly_more(box: tuple[float, float]) -> None:
    (region,) = regions(Figure(polygon(*box), BLACK, blur=2.0))
    assert not region.in_user_units
    margins = -np.array([region.left, region.top]) * box
    assert (margins >= 6.0 - 1e-9).all()
    assert (margins <= 1.1 * 6.0).all()
    assert np.array([region.width, region.height]) * box == pytest.approx(np.array(box) + 2 * margins)


def test_a_sliver_with_a_wide_blur_takes_the_canvas() -> None:
    wide = [Figure(polygon(150.0, 0.2), BLACK, blur=30.0), Figure(polygon(151.0, 90.0), BLACK, blur=30.0)]
    canvas = Region(-90.0, -90.0, 380.0, 280.0, in_user_units=True)
    assert regions(*wide, worth=10.0) == [canvas, canvas]


@pytest.mark.parametrize("height", [0.0, 0.4])
def test_what_has_no_height_but_a_stroke_has_a_region_in_user_units(height: float) -> None:
    """Shares of a box without a height are none: renderers would not draw it."""
    bar = PolygonOutline(((50.0, 50.0), (90.0, 50.0), (90.0, 50.0 + height)), 10.0)
    (region,) = regions(Figure(bar, BLACK, blur=2.0))
    assert region == Region(-6.0, -6.0, 212.0, 112.0, in_user_units=True)


def test_the_region_of_a_stroke_holds_it_and_what_a_blur_reaches() -> None:
    """Its element's box is that of its middle line, here 40 wide and 20 high, and does not hold its width."""
    half_turn = Figure(ArcOutline((30.0, 60.0), (70.0, 60.0), -20.0, 5.0), BLACK, blur=2.0)
    assert region_of(half_turn) == pytest.approx(Region(19.0, 29.0, 62.0, 42.0, True), abs=1.01)
    (shared,) = regions(half_turn)
    assert np.array(shared[:4]) * (40, 20, 40, 20) == pytest.approx([-11, -11, 62, 42], abs=2.0)


def test_a_turned_ellipse_has_units_of_its_own_and_keeps_its_box() -> None:
    ellipse = EllipseOutline((50.0, 50.0), (250.0, 0.5), 0.5)
    sliver = Figure(polygon(500.0, 1.0), BLACK, blur=30.0)
    found = regions(sliver, Figure(ellipse, BLACK, blur=30.0), worth=0.0)
    assert [region.in_user_units for region in found] == [True, False]


def test_figures_share_a_region_where_a_filter_costs_more_than_its_pixels() -> None:
    figures = [Figure(polygon(20.0, 20.0 + step), BLACK, blur=2.0) for step in range(4)]
    assert len(set(regions(*figures, worth=0.0))) > 1
    assert len(set(regions(*figures, worth=0.1))) == 1


def test_blurs_share_nothing() -> None:
    figures = [Figure(polygon(20.0, 20.0), BLACK, blur=blur) for blur in (2.0, 3.0)]
    first, second = regions(*figures, worth=math.inf)
    assert first.left == pytest.approx(-0.3)
    assert second.left == pytest.approx(-0.45)


def test_very_many_figures_are_told_apart_by_fewer_steps() -> None:
    boxes = np.random.default_rng(0).uniform(5.0, 90.0, (600, 2)).tolist()
    figures = [Figure(polygon(*box), BLACK, blur=3.0) for box in boxes]
    found = regions(*figures, worth=0.0)
    assert len(set(found)) < 150
    margins = -np.array([[region.left, region.top] for region in found]) * boxes
    assert (margins >= 9.0 - 1e-9).all()

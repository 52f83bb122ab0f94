"""Coverage said by gradients: where they reach, what they are made of."""

from typing import Any

import numpy as np
import pytest

from sdf2vec import Layer, Scene, Shape
from sdf2vec.export.svg.canvas import Canvas
from sdf2vec.export.svg.display import LinearGradient, RadialGradient
from sdf2vec.export.svg.gradients import SoftEdge, ellipse, radial, sliced
from sdf2vec.export.svg.sampling import edge_range
from sdf2vec.outlines import EllipseOutline

CANVAS = Canvas.of(Scene(300, 200, (), None))
EDGE = SoftEdge((1.0, 0.5, 0.0), 0.75, 20.0)
REACH = 20.0 * edge_range()[1]


def test_a_disc_reaches_as_far_as_its_coverage():
    """Radius 0.25 is 50 user units; half of the falloff of 20 outside, coverage is one half."""
    figure = ellipse(EllipseOutline((0.0, 0.0), (0.25, 0.25)), EDGE, CANVAS)
    gradient = figure.fill
    assert isinstance(gradient, RadialGradient)
    assert gradient.center == (150.0, 100.0)
    assert gradient.radii == pytest.approx((50.0 + REACH, 50.0 + REACH))
    assert figure.opacity == 0.75
    offsets, covers = np.array([(stop.offset, stop.opacity) for stop in gradient.stops]).T
    assert (offsets[-1], covers[-1]) == (pytest.approx(1.0), 0.0)
    assert np.interp(60.0 / (50.0 + REACH), offsets, covers) == pytest.approx(0.5, abs=0.01)


def test_a_square_is_a_slice_beyond_each_side_and_each_corner():
    corners = np.array([[100.0, 50.0], [200.0, 50.0], [200.0, 150.0], [100.0, 150.0]])
    slices: Any = sliced(corners, 0.0, EDGE, CANVAS).items
    kinds = [type(figure.fill) for figure in slices]
    assert kinds == [LinearGradient] * 4 + [RadialGradient] * 4
    assert not any(figure.antialiased for figure in slices)
    points = np.concatenate([figure.geometry.points for figure in slices])
    assert points.min(axis=0) == pytest.approx([100.0 - REACH, 50.0 - REACH], abs=0.05)
    assert points.max(axis=0) == pytest.approx([200.0 + REACH, 150.0 + REACH], abs=0.05)
    lengths = [np.ptp([f.fill.start, f.fill.end], axis=0).max() for f in slices[:4]]
    assert lengths == pytest.approx([REACH] * 4)


def test_a_point_is_a_whole_turn():
    slices = sliced(np.array([[150.0, 100.0]]), 5.0, EDGE, CANVAS).items
    (figure,) = slices
    assert isinstance(figure.fill, RadialGradient)
    assert figure.fill.radii == pytest.approx((5.0 + REACH, 5.0 + REACH))


def test_a_gaussian_is_one_gradient():
    shape = Shape.of("gaussian", (1, 0, 0), center=(0, 0), radii=(0.1, 0.05), angle=0.0)
    figure: Any = radial(Layer((shape,), 0.0, 0.5), (1.0, 0.0, 0.0), CANVAS)
    assert figure.opacity == 0.5
    covers = [stop.opacity for stop in figure.fill.stops]
    assert covers[0] == pytest.approx(1.0, abs=0.01)
    assert covers[-1] == pytest.approx(0.0, abs=0.01)
    assert covers == sorted(covers, reverse=True)
    across, down = figure.geometry.radii
    assert across == pytest.approx(2 * down, rel=1e-6)

"""Layers as items of the display list."""

import numpy as np
import pytest

from sdf2vec import Joint, Layer, Scene, Shape
from sdf2vec.export.svg.display import Figure, Group, LinearGradient, Outlines, Path, RadialGradient
from sdf2vec.export.svg.layers import drawing
from sdf2vec.export.svg.plan import DETAILS, Planner
from sdf2vec.outlines import EllipseOutline, PolygonOutline
from tests.export.svg.drawings import Parameters

RED, BLUE = (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)
DISC = Shape.of("circle", RED, center=(0, 0), radius=0.25)
CORNERS: Parameters = {"a": (0, -0.4), "b": (0.3, 0.2), "c": (-0.3, 0.2)}


def items(*layers, filters=False):
    planner = Planner(Scene(300, 200, layers, (0.0, 0.0, 0.0)), filters)
    return drawing(planner.scene, planner.plan(DETAILS[0]), DETAILS[0]).items


def test_a_sharp_disc_is_an_ellipse_of_its_colour():
    (figure,) = items(Layer((DISC,), 0.0, 0.5))
    assert figure == Figure(EllipseOutline((150.0, 100.0), (50.0, 50.0), 0.0), RED, 0.5, name="circle-1")


def test_a_soft_disc_is_one_gradient_and_a_soft_triangle_slices():
    disc, triangle = items(Layer((DISC,), 0.1), Layer((Shape.of("triangle", BLUE, **CORNERS),), 0.1))
    assert isinstance(disc.fill, RadialGradient)
    assert isinstance(triangle, Group)
    assert triangle.name == "triangle-2"
    assert all(isinstance(figure.geometry, PolygonOutline) for figure in triangle.items)


def test_a_linear_paint_fills_the_outline_with_its_gradient():
    painted = Shape.of(
        "circle", RED, paint="linear", color_end=BLUE, direction=(0.5, 0), center=(0, 0), radius=0.25
    )
    (figure,) = items(Layer((painted,), 0.0))
    assert isinstance(figure.fill, LinearGradient)
    assert isinstance(figure.geometry, EllipseOutline)


@pytest.mark.parametrize("filters", [False, True])
def test_what_has_no_outline_is_traced_and_what_is_nowhere_left_out(filters):
    shape = Shape.of("displaced", RED, center=(0, 0), radius=0.3, amplitude=0.05, frequency=(9, 9))
    nowhere = Shape.of("displaced", RED, center=(50, 0), radius=0.3, amplitude=0.05, frequency=(9, 9))
    sharp, *rest = items(Layer((shape,), 0.0), Layer((nowhere,), 0.0), filters=filters)
    assert isinstance(sharp.geometry, Path)
    assert rest == []


def test_soft_bands_are_rings_with_filters_and_steps_without():
    shape = Shape.of("displaced", (1, 1, 1), center=(0, 0), radius=0.3, amplitude=0.05, frequency=(9, 9))
    (rings,), (steps,) = (items(Layer((shape,), 0.5), filters=filters) for filters in (True, False))
    assert not any(figure.antialiased for figure in rings.items)
    assert all(figure.antialiased for figure in steps.items)
    assert [len(figure.geometry.contours) for figure in rings.items[:-1]] == [2] * (len(rings.items) - 1)
    assert {len(figure.geometry.contours) for figure in steps.items} == {1}


def cut(x, radius, smoothness=0.0, join="subtraction"):
    """The disc joined with another at some place."""
    other = Shape.of("circle", RED, center=(x, 0), radius=radius)
    return Layer((DISC, other), 0.0, 1.0, (Joint(join, smoothness),))


@pytest.mark.parametrize("layer", [cut(0.05, 0.1), cut(0.05, 0.1, 0.003), cut(0.6, 0.1, join="union")])
def test_edges_that_do_not_cross_are_those_of_the_shapes(layer):
    (figure,) = items(layer)
    assert isinstance(figure.geometry, Outlines)
    radii = [outline.radii for outline in figure.geometry.each if isinstance(outline, EllipseOutline)]
    assert np.allclose(radii, [(50, 50), (20, 20)])


@pytest.mark.parametrize(
    "layer",
    [cut(0.2, 0.1), cut(0.15, 0.1), cut(0.6, 0.1), cut(0.05, 0.1, 0.05), cut(0.05, 0.1, join="union")],
    ids=["crossing", "touching", "a cutter outside", "a smooth cut", "one within the other"],
)
def test_edges_that_are_not_those_of_the_shapes_are_traced(layer):
    (figure,) = items(layer)
    assert isinstance(figure.geometry, Path)

"""Layers as items of the display list."""

import numpy as np
import pytest

from sdf2vec import Joint, Layer, Scene, Shape
from sdf2vec.export.svg.display import Arc, Figure, Group, LinearGradient, Path, RadialGradient
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
    assert isinstance(figure.geometry, Path)
    arcs = [segment for contour in figure.geometry.contours for segment in contour.segments]
    radii = [arc.radii for arc in arcs if isinstance(arc, Arc)]
    assert np.allclose(radii, [(50, 50)] * 2 + [(20, 20)] * 2, atol=0.02)  # halves that renderers make larger


@pytest.mark.parametrize(
    ("layer", "contours"),
    [
        (cut(0.2, 0.1), 1),
        (cut(0.6, 0.1), 1),
        (cut(0.05, 0.1, join="union"), 1),
        (cut(0.6, 0.1, join="union"), 2),
    ],
    ids=["crossing", "a cutter outside", "one within the other", "apart"],
)
def test_edges_are_made_of_those_of_the_shapes(layer, contours):
    (figure,) = items(layer)
    assert isinstance(figure.geometry, Path)
    assert len(figure.geometry.contours) == contours
    assert all(isinstance(each, Arc) for contour in figure.geometry.contours for each in contour.segments)


def test_the_edge_of_a_smooth_cut_is_traced():
    (figure,) = items(cut(0.05, 0.1, 0.05))
    assert isinstance(figure.geometry, Path)
    assert all(contour.is_curved for contour in figure.geometry.contours)

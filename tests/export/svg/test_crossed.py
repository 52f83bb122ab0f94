"""Outlines of shapes that are joined sharply and cross: corners by hand, and drawn by an engine."""

import math
import re

import numpy as np
import pytest

from sdf2vec import Joint, Layer, Scene, Shape, exported, render
from sdf2vec.engines import ENGINES
from sdf2vec.export.svg.canvas import Canvas
from sdf2vec.export.svg.crossed import crossed
from sdf2vec.export.svg.display import Arc, Path

BLUE = (0.1, 0.2, 0.8)
CANVAS = Canvas(100.0, 100.0, 100.0, 3)  # user units: hundredths of the canvas, from its upper left corner
WAVY = Shape.of("displaced", BLUE, center=(0.1, 0.0), radius=0.2, amplitude=0.02, frequency=(30.0, 30.0))


def circle(x, y, radius):
    return Shape.of("circle", BLUE, center=(x, y), radius=radius)


def box(x, y, across, down, angle=0.0, corner=0.0):
    return Shape.of("box", BLUE, center=(x, y), half_size=(across, down), angle=angle, corner_radius=corner)


def pen(a, b, sagitta, half):
    return Shape.of("arc", BLUE, a=a, b=b, sagitta=sagitta, half_width=half)


def joined(*shapes, falloff=0.0, smoothness=0.0):
    """A layer of a shape and of pairs of a join and another."""
    first, *others = shapes
    joints = tuple(Joint(join, smoothness) for join, _ in others)
    return Layer((first, *(shape for _, shape in others)), falloff, 1.0, joints)


def outline(layer, off=0.05) -> Path:
    found = crossed(layer, CANVAS, off)
    assert found is not None
    return found


def test_a_lens_is_two_arcs_from_corner_to_corner():
    """Circles of radius 0.25 whose centres are 0.3 apart cross at ±√(0.25² − 0.15²) = ±0.2."""
    lens = joined(circle(-0.15, 0.0, 0.25), ("intersection", circle(0.15, 0.0, 0.25)))
    (contour,) = outline(lens).contours
    assert sorted(map(tuple, np.round(contour.points, 3).tolist())) == [(50.0, 30.0), (50.0, 70.0)]
    for segment in contour.segments:
        assert isinstance(segment, Arc)
        assert segment.radii == pytest.approx((25, 25))
        assert (segment.is_clockwise, segment.is_large) == (True, False)


def test_what_is_cut_out_is_gone_round_the_other_way():
    """Half a turn of a circle of which a box takes the lower half, and three sides of a notch."""
    bowl = joined(circle(0.0, 0.0, 0.4), ("subtraction", box(0.0, 0.25, 0.5, 0.25)))
    (contour,) = outline(bowl).contours
    arcs = [segment for segment in contour.segments if isinstance(segment, Arc)]
    assert all(arc.is_clockwise and arc.radii == pytest.approx((40, 40)) for arc in arcs)
    assert len(arcs) == 2  # half a turn in one would hang on how its radius is rounded
    assert sorted(map(tuple, np.round(contour.points, 3).tolist())) == [(10, 50), (50, 10), (90, 50)]
    bitten = joined(circle(0.0, 0.0, 0.4), ("subtraction", circle(0.4, 0.0, 0.2)))
    (contour,) = outline(bitten).contours
    ways = {
        round(segment.radii[0]): segment.is_clockwise
        for segment in contour.segments
        if isinstance(segment, Arc)
    }
    assert ways == {40: True, 20: False}


def test_a_cross_has_twelve_corners():
    cross = joined(box(0.0, 0.0, 0.4, 0.1), ("union", box(0.0, 0.0, 0.1, 0.3)))
    (contour,) = outline(cross).contours
    found = {tuple(point) for point in np.round(contour.points, 3).tolist()}
    inner = {(40 + 20 * i, 40 + 20 * j) for i in range(2) for j in range(2)}
    outer = {(10 + 80 * i, 40 + 20 * j) for i in range(2) for j in range(2)}
    assert found == inner | outer | {(40 + 20 * i, 20 + 60 * j) for i in range(2) for j in range(2)}


def test_a_hole_that_nothing_crosses_is_a_contour_of_its_own():
    pierced = joined(
        circle(0.0, 0.0, 0.4), ("union", box(0.4, 0.0, 0.1, 0.05)), ("subtraction", circle(0.0, 0.1, 0.1))
    )
    hole = min(outline(pierced).contours, key=lambda contour: len(contour.segments))
    assert all(isinstance(segment, Arc) and not segment.is_clockwise for segment in hole.segments)
    assert np.hypot(*(np.array(hole.points) - (50, 60)).T) == pytest.approx(10, abs=0.01)


def test_an_edge_is_where_coverage_is_one_half():
    """Half a falloff outside of what is joined, and as much within what is cut out."""
    soft = joined(circle(0.0, 0.0, 0.3), ("subtraction", circle(0.3, 0.0, 0.2)), falloff=0.02)
    (contour,) = outline(soft).contours
    radii = {round(segment.radii[0], 3) for segment in contour.segments if isinstance(segment, Arc)}
    assert radii == {31.0, 19.0}


def test_a_stroke_out_of_which_a_disc_is_cut():
    """Half a turn around the middle by a pen of 10 units: its edges are of radii 35 and 25, its ends of 5."""
    stroke = joined(pen((-0.3, 0.0), (0.3, 0.0), -0.3, 0.05), ("subtraction", circle(0.0, -0.3, 0.1)))
    found = [segment for contour in outline(stroke).contours for segment in contour.segments]
    assert all(isinstance(segment, Arc) for segment in found)
    assert {round(arc.radii[0], 3) for arc in found if isinstance(arc, Arc)} == {35.0, 25.0, 10.0, 5.0}
    lower = [
        point for contour in outline(stroke).contours for point in contour.points if round(point[1]) == 50
    ]
    assert sorted({(round(x), round(y)) for x, y in lower}) == [(15, 50), (25, 50), (75, 50), (85, 50)]


@pytest.mark.parametrize(
    "layer",
    [
        joined(circle(-0.1, 0.0, 0.2), ("union", circle(0.1, 0.0, 0.2)), smoothness=0.05),
        joined(circle(0.0, 0.0, 0.2), ("union", WAVY)),
        joined(circle(0.0, 0.0, 0.2), ("subtraction", box(0.0, 0.0, 0.4, 0.4))),
        joined(circle(0.0, 0.0, 0.3), ("subtraction", circle(0.0, 0.0, 0.01)), falloff=0.02),
        Layer((circle(0.0, 0.0, 0.2),)),
        joined(pen((-0.1, 0.0), (0.1, 0.0), -0.1, 0.15), ("union", circle(0.2, 0.0, 0.1))),
    ],
    ids=["smooth", "no-outline", "nothing-left", "no-hole", "alone", "wider than its radius"],
)
def test_what_is_not_made_of_lines_and_arcs_is_none(layer):
    assert crossed(layer, CANVAS, 0.05) is None


def some_layer(generator):
    """Two to four shapes at random, joined at random."""
    shapes = []
    for _ in range(generator.integers(2, 5)):
        x, y, size, other, turn = generator.uniform((-0.2, -0.2, 0.08, 0.08, 0.0), (0.2, 0.2, 0.3, 0.3, 3.1))
        corners = np.stack(
            [np.cos(turn + np.arange(3) * 2.1), np.sin(turn + np.arange(3) * 2.1)], 1
        ) * size + (x, y)
        a, b, c = map(tuple, corners.tolist())
        shapes.append(
            [
                circle(x, y, size),
                box(x, y, size, other, turn, generator.choice([0.0, 0.03])),
                Shape.of("ellipse", BLUE, center=(x, y), radii=(size, other), angle=turn),
                Shape.of("triangle", BLUE, a=a, b=b, c=c),
                pen(a, b, generator.choice([0.0, other, -other]), 0.04),
            ][generator.integers(5)]
        )
    joins = generator.choice(["union", "subtraction", "intersection"], len(shapes) - 1)
    return joined(shapes[0], *zip(joins.tolist(), shapes[1:], strict=True))


# not 3: an ellipse crosses a side twice within less than lies between the places that are looked at, so it is traced
@pytest.mark.parametrize("seed", [0, 1, 2, *range(4, 13)])
def test_an_engine_draws_what_the_shapes_are(seed):
    """At the picture's size and at another, beside the render; and the edge is nowhere a curve."""
    generator = np.random.default_rng(seed)
    layer = some_layer(generator)
    scene = Scene(300, 200, (layer,), (1.0, 1.0, 1.0))
    text = str(exported(scene, "svg", svg_fidelity="exact").data)
    assert "c" not in "".join(re.findall(r' d="([^"]*)"', text))
    for width, height in ((300, 200), (1000, 667)):
        off = (
            np.asarray(ENGINES["resvg"].render(text, width, height))[..., :3]
            - render(scene, width, height)[..., :3]
        )
        assert -10 * math.log10(np.mean(off**2) + 1e-9) > 42
        assert abs(off.mean()) < 4e-4  # a tenth of a level

"""The display list as text: what is said once, numbers and ids; compared with what a person would write."""

import math
import re
from xml.etree import ElementTree

import pytest

from sdf2vec.export.svg.display import (
    Contour,
    Drawing,
    Figure,
    Group,
    LinearGradient,
    Path,
    RadialGradient,
    Stop,
)
from sdf2vec.export.svg.writer import Style, number, written
from sdf2vec.outlines import ArcOutline, EllipseOutline, PolygonOutline, RectangleOutline

NAMESPACE = "{http://www.w3.org/2000/svg}"
RED, BLUE = (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)
FADE = (Stop(0.0, RED), Stop(1.0, RED, 0.0))
DISC = EllipseOutline((20.0, 30.0), (10.0, 10.0))
SQUARE = PolygonOutline(((0.0, 0.0), (9.0, 0.0), (9.0, 9.0), (0.0, 9.0)), 0.0)


def text_of(*items, style=None, digits=1):
    return written(Drawing(100, 50, 2.0, digits, None, items), "a <title>", style or Style())


def parsed(*items, **options):
    return ElementTree.fromstring(text_of(*items, **options))


def last(*items, **options):
    return parsed(*items, **options)[-1]


def test_the_whole_document():
    plain = Figure(RectangleOutline((50.0, 25.0), (10.0, 5.0), 0.0, 0.0), BLUE, name="box-1")
    text = text_of(plain, style=Style(sized=True))
    name = re.findall(r'id="(s[0-9a-f]{5})box-1"', text)[0]
    assert text == (
        '<svg height="100" role="img" viewBox="0 0 100 50" width="200" xmlns="http://www.w3.org/2000/svg">\n'
        "<title>a &lt;title&gt;</title><!-- Made with sdf2vec -->\n"
        f'<rect fill="#00f" height="10" id="{name}box-1" width="20" x="40" y="20"/>\n</svg>\n'
    )


@pytest.mark.parametrize(
    ("value", "text"), [(0.5, ".5"), (-0.04, "0"), (-0.25, "-.2"), (12.0, "12"), (100.0, "100")]
)
def test_numbers_are_short(value, text):
    assert number(value, 1) == text


def test_equal_definitions_are_written_once():
    gradients = [LinearGradient((0.0, 0.0), (end, 0.0), FADE) for end in (9.0, 9.0004, 8.0)]
    root = parsed(*(Figure(DISC, gradient) for gradient in gradients))
    assert len(root.findall(f"{NAMESPACE}defs/*")) == 2
    fills = [circle.get("fill") for circle in root.iter(f"{NAMESPACE}circle")]
    assert fills[0] == fills[1] != fills[2]


def test_a_disc_and_its_own_gradient_are_in_shares_of_its_box():
    root = parsed(Figure(DISC, RadialGradient(DISC.center, DISC.radii, FADE)))
    (gradient,) = root.findall(f"{NAMESPACE}defs/*")
    assert set(gradient.attrib) == {"id"}
    assert [(s.get("offset"), s.get("stop-opacity")) for s in gradient] == [("0", None), ("1", "0")]


@pytest.mark.parametrize(
    ("geometry", "transform"),
    [
        (SQUARE, "translate(5 3)rotate(30)scale(1 .5)"),
        (EllipseOutline((5.0, 3.0), (6.0, 2.0), 0.0), "rotate(30)scale(1 .5)"),
        (EllipseOutline((5.0, 3.0), (6.0, 2.0), math.pi / 6), "scale(1 .5)"),
        (EllipseOutline((4.0, 3.0), (6.0, 2.0), math.pi / 2), "translate(0 -1)rotate(120)scale(1 .5)"),
    ],
    ids=["a polygon", "an ellipse around it", "turned as it is", "turned elsewhere"],
)
def test_a_squeezed_radial_gradient_is_in_the_element_s_own_units(geometry, transform):
    """Its middle is (5, 3) and its long axis 30° down from x."""
    root = parsed(Figure(geometry, RadialGradient((5.0, 3.0), (8.0, 4.0), FADE, math.pi / 6)))
    (gradient,) = root.findall(f"{NAMESPACE}defs/*")
    assert gradient.get("gradientTransform") == transform
    assert [gradient.get(name) for name in ("cx", "cy", "r")] == ["0", "0", "8"]


def test_a_round_one_has_its_middle():
    root = parsed(Figure(DISC, RadialGradient((5.0, 3.0), (8.0, 8.0), FADE)))
    (gradient,) = root.findall(f"{NAMESPACE}defs/*")
    assert [gradient.get(name) for name in ("cx", "cy", "r")] == ["5", "3", "8"]


def test_rounded_steps_do_not_add_up():
    """A hundred steps of 0.34 end at 34, not at 30."""
    line = tuple(((0.34 * i, 0.0),) for i in range(1, 101))
    data = last(Figure(Path((Contour((0.0, 0.0), line),)), RED)).get("d", "")
    steps = [float(v) for v in re.findall(r"-?(?:\d+\.?\d*|\.\d+)", data)]
    assert sum(steps[2::2]) == pytest.approx(34.0, abs=0.051)


def test_a_group_says_what_its_figures_share():
    path = Path((Contour((0.0, 0.0), (((9.0, 0.0),), ((9.0, 9.0),))),))
    group = last(Group(tuple(Figure(path, RED, opacity, antialiased=False) for opacity in (0.5, 1.0)), 0.25))
    assert group.attrib == {
        "fill": "#f00",
        "fill-rule": "evenodd",
        "shape-rendering": "crispEdges",
        "opacity": ".25",
    }
    assert [figure.get("fill-opacity") for figure in group] == [".5", None]


@pytest.mark.parametrize("angle", [0.0, 0.7])
def test_a_filter_leaves_room_for_the_blur(angle):
    """Three standard deviations on each side of the element's own box, however it is turned."""
    shape = RectangleOutline((50.0, 25.0), (20.0, 2.0), angle, 0.0)
    (filter_,) = parsed(Figure(shape, RED, 0.5, blur=3.0)).findall(f"{NAMESPACE}defs/*")
    for start, size, side in (("x", "width", 40.0), ("y", "height", 4.0)):
        margin = -float(filter_.get(start, "nan")) * side
        assert margin >= 9.0
        assert float(filter_.get(size, "nan")) * side == pytest.approx(side + 2 * margin)
    assert [e.get("slope") for e in filter_.iter(f"{NAMESPACE}feFuncA")] == [".5"]


def test_compact_words():
    """Colour once, softness and the usual rounding as a class, another rounding as a stroke's width."""
    corners = ((10.0, 10.0), (30.0, 10.0), (10.0, 30.0))
    figures = [Figure(PolygonOutline(corners, r), RED, 0.5, blur=2.0) for r in (4.0, 4.0, 7.0)]
    root = parsed(*figures, style=Style(named=False, compact=True), digits=0)
    usual, again, other = root[-1]
    assert usual.attrib == again.attrib
    assert usual.attrib["color"] == "#f00"
    assert usual.attrib["d"] in ("m10 10 20 0-20 20z", "m30 10-20 20 0-20z", "m10 30 0-20 20 0z")
    assert "stroke-width" not in usual.attrib
    assert other.get("stroke-width") == "14"
    rules, colors = root.findtext(f"{NAMESPACE}style", ""), ";fill:currentColor;stroke:currentColor"
    assert re.search(rf"\.{usual.get('class')}{{filter:url\(#\w+\){colors};stroke-width:8}}", rules)
    assert re.search(rf"\.{other.get('class')}{{filter:url\(#\w+\){colors}}}", rules)


def test_a_bent_stroke_is_not_filled():
    """Neither by itself, nor in a run with straight ones, nor where a class says its colour."""
    bent, line = (
        ArcOutline((10.0, 20.0), (30.0, 20.0), -4.0, 2.0),
        ArcOutline((40.0, 9.0), (40.0, 30.0), 0.0, 2.0),
    )
    made = last(Figure(bent, RED, 0.5))
    assert made.attrib == {
        "d": "M10 20a14.5 14.5 0 0 1 20 0",  # its radius is (10² + 4²) / 8
        "fill": "none",
        "stroke": "#f00",
        "stroke-width": "4",
        "stroke-linecap": "round",
        "opacity": ".5",
    }
    compact = Style(named=False, compact=True)
    (run,) = last(Figure(line, RED), Figure(bent, RED), style=compact)
    assert run.get("d") == "M40 9l0 21M10 20a14.5 14.5 0 0 1 20 0"
    assert run.get("fill") == "none"
    (straight,) = last(Figure(line, RED), style=compact)
    assert straight.get("fill") is None
    root = parsed(Figure(bent, RED, 0.5, blur=2.0), style=compact)
    rule = root.findtext(f"{NAMESPACE}style", "")
    assert ";fill:none;stroke:currentColor;stroke-width:4}" in rule


def test_more_than_half_a_turn_is_the_larger_part():
    nearly_round = ArcOutline((19.0, 20.0), (21.0, 20.0), -20.0, 1.0)
    data = last(Figure(nearly_round, RED)).get("d")
    assert (
        len(re.findall("a10", data)) + len(re.findall(" 10 10", data)) == 3
    )  # whatever its radius is rounded to


def test_a_turned_ellipse():
    made = last(Figure(EllipseOutline((20.0, 30.0), (10.0, 5.0), math.pi / 6), RED))
    assert made.attrib == {"rx": "10", "ry": "5", "transform": "translate(20 30)rotate(30)", "fill": "#f00"}


def test_each_contour_of_several_begins_where_it_is():
    """A second `m` would count from where the first contour began."""
    contours = [Contour.straight(((x, x), (x + 4.0, x), (x, x + 4.0))) for x in (10.0, 20.0)]
    assert last(Figure(Path(tuple(contours)), RED), digits=0).get("d") == "M10 10l4 0-4 4zM20 20l4 0-4 4z"
    assert last(Figure(Path(tuple(contours[:1])), RED), digits=0).get("d") == "m10 10 4 0-4 4z"

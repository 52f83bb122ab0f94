"""Lines of one pen in small drawings: one path for all that follow each other, drawn by real engines."""

import re
from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest

from sdf2vec import Layer, Scene, Shape
from sdf2vec.engines import ENGINES
from sdf2vec.export.options import Options
from sdf2vec.export.svg import small_svg
from sdf2vec.fit.drawable import rounded
from sdf2vec.grain import USUAL
from tests.export.svg.drawings import BLACK, NAMESPACE, ORANGE, WHITE, rendered

GRAIN = USUAL[-1]
ENDS = [((-0.5, 0.1), (-0.1, 0.1)), ((-0.1, 0.1), (0.1, -0.3)), ((0.1, -0.3), (0.5, 0.3))]


def stroke(start, end, half=0.06, color=ORANGE):
    (ax, ay), (bx, by) = start, end
    length = np.hypot(bx - ax, by - ay)
    shape = Shape.of(
        "box",
        color,
        center=((ax + bx) / 2, (ay + by) / 2),
        half_size=(length / 2 + half, half),
        angle=float(np.arctan2(by - ay, bx - ax)),
        corner_radius=half * 0.999,
    )
    return Layer((shape,))


def arc(start, end, sagitta, half=0.06):
    return Layer((Shape.of("arc", ORANGE, a=start, b=end, sagitta=sagitta, half_width=half),))


LINES = Scene(150, 100, tuple(stroke(*ends) for ends in ENDS), BLACK)
BENT = Scene(150, 100, tuple(map(arc, *zip(*ENDS, strict=True), (0.0, -0.25, 0.5))), BLACK)


def drawing_of(scene):
    return str(small_svg(rounded(scene, GRAIN), Options(), GRAIN).data)


def paths_of(scene):
    root = ElementTree.fromstring(drawing_of(scene))
    return [path.get("d", "") for path in root.iter(f"{NAMESPACE}path")]


def test_lines_of_one_pen_are_one_path_of_as_many_parts():
    (data,) = paths_of(LINES)
    assert re.fullmatch(r"(M-?\d+ ?-?\d+l-?\d+ ?-?\d+){3}", data)


@pytest.mark.parametrize(
    "other",
    [stroke(*ENDS[1], color=WHITE), stroke(*ENDS[1], half=0.03), replace(stroke(*ENDS[1]), opacity=0.5)],
    ids=["another colour", "another width", "translucent"],
)
def test_another_pen_parts_them(other):
    first, _, last = LINES.layers
    assert len(paths_of(Scene(150, 100, (first, other, last), BLACK))) == 3


def test_so_are_arcs():
    """One of them of more than half a turn."""
    (data,) = paths_of(BENT)
    assert [len(re.findall(letter, data)) for letter in "Mla"] == [3, 1, 2]


@pytest.mark.parametrize("scene", [LINES, BENT], ids=["lines", "arcs"])
@pytest.mark.parametrize("size", [(150, 100), (411, 274)])
@pytest.mark.parametrize("name", ["resvg", "librsvg", "chromium", "firefox", "cairosvg", "inkscape"])
def test_engines_draw_them_as_they_are(name, size, scene, require_engine):
    """An antialiased edge differs from engine to engine; half a level is a pixel's tenth of it."""
    require_engine(name)
    wrong = ENGINES[name].render(drawing_of(scene), *size) - rendered(scene, *size)
    assert -10 * np.log10(np.mean(wrong**2)) > 34
    assert abs(wrong[..., :3].mean()) < 0.002

"""Blurs: their standard deviations, turned boxes, half circles, traced contours."""

import math
import random
import re
from xml.etree import ElementTree

import numpy as np
import pytest

from sdf2vec import Layer, Scene, Shape
from sdf2vec.engines import ENGINES
from sdf2vec.export.svg.blur import STEPS, trial_of
from sdf2vec.export.svg.canvas import Canvas
from sdf2vec.export.svg.display import Drawing, Figure
from sdf2vec.export.svg.outlines import placed
from sdf2vec.export.svg.sampling import distances
from sdf2vec.export.svg.writer import Style, written
from sdf2vec.outlines import PolygonOutline
from tests.export.svg.drawings import BLURRING, NAMESPACE, Parameters, off_in, text_of


@pytest.mark.parametrize("engine", BLURRING)
@pytest.mark.parametrize("scale", [1, 2])
def test_at_these_deviations_boxes_are_near_a_gaussian(engine, scale, require_engine):
    """The edge of a half-plane, blurred, is the error function; renderers put boxes in the place of the Gaussian."""
    require_engine(engine)
    side, worst = 120, {}
    x = np.arange(side * scale) + 0.5
    height = side * len(STEPS)  # a half-plane for each, so far from the next that neither sees the other
    region = (
        'filterUnits="userSpaceOnUse" x="-60" width="240" height="240" color-interpolation-filters="sRGB"'
    )
    parts = [
        f'<filter id="f{i}" {region} y="{side * i - 60}"><feGaussianBlur stdDeviation="{deviation}"/>'
        f'</filter><rect x="40" y="{side * i}" width="40" height="{side}" fill="#fff" filter="url(#f{i})"/>'
        for i, deviation in enumerate(STEPS)
    ]
    text = (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{side}" height="{height}" viewBox="0 0 {side} {height}">'
        f'<rect width="100%" height="100%"/>{"".join(parts)}</svg>'
    )
    drawn = ENGINES[engine].render(text, side * scale, height * scale)[..., 0]
    for row, deviation in zip(drawn[side * scale // 2 :: side * scale], STEPS, strict=True):
        spread = deviation * scale * math.sqrt(2)
        exact = [0.5 * (math.erf((v - 40 * scale) / spread) - math.erf((v - 80 * scale) / spread)) for v in x]
        worst[deviation] = float(np.abs(row - exact).max())
    assert max(worst.values()) <= 0.025, worst


@pytest.mark.parametrize("engine", BLURRING)
def test_turned_boxes_are_blurred_alike_in_all_directions(engine, require_engine):
    """librsvg turns standard deviations as if they were distances: what is blurred must not be a turned element."""
    require_engine(engine)
    numbers: Parameters = {"center": (0, 0), "half_size": (0.3, 0.1), "angle": 0.8, "corner_radius": 0.0}
    box = Layer((Shape.of("box", (0.3, 0.3, 0.3), **numbers),), 0.15)
    scene = Scene(300, 200, (box,), (0.2, 0.2, 0.2))
    text = text_of(scene)
    assert "feGaussianBlur" in text
    assert 255 * np.abs(off_in(engine, scene)).max() <= 3


def test_half_circles_are_whole():
    """Ends rounded towards each other would flatten an arc of half a turn by pixels; a small radius grows instead."""
    r = random.Random(1)
    canvas = Canvas.of(Scene(512, 512, (), None))
    for _ in range(100):
        ends = tuple((r.uniform(-0.5, 0.5), r.uniform(-0.5, 0.5)) for _ in range(2))
        outline = placed(PolygonOutline(ends, r.uniform(0.01, 0.2)), canvas)
        drawing = Drawing(512, 512, 1, canvas.digits, None, (Figure(outline, (0, 0, 0)),))
        path = ElementTree.fromstring(written(drawing, "", Style()))[-1]
        move, *arcs = re.findall(r"[A-Z][^A-Z]*", path.get("d", ""))
        corners = [
            [float(v) for v in command[1:].split()][-2:] for command in (move, *arcs) if command != "Z"
        ]
        radii = [float(command[1:].split()[0]) for command in arcs if command[0] == "A"]
        (across, back) = (math.dist(corners[1], corners[2]), math.dist(corners[3], corners[4]))
        assert len(radii) == 2
        assert 2 * radii[0] <= across < 2 * radii[0] + 0.5
        assert 2 * radii[1] <= back < 2 * radii[1] + 0.5


@pytest.mark.parametrize("engine", BLURRING)
def test_a_traced_blur(engine, require_engine):
    """One element for a displaced circle of little contrast, at the fitted size and others."""
    require_engine(engine)
    numbers: Parameters = {"center": (0, 0), "radius": 0.28, "amplitude": 0.03, "frequency": (9, 8)}
    layer = Layer((Shape.of("displaced", (0.5, 0.4, 0.3), **numbers),), 0.12, 0.7)
    scene = Scene(300, 220, (layer,), (0.4, 0.4, 0.4))
    root = ElementTree.fromstring(text_of(scene))
    (path,) = root.findall(f"{NAMESPACE}path")
    assert path.get("filter")
    for size in ((300, 220), (600, 440), (405, 297)):
        off = off_in(engine, scene, size)
        assert 255 * np.abs(off).max() <= 3
        assert abs(off.mean()) <= 0.3 / 255


def test_a_traced_contour_moves_to_where_its_blur_is_one_half():
    """Where an outline bends, its blur lies inside of it."""
    numbers: Parameters = {"center": (0, 0), "radius": 0.1, "amplitude": 0.03, "frequency": (9, 8)}
    layer = Layer((Shape.of("displaced", (1, 1, 1), **numbers),), 0.15)
    trial = trial_of(layer, Canvas.of(Scene(300, 220, (layer,), None)), 128, 128)
    still, *moved = trial.moved(distances(layer, trial.grid) - 0.075, trial.deviation(1.0))
    assert moved[-1].error < 0.7 * still.error

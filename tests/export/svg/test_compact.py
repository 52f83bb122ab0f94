"""The smallest drawing, and those between it and the finest."""

import gzip
import random
from dataclasses import replace
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest

from sdf2vec import Layer, Scene, Shape
from sdf2vec.engines import ENGINES
from sdf2vec.export.exported import MARK
from sdf2vec.export.options import Options
from sdf2vec.export.svg import small_svg
from sdf2vec.fit import settling
from sdf2vec.fit.drawable import rounded
from sdf2vec.grain import GRAINS
from tests.export.svg.drawings import BLACK, NAMESPACE, ORANGE, made, rendered, text_of, triangle
from tests.scenes import random_shape


def test_the_smallest_drawing_says_a_triangle_in_few_bytes():
    """Whole coordinates, three digits of colour, one of opacity, three blurs: gzipped, at most 17.5 bytes a triangle at
    256, the mark of who made it left out."""
    r = random.Random(7)
    layers = []
    for _ in range(256):
        x, y = r.uniform(-0.5, 0.5), r.uniform(-0.5, 0.5)
        corners: dict[str, Any] = {name: (x + r.gauss(0, 0.15), y + r.gauss(0, 0.15)) for name in "abc"}
        color = (r.random(), r.random(), r.random())
        layers.append(
            Layer((Shape.of("triangle", color, **corners),), r.uniform(0.01, 0.2), r.uniform(0.4, 1.0))
        )
    scene = Scene(256, 256, tuple(layers), (0.5, 0.5, 0.5))
    text = str(small_svg(rounded(scene, GRAINS[-1]), Options(svg_size="fixed"), GRAINS[-1]).data)
    root = ElementTree.fromstring(text)
    assert root.get("viewBox") == "0 0 160 160"
    groups = [element for element in root if element.tag == f"{NAMESPACE}g"]
    paths = list(root.iter(f"{NAMESPACE}path"))
    assert len(groups) <= 3
    assert all("url(#" in group.get("filter", "") for group in groups)
    assert len(paths) == 256
    fills = [path.get("fill", group.get("fill", "")) for group in groups for path in group]
    assert {len(fill) for fill in fills} == {4}  # of a run of one its group says it
    for path in paths:
        assert len(path.get("opacity", ".1")) == 2
        assert "." not in path.get("d", ".")
    assert len(gzip.compress(text.replace(f"<!-- {MARK} -->", "").encode(), 9)) <= 4480


@pytest.mark.usefixtures("drawn_once")
@pytest.mark.parametrize("softest", [0.0, 0.15])
def test_a_tighter_limit_takes_no_more_from_the_picture_than_it_must(softest, require_engine, monkeypatch):
    """From drawing to drawing, each a byte too large for the next limit: smaller and less near, by few dB a step."""
    require_engine("resvg")
    monkeypatch.setattr(settling, "PHASES", [replace(phase, steps=40) for phase in settling.PHASES])
    r = random.Random(9)
    layers = tuple(
        Layer((random_shape(("triangle", "ellipse", "box")[i % 3], r),), r.uniform(0.2, 1.0) * softest, 0.8)
        for i in range(12)
    )
    scene = Scene(160, 120, layers, (0.5, 0.5, 0.5))
    wanted = rendered(scene, 320, 240)
    texts = [text_of(scene)]
    while (last := made(scene, max_bytes=len(texts[-1].encode()) - 1)).met:
        texts.append(str(last.data))
    assert last.data == texts[-1]
    found = [-10 * np.log10(np.mean((ENGINES["resvg"].render(t, 320, 240) - wanted) ** 2)) for t in texts]
    steps = -np.diff(found)
    assert len(steps) >= 5
    assert steps[1:].min() > -1.0, found
    assert (
        steps[0] > -1.5
    )  # where all are sharp the finest small one is nearer: its colours are rounded together
    assert steps.max() < 8.0, found


BLUE = (0.2, 0.4, 1.0)


def rounded_box(x, y, color, falloff=0.0):
    shape = Shape.of("box", color, center=(x, y), half_size=(0.25, 0.15), angle=0.4, corner_radius=0.08)
    return Layer((shape,), falloff, 0.9)


@pytest.mark.parametrize("size", [(150, 100), (411, 274)])
@pytest.mark.parametrize(("name", "softest"), [("inkscape", 0.0), ("inkscape", 0.12), ("cairosvg", 0.0)])
def test_who_takes_a_groups_colour_for_the_current_one_draws_each_shape_in_its_own(
    name, softest, size, require_engine
):
    """Everything was black. CairoSVG blurs nothing, so that only sharp shapes are as they should be."""
    require_engine(name)
    layers = (rounded_box(-0.3, -0.1, ORANGE, softest), rounded_box(0.3, 0.1, BLUE, softest))
    scene = Scene(
        150, 100, (*layers, triangle((-0.2, 0.4), (0.2, 0.4), (0.0, -0.4), falloff=softest / 2)), BLACK
    )
    text = str(small_svg(rounded(scene, GRAINS[0]), Options(), GRAINS[0]).data)
    wrong = ENGINES[name].render(text, *size) - rendered(scene, *size)
    assert -10 * np.log10(np.mean(wrong**2)) > 32
    assert abs(wrong[..., :3].mean()) < 0.005

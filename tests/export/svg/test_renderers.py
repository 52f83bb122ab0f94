"""Every renderer draws the same, also of unions of many colours, the smallest text, and two drawings in one page."""

import math
import random
from xml.etree import ElementTree

import numpy as np
import pytest
import torch

from sdf2vec import Layer, Scene
from sdf2vec.engines import ENGINES, chromium
from sdf2vec.export.options import Options
from sdf2vec.export.svg import svg as write_svg
from sdf2vec.image import premultiply
from sdf2vec.render.reference import render
from tests.export.svg.drawings import NAMESPACE, text_of
from tests.scenes import SOFT, random_shape


@pytest.mark.parametrize("engine", ["resvg", "cairosvg", "chromium"])
def test_unions_of_many_colours_mix_as_in_the_render(engine, require_engine):
    require_engine(engine)
    r = random.Random(2)
    for kind, falloff, opacity in (("circle", 0.05, 0.8), ("triangle", 0.1, 1.0), ("box", 0.0, 1.0)):
        union = Layer.union([random_shape(kind, r) for _ in range(3)], 0.06, falloff, opacity)
        scene = Scene(150, 100, (union,), (0.2, 0.3, 0.4))
        text = text_of(scene, svg_profile="portable")
        for size in ((150, 100), (390, 260)):
            error = ENGINES[engine].render(text, *size) - render(scene, *size).permute(1, 2, 0).numpy()
            assert -10 * np.log10(np.mean(error**2)) >= 39, (kind, size)
            assert abs(error.mean()) <= 1.0 / 255.0


@pytest.mark.parametrize("engine", ["resvg", "chromium", "librsvg"])
def test_the_smallest_drawing_still_looks_like_the_render(engine, require_engine):
    require_engine(engine)
    r = random.Random(5)
    kinds = ("triangle", "box", "circle", "ellipse")
    layers = []
    for index in range(24):
        falloff = (0.0, 0.06, 0.15, 0.3)[index // 4 % 4]
        layers.append(Layer((random_shape(kinds[index % 4], r),), falloff, r.uniform(0.3, 1.0)))
    scene = Scene(300, 200, tuple(layers), (0.3, 0.4, 0.5))
    made = write_svg(scene, Options(svg_size_limit=24 * 178))
    text = made.data
    assert isinstance(text, str)
    (note,) = made.notes
    assert "smallest form" in note
    (group,) = (element for element in ElementTree.fromstring(text) if element.tag == f"{NAMESPACE}g")
    assert len(group) == 24
    for size in ((300, 200), (600, 400)):
        error = ENGINES[engine].render(text, *size) - render(scene, *size).permute(1, 2, 0).numpy()
        assert -10 * np.log10(np.mean(error**2)) >= (34 if engine == "librsvg" else 43)
        assert abs(error.mean()) <= 1.0 / 255.0


FILTERS = ("resvg", "librsvg", "chromium", "firefox")
SIZES = [(150, 100), (300, 200), (260, 110)]  # fitted, twice, and neither that size nor that shape


def off_in(engine, scene, profile, size):
    """Signed differences in levels of 255, [H, W, 4]; beyond the drawing's edges nothing is compared."""
    drawn = premultiply(ENGINES[engine].render(text_of(scene, svg_profile=profile), *size))
    width, height = size
    scale = min(width / scene.width, height / scene.height)
    across, down = (round((n - m * scale) / 2) for n, m in ((width, scene.width), (height, scene.height)))
    expected = render(scene, width, height, dtype=torch.float64).permute(1, 2, 0).numpy()
    inner = np.s_[down : height - down, across : width - across]
    return 255 * (drawn - expected)[inner]


def soft_scene(background=(0.3, 0.4, 0.5)):
    """Twelve soft shapes of all kinds, little and much contrast, some translucent."""
    r = random.Random(3)
    layers = []
    for index in range(12):
        shape = random_shape(sorted(SOFT)[index % 5], r)
        layers.append(Layer((shape,), r.uniform(0.05, 0.4), r.uniform(0.3, 1.0)))
    return Scene(150, 100, tuple(layers), background)


@pytest.mark.parametrize(
    ("engine", "profile"),
    [*((engine, "filters") for engine in FILTERS), *((e, "portable") for e in (*FILTERS, "cairosvg"))],
)
@pytest.mark.parametrize("background", [(0.3, 0.4, 0.5), None], ids=["opaque", "transparent"])
def test_every_renderer_draws_the_same(require_engine, engine, profile, background):
    require_engine(engine)
    scene = soft_scene(background=background)
    for size in SIZES if engine != "firefox" else SIZES[:1]:
        off = off_in(engine, scene, profile, size)
        assert 10 * math.log10(255**2 / np.mean(off**2)) > 40, size
        assert abs(off.mean()) < 0.7, size


def test_two_drawings_in_one_page_do_not_disturb_each_other(require_engine):
    """Inline or as <img>, alone, twice, or with another that has the same kinds of definitions: equal pixels.

    Compared at one place of the page, for browsers dither gradients by place.
    """
    require_engine("chromium")
    one, other = text_of(soft_scene()), text_of(soft_scene(background=(0.9, 0.1, 0.1)))
    image = '<img src="one.svg">'

    def second_in(*drawings):
        style = "<style>*{margin:0}svg,img{display:block}</style>"
        page = f"<!DOCTYPE html>{style}{''.join(drawings)}"
        with chromium.opened({"index.html": page, "one.svg": one}, 150, 300) as opened:
            return chromium.screenshot(opened)[100:200]

    alone = second_in(other, one)
    assert np.abs(alone - second_in(one, other)).max() > 0.2
    for drawings in ((one, one), (image, image, image), (one, image, one), (other, image, other)):
        np.testing.assert_array_equal(second_in(*drawings), alone)

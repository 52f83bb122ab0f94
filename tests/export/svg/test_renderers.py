"""Every renderer draws the same, also of unions of many colours, the smallest text, and two drawings in one page."""

import random

import numpy as np
import pytest

from sdf2vec import Layer, Scene
from sdf2vec.engines import ENGINES, chromium, svgo
from sdf2vec.image import premultiply
from tests.export.svg.drawings import BLURRING, NAMESPACE, decibels, made, off_in, parsed, text_of
from tests.scenes import SOFT, random_shape


@pytest.mark.parametrize("engine", ["resvg", "cairosvg", "chromium"])
def test_unions_of_many_colours_mix_as_in_the_render(engine, require_engine):
    require_engine(engine)
    r = random.Random(2)
    for kind, falloff, opacity in (("circle", 0.05, 0.8), ("triangle", 0.1, 1.0), ("box", 0.0, 1.0)):
        union = Layer.union([random_shape(kind, r) for _ in range(3)], 0.06, falloff, opacity)
        scene = Scene(150, 100, (union,), (0.2, 0.3, 0.4))
        for size in ((150, 100), (390, 260)):
            error = off_in(engine, scene, size, svg_profile="portable")
            assert decibels(error) >= 39, (kind, size)
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
    limit = {"max_bytes": 24 * 178}
    (note,) = made(scene, **limit).notes
    assert "drawn small" in note
    (group,) = (element for element in parsed(scene, **limit) if element.tag == f"{NAMESPACE}g")
    assert len(group) == 24
    for size in ((300, 200), (600, 400)):
        error = off_in(engine, scene, size, **limit)
        assert decibels(error) >= (34 if engine == "librsvg" else 43)
        assert abs(error.mean()) <= 1.0 / 255.0


SIZES = [(150, 100), (300, 200), (260, 110)]  # fitted, twice, and neither that size nor that shape


def within(scene, size):
    """Where a drawing is on a canvas of another shape; beyond its edges nothing is compared."""
    scale = min(size[0] / scene.width, size[1] / scene.height)
    across, down = (
        round((n - m * scale) / 2) for n, m in zip(size, (scene.width, scene.height), strict=True)
    )
    return np.s_[down : size[1] - down, across : size[0] - across]


def soft_scene(background=(0.3, 0.4, 0.5)):
    """Twelve soft shapes of all kinds, little and much contrast, some translucent."""
    r = random.Random(3)
    layers = []
    for index in range(12):
        shape = random_shape(sorted(SOFT)[index % len(SOFT)], r)
        layers.append(Layer((shape,), r.uniform(0.05, 0.4), r.uniform(0.3, 1.0)))
    return Scene(150, 100, tuple(layers), background)


@pytest.mark.parametrize(
    ("engine", "profile"),
    [*((engine, "filters") for engine in BLURRING), *((e, "portable") for e in (*BLURRING, "cairosvg"))],
)
@pytest.mark.parametrize("background", [(0.3, 0.4, 0.5), None], ids=["opaque", "transparent"])
def test_every_renderer_draws_the_same(require_engine, engine, profile, background):
    require_engine(engine)
    scene = soft_scene(background=background)
    for size in SIZES if engine != "firefox" else SIZES[:1]:
        off = off_in(engine, scene, size, svg_profile=profile)[within(scene, size)]
        assert decibels(off) > 40, size
        assert abs(off.mean()) < 0.7 / 255, size


@pytest.mark.parametrize(
    "options", [{}, {"svg_profile": "portable"}, {"max_bytes": 6000}], ids=["filters", "portable", "small"]
)
def test_svgo_leaves_the_picture_as_it_is(options, require_engine):
    """With its default options: which names, groups, numbers and definitions it may change is its business."""
    for engine in ("svgo", "resvg"):
        require_engine(engine)
    scene = soft_scene()
    text = text_of(scene, **options)
    smaller = svgo.optimized(text)
    assert len(smaller) < len(text)
    one, other = (premultiply(ENGINES["resvg"].render(drawing, 300, 200)) for drawing in (text, smaller))
    assert np.square(one - other).mean() <= 1e-5  # 50 dB


def test_two_drawings_in_one_page_do_not_disturb_each_other(require_engine):
    """Inline or as <img>, alone, twice, or with another that has the same kinds of definitions: equal pixels.

    Compared at one place of the page, for browsers dither gradients by place.
    """
    require_engine("chromium")
    one, other = text_of(soft_scene()), text_of(soft_scene(background=(0.9, 0.1, 0.1)))
    image = '<img src="one.svg">'

    def second_in(*drawings):
        style = "<style>*{margin:0}svg,img{display:block;width:150px}</style>"
        page = f"<!DOCTYPE html>{style}{''.join(drawings)}"
        with chromium.opened({"index.html": page, "one.svg": one}, 150, 300) as opened:
            return chromium.screenshot(opened)[100:200]

    alone = second_in(other, one)
    assert np.abs(alone - second_in(one, other)).max() > 0.2
    for drawings in ((one, one), (image, image, image), (one, image, one), (other, image, other)):
        np.testing.assert_array_equal(second_in(*drawings), alone)

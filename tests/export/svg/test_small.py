"""Small drawings of scenes whose numbers they can say, and when one is chosen."""

import gzip
from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest

from sdf2vec import Layer, Scene, Shape, export, exported, fit
from sdf2vec.blend import EDGE_DEVIATION
from sdf2vec.engines import ENGINES
from sdf2vec.export.options import Options
from sdf2vec.export.svg import small_svg
from sdf2vec.fit.drawable import rounded
from sdf2vec.grain import GRAINS
from sdf2vec.image import load, premultiply
from sdf2vec.quality import psnr_of
from sdf2vec.render.draw import draw
from sdf2vec.scene import Joint
from tests.export.svg.drawings import NAMESPACE
from tests.fit.test_drawable import of_kinds
from tests.scenes import random_scene


@pytest.fixture(scope="module")
def picture():
    """Soft discs and a sharp edge, not square."""
    x, y = np.meshgrid(np.linspace(-1.5, 1.5, 150), np.linspace(-1, 1, 100))
    disc = np.exp(-3 * ((x - 0.4) ** 2 + y**2))
    return np.stack([disc, 0.2 + 0.6 * (x + y > 0), np.clip(0.5 + 0.3 * y, 0, 1)], axis=2).astype(np.float32)


@pytest.fixture(scope="module")
def scene(picture):
    return fit(picture, 12, preset="fast", kind="triangle")


def joined(**size):
    """Layers that have no outline of their own, or are painted."""
    joined = random_scene(("circle", "triangle", "box"), layers=6, seed=3, paints=("flat",)).layers
    layers = [
        *random_scene(("displaced", "ellipse"), layers=4, seed=1, paints=("flat",), joins=()).layers,
        *random_scene(("box", "triangle"), layers=4, seed=2, paints=("linear",), joins=()).layers,
        *(replace(layer, falloff=falloff) for layer in joined[2::3] for falloff in (0.0, 0.1)),
    ]
    disc = Shape.of("circle", (0.9, 0.8, 0.1), center=(0.3, 0.1), radius=0.3)
    hole = Shape.of("ellipse", (0, 0, 0), center=(0.35, 0.12), radii=(0.1, 0.15), angle=0.5)
    ring = Layer((disc, hole), 0.0, 1.0, (Joint("subtraction", 0.0),))
    return Scene(layers=(*layers, ring), background=(0.5, 0.5, 0.5), **size)


def drawn_by(engine, text, width, height):
    return premultiply(ENGINES[engine].render(text, width, height))[..., :3]


def assert_as_rendered(engine, text, scene, decibels, levels):
    """At the size fitted and at a larger one; so near, and so many levels off in the mean."""
    for size in ((150, 100), (330, 220)):
        wanted = draw(scene, *size).permute(1, 2, 0).numpy()[..., :3]
        off = drawn_by(engine, text, *size) - wanted
        assert -10 * np.log10(np.mean(off**2)) > decibels
        assert abs(255 * off.mean()) < levels


@pytest.mark.parametrize("engine", ["resvg", "chromium"])
@pytest.mark.parametrize("grain", GRAINS[:3], ids=lambda grain: str(grain.units))
def test_it_is_drawn_as_it_was_fitted(engine, grain, require_engine):
    """Triangles, boxes and circles of all softnesses, at the size fitted and at a larger one."""
    require_engine(engine)
    drawable = rounded(of_kinds(width=150, height=100), grain)
    text = str(small_svg(drawable, Options(), grain).data)
    assert_as_rendered(engine, text, drawable.scene, 30, 1.5)


@pytest.mark.parametrize("engine", ["resvg", "chromium"])
@pytest.mark.parametrize("grain", GRAINS[:3], ids=lambda grain: str(grain.units))
def test_so_are_layers_of_several_shapes_and_gradients(engine, grain, require_engine):
    """Ellipses, displaced circles, unions, cut-outs and a ring, sharp and soft; and paints."""
    require_engine(engine)
    drawable = rounded(joined(width=150, height=100), grain)
    text = str(small_svg(drawable, Options(), grain).data)
    assert "Gradient" in text
    assert_as_rendered(engine, text, drawable.scene, 32, 1.0)


@pytest.mark.parametrize("engine", ["resvg", "firefox"])
@pytest.mark.parametrize("deviation", [0.55, 0.8])
def test_narrow_edges_are_blurred(engine, deviation, require_engine):
    """By less than a pixel, which these renderers do, at the size fitted and at a larger one."""
    require_engine(engine)
    ellipse = Shape.of("ellipse", (1, 1, 0.5), center=(-0.4, 0), radii=(0.3, 0.2), angle=0.3)
    disc = Shape.of("circle", (0, 0.2, 0), center=(0.4, 0), radius=0.25)
    triangle = Shape.of("triangle", (1, 0.2, 0), a=(0.4, -0.15), b=(0.2, 0.1), c=(0.5, 0.1))
    falloff = deviation / EDGE_DEVIATION / 100
    scene = Scene(150, 100, tuple(Layer((s,), falloff) for s in (ellipse, disc, triangle)), (0.5, 0.5, 0.5))
    text = str(small_svg(rounded(scene, GRAINS[0]), Options(), GRAINS[0]).data)
    assert_as_rendered(engine, text, scene, 41, 0.5)


@pytest.mark.parametrize("engine", ["resvg", "chromium", "librsvg"])
@pytest.mark.parametrize("half", [(0.4, 0.06), (0.06, 0.35)])
def test_a_bar_with_round_ends_and_a_soft_edge_is_drawn(engine, half, require_engine):
    """Its outline is a line, upright or level, and a stroke."""
    require_engine(engine)
    bar = Shape.of("box", (1, 0.9, 0.2), center=(-0.2, 0), half_size=half, angle=0, corner_radius=min(half))
    scene = Scene(150, 100, (Layer((bar,), 0.05),), (0.1, 0.2, 0.4))
    text = str(small_svg(rounded(scene, GRAINS[0]), Options(), GRAINS[0]).data)
    assert_as_rendered(engine, text, scene, 34, 1.0)


@pytest.mark.parametrize("units", [512, 1024])
def test_how_far_it_is_off_is_told(units, require_engine):
    """Sharp edges, of which some are not on the grid: boxes, contours, ellipses. Never told as less than half of it."""
    require_engine("resvg")
    (grain,) = (grain for grain in GRAINS if grain.units == units)
    layers = tuple(replace(layer, falloff=0.0) for layer in joined(width=384, height=256).layers)
    drawable = rounded(Scene(384, 256, layers, (0.5, 0.5, 0.5)), grain)
    made = small_svg(drawable, Options(), grain)
    wanted = draw(drawable.scene, 384, 256).permute(1, 2, 0).numpy()[..., :3]
    off = 255.0 * np.sqrt(np.mean((drawn_by("resvg", str(made.data), 384, 256) - wanted) ** 2))
    assert 0.5 * off < made.error < 2.5 * off


def test_the_picture_decides(scene, picture):
    """Of a fit whose picture is given a small drawing, which loses hardly anything of it; else one like the render."""
    small, like_render = exported(scene, "svg", picture=picture), exported(scene, "svg")
    (note,) = small.notes
    assert "drawn small" in note
    assert not like_render.notes
    assert len(gzip.compress(small.raw)) < 0.4 * len(gzip.compress(like_render.raw))
    for fidelity in ("render", "exact"):
        assert "drawn small" not in str(exported(scene, "svg", picture=picture, svg_fidelity=fidelity).notes)


def test_a_union_that_no_gradient_fills_is_drawn_like_the_render():
    colors, places = ((1, 0, 0), (0, 1, 0), (0, 0, 1)), ((-0.2, 0), (0.2, 0), (0, 0.3))
    discs = [Shape.of("circle", c, center=p, radius=0.25) for c, p in zip(colors, places, strict=True)]
    scene = Scene(150, 100, (Layer.union(discs, 0.05, 0.05),), (0.5, 0.5, 0.5))
    shown = draw(scene, 150, 100).permute(1, 2, 0).numpy()[..., :3]
    assert not exported(scene, "svg", picture=shown).notes
    same = replace(scene.layers[0], shapes=tuple(replace(disc, color=(1, 0, 0)) for disc in discs))
    assert "drawn small" in str(exported(replace(scene, layers=(same,)), "svg", picture=shown).notes)


def test_little_of_the_picture_is_lost(scene, picture, require_engine):
    require_engine("resvg")
    text = str(export(scene, "svg", picture=picture))
    off = drawn_by("resvg", text, 150, 100) - picture
    assert -10 * np.log10(np.mean(off**2)) > psnr_of(scene, load(picture)) - 0.6


def test_exact_is_without_blurs(scene):
    assert "feGaussianBlur" not in str(export(scene, "svg", svg_fidelity="exact"))
    assert "feGaussianBlur" in str(export(scene, "svg"))


def test_limits_are_kept_from_fine_to_coarse(scene, picture):
    """The finest small drawing that fits; each has whole coordinates on a grid of its own."""
    grids = []
    for limit in ("1500gz", "900gz", "700gz"):
        made = exported(scene, "svg", picture=picture, max_bytes=limit)
        assert made.met == (len(gzip.compress(made.raw, 9)) <= int(limit[:-2]))
        root = ElementTree.fromstring(str(made.data))
        grids.append(float(root.get("viewBox", "").split()[3]))
        assert not any("." in path.get("d", "") for path in root.iter(f"{NAMESPACE}path"))
    assert grids == sorted(grids, reverse=True)
    assert grids[0] > grids[-1]


def test_as_a_data_uri(scene, picture):
    assert len(export(scene, "data-uri", picture=picture)) < 0.4 * len(export(scene, "data-uri"))

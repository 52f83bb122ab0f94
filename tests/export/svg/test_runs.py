"""Drawings whose layers are blurred in runs: what engines make of them, and how they are written."""

import random
import re
from xml.etree import ElementTree

import numpy as np
import pytest
import torch

from sdf2vec import Layer, Scene, Shape, exported, fit
from sdf2vec.engines import ENGINES
from sdf2vec.export.options import Options
from sdf2vec.export.svg import small_svg
from sdf2vec.export.svg.wording import compressible
from sdf2vec.fit.drawable import drawable, rounded
from sdf2vec.fit.settling import views_of
from sdf2vec.grain import DENSE, Drawable, Run
from sdf2vec.image import load, premultiply
from sdf2vec.render.runs import Runs
from sdf2vec.render.tensors import from_scene
from tests.export.svg.drawings import NAMESPACE, circle, triangle

GREY = (0.5, 0.5, 0.5)


def drawn(found: Drawable, width, height):
    """What a drawing in runs is to look like."""
    counts, deviations = zip(*found.runs, strict=True)
    image = Runs(counts, torch.tensor(deviations)).composite(from_scene(found.scene), width, height, 3)
    return image.clamp(0, 1).permute(1, 2, 0).numpy()


def text_of(found: Drawable, **options):
    return str(small_svg(found, Options(**options), DENSE).data)


def mixed():
    """Kinds of all outlines; beyond the canvas too."""
    box = Shape.of(
        "box", (0.1, 0.2, 0.9), center=(-0.3, 0.2), half_size=(0.2, 0.1), angle=0.4, corner_radius=0.05
    )
    layers = (
        triangle((-0.9, -0.6), (0.5, -0.7), (-0.2, 0.5), color=(0.8, 0.1, 0.2)),
        circle(0.2, 0.1, 0.25, (0.1, 0.7, 0.3), 0.0, 0.7),
        triangle((0.1, 0.1), (0.8, 0.3), (0.3, 0.6), color=(0.9, 0.9, 0.2)),
        Layer((box,), 0.0),
    )
    return Scene(150, 100, layers, GREY)


@pytest.mark.parametrize("engine", ["resvg", "chromium", "librsvg", "firefox"])
@pytest.mark.parametrize("deviations", [(0.04, 0.0), (0.015, 0.03)])
def test_it_is_drawn_as_it_was_fitted(engine, deviations, require_engine):
    """At the size fitted and at a larger one; librsvg draws nothing beyond the edge, and fades there."""
    require_engine(engine)
    scene = rounded(mixed(), DENSE).scene
    found = Drawable(scene, tuple(Run(2, deviation) for deviation in deviations))
    text = text_of(found)
    for size in ((150, 100), (330, 220)):
        off = premultiply(ENGINES[engine].render(text, *size))[..., :3] - drawn(found, *size)
        inner = off[size[1] // 8 : -size[1] // 8, size[0] // 8 : -size[0] // 8]
        assert -10 * np.log10(np.mean((inner if engine == "librsvg" else off) ** 2)) > 38
        assert abs(255 * inner.mean()) < 0.7


@pytest.mark.parametrize(("count", "units"), [(1, 256), (64, 256), (216, 384), (512, 512)])
def test_the_more_layers_the_finer_their_grid(count, units, require_engine):
    """Beyond 64 with the cube root of their number: numbers are rounded to what is written, and drawn so."""
    require_engine("resvg")
    r = random.Random(3)
    corners = [[(r.uniform(-0.7, 0.7), r.uniform(-0.5, 0.5)) for _ in "abc"] for _ in range(count)]
    layers = tuple(triangle(*three, falloff=0.05, color=(r.random(), 0.5, 0.1)) for three in corners)
    found = rounded(Scene(150, 100, layers, GREY), DENSE)
    said = np.array([layer.shapes[0].parameters for layer in found.scene.layers])
    places = (said + np.tile((0.75, 0.5), 3)) * units
    assert np.abs(places - np.round(places)).max() < 1e-3
    text = text_of(found)
    assert f'viewBox="0 0 {units * 3 // 2} {units}"' in text
    written = [
        float(number) for path in re.findall(' d="M([^"]*)"', text) for number in re.findall(r"[\d.]+", path)
    ]
    assert all(number == int(number) for number in written)
    off = premultiply(ENGINES["resvg"].render(text, 150, 100))[..., :3] - drawn(found, 150, 100)
    assert -10 * np.log10(np.mean(off**2)) > 38
    assert abs(255 * off.mean()) < 0.7


def test_a_filter_says_no_region_where_its_own_will_do():
    """Not where shapes are so small that a tenth of their box is less than the blur reaches."""
    large = triangle((-0.8, -0.7), (0.8, -0.7), (0, 0.9))
    small = triangle((-0.1, -0.1), (0.1, -0.1), (0, 0.1))
    for layer, has_region in ((large, False), (small, True)):
        scene = rounded(Scene(100, 100, (layer,), GREY), DENSE).scene
        text = text_of(Drawable(scene, (Run(1, 0.04),)))
        assert (" x=" in re.findall("<filter[^>]*>", text)[0]) == has_region


def test_sharp_layers_are_in_no_run():
    found = rounded(Scene(100, 100, (circle(0, 0, 0.3, falloff=0.0),), GREY), DENSE)
    assert found.runs == ()
    assert "filter" not in text_of(found)


@pytest.fixture(scope="module")
def picture():
    """Soft discs, not square."""
    x, y = np.meshgrid(np.linspace(-1.5, 1.5, 150), np.linspace(-1, 1, 100))
    discs = [np.exp(-9 * ((x - a) ** 2 + (y - b) ** 2)) for a, b in ((0.4, 0), (-0.6, 0.3), (-0.2, -0.5))]
    return np.stack([discs[0], 0.2 + 0.6 * discs[1], 0.1 + 0.5 * discs[2]], axis=2).astype(np.float32)


def test_fitted_in_runs_it_is_nearer_than_rounded(picture):
    scene = fit(picture, 12, preset="fast", kind="triangle")
    near = [
        -10 * np.log10(np.mean((drawn(found, 150, 100) - picture) ** 2))
        for found in (rounded(scene, DENSE), drawable(scene, views_of(load(picture)), DENSE))
    ]
    assert near[1] > near[0] + 3
    assert near[1] > 28


def test_a_size_limit_is_met_by_runs(picture, require_engine):
    require_engine("resvg")
    scene = fit(picture, 12, preset="fast", kind="triangle")
    found = exported(scene, "svg", picture=picture, max_bytes="560gz")
    assert found.met
    assert "layers blurred together" in str(found.notes)
    near = premultiply(ENGINES["resvg"].render(str(found.data), 150, 100))[..., :3] - picture
    assert -10 * np.log10(np.mean(near**2)) > 28
    assert len(ElementTree.fromstring(str(found.data)).findall(f"{NAMESPACE}g")) == 1


def test_the_text_of_frequent_characters_is_chosen():
    assert compressible([["78", "12"], ["1", "22"], ["79", "11"]], "1111") == ["12", "1", "11"]


def test_a_polygon_is_the_same_from_wherever_it_begins():
    corners = [(-0.31, -0.2), (0.42, -0.11), (0.13, 0.37)]
    for turned in (corners, corners[1:] + corners[:1], corners[::-1]):
        scene = rounded(Scene(100, 100, (triangle(*turned),), GREY), DENSE).scene
        (data,) = re.findall(r' d="m([^"]*)z"', text_of(Drawable(scene)))
        steps = np.array(re.findall(r"-?\d+", data), int).reshape(3, 2)
        found = np.cumsum(steps, axis=0)
        assert {tuple(point) for point in found.tolist()} == {(49, 77), (236, 100), (161, 223)}

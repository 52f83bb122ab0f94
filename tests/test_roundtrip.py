"""Exports drawn by real engines against the torch render in float64: the promise of the project."""

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest

import sdf2vec
from sdf2vec import Layer, Scene, Shape, blend, exports, roundtrip
from sdf2vec.engines import ENGINES, glslang_validate
from sdf2vec.export import EXPORTERS
from sdf2vec.export.exported import Exported
from sdf2vec.export.options import Options
from sdf2vec.lower.shader import literal
from sdf2vec.roundtrip import ROUND_TRIPS, compare
from sdf2vec.shapes import KINDS
from tests.scenes import SOFT, random_scene

SIZES = [(60, 40), (133, 71), (9, 6)]  # the fitted one, one larger and of another shape, a tiny one
LARGEST, MEAN = 0.25, 0.05  # levels of 255


def text_of(scene: Scene, target: str, **options: Any) -> str:
    text = sdf2vec.export(scene, target, **options)
    assert isinstance(text, str)
    return text


expected = cache(roundtrip._expected)  # rendered once for all targets


def assert_same(scene, target, sizes=SIZES, largest=LARGEST, **options):
    framing: dict[str, Any] = {"framing": "fit"} if target in ("glsl", "shadertoy", "wgsl") else {}
    made = sdf2vec.exported(scene, target, **framing, **options)
    for size in sizes:
        result = compare(ROUND_TRIPS[target][0], made, scene, size, expected(scene, *size))
        assert result.largest_error <= largest, (target, size, result)
        assert abs(result.mean_error) <= MEAN, (target, size, result)


@pytest.mark.parametrize("compositing", ["over", "additive"])
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("target", ["glsl", "shadertoy", "wgsl"])
def test_every_kind_and_compositing(target, kind, compositing, require_engine):
    require_engine(ROUND_TRIPS[target][0].engine)
    assert_same(random_scene((kind,), compositing, seed=1), target)


@pytest.mark.parametrize("compositing", ["over", "additive"])
@pytest.mark.parametrize("target", ["glsl", "shadertoy", "wgsl"])
def test_mixed_kinds_on_a_transparent_ground(target, compositing, require_engine):
    require_engine(ROUND_TRIPS[target][0].engine)
    assert_same(random_scene(compositing=compositing, layers=20, seed=2, transparent=True), target)


@pytest.mark.parametrize("compositing", ["over", "additive"])
@pytest.mark.parametrize("kinds", [("box",), tuple(KINDS)])
@pytest.mark.parametrize("version", ["es300", "330"])
def test_tables(kinds, compositing, version, require_engine):
    require_engine("opengl")
    scene = random_scene(kinds, compositing, layers=20, seed=3)
    text = text_of(scene, "glsl", layout="table", glsl=version)
    assert "const vec4 table0" in text
    assert_same(scene, "glsl", layout="table", glsl=version)


def test_tables_without_unions(require_engine):
    require_engine("opengl")
    layers = tuple(layer for layer in random_scene(layers=20, seed=5).layers if len(layer.shapes) == 1)
    assert_same(Scene(60, 40, layers), "shadertoy", layout="table")


def test_desktop_glsl(require_engine):
    require_engine("opengl")
    text = text_of(random_scene(seed=6), "glsl", glsl="330")
    assert text.startswith("#version 330\n")
    assert_same(random_scene(seed=6), "glsl", glsl="330")


@pytest.mark.parametrize("target", ["glsl", "shadertoy", "wgsl"])
@pytest.mark.parametrize("size", [(1, 1), (1, 50), (200, 3)])
def test_odd_canvases(target, size, require_engine):
    require_engine(ROUND_TRIPS[target][0].engine)
    assert_same(random_scene(width=size[0], height=size[1], seed=8), target, [size, (17, 5)])


@pytest.mark.parametrize("target", ["glsl", "shadertoy", "wgsl"])
def test_a_scene_without_layers(target, require_engine):
    require_engine(ROUND_TRIPS[target][0].engine)
    assert_same(Scene(6, 4, (), (0.1, 0.2, 0.3)), target)
    assert_same(Scene(6, 4, (), None), target)


@pytest.fixture(scope="module")
def photo_scene():
    """A real photo, fitted with all kinds."""
    data = pytest.importorskip("skimage.data")
    start = random_scene(SOFT, layers=20, width=150, height=100, paints=("flat",), joins=())
    return sdf2vec.fit(data.coffee()[::4, ::4], 24, kind="mixed", preset="fast", seed=4, start=start)


@pytest.mark.parametrize("target", ["glsl", "shadertoy", "wgsl"])
def test_a_fitted_photo_with_mixed_kinds(target, photo_scene, require_engine):
    require_engine(ROUND_TRIPS[target][0].engine)
    assert {layer.shapes[0].kind for layer in photo_scene.layers} == set(SOFT)
    assert_same(photo_scene, target, [(photo_scene.width, photo_scene.height), (301, 170), (16, 11)])


def test_eight_bit_read_back_is_within_a_level(photo_scene, require_engine):
    require_engine("opengl")
    made = sdf2vec.exported(photo_scene, "glsl")
    drawn = ROUND_TRIPS["glsl"][0].draw(made, photo_scene, 150, 100)
    png = sdf2vec.render(photo_scene, 150, 100)
    eight = [np.round(np.clip(pixels[..., :3], 0, 1) * 255) for pixels in (drawn, png)]
    assert np.abs(eight[0] - eight[1]).max() <= 1


@pytest.mark.parametrize("target", ["glsl", "shadertoy", "wgsl"])
def test_a_formula_that_drifts_is_seen(target, require_engine, monkeypatch):
    """The check itself can fail: a falloff that is 2 % off in the exported text alone."""
    require_engine(ROUND_TRIPS[target][0].engine)
    text = text_of(random_scene(seed=1), target)
    number = literal(blend.STEEPNESS)
    assert f"{number} * (0.5 * falloff" in text
    broken = text.replace(f"{number} * (0.5 * falloff", f"{number[:-1]}2 * (0.5 * falloff")
    result = compare(ROUND_TRIPS[target][0], Exported(broken), random_scene(seed=1), (60, 40))
    assert result.largest_error > LARGEST
    assert result.verdict != "same"


@pytest.mark.parametrize("target", ["glsl", "shadertoy", "wgsl"])
def test_half_a_pixel_is_seen(target, require_engine):
    require_engine(ROUND_TRIPS[target][0].engine)
    text = text_of(random_scene(seed=1), target)
    broken = text.replace("(pixel - 0.5 * resolution)", "(pixel - 0.5 * resolution + 0.5)")
    assert broken != text
    assert (
        compare(ROUND_TRIPS[target][0], Exported(broken), random_scene(seed=1), (60, 40)).largest_error
        > LARGEST
    )


def test_check_reports_every_target(require_engine):
    for engine in ENGINES:
        require_engine(engine)
    scene = random_scene(("circle", "box", "triangle"), seed=9, layers=3, joins=("union",))
    results = sdf2vec.check(scene, sizes=[(60, 40)])
    assert len(results) == sum(map(len, ROUND_TRIPS.values()))
    assert not any(result.missing for result in results)
    exact = {r.target for r in results if r.verdict == "same"}
    assert exact >= {"glsl", "shadertoy", "wgsl", "godot"}
    assert {r.target for r in results if r.largest_error < 1.1} >= {*exact, "three", "html", "component"}
    assert set(ROUND_TRIPS) == set(EXPORTERS) - {"json", "png", "jpg", "webp"}


def test_three_sizes_unless_told(require_engine):
    require_engine("opengl")
    sizes = [(r.width, r.height) for r in sdf2vec.check(random_scene(seed=9, layers=1), ["glsl", "godot"])]
    assert sizes == [(60, 40), (76, 46), (19, 13), (60, 40), (120, 80), (36, 24)]


def test_check_converts_an_additive_scene_once(require_engine, monkeypatch):
    for engine in ("resvg", "librsvg", "pdfium"):
        require_engine(engine)
    scene, fits = random_scene(compositing="additive", layers=3, seed=2, transparent=True), []

    def over_of(scene):
        fits.append(scene)
        return replace(scene, layers=(), compositing="over"), 12.0

    monkeypatch.setattr(exports, "_over_of", over_of)
    for name in ("chromium", "firefox", "image", "cairosvg", "inkscape"):
        monkeypatch.setitem(ENGINES, name, absent(name))
    results = [r for r in sdf2vec.check(scene, ["svg", "data-uri", "pdf"], [(60, 40)]) if not r.missing]
    assert len(results) == 7  # one more by resvg: the profile for Inkscape
    assert fits == [scene]


def absent(name, reason="not here"):
    def probe():
        raise OSError(reason)

    return replace(ENGINES[name], probe=probe, advice="get it")


def test_check_says_what_is_missing(monkeypatch):
    monkeypatch.setitem(ENGINES, "opengl", absent("opengl"))
    (result,) = sdf2vec.check(random_scene(seed=9, layers=1), ["glsl"])
    assert (result.verdict, result.missing) == ("not checked", "not here; get it")


def test_shader_text_is_readable():
    circle = Shape.of("circle", (1, 0.5, 0), center=(0.1, -0.2), radius=0.25)
    text = text_of(Scene(30, 20, (Layer((circle,), 0.05, 0.9),)), "glsl", title="photo.png")
    line = (
        "  c = over(c, vec3(1.0, 0.5, 0.0), 0.9, coverage(sdCircle(p - vec2(0.1, -0.2), 0.25), 0.05, pixel)); "
        "// 0 circle"
    )
    assert line in text.splitlines()
    assert "// photo.png in 1 shape, fitted at 30 x 20." in text
    assert "precision highp float;" in text


@pytest.mark.parametrize("layout", ["readable", "table"])
@pytest.mark.parametrize("version", ["es300", "330"])
def test_glslang_accepts_every_text(layout, version, require_engine):
    require_engine("glslang")
    scene = random_scene(layers=12, seed=10)
    assert glslang_validate(text_of(scene, "glsl", layout=layout, glsl=version)) is None
    whole = roundtrip.SHADERTOY_HEAD + text_of(scene, "shadertoy", layout=layout) + roundtrip.SHADERTOY_TAIL
    assert glslang_validate(whole) is None


def test_a_drawing_in_few_pixels_is_judged_by_what_they_can_show(require_engine, monkeypatch):
    """A soft and a sharp scene, well drawn, at 24 pixels and some more: neither differs. Moved by a pixel, both do."""
    both = ("resvg", "librsvg")
    for engine in both:
        require_engine(engine)
    trips = (t for t in ROUND_TRIPS["svg"] if t.engine in both and t.profile != "inkscape")
    monkeypatch.setitem(ROUND_TRIPS, "svg", tuple(trips))
    worst = np.inf
    for seed in range(2):
        scene = random_scene(("circle", "box"), layers=8, seed=seed, width=60, height=40)
        if seed:
            scene = replace(scene, layers=tuple(replace(layer, falloff=0.0) for layer in scene.layers))
        sizes = [(36, 24), (48, 32)]
        results = sdf2vec.check(scene, ["svg"], sizes)
        assert {r.verdict for r in results} <= {"close", "same"}
        worst = min(worst, *(r.psnr for r in results))
        made = sdf2vec.exported(scene, "svg", svg_profile="portable")
        moved = replace(made, data=str(made.data).replace('viewBox="0 0', 'viewBox="1.6 0'))
        found = roundtrip.check(scene, None, sizes, {"svg": moved})
        assert {r.verdict for r in found} == {"differs"}
    assert worst < roundtrip.CLOSE


def test_a_written_drawing_without_filters_is_judged_by_every_renderer(require_engine, monkeypatch):
    for engine in ("resvg", "cairosvg"):
        require_engine(engine)
    quick = tuple(t for t in ROUND_TRIPS["svg"] if t.engine in ("resvg", "cairosvg"))
    monkeypatch.setitem(ROUND_TRIPS, "svg", quick)
    scene = random_scene(("circle",), layers=3, seed=1, width=30, height=30)
    made = sdf2vec.exported(scene, "svg", svg_profile="portable")
    names: list[str] = []
    found = roundtrip.check(scene, None, [(30, 30)], {"svg": made}, names.append)
    assert {r.target for r in found} == {"svg portable"}
    assert {r.engine for r in found} == {"resvg", "cairosvg"}
    assert "svg portable on resvg" in names


@pytest.mark.parametrize(("target", "engine", "smaller"), [("glsl", "opengl", True), ("svg", "resvg", False)])
def test_a_shader_of_many_shapes_is_drawn_smaller_after_its_export(
    target, engine, smaller, require_engine, monkeypatch
):
    require_engine(engine)
    sizes: list[tuple[int, int]] = []
    monkeypatch.setattr(
        roundtrip, "compare", lambda trip, made, scene, size, expected, picture: sizes.append(size)
    )
    monkeypatch.setattr(roundtrip, "QUICK_WORK", 2e5)
    for layers in (2, 50):
        scene = random_scene(("circle",), layers=layers, width=300, height=200, joins=())
        roundtrip.figure(scene, target, Exported(""), Options())
    assert sizes[0] == (300, 200)
    width, height = sizes[1]
    if smaller:
        assert width / height == pytest.approx(1.5, rel=0.05)
        assert 0.9 * 2e5 / 50 <= width * height <= 2e5 / 50 * 1.02
    else:
        assert (width, height) == (300, 200)

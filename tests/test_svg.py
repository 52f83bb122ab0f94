"""SVG: well-formed by an independent parser, and the render's picture when resvg draws it."""

import base64
import math
import random
import re
from dataclasses import replace
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
import torch
from skimage.morphology import dilation, footprint_rectangle

from sdf2vec import Layer, Scene, Sdf2vecError, Shape
from sdf2vec.engines import ENGINES, chromium
from sdf2vec.export.options import Options
from sdf2vec.export.svg import accepts, data_uri, pdf
from sdf2vec.export.svg import svg as write_svg
from sdf2vec.export.svg.blur import best_blur, trial_of
from sdf2vec.export.svg.canvas import Canvas
from sdf2vec.export.svg.outlines import edge_of
from sdf2vec.image import premultiply
from sdf2vec.render.reference import render
from sdf2vec.shapes import KINDS

from .scenes import SOFT, random_scene, random_shape

NAMESPACE = "{http://www.w3.org/2000/svg}"
Parameters = dict[str, Any]
WHITE, BLACK, ORANGE = (1.0, 1.0, 1.0), (0.0, 0.0, 0.0), (1.0, 0.6, 0.0)


def scene_of(*layers, width=150, height=100, background=BLACK):
    return Scene(width, height, layers, background)


def circle(x, y, radius, color=WHITE, falloff=0.2, opacity=1.0):
    return Layer((Shape.of("circle", color, center=(x, y), radius=radius),), falloff, opacity)


def triangle(*points, falloff=0.0, color=WHITE):
    return Layer((Shape.of("triangle", color, a=points[0], b=points[1], c=points[2]),), falloff)


def text_of(scene, **options):
    return write_svg(scene, Options(**options)).data


def parsed(scene, **options):
    return ElementTree.fromstring(text_of(scene, **options))


def drawn_in(root):
    """The elements that draw layers: all but title, definitions and background."""
    return [e for e in root if e.tag not in (f"{NAMESPACE}title", f"{NAMESPACE}defs")][1:]


def tags(root):
    return [element.tag.removeprefix(NAMESPACE) for element in root.iter()]


def numbers_of(path_data):
    return [float(number) for number in re.findall(r"-?(?:\d+\.?\d*|\.\d+)", path_data)]


@pytest.fixture
def levels_off(require_engine):
    """Differences in levels of 255, [H, W, 4], between resvg's drawing and the render, both premultiplied."""
    require_engine("resvg")

    def difference(scene, width=None, height=None):
        width, height = width or scene.width, height or scene.height
        drawn = premultiply(ENGINES["resvg"].render(text_of(scene), width, height))
        expected = render(scene, width, height, dtype=torch.float64).permute(1, 2, 0).numpy()
        return 255 * np.abs(drawn - expected)

    return difference


def away_from_edges(scene, falloff_pixels=3):
    """Pixels [H, W] whose neighbourhood a sharp scene leaves in one colour."""
    image = render(scene).numpy()
    edge = np.zeros(image.shape[1:], bool)
    for axis in (1, 2):
        change = np.abs(np.diff(image, axis=axis)).max(axis=0) > 1e-3
        edge |= np.pad(change, [(0, 1), (0, 0)] if axis == 1 else [(0, 0), (0, 1)])
    return ~dilation(edge, footprint_rectangle((falloff_pixels, falloff_pixels)))


# --- the document ------------------------------------------------------------------------------------------


def test_the_root_says_size_and_role():
    root = parsed(random_scene(layers=10, width=60, height=40))
    assert root.tag == f"{NAMESPACE}svg"
    assert (root.get("width"), root.get("height")) == ("60", "40")
    assert root.get("viewBox") == "0 0 60 40"
    assert root.get("role") == "img"


@pytest.mark.parametrize("title", ["photo.jpg", "<a> & \"b\" 'c' ]]> <!-- &amp;", "Blüte 花.png", ""])
def test_title_is_escaped(title):
    (element,) = parsed(scene_of(), title=title).findall(f"{NAMESPACE}title")
    assert (element.text or "").strip("'") == title.strip("'")


@pytest.mark.parametrize("title", ["a\0b", "two\nlines", "\ud800", "\ufffe"])
def test_titles_that_xml_cannot_hold(title):
    text = text_of(scene_of(), title=title)
    (element,) = ElementTree.fromstring(text.encode()).findall(f"{NAMESPACE}title")
    assert element.text
    assert element.text.isprintable()


@pytest.mark.parametrize("transparent", [False, True])
def test_ids_are_unique_and_references_lead_somewhere(transparent):
    root = parsed(random_scene(layers=20, seed=1, transparent=transparent))
    ids = [element.get("id") for element in root.iter() if element.get("id")]
    assert len(ids) > 5
    assert len(set(ids)) == len(ids)
    used = [
        name
        for element in root.iter()
        for value in element.attrib.values()
        for name in re.findall(r"url\(#(\w+)\)", value)
    ]
    definitions = [element.get("id") for element in root.findall(f"{NAMESPACE}defs/*")]
    assert set(used) == set(definitions)


def test_same_scene_same_text():
    assert text_of(random_scene(seed=3)) == text_of(random_scene(seed=3))
    assert text_of(random_scene(seed=3)) != text_of(random_scene(seed=4))


def test_no_layers():
    root = parsed(scene_of(background=ORANGE))
    assert tags(root) == ["svg", "title", "rect"]
    assert root[-1].get("fill") == "#f90"
    assert "rect" not in tags(parsed(scene_of(background=None)))


def test_layers_come_in_draw_order():
    colors = [(i / 15, 0.0, 0.0) for i in range(16)]
    root = parsed(scene_of(*(circle(i / 20, 0, 0.1, color, falloff=0) for i, color in enumerate(colors))))
    fills = [element.get("fill") for element in root.iter(f"{NAMESPACE}circle")]
    assert fills == [f"#{i:x}00" for i in range(16)]


@pytest.mark.parametrize("profile", ["portable", "filters"])
def test_additive_scenes_are_refused(profile):
    options = Options(svg_profile=profile)
    assert accepts(options).compositing == ("over",)
    for export in (write_svg, data_uri, pdf):
        with pytest.raises(Sdf2vecError, match=r"^svg: takes scenes under over, not additive$"):
            export(Scene(3, 2, (), (0.5, 0.5, 0.5), "additive"), options)


def test_portable_has_neither_filters_nor_blend_modes():
    text = text_of(random_scene(layers=20, seed=4), svg_profile="portable")
    assert not re.search(r"<filter|filter=|<mask|<style|mix-blend-mode", text)


def test_a_size_limit_is_kept_or_refused():
    scene = random_scene(("box", "triangle"), layers=40, seed=7, paints=("flat",), joins=())
    free = len(text_of(scene).encode())
    assert len(text_of(scene, svg_size_limit=free).encode()) == free
    limited = write_svg(scene, Options(svg_size_limit=free // 2))
    assert len(limited.raw) <= free // 2
    assert any("drawn coarser" in note for note in limited.notes)
    with pytest.raises(Sdf2vecError, match=r"^svg: [\d,]+ bytes at least, more than the limit of 500"):
        text_of(scene, svg_size_limit=500)
    with pytest.raises(Sdf2vecError, match=r"bytes at least.*sharp ones \(--max-falloff 0\)"):
        text_of(scene, svg_size_limit=40 * 170, svg_profile="portable")
    sharp = replace(scene, layers=tuple(replace(layer, falloff=0.0) for layer in scene.layers))
    small = text_of(sharp, svg_size_limit=40 * 120, svg_profile="portable")
    assert not re.search(r"<filter|filter:|class=", small)
    with pytest.raises(Sdf2vecError, match=r"of 500; fit fewer shapes$"):
        text_of(sharp, svg_size_limit=500)


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


def test_a_data_uri_holds_the_svg():
    scene = random_scene(layers=3, seed=4)
    head, _, body = str(data_uri(scene, Options()).data).partition(",")
    assert head == "data:image/svg+xml;base64"
    assert base64.b64decode(body).decode() == text_of(scene)


def test_a_pdf_of_the_portable_profile(require_engine):
    require_engine("cairosvg")
    assert pdf(random_scene(layers=6, seed=4), Options()).raw.startswith(b"%PDF-")


def test_all_numbers_are_finite_and_plain():
    text = text_of(random_scene(layers=25, seed=2))
    assert not re.search(r"\b(nan|inf)\b", text, re.IGNORECASE)


# --- sharp shapes: the very elements, with coordinates by hand ----------------------------------------------


def test_a_sharp_circle_is_a_circle():
    (element,) = drawn_in(parsed(scene_of(circle(0.1, -0.2, 0.25, ORANGE, falloff=0, opacity=0.5))))
    assert element.tag == f"{NAMESPACE}circle"
    place = {name: float(element.get(name, "nan")) for name in ("cx", "cy", "r", "fill-opacity")}
    assert place == {"cx": 85, "cy": 30, "r": 25, "fill-opacity": 0.5}
    assert element.get("fill") == "#f90"


def test_a_sharp_falloff_moves_the_edge_by_half_of_it():
    (element,) = drawn_in(parsed(scene_of(circle(0, 0, 0.25, falloff=0.01))))
    assert float(element.get("r", "nan")) == pytest.approx(25.5)


def test_a_sharp_box_is_a_turned_rectangle():
    numbers: Parameters = {
        "center": (0, 0.1),
        "half_size": (0.3, 0.2),
        "angle": math.pi / 6,
        "corner_radius": 0.05,
    }
    (element,) = drawn_in(parsed(scene_of(Layer((Shape.of("box", WHITE, **numbers),), 0))))
    assert element.tag == f"{NAMESPACE}rect"
    place = {name: float(element.get(name, "nan")) for name in ("x", "y", "width", "height", "rx")}
    assert place == {"x": 45, "y": 40, "width": 60, "height": 40, "rx": 5}
    assert numbers_of(element.get("transform", "")) == pytest.approx([30, 75, 60])


def test_a_sharp_triangle_is_a_polygon():
    (element,) = drawn_in(parsed(scene_of(triangle((0, -0.4), (0.3, 0.2), (-0.3, 0.2)))))
    assert element.get("d") == "M75 10 105 70 45 70Z"


@pytest.mark.parametrize(
    "points", [[(0, -0.4), (0.3, 0.2), (-0.3, 0.2)], [(0, -0.4), (-0.3, 0.2), (0.3, 0.2)]]
)
def test_rounded_triangles_grow_outwards_whatever_their_orientation(points):
    """1 pixel of falloff moves the edges out by half a pixel: the topmost point to 9.5, the lowest to 70.5."""
    (element,) = drawn_in(parsed(scene_of(triangle(*points, falloff=0.01))))
    assert element.tag == f"{NAMESPACE}path"
    data = element.get("d", "")
    assert data.count("A.5 .5 0 0 1") == 3
    places = numbers_of(data.replace("A.5 .5 0 0 1", ""))
    x, y = np.array(places[0::2]), np.array(places[1::2])
    assert y.max() == pytest.approx(70.5, abs=0.011)
    center = np.array([75, 50])
    corners = np.array([[75, 10], [105, 70], [45, 70]])
    spokes = np.hypot(x - center[0], y - center[1])
    assert spokes.min() > np.hypot(*(corners - center).T).min()


def test_coordinates_of_small_pictures_have_more_decimals():
    """A drawing of 1 × 1 pixel is shown at any size, so its coordinates can't be whole hundredths."""
    (element,) = drawn_in(parsed(scene_of(circle(0.1234, 0, 0.0567, falloff=0), width=1, height=1)))
    assert float(element.get("cx", "nan")) == pytest.approx(0.6234, abs=1e-4)
    assert float(element.get("r", "nan")) == pytest.approx(0.0567, abs=1e-4)


# --- as resvg draws it -------------------------------------------------------------------------------------


@pytest.mark.parametrize("background", [(0.2, 0.3, 0.4), None], ids=["opaque", "transparent"])
@pytest.mark.parametrize("falloff", [0.05, 0.3, 1.5])
def test_soft_circles_are_gradients_that_say_the_coverage(levels_off, falloff, background):
    layers = [
        circle(-0.3, 0.1, 0.2, ORANGE, falloff, 0.8),
        circle(0.2, -0.1, 0.35, (0.1, 0.9, 0.3), falloff),
        circle(0.6, 0.3, 0.01, (0.9, 0.1, 0.9), falloff, 0.9),
    ]
    for layer in layers:
        scene = scene_of(layer, background=background)
        assert levels_off(scene).max() <= 4
        assert levels_off(scene, 300, 200).max() <= 4
    scene = scene_of(*layers, background=background)
    root = parsed(scene)
    assert len(root.findall(f".//{NAMESPACE}radialGradient")) == 3
    assert "filter" not in tags(root)
    assert levels_off(scene).max() <= 7


def test_soft_ellipses_too(levels_off):
    shape = Shape.of("ellipse", ORANGE, center=(0.1, 0.05), radii=(0.5, 0.15), angle=0.7)
    scene = scene_of(Layer((shape,), 0.1, 0.9))
    assert "filter" not in tags(parsed(scene))
    assert levels_off(scene).max() <= 4


SHARP: dict[str, Parameters] = {
    "circle": {"center": (0.1, 0), "radius": 0.3},
    "ellipse": {"center": (0.1, 0), "radii": (0.5, 0.2), "angle": 0.5},
    "box": {"center": (0.1, 0), "half_size": (0.5, 0.2), "angle": 0.5, "corner_radius": 0.1},
    "triangle": {"a": (0, -0.4), "b": (0.5, 0.3), "c": (-0.4, 0.2)},
    "displaced": {"center": (0, 0), "radius": 0.3, "amplitude": 0.1, "frequency": (12, 9)},
}


@pytest.mark.parametrize("falloff", [0.0, 0.01])
@pytest.mark.parametrize("kind", SOFT)
def test_sharp_shapes_away_from_their_edges(levels_off, kind, falloff):
    scene = scene_of(Layer((Shape.of(kind, ORANGE, **SHARP[kind]),), falloff, 0.8), background=(0.2, 0, 0.5))
    inner = away_from_edges(scene)
    assert 0.5 < inner.mean() < 0.99
    off = levels_off(scene)
    assert off[inner].max() <= 1
    assert off.max() < 55  # an edge in the wrong place by half a pixel would be off by 102


def test_sharp_unions_are_traced(levels_off):
    shapes = tuple(Shape.of("circle", ORANGE, center=(x, 0.0), radius=0.2) for x in (-0.2, 0.2))
    scene = scene_of(Layer.union(shapes, 0.05, 0.0))
    assert len(parsed(scene).findall(f".//{NAMESPACE}path")) == 1
    off = levels_off(scene)
    assert off[away_from_edges(scene)].max() <= 1
    assert off.max() < 50


def test_a_union_around_a_hole(levels_off):
    ring = [
        Shape.of("circle", WHITE, center=(0.3 * math.cos(a), 0.3 * math.sin(a)), radius=0.08)
        for a in np.arange(0, 6.2, 0.4)
    ]
    scene = scene_of(Layer.union(ring, 0.01, 0.0))
    assert levels_off(scene)[50, 75, :3].max() == 0
    assert levels_off(scene)[away_from_edges(scene)].max() <= 1


@pytest.mark.parametrize("falloff", [0.03, 0.08, 0.5])
@pytest.mark.parametrize(("kind", "largest"), [("box", 4), ("triangle", 4), ("displaced", 64)])
def test_soft_shapes_alone(levels_off, kind, largest, falloff):
    """White on black: the worst case. Slices say the coverage; bands have steps."""
    scene = scene_of(Layer((Shape.of(kind, WHITE, **SHARP[kind]),), falloff))
    for size in [(150, 100), (300, 200), (450, 300)]:
        assert levels_off(scene, *size).max() <= largest
        assert levels_off(scene, *size).mean() <= 2


def test_slices_have_no_seams(levels_off):
    """Translucent slices that shared or missed a row of pixels would be off by up to 64 levels there."""
    sides = [(0.3 * math.cos(a), 0.3 * math.sin(a)) for a in (0.3, 2.2, 4.4)]
    layer = Layer((Shape.of("triangle", WHITE, a=sides[0], b=sides[1], c=sides[2]),), 0.1, 0.5)
    for size in [(150, 100), (297, 198), (615, 410)]:
        assert levels_off(scene_of(layer), *size).max() <= 3


@pytest.mark.parametrize("kind", ["box", "triangle"])
def test_blurs_where_they_are_near_enough(levels_off, kind):
    """A shape of little contrast is blurred in one element; portable drawings never have a filter."""
    layer = Layer((Shape.of(kind, (0.25, 0.25, 0.25), **SHARP[kind]),), 0.2)
    scene = scene_of(layer, background=(0.2, 0.2, 0.2), width=600, height=400)
    assert parsed(scene).findall(f".//{NAMESPACE}feGaussianBlur")
    assert levels_off(scene).max() <= 3
    assert "filter" not in tags(parsed(scene, svg_profile="portable"))


@pytest.mark.parametrize("kind", ["box", "triangle"])
def test_a_fitted_blur_is_nearer_than_a_plain_one(kind):
    """Sharper corners undo what the blur takes off them; compared by the same Gaussian on a grid."""
    layer = Layer((Shape.of(kind, WHITE, **SHARP[kind]),), 0.2)
    canvas = Canvas.of(scene_of(layer, width=600, height=400))
    fitted = best_blur(layer, canvas)
    assert fitted is not None
    rounded = edge_of(layer, 0.5)
    assert rounded is not None
    plain = trial_of(layer, canvas).blurred(rounded, 1.0)
    assert fitted.error < 0.6 * plain.error


def test_a_traced_shape_larger_than_the_canvas(levels_off):
    """Only what can be seen is traced: neither the memory nor the time grows with the shape."""
    numbers: Parameters = {"center": (0, 30), "radius": 30, "amplitude": 0.05, "frequency": (20, 20)}
    sharp = scene_of(Layer((Shape.of("displaced", ORANGE, **numbers),), 0.0))
    assert levels_off(sharp)[away_from_edges(sharp)].max() <= 1
    everywhere: Parameters = {"center": (0, 0), "radius": 1000, "amplitude": 0.05, "frequency": (20, 20)}
    for falloff in (0.0, 0.3):
        filled = scene_of(Layer((Shape.of("displaced", ORANGE, **everywhere),), falloff))
        assert levels_off(filled).max() <= 1
    nowhere: Parameters = {"center": (500, 0), "radius": 10, "amplitude": 0.05, "frequency": (20, 20)}
    assert "path" not in tags(parsed(scene_of(Layer((Shape.of("displaced", ORANGE, **nowhere),), 0.1))))


@pytest.mark.parametrize(
    "points",
    [
        [(-0.3, 0), (0.3, 0), (-0.3, 0)],
        [(-0.3, 0), (-0.3, 0), (0.3, 0)],
        [(0.3, 0), (-0.3, 0), (0, 0)],
        [(-0.3, 0), (0, 0), (0.3, 0)],
    ],
)
def test_triangles_without_area_are_drawn_as_lines(points):
    """The distance to a segment: at falloff f its outline is a stadium of radius f / 2, 3/4 of a pixel here.

    A hundredth less is written, so that half circles are whole although their ends are rounded.
    """
    (element,) = drawn_in(parsed(scene_of(triangle(*points, falloff=0.015))))
    arcs = re.findall(r"A\.74 \.74 0 0 1 (\S+) ([^LZ]+)", element.get("d", ""))
    ends = {(float(x), round(float(y), 2)) for x, y in arcs if abs(float(x) - 75) > 1}
    assert ends == {(45.0, 49.25), (105.0, 50.75)} or ends == {(45.0, 49.25), (105.0, 49.25), (105.0, 50.75)}


def test_a_point_of_a_triangle_is_no_error():
    parsed(scene_of(triangle((0, 0), (0, 0), (0, 0), falloff=0.015)))
    parsed(scene_of(triangle((0, 0), (0, 0), (0, 0), falloff=0.5)))


def test_a_mixed_scene(levels_off):
    """Without unions, whose colours are averaged, and without opacity where outlines cross."""
    kept = [layer for layer in random_scene(layers=20, seed=5).layers if len(layer.shapes) == 1]
    assert {layer.shapes[0].kind for layer in kept} == set(KINDS)
    assert levels_off(Scene(120, 80, tuple(kept), ORANGE)).mean() < 1.5


@pytest.mark.parametrize("size", [(1, 1), (1, 40), (40, 1)])
def test_thin_canvases(levels_off, size):
    width, height = size
    scene = Scene(width, height, (circle(0, 0, 0.4, ORANGE, falloff=2),), BLACK)
    root = parsed(scene)
    assert root.get("viewBox") == f"0 0 {width} {height}"
    assert levels_off(scene, 20 * width, 20 * height).max() <= 3


def test_smaller_than_any_pixel():
    shape = Shape.of("ellipse", WHITE, center=(0, 0), radii=(1e-6, 1e-6), angle=0)
    for falloff in (0.0, 0.1, 64.0):
        root = parsed(scene_of(Layer((shape,), falloff), width=1, height=1))
        assert drawn_in(root)


# --- as every renderer draws it ----------------------------------------------------------------------------

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

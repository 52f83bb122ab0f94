"""The whole document: well-formed by an independent parser, sharp shapes with coordinates by hand."""

import base64
import gzip
import math
import re
from dataclasses import replace
from urllib.parse import unquote
from urllib.request import urlopen
from xml.etree import ElementTree

import numpy as np
import pytest

from sdf2vec import Layer, Scene, Sdf2vecError, Shape, export, exported
from sdf2vec.export.options import Options
from sdf2vec.export.svg import _quoted, accepts, data_uri, pdf
from sdf2vec.export.svg import svg as write_svg
from tests.export.svg.drawings import (
    NAMESPACE,
    ORANGE,
    WHITE,
    Parameters,
    circle,
    drawn_in,
    numbers_of,
    parsed,
    scene_of,
    tags,
    text_of,
    triangle,
)
from tests.scenes import random_scene


@pytest.mark.parametrize(("asked", "size"), [({}, (None, None)), ({"svg_size": "fixed"}, ("60", "40"))])
def test_the_root_says_proportions_and_role(asked, size):
    """A drawing is as large as where it is put, unless a size is asked for."""
    root = parsed(random_scene(layers=3, width=60, height=40), **asked)
    assert root.tag == f"{NAMESPACE}svg"
    assert (root.get("width"), root.get("height")) == size
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
    one, again, other = (write_svg(random_scene(layers=6, seed=seed), Options()).data for seed in (3, 3, 4))
    assert one == again != other


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
    for make in (write_svg, data_uri, pdf):
        with pytest.raises(Sdf2vecError, match=r"^svg: takes scenes under over, not additive$"):
            make(Scene(3, 2, (), (0.5, 0.5, 0.5), "additive"), options)


def test_portable_has_neither_filters_nor_blend_modes():
    text = text_of(random_scene(layers=20, seed=4), svg_profile="portable")
    assert not re.search(r"<filter|filter=|<mask|<style|mix-blend-mode", text)


@pytest.mark.usefixtures("drawn_once")
def test_a_size_limit_is_kept_or_refused():
    scene = random_scene(("box", "triangle"), layers=24, seed=7, paints=("flat",), joins=())
    free = len(text_of(scene).encode())
    assert len(text_of(scene, max_bytes=free).encode()) == free
    limited = exported(scene, "svg", max_bytes=free // 2)
    assert limited.met
    assert len(limited.raw) <= free // 2
    assert any("drawn small" in note for note in limited.notes)
    with pytest.raises(Sdf2vecError, match=r"^svg: [\d,]+ bytes at least, more than the limit of 500 bytes"):
        export(scene, "svg", max_bytes=500)
    assert not exported(scene, "svg", max_bytes=24 * 170, svg_profile="portable").met
    sharp = replace(scene, layers=tuple(replace(layer, falloff=0.0) for layer in scene.layers))
    small = text_of(sharp, max_bytes=24 * 120, svg_profile="portable")
    assert not re.search(r"<filter|filter:|class=", small)


@pytest.mark.usefixtures("drawn_once")
def test_a_limit_may_be_that_of_the_gzipped_text():
    scene = random_scene(("box", "triangle"), layers=24, seed=7, paints=("flat",), joins=())
    free = len(gzip.compress(exported(scene, "svg").raw, 9))
    limited = exported(scene, "svg", max_bytes=f"{free // 2}gz")
    assert len(gzip.compress(limited.raw, 9)) <= free // 2 < len(limited.raw)


@pytest.mark.parametrize("limit", ["", "0", "-1", "4k", "4000 gz", 0, True])
def test_what_is_no_limit_is_refused(limit):
    with pytest.raises(Sdf2vecError, match="a number of bytes, as 4000, or gzipped 4000gz"):
        exported(scene_of(), "svg", max_bytes=limit)


@pytest.mark.parametrize("title", ["photo", "a 'quoted' \"50 %\" #1 & <more>", "写真" * 2000])
def test_a_data_uri_holds_the_svg(title):
    """In what an address may have in double quotes; in base64 where that is smaller."""
    scene = random_scene(layers=3, seed=4)
    address = str(data_uri(scene, Options(title=title)).data)
    with urlopen(address) as stream:  # Python's own reader of data URIs
        assert stream.headers.get_content_type() == "image/svg+xml"
        found = stream.read().decode()
    wanted = text_of(scene, title=title)
    assert ElementTree.canonicalize(found, strip_text=True) == ElementTree.canonicalize(
        wanted, strip_text=True
    )
    encoded = "data:image/svg+xml;base64," + base64.b64encode(wanted.encode()).decode()
    assert address == encoded if len(title) > 1000 else len(address) < 0.96 * len(encoded)
    assert re.fullmatch(r"[!#$'()*+,\-./0-9:;=?@A-Z_a-z~%]+", address)
    assert "#" not in address


def test_quotes_in_attributes_of_a_data_uri_survive():
    assert ElementTree.fromstring(unquote(_quoted('<a b="it\'s"/>'))).get("b") == "it's"


def test_what_is_in_the_picture_is_said():
    root = ElementTree.fromstring(text_of(random_scene(layers=1), title="<cat>", alt="A cat & a\nhat"))
    assert [root.findtext(f"{{*}}{name}") for name in ("title", "desc")] == ["<cat>", r"A cat & a\nhat"]
    assert ElementTree.fromstring(text_of(random_scene(layers=1))).find("{*}desc") is None


def test_a_pdf_of_the_portable_profile(require_engine):
    require_engine("cairosvg")
    assert pdf(random_scene(layers=6, seed=4), Options()).raw.startswith(b"%PDF-")


def test_all_numbers_are_finite_and_plain():
    text = text_of(random_scene(layers=20, seed=1))
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

"""The page in a real browser: pixels, resizing, the fallback, copying, comparing."""

import base64
import gzip
import json
import random
import re
from dataclasses import replace
from functools import cache
from xml.etree import ElementTree

import numpy as np
import pytest

import sdf2vec
from sdf2vec import Layer, Scene, Shape
from sdf2vec.engines import chromium
from sdf2vec.export import packing, page_texts
from sdf2vec.export import page as page_module
from sdf2vec.export.options import Options
from sdf2vec.image import encode_png
from tests.scenes import random_scene, random_shape

SCENE = random_scene(("circle", "triangle"), layers=9, seed=4, width=120, height=80)
TITLE = 'a "quoted" <picture>'
RECORD_COPIES = "navigator.clipboard.writeText = async (text) => { window.copied = text; }"
NO_WEBGL = "<script>HTMLCanvasElement.prototype.getContext = () => null;</script>"


@pytest.fixture(autouse=True)
def _quick_packing(monkeypatch):
    monkeypatch.setattr(packing, "SAMPLE", 1 << 17)


@cache
def page_of(scene, **options):
    """A page, made once for all that look at it."""
    return page_anew(scene, **options)


def page_anew(scene, **options):
    """A page where the program isn't what it is elsewhere."""
    text = sdf2vec.export(scene, "html", title=TITLE, **options)
    assert isinstance(text, str)
    return text


def without_webgl(text):
    """By a script of its own, which the page's policy would forbid."""
    text = re.sub(r'<meta http-equiv="Content-Security-Policy"[^>]*>', "", text)
    return text.replace("</head>", NO_WEBGL + "</head>")


@pytest.fixture
def opened(require_engine):
    require_engine("chromium")
    return lambda text, width, height: chromium.opened({"index.html": text}, width, height)


def box(page, selector):
    return page.locator(selector).bounding_box()


def assert_shows(page, scene, levels=1.6):
    """The picture on the page is the render at its size in device pixels, but for 8-bit rounding."""
    chromium.wait_until(page, "document.querySelector('canvas').width > 1")
    for _ in range(20):  # a machine with other work may take seconds to draw it
        page.wait_for_timeout(300)
        width, height = page.evaluate(
            "[document.querySelector('canvas').width, document.querySelector('canvas').height]"
        )
        shown = chromium.screenshot(page, "canvas")[:height, :width, :3]  # it rounds fractional boxes up
        assert shown.shape[:2] == (height, width)
        difference = 255 * np.abs(shown - sdf2vec.render(scene, width, height))
        if difference.max() <= levels:
            break
    assert difference.max() <= levels
    assert difference.mean() <= 0.5


def test_page_shows_the_scene_and_follows_its_size(opened):
    with opened(page_of(SCENE), 400, 500) as page:
        assert_shows(page, held(SCENE))
        page.set_viewport_size({"width": 641, "height": 700})
        chromium.wait_until(page, "document.querySelector('canvas').width > 550")
        assert_shows(page, held(SCENE))
        assert not page.locator(".fallback").is_visible()


def test_page_holds_all_that_it_needs(opened):
    requests = []
    with opened(page_of(SCENE), 300, 300) as page:
        page.on("request", lambda request: requests.append(request.url))
        page.reload()
        chromium.wait_until(page, "document.querySelector('canvas').width > 1")
    assert [url for url in requests if not url.startswith("data:")] == [chromium.ORIGIN]
    assert not re.search(r'(src|href)="(?!data:)', page_of(SCENE))


def test_without_webgl_the_drawing_is_shown(opened):
    text = without_webgl(page_of(SCENE))
    with opened(text, 400, 400) as page:
        assert page.locator(".fallback svg").is_visible()
        assert not page.locator("canvas").is_visible()
        place = box(page, ".fallback svg")
        assert place["width"] / place["height"] == pytest.approx(1.5, abs=0.02)


def test_a_scene_without_a_drawing_falls_back_to_pixels(opened, monkeypatch):
    def refuse(scene, options):
        raise sdf2vec.Sdf2vecError("no")

    monkeypatch.setattr(page_module, "svg", refuse)
    text = without_webgl(page_anew(SCENE))
    assert "Copy SVG" not in text
    with opened(text, 300, 300) as page:
        assert page.evaluate("document.querySelector('.fallback img').naturalWidth") == 120


def test_buttons_copy_the_texts(opened):
    with opened(page_of(SCENE), 300, 300) as page:
        page.evaluate(RECORD_COPIES)
        for name in ("svg", "shadertoy", "glsl", "wgsl"):
            page.locator(f'[data-text="{name}"]').focus()
            page.keyboard.press("Enter")
            chromium.wait_until(
                page, "document.querySelector('[role=status]').textContent.endsWith('copied.')"
            )
            copied = page.evaluate("window.copied")
            assert _canonical(copied) == _canonical(_text(name)) if name == "svg" else copied == _text(name)
            page.evaluate("document.querySelector('[role=status]').textContent = ''")


def _text(name, scene=SCENE, layout="readable"):
    """What the exporter writes of the scene that the page holds; of a drawing, which it has as it is, of the scene."""
    if name == "svg":
        return sdf2vec.export(scene, name, title=TITLE)
    return sdf2vec.export(held(scene), name, title=TITLE, alone=True, layout=layout)


def held(scene):
    """The scene that a page holds."""
    (file,) = re.findall(r'id="file">([^<]+)</script>', page_of(scene))
    return sdf2vec.loads(base64.b64decode(file))


def test_a_page_holds_the_scene_once_and_hardly_less():
    found = held(SCENE)
    off = sdf2vec.render(found, 360) - sdf2vec.render(SCENE, 360)
    assert 255 * np.abs(off).max() < 0.3
    script = page_of(SCENE).partition("</svg>")[2]
    assert len(page_of(replace(SCENE, layers=SCENE.layers * 2)).partition("</svg>")[2]) < len(script) + 9 * 60


def test_a_page_takes_hardly_more_than_its_drawing():
    """At most 1.3 times the drawing's bytes and 12,000, all gzipped, less 2 %.

    Of fitted pictures the scene's file takes at most 0.58 of what the drawing takes (`docs/embed.md`).
    """
    r = random.Random(5)
    layers = [
        Layer((random_shape("triangle", r),), r.uniform(0.01, 0.1), r.uniform(0.3, 0.9)) for _ in range(256)
    ]
    scene = Scene(120, 80, tuple(layers), (0.2, 0.4, 0.6))
    page = str(page_module.html(scene, Options(drawing="<svg></svg>")).data)
    (file,) = re.findall(r'id="file">([^<]+)</script>', page)
    drawing = len(base64.b64decode(file)) / 0.58
    assert len(gzip.compress(page.encode(), 9)) + drawing <= 0.98 * (1.3 * drawing + 12_000)


@pytest.mark.parametrize(
    "script",
    [
        'a("b  //c",`d ${e ? `f  ${g}` : "h"}  i`);',
        "const a=1+ +b- -c;",
        "`vec4 a = b;\n  c = ${d};\n`",
    ],
)
def test_what_a_script_says_is_kept(script):
    assert page_module.lean(script) == script


def test_what_sets_a_script_off_and_its_checks_are_left_out():
    script = """// What it does.
function f(a, b) {
  require(a > 0, "a", `must be ${b}`);
  if (a in b) return [a / 2]; // half
  else throw new Error("a  b");
}

const c = f(1, 2);
"""
    lean = """
function f(a,b){if(a in b)return[a/2];else throw new Error("a  b");}
const c=f(1,2);"""
    assert page_module.lean(script) == lean


@pytest.mark.parametrize("compositing", ["over", "additive"])
def test_texts_are_those_of_the_exporter_whatever_is_in_them(compositing, opened, monkeypatch):
    """All kinds, paints and joins; numbers that make a formula simpler, and whole, tiny and negative ones."""
    whole = Layer(
        (Shape.of("box", (1, 0, 1), center=(0, -1), half_size=(1e-6, 2), angle=0, corner_radius=0),), 0.0
    )
    scene = random_scene(layers=8, seed=6, compositing=compositing, width=30, height=20)
    disc = Shape.of("circle", (1, 0, 0), center=(0.1, 0.2), radius=0.3)
    twice = Layer.union((disc, disc), 0.1, 0.1)  # said once
    scene = replace(scene, layers=(*scene.layers, whole, replace(whole, opacity=0.0), twice))
    with opened(page_of(scene), 300, 300) as page:
        page.evaluate(RECORD_COPIES)
        for name in ("shadertoy", "glsl", "wgsl"):
            page.locator(f'[data-text="{name}"]').click()
            chromium.wait_until(page, "window.copied")
            assert page.evaluate("window.copied") == _text(name, scene)
            page.evaluate("window.copied = ''")


def texts_in(page):
    (texts,) = re.findall(r'id="texts">(.*?)</script>', page, re.DOTALL)
    return json.loads(texts, strict=False)  # its line breaks are as they are


def test_a_text_too_long_to_be_readable_is_in_a_table(opened, monkeypatch):
    """Of all kinds, paints and joins; a host without tables has it readable."""
    monkeypatch.setattr(page_texts, "TEXT_LIMIT", 1000)
    scene = random_scene(layers=8, seed=6, width=30, height=20)
    scene = replace(
        scene,
        layers=(*scene.layers, Layer((Shape.of("circle", (1, 0, 0), center=(0, -1e-7), radius=2),), 0.0)),
    )
    with opened(page_anew(scene), 300, 300) as page:
        page.evaluate(RECORD_COPIES)
        for name, layout in (("shadertoy", "table"), ("glsl", "table"), ("wgsl", "readable")):
            page.locator(f'[data-text="{name}"]').click()
            chromium.wait_until(page, "window.copied")
            assert page.evaluate("window.copied") == _text(name, scene, layout)
            page.evaluate("window.copied = ''")


def test_a_text_too_long_for_a_table_is_as_exported(monkeypatch):
    monkeypatch.setattr(page_texts, "TEXT_LIMIT", 1000)
    monkeypatch.setattr(page_texts, "fits_constants", lambda scene: False)
    assert texts_in(page_anew(SCENE))["shadertoy"] == sdf2vec.export(
        held(SCENE), "shadertoy", title=TITLE, alone=True
    )


def _canonical(drawing):
    return ElementTree.canonicalize(drawing, strip_text=True)


def png_of_red():
    return encode_png(np.broadcast_to(np.array([1, 0, 0], np.float32), (8, 12, 3)))


def test_slider_uncovers_the_original(opened):
    red = png_of_red()
    blue = Scene(12, 8, (Layer((Shape.of("circle", (0, 0, 1), center=(0, 0), radius=3),), 0.1),))
    with opened(page_of(blue, original=red), 300, 300) as page:
        chromium.wait_until(page, "document.querySelector('canvas').width > 1")
        page.locator("#split").focus()
        for _ in range(20):
            page.keyboard.press("ArrowRight")
        shown = chromium.screenshot(page, ".picture")
        edge = int(shown.shape[1] * 0.7)
        np.testing.assert_allclose(
            shown[20, 5 : edge - 3, :3], np.broadcast_to([1, 0, 0], (edge - 8, 3)), atol=0.01
        )
        np.testing.assert_allclose(shown[20, edge + 3 : -5, 2], 1, atol=0.01)
        assert page.evaluate("document.querySelector('.original').alt")


def test_what_is_in_the_picture_is_the_name_of_all_that_show_it(opened):
    with opened(page_of(SCENE, alt="A <cat>", original=png_of_red()), 300, 300) as page:
        assert page.get_by_role("img", name="A <cat>").count() == 2
        assert page.locator("svg desc").text_content() == "A <cat>"


def test_page_speaks_to_screen_readers(opened):
    with opened(page_of(SCENE), 300, 300) as page:
        name = page.evaluate("document.querySelector('canvas').getAttribute('aria-label')")
        assert name == 'a "quoted" <picture>'
        assert page.get_by_role("img", name="quoted").count() >= 1
        assert page.get_by_role("button").count() == 4
        assert page.evaluate("document.documentElement.lang") == "en"


def test_texts_can_not_end_the_script():
    page = sdf2vec.export(SCENE, "html", title="</script><script>alert(1)</script>")
    assert isinstance(page, str)
    assert set(texts_in(page)) == {"shadertoy", "glsl", "wgsl"}
    assert "<script>alert" not in page


@pytest.mark.parametrize("layers", [0, 1])
def test_hardly_any_shapes(layers, opened):
    scene = Scene(30, 30, random_scene(("circle",), layers=layers).layers, (0.2, 0.4, 0.6))
    with opened(page_of(scene), 300, 400) as page:
        assert_shows(page, scene)

"""Hostile words in every target, drawn in a browser under a strict Content-Security-Policy: nothing runs."""

import base64
import hashlib
import json
import re
from html import escape

import pytest

import sdf2vec
from sdf2vec import Layer, Scene, Shape
from sdf2vec.engines import chromium
from sdf2vec.export import EXPORTERS
from sdf2vec.scene_file import dumps

RUN = "window.ran = true"
HOSTILE = (
    f"</script><script>{RUN}</script>--><img src=x onerror='{RUN}'>]]>*/ \" onload=\"{RUN}\n\u2028\u202e\udc80"
    f"`${{{RUN}}}</style></title></svg><svg onload={RUN}>"
)
SCENE = Scene(30, 20, (Layer((Shape.of("circle", (1, 0, 0), center=(0, 0), radius=0.3),), 0.05),), (0, 0, 1))
DRAWN = "() => [...document.querySelectorAll('canvas')].some((canvas) => canvas.width > 1 && !canvas.hidden)"
IN_ELEMENT = (
    "() => { const c = document.querySelector('sdf-image').shadowRoot?.querySelector('canvas');"
    " return c?.width > 1 && !c.hidden }"
)


def text_of(target, **options):
    text = sdf2vec.export(SCENE, target, **options)
    assert isinstance(text, str)
    return text


def digest(text):
    return f"'sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}'"


def red_in_the_middle(page, selector):
    pixels = chromium.screenshot(page, selector)
    height, width = pixels.shape[:2]
    return pixels[height // 2, width // 2].tolist()[:3] == pytest.approx([1, 0, 0], abs=0.05)


def test_a_page_with_hostile_words_works_under_its_own_policy(require_engine):
    require_engine("chromium")
    text = text_of("html", title=HOSTILE, alt=HOSTILE)
    (policy,) = re.findall(r'http-equiv="Content-Security-Policy" content="([^"]*)"', text)
    assert policy.startswith("default-src 'none'")
    assert "unsafe" not in policy
    said: list[str] = []
    with chromium.opened({"index.html": text}, 200, 300) as page:
        page.on("console", lambda message: said.append(message.text))
        page.reload()
        chromium.wait_until(page, DRAWN)
        page.wait_for_timeout(300)
        assert red_in_the_middle(page, "canvas")
        assert page.evaluate("window.ran") is None
        assert page.locator("svg").count() == 1  # the drawing, and none that the title has begun
    assert said == []


def test_a_script_that_got_into_a_page_would_not_run(require_engine):
    """Even so: the policy is what forbids it."""
    require_engine("chromium")
    text = text_of("html").replace("</main>", f"<script>{RUN}</script></main>")
    with chromium.opened({"index.html": text}, 200, 300) as page:
        page.wait_for_timeout(200)
        assert page.evaluate("window.ran") is None


def test_the_element_works_under_a_strict_policy(require_engine):
    """Its module by its hash, the scene from the page's own place; no style has to be allowed."""
    require_engine("chromium")
    module = text_of("component")
    policy = f"default-src 'none'; script-src {digest(module)}; connect-src 'self'"
    page = (
        f'<!DOCTYPE html><meta http-equiv="Content-Security-Policy" content="{policy}">'
        f'<script type="module" src="sdf-image.js" integrity={digest(module)}></script>'
        f'<sdf-image src="a.scene.json" alt="{escape(HOSTILE.encode("utf-8", "replace").decode())}"></sdf-image>'
    )
    said: list[str] = []
    files = {"index.html": page, "sdf-image.js": module, "a.scene.json": dumps(SCENE)}
    with chromium.opened(files, 200, 300) as shown:
        shown.on("console", lambda message: said.append(message.text))
        shown.reload()
        chromium.wait_until(shown, IN_ELEMENT)
        shown.wait_for_timeout(300)
        assert red_in_the_middle(shown, "sdf-image")
        assert shown.evaluate("window.ran") is None
    assert said == []


@pytest.mark.parametrize("target", ["svg", "data-uri"])
@pytest.mark.parametrize("profile", ["filters", "portable"])
def test_drawings_with_hostile_words_run_nothing(target, profile, require_engine):
    """As a document of its own, where scripts would run; and as a picture in a page."""
    require_engine("chromium")
    drawing = text_of("svg", title=HOSTILE, alt=HOSTILE, svg_profile=profile)
    page = drawing[drawing.index("<svg") :] if target == "svg" else "<!DOCTYPE html>"
    if target == "data-uri":
        address = text_of(target, title=HOSTILE, alt=HOSTILE, svg_profile=profile)
        page += f'<img src="{escape(address)}" width="60" height="40">'
    with chromium.opened({"index.html": page}, 60, 40) as shown:
        shown.wait_for_timeout(100)
        assert red_in_the_middle(shown, "img, svg")
        assert shown.evaluate("window.ran") is None


@pytest.mark.parametrize("target", ["three", "component"])
def test_modules_with_hostile_words_run_nothing(target, require_engine):
    require_engine("chromium")
    module = text_of(target, title=HOSTILE)
    page = '<!DOCTYPE html><script type="module" src="it.js"></script>'
    said: list[str] = []
    with chromium.opened({"index.html": page, "it.js": module}, 60, 40) as shown:
        shown.on("pageerror", lambda error: said.append(str(error)))
        shown.reload()
        assert shown.evaluate("import('./it.js').then((made) => Object.keys(made).length > 0)")
        assert shown.evaluate("window.ran") is None
    assert said == []


@pytest.mark.parametrize(
    "target", [name for name in EXPORTERS if name not in ("html", "svg", "data-uri", "pdf")]
)
def test_no_other_target_holds_what_ends_a_comment_or_a_line(target):
    """The title of a shader is one line of a comment, that of a picture is in none."""
    titled = "title" in EXPORTERS[target].heeds
    made = sdf2vec.exported(SCENE, target, title=HOSTILE) if titled else sdf2vec.exported(SCENE, target)
    raw = made.raw
    if target in ("png", "jpg", "webp", "sdf"):
        assert RUN.encode() not in raw
        return
    text = raw.decode()
    assert not any(mark in text for mark in ("\u2028", "\u202e", "\udc80"))
    held = [line for line in text.splitlines() if RUN in line]
    assert all(line.startswith(("//", "/*", " *")) for line in held)
    if target == "json":
        assert json.loads(text)["width"] == 30

"""What needs a web page to be seen, drawn by Chromium: the page itself, an image's address, an element, a material.

Each function draws into `width` × `height` pixels and returns float32 `[height, width, 4]` in 0..1 with straight alpha.
"""

import math
import os
from pathlib import Path

from playwright.sync_api import Page

from sdf2vec.engines.chromium import drawn, probe, screenshot, wait_until
from sdf2vec.engines.engine import EngineError, Picture
from sdf2vec.npm import NODE_MODULES

__all__ = ["element", "image", "material", "page", "probe", "probe_three"]

MARGIN = 32  # pixels at both sides of the picture on the page
SHARE = 0.85  # of the window's height that the picture may take

IMAGE = """<!DOCTYPE html><style>*{{margin:0}}img{{display:block;width:100vw;height:100vh}}</style>
<img src="{address}" alt="">"""

ELEMENT = """<!DOCTYPE html><style>*{margin:0}</style><script type="module" src="sdf-image.js"></script>
<sdf-image src="picture.scene.json" alt="A picture"><p>Not drawn</p></sdf-image>"""

MATERIAL = """<!DOCTYPE html><style>*{{margin:0}}canvas{{display:block}}</style><script type="module">
import * as THREE from "./three.module.min.js";
import {{ createMaterial, aspect }} from "./material.js";
const renderer = new THREE.WebGLRenderer({{ antialias: false, alpha: true }});
renderer.setSize({width}, {height});
document.body.append(renderer.domElement);
const scene = new THREE.Scene();
scene.add(new THREE.Mesh(new THREE.PlaneGeometry(aspect, 1), createMaterial(THREE)));
renderer.render(scene, new THREE.OrthographicCamera(-aspect / 2, aspect / 2, 0.5, -0.5, -1, 1));
document.title = "drawn";
</script>"""

TWO_FRAMES = "new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))"


def page(html: str, width: int, height: int) -> Picture:
    """The picture on the page that `sdf2vec.export.page` makes."""
    window = width + MARGIN, math.ceil((height + 1) / SHARE)
    canvas = "document.querySelector('canvas')"

    def draw(shown: Page) -> Picture:
        _wait_for(shown, canvas, width, height)
        return screenshot(shown, "canvas")[:height, :width]  # a fractional box is rounded up

    return drawn({"index.html": html}, *window, draw)


def image(address: str, width: int, height: int) -> Picture:
    """What an `<img>` with this address shows."""
    return drawn({"index.html": IMAGE.format(address=address)}, width, height, screenshot)


def element(module: str, width: int, height: int, scene: str | bytes) -> Picture:
    """A scene file, JSON or compact, in the element that a module defines."""
    files: dict[str, str | bytes] = {"index.html": ELEMENT, "sdf-image.js": module}
    files["picture.scene.json"] = scene
    canvas = "document.querySelector('sdf-image').shadowRoot?.querySelector('canvas')"

    def draw(shown: Page) -> Picture:
        _wait_for(shown, canvas, width, height)
        return screenshot(shown, "sdf-image")[:height, :width]

    return drawn(files, width, height, draw)


def material(module: str, width: int, height: int) -> Picture:
    """A rectangle with the three.js material that a module makes."""
    files = {"index.html": MATERIAL.format(width=width, height=height), "material.js": module}

    def draw(shown: Page) -> Picture:
        wait_until(shown, "document.title === 'drawn'")
        shown.evaluate(TWO_FRAMES)
        return screenshot(shown, "canvas")

    return drawn(files | _three_modules(), width, height, draw)


def _wait_for(shown: Page, canvas: str, width: int, height: int) -> None:
    """Until a canvas has its size, and is painted."""
    wait_until(
        shown,
        f"([w, h]) => {{ const c = {canvas}; return c?.width === w && Math.abs(c.height - h) < 2 }}",
        [width, height],
    )
    shown.evaluate(TWO_FRAMES)


def probe_three() -> None:
    """Raises where the browser does not start or three.js is not here."""
    probe()
    if not _three_modules():
        raise EngineError("three.js is not here: make engines")


def _three_modules() -> dict[str, str | bytes]:
    """The modules of three.js by name; SDF2VEC_THREE names another folder than where `make engines` puts them."""
    named = os.environ.get("SDF2VEC_THREE")
    folder = Path(named) if named else NODE_MODULES / "three" / "build"
    return {path.name: path.read_text() for path in folder.glob("three.*.min.js")}

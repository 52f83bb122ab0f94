"""The web component in a real browser, and the JavaScript that its formulas are lowered to."""

import json

import numpy as np
import pytest

import sdf2vec
from sdf2vec import Scene
from sdf2vec.engines import chromium
from sdf2vec.engines.pages import ELEMENT
from sdf2vec.expr import var
from sdf2vec.graph import scalarize
from sdf2vec.lower.javascript import function_text
from sdf2vec.render import reference
from sdf2vec.scene_file import dumps
from tests.operations import MEANINGS, expected
from tests.scenes import random_scene


@pytest.fixture
def opened(require_engine):
    require_engine("chromium")

    def show(scene, width, height, page=ELEMENT):
        files = {"index.html": page, "sdf-image.js": module(), "picture.scene.json": scene}
        return chromium.opened(files, width, height)

    return show


def module():
    text = sdf2vec.export(Scene(1, 1, ()), "component")
    assert isinstance(text, str)
    return text


def assert_shows(page, scene, width, height):
    page.wait_for_function(
        "([w, h]) => { const c = document.querySelector('sdf-image').shadowRoot.querySelector('canvas');"
        " return c && c.width === w && c.height === h }",
        arg=[width, height],
    )
    page.wait_for_timeout(300)
    expected = reference.render(scene, width, height).permute(1, 2, 0).numpy()
    shown = chromium.screenshot(page, "sdf-image")
    shown[..., :3] *= shown[..., 3:]
    assert 255 * np.abs(shown - expected).max() <= 2.1


@pytest.mark.parametrize("compositing", ["over", "additive"])
def test_it_shows_a_scene_file_and_follows_its_size(compositing, opened):
    scene = random_scene(compositing=compositing, layers=20, seed=7, width=90, height=60)
    with opened(dumps(scene), 300, 200) as page:
        assert_shows(page, scene, 300, 200)
        assert page.get_by_role("img", name="A picture").count() == 1
        page.set_viewport_size({"width": 120, "height": 80})
        assert_shows(page, scene, 120, 80)


@pytest.mark.parametrize("layers", [0, 1])
def test_hardly_any_shapes_on_no_ground(layers, opened):
    scene = random_scene(("circle",), layers=layers, seed=7, width=50, height=50, transparent=True)
    with opened(dumps(scene), 150, 150) as page:
        assert_shows(page, scene, 150, 150)


@pytest.mark.parametrize("content", ["{}", "not json"])
def test_what_is_inside_stays_where_nothing_can_be_shown(content, opened):
    with opened(content, 200, 100) as page:
        page.wait_for_timeout(300)
        assert page.get_by_text("Not drawn").is_visible()


def test_every_operation_means_the_same_in_javascript(opened):
    texts, calls = [], []
    for name, meaning in MEANINGS.items():
        inputs = [var(f"v{i}") for i in range(meaning.arity)]
        texts.append(function_text(f"{name}_", scalarize(meaning.build(*inputs)), inputs))
        rows = [list(map(float, row)) for row in meaning.cases]
        calls.append(f"{json.dumps(rows)}.map((row) => {name}_(...row))")
    script = " ".join(texts)
    with opened("{}", 10, 10, f"<script>{script}</script>") as page:
        found = page.evaluate(f"[{', '.join(calls)}]")
    for (name, meaning), values in zip(MEANINGS.items(), found, strict=True):
        wanted = expected(meaning, np.array(meaning.cases))
        np.testing.assert_allclose(np.array(values, float).T, wanted, rtol=1e-9, atol=1e-12, err_msg=name)

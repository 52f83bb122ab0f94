"""The web component in a real browser, and the JavaScript that its formulas are lowered to."""

import base64
import json
import random
from contextlib import contextmanager
from dataclasses import replace

import numpy as np
import pytest

import sdf2vec
from sdf2vec import Scene
from sdf2vec.compact_file import PRECISIONS, written
from sdf2vec.engines import chromium
from sdf2vec.engines.pages import ELEMENT
from sdf2vec.expr import var
from sdf2vec.graph import scalarize
from sdf2vec.lower.javascript import function_text
from sdf2vec.render import reference
from sdf2vec.scene_file import dumps
from tests.operations import MEANINGS, expected
from tests.scenes import FIRST_COMPACT, random_scene


@pytest.fixture(scope="module", autouse=True)
def browser_of_its_own():
    """After hundreds of other pages Chromium may draw no frame of a canvas for minutes."""
    chromium.renew()


@pytest.fixture
def opened(require_engine):
    require_engine("chromium")

    def show(scene, width, height, page=ELEMENT):
        files = {"index.html": page, "sdf-image.js": module(), "picture.scene.json": scene}
        return chromium.opened(files, width, height)

    return show


@pytest.fixture
def reading(require_engine):
    """A page whose function `read` reads scenes as the element does."""
    require_engine("chromium")

    @contextmanager
    def show():
        files = {"index.html": MODULE, "sdf-image.js": f"{module()}\nwindow.read = sceneOf;"}
        with chromium.opened(files, 50, 50) as page:
            chromium.wait_until(page, "Boolean(window.read)", seconds=10)
            yield page

    return show


def module():
    text = sdf2vec.export(Scene(1, 1, ()), "component")
    assert isinstance(text, str)
    return text


def assert_shows(page, scene, width, height):
    chromium.wait_until(
        page,
        "([w, h]) => { const c = document.querySelector('sdf-image').shadowRoot.querySelector('canvas');"
        " return c && c.width === w && c.height === h }",
        [width, height],
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


@pytest.mark.parametrize("compositing", ["over", "additive"])
def test_compact_scenes_are_read_as_python_reads_them(compositing, reading):
    """To the last digit, whatever kinds, paints, joins and ground there are."""
    scenes = [
        random_scene(compositing=compositing, layers=14, seed=seed, transparent=bool(seed))
        for seed in range(2)
    ]
    files = [written(scene, dict.fromkeys(PRECISIONS, bits)) for scene in scenes for bits in (5, 13)]
    with reading() as page:
        for file in (*files, base64.b64decode(FIRST_COMPACT)):
            compact, plain = base64.b64encode(file).decode(), json.loads(dumps(sdf2vec.loads(file)))
            found = page.evaluate(
                "(data) => read(Uint8Array.from(atob(data), (c) => c.charCodeAt(0)))", compact
            )
            assert found == page.evaluate("(scene) => read(scene)", plain)


def test_compact_scenes_from_a_file_an_attribute_and_an_address(require_engine):
    """Under a policy that lets nothing be fetched but the file."""
    require_engine("chromium")
    scene = random_scene(layers=5, seed=2, width=50, height=50)
    file = written(scene, dict.fromkeys(PRECISIONS, 12))
    address = sdf2vec.export(scene, "sdf-uri")
    assert isinstance(address, str)
    allowed = "default-src 'none'; script-src 'self'; connect-src 'self'; style-src 'unsafe-inline'"
    policy = f'<meta http-equiv="Content-Security-Policy" content="{allowed}">'
    elements = [
        '<sdf-image src="a.sdf"></sdf-image>',
        f'<sdf-image data="{base64.b64encode(file).decode()}"></sdf-image>',
        f'<sdf-image src="{address}"></sdf-image>',
    ]
    page = policy + GRID + MODULE + "".join(elements)
    with chromium.opened({"index.html": page, "sdf-image.js": module(), "a.sdf": file}, 400, 80) as shown:
        sent = sdf2vec.loads(base64.b64decode(address.partition(",")[2]))
        assert_all_shown(shown, [sdf2vec.loads(file), sdf2vec.loads(file), sent])


@pytest.mark.parametrize(("layers", "ground"), [(0, None), (1, (0.8, 0.3, 0.1, 0.4))])
def test_hardly_any_shapes_on_no_ground_and_on_a_faint_one(layers, ground, opened):
    drawn = random_scene(("circle",), layers=layers, seed=7, width=50, height=50)
    scene = replace(drawn, background=ground)
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


# --- many elements, lost contexts ------------------------------------------------------------------------------

COUNT_CONTEXTS = """<script>window.contexts = [];
const before = HTMLCanvasElement.prototype.getContext;
HTMLCanvasElement.prototype.getContext = function (kind, ...more) {
  const made = before.call(this, kind, ...more);
  if (kind === "webgl2" && made && !contexts.includes(made)) contexts.push(made);
  return made;
};</script>"""
GRID = (
    "<style>*{margin:0}body{display:grid;grid-template-columns:repeat(10,40px);grid-auto-rows:40px}</style>"
)
MODULE = '<script type="module" src="sdf-image.js"></script>'
SHOWN = (
    """[...document.querySelectorAll('sdf-image')].map((e) => e.shadowRoot?.querySelector('slot').hidden)"""
)


def element(name):
    return f'<sdf-image src="{name}" alt="{name}"><p>Not drawn</p></sdf-image>'


def assert_all_shown(page, scenes, shown=None):
    """Every element of the grid shows its scene, in 40 × 40 pixels."""
    chromium.wait_until(page, f"{SHOWN}.length === {len(scenes)} && {SHOWN}.every(Boolean)")
    page.wait_for_timeout(300)
    pixels = chromium.screenshot(page)
    pixels[..., :3] *= pixels[..., 3:]
    for index, scene in enumerate(scenes):
        row, column = divmod(index, 10)
        found = pixels[40 * row : 40 * row + 40, 40 * column : 40 * column + 40]
        expected = reference.render(scene, 40, 40).permute(1, 2, 0).numpy()
        assert 255 * np.abs(found - expected).max() <= 2.1


def test_two_dozen_elements_share_one_context(require_engine):
    """Browsers give a page 16 contexts or so. Scenes of any size and compositing share it."""
    require_engine("chromium")
    several = [
        random_scene(
            compositing=compositing,
            layers=3 + seed,
            seed=seed,
            width=50,
            height=50,
            transparent=bool(seed % 2),
        )
        for seed in range(3)
        for compositing in ("over", "additive")
    ]
    files = {f"{i}.scene.json": dumps(scene) for i, scene in enumerate(several)}
    order = [i % len(several) for i in range(24)]
    page = COUNT_CONTEXTS + GRID + MODULE + "".join(element(f"{i}.scene.json") for i in order)
    with chromium.opened({"index.html": page, "sdf-image.js": module(), **files}, 400, 240) as shown:
        assert_all_shown(shown, [several[i] for i in order])
        assert shown.evaluate("contexts.length") == 1


def test_a_lost_context_keeps_what_is_shown_and_comes_back(require_engine):
    require_engine("chromium")
    scene = random_scene(layers=5, seed=2, width=50, height=50)
    page = COUNT_CONTEXTS + GRID + MODULE + element("a.scene.json")
    files = {"index.html": page, "sdf-image.js": module(), "a.scene.json": dumps(scene)}
    with chromium.opened(files, 400, 80) as shown:
        assert_all_shown(shown, [scene])
        shown.evaluate("window.lose = contexts[0].getExtension('WEBGL_lose_context'); lose.loseContext()")
        shown.evaluate(f"document.body.insertAdjacentHTML('beforeend', `{element('a.scene.json')}`)")
        shown.wait_for_timeout(500)
        assert shown.evaluate(SHOWN) == [True, False]
        assert shown.get_by_text("Not drawn").nth(1).is_visible()
        shown.evaluate("lose.restoreContext()")
        assert_all_shown(shown, [scene, scene])
        assert shown.evaluate("contexts.length") == 1


def test_an_element_moved_in_its_page_goes_on(opened):
    scene = random_scene(layers=5, seed=2, width=60, height=40)
    with opened(dumps(scene), 300, 200) as page:
        assert_shows(page, scene, 300, 200)
        page.evaluate("const e = document.querySelector('sdf-image'); e.remove(); document.body.append(e)")
        page.set_viewport_size({"width": 150, "height": 100})
        assert_shows(page, scene, 150, 100)


# --- hostile files ---------------------------------------------------------------------------------------------

GOOD = json.loads(dumps(random_scene(("circle",), layers=2, seed=3, width=50, height=50)))
JOINED = {"shapes": [{"kind": "circle", "center": [0, 0], "radius": 0.1, "color": [1, 0, 0]}] * 2}
WIDE = {"kind": "circle", "center": [0, 0], "radius": 9, "color": [1, 0, 0], "opacity": 0.5, "falloff": 0.1}


def changed(path, value):
    """The good scene with one field changed."""
    scene = json.loads(json.dumps(GOOD))
    place = scene
    for key in path[:-1]:
        place = place[key]
    place[path[-1]] = value
    return scene


HOSTILE = [
    (changed(["background"], ["0.0); discard; //", 0, 0]), "background"),
    (changed(["background"], "red"), "background"),
    (changed(["background"], [0, 0, 2]), "background"),
    (changed(["background"], [0, 0, 0, 2]), "background"),
    (changed(["background"], [0, 0, 0, 0, 0]), "background"),
    (changed(["width"], 1e9), "width"),
    (changed(["width"], "50"), "width"),
    (changed(["height"], 0), "height"),
    (changed(["compositing"], "constructor"), "compositing"),
    (changed(["layers"], {"length": 3}), "layers"),
    (changed(["layers"], [None]), "layers[0]"),
    (changed(["layers", 1, "kind"], "__proto__"), "layers[1].kind"),
    (changed(["layers", 1, "paint"], "toString"), "layers[1].paint"),
    (changed(["layers", 1, "radius"], -1), "layers[1].radius"),
    (changed(["layers", 1, "radius"], 0), "layers[1].radius"),
    (changed(["layers", 1, "radius"], 1e300), "layers[1].radius"),
    (changed(["layers", 1, "radius"], None), "layers[1].radius"),
    (changed(["layers", 1, "radius"], [1]), "layers[1].radius"),
    (changed(["layers", 1, "center"], [0]), "layers[1].center"),
    (changed(["layers", 0, "color"], [-0.1, 0, 0]), "layers[0].color"),
    (changed(["layers", 0, "opacity"], -0.5), "layers[0].opacity"),
    (changed(["layers", 0], JOINED | {"shapes": []}), "layers[0].shapes"),
    (changed(["layers", 0], JOINED | {"shapes": JOINED["shapes"] * 80}), "layers[0].shapes"),
    (
        changed(["layers", 0], {"shapes": [*JOINED["shapes"], JOINED["shapes"][0] | {"join": "xor"}]}),
        "shapes[2].join",
    ),
    (
        changed(["layers", 0], {"shapes": [JOINED["shapes"][0], JOINED["shapes"][0] | {"smoothness": -1}]}),
        "smoothness",
    ),
    (changed(["layers"], [WIDE] * 65536), "layers"),
    (changed(["layers"], [WIDE] * 8192), "layers"),
    ([], "format"),
    (None, "format"),
]


def test_what_scene_files_may_not_say_is_refused(opened):
    """As `loads` refuses it, but for what is too much for a page; and nothing of it gets into a shader."""
    names = [words for _, words in HOSTILE]
    for scene, _ in HOSTILE[:-4]:
        with pytest.raises(sdf2vec.Sdf2vecError):
            sdf2vec.loads(json.dumps(scene))
    collect = """(scenes) => {
      const e = document.querySelector('sdf-image');
      return scenes.map((scene) => { try { e.show(scene); return 'shown' } catch (error) { return error.message } });
    }"""
    with opened(json.dumps(GOOD), 100, 100) as page:
        chromium.wait_until(page, f"{SHOWN}[0]")
        found = page.evaluate(collect, [scene for scene, _ in HOSTILE])
        assert [words in said for words, said in zip(names, found, strict=True)] == [True] * len(names), found
        assert_shows(page, sdf2vec.loads(json.dumps(GOOD)), 100, 100)


def test_what_compact_files_may_not_say_is_refused(reading):
    """As `loads` refuses it; and of random ones nothing is worse than refused."""
    scene = random_scene(("circle",), layers=2, seed=3, width=50, height=50)
    good, r = written(scene, dict.fromkeys(PRECISIONS, 9)), random.Random(5)
    files = [good[:5], good[:-9], good + b"and more", good[:4] + b"\x02" + good[5:], b"{}"]
    for _ in range(150):
        changed = bytearray(good)
        changed[r.randrange(5, len(good))] = r.randrange(256)
        files.append(bytes(changed))
    collect = """(files) => {
      return files.map((data) => { try { window.read(Uint8Array.from(atob(data), (c) => c.charCodeAt(0))); return '' }
        catch (error) { return error.constructor.name + error.message } });
    }"""
    with reading() as page:
        found = page.evaluate(collect, [base64.b64encode(file).decode() for file in files])
    for file, said in zip(files, found, strict=True):
        assert bool(said) == _is_refused(file), (file, said)
        assert said.startswith("Error") or not said


def _is_refused(file):
    try:
        sdf2vec.loads(file)
    except sdf2vec.Sdf2vecError:
        return True
    return False


@pytest.mark.parametrize(("width", "height"), [(65536, 1), (1, 65536)])
def test_the_thinnest_scene_is_quick(opened, width, height):
    scene = random_scene(("circle",), layers=40, seed=3, width=width, height=height)
    with opened(dumps(scene), 100, 100) as page:
        chromium.wait_until(page, f"{SHOWN}[0]", seconds=20)

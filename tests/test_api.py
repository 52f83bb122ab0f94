"""The public functions, in the words of the command line."""

import base64
import io
import subprocess
import sys
from dataclasses import replace
from importlib.resources import files
from types import FunctionType
from typing import TYPE_CHECKING

import numpy as np
import pytest
from PIL import Image

import sdf2vec
from sdf2vec import Layer, Scene, Sdf2vecError, Shape, keyword_text, keywords, quality
from sdf2vec.declared import options_of
from sdf2vec.export import EXPORTERS
from sdf2vec.export.options import Options
from sdf2vec.fit.presets import PRESETS
from sdf2vec.fit.settings import LOSS_NAMES, READERS, Settings, kinds_of, losses_of, settings_of
from sdf2vec.image import load
from tests.scenes import SOFT

if TYPE_CHECKING:
    from sdf2vec.fit.loop import Progress


@pytest.fixture(autouse=True)
def short_fits(monkeypatch):
    """Three steps a phase: what is tested here is not the fit."""
    short = tuple(replace(phase, steps=3) for phase in PRESETS["fast"].phases)
    monkeypatch.setitem(PRESETS, "fast", replace(PRESETS["fast"], phases=short))


@pytest.fixture(scope="module")
def levels():
    return np.random.default_rng(0).integers(0, 256, (16, 24, 3), dtype=np.uint8)


def fit(image, shapes=6, **settings):
    return sdf2vec.fit(image, shapes, preset="fast", **settings)


def red_circle(background: tuple[float, float, float] | None = (0, 0, 1)):
    circle = Shape.of("circle", (1, 0, 0), center=(0, 0), radius=0.25)
    return Scene(24, 16, (Layer((circle,), 0.1, 0.5),), background)


def test_a_picture_is_the_same_in_every_form(levels, tmp_path):
    path = tmp_path / "photo.png"
    Image.fromarray(levels).save(path)
    expected = fit(str(path))
    assert expected.shape_count == 6
    forms = [
        path,
        path.read_bytes(),
        io.BytesIO(path.read_bytes()),
        Image.fromarray(levels),
        levels,
        levels[:, :, ::-1][:, :, ::-1],
        levels.astype(np.float32) / 255,
        levels / 255.0,
        load(path),
    ]
    for form in forms:
        assert fit(form) == expected
    assert fit(255 - levels) != expected


def test_fitting_leaves_the_array_alone(levels):
    before = levels.copy()
    fit(levels)
    assert (levels == before).all()


def test_settings_matter_and_defaults_are_said(levels):
    assert fit(levels, seed=1) == fit(levels, seed=1)
    assert fit(levels, seed=1) != fit(levels, seed=2)
    assert fit(levels, seed=np.int64(1)) == fit(levels, seed=1)
    assert {layer.shapes[0].kind for layer in fit(levels).layers} == {"triangle"}
    assert {layer.shapes[0].kind for layer in fit(levels, kind=["circle"]).layers} == {"circle"}
    assert {layer.shapes[0].kind for layer in fit(levels, 12, kind="circle,box").layers} == {"circle", "box"}
    assert fit(levels, compositing="additive").compositing == "additive"
    assert fit(levels, loss="mse") != fit(levels, loss="l1")
    assert settings_of().shapes == "auto"


def test_names_of_kinds():
    assert kinds_of("box") == ("box",)
    assert kinds_of(["box", "circle", "box"]) == ("circle", "box")
    assert kinds_of("mixed") == kinds_of(["box", "mixed"]) == SOFT


def test_transparency_is_kept(levels):
    alpha = np.zeros((16, 24, 1), np.uint8)
    alpha[4:12, 6:18] = 255
    assert fit(np.concatenate([levels, alpha], axis=2)).background is None
    assert fit(np.concatenate([levels, alpha * 0 + 255], axis=2)) == fit(levels)


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"shapes": 0}, "number of shapes .* got 0"),
        ({"shapes": 65537}, "number of shapes .* got 65537"),
        ({"shapes": 2.5}, "number of shapes .* got 2.5"),
        ({"shapes": "3"}, "number of shapes .* got '3'"),
        ({"shapes": True}, "number of shapes .* got True"),
        ({"seed": -1}, "seed .* got -1"),
        ({"seed": 2**63}, "seed"),
        ({"seed": None}, "seed .* got None"),
        ({"kind": "star"}, "unknown kind 'star'; choose from circle"),
        ({"kind": []}, "at least one kind"),
        ({"kind": ["mixed", "star"]}, "unknown kind 'star'"),
        ({"compositing": "multiply"}, "unknown compositing 'multiply'; choose from over, additive"),
        ({"preset": "slow"}, "unknown preset 'slow'"),
        ({"loss": "l3"}, "unknown loss 'l3'; choose from l1, mse, ssim, flip"),
        ({"loss": ""}, "unknown loss ''"),
        ({"loss": "l1,"}, "unknown loss ''"),
        ({"loss": ()}, "at least one loss"),
        ({"loss": "l1:0.8,l3:0.2"}, "unknown loss 'l3'"),
        ({"loss": "l1:a lot"}, "name or name:weight, got 'l1:a lot'"),
        ({"loss": "l1:"}, "name or name:weight, got 'l1:'"),
        ({"loss": "l1:1:2"}, "name or name:weight, got 'l1:1:2'"),
        ({"loss": "l1:0"}, "weight of loss 'l1' must be positive and finite, got 0"),
        ({"loss": "l1:-1"}, "weight of loss 'l1' .* got -1"),
        ({"loss": "l1:nan"}, "weight of loss 'l1' .* got nan"),
        ({"loss": "l1:inf,ssim"}, "weight of loss 'l1' .* got inf"),
        ({"loss": "l1,ssim,l1:2"}, "loss 'l1' is given twice"),
        ({"loss": [("l1", None)]}, r"name or name:weight, got \('l1', None\)"),
        ({"loss": [3]}, "name or name:weight, got 3"),
    ],
)
def test_impossible_settings(levels, settings, words):
    with pytest.raises(Sdf2vecError, match=words) as caught:
        sdf2vec.fit(levels, **settings)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("image", ["missing.png", b"", b"no picture", np.zeros((0, 3)), np.zeros(5), None, 3])
def test_impossible_pictures(image):
    with pytest.raises(Sdf2vecError) as caught:
        fit(image)
    assert "\n" not in str(caught.value)


@pytest.mark.usefixtures("kernels_there")
def test_the_callback_sees_every_step(levels):
    seen: list[Progress] = []

    def note(progress: "Progress") -> bool:
        seen.append(progress)
        return False

    scene = fit(levels, callback=note)
    steps = PRESETS["fast"].steps + 3 * PRESETS["fast"].phases[0].total  # so few shapes: from four starts
    assert [progress.step for progress in seen] == list(range(1, steps + 1))
    assert {progress.steps for progress in seen} == {steps}
    assert list(dict.fromkeys(progress.phase for progress in seen)) == [
        p.name for p in PRESETS["fast"].phases
    ]
    assert all(0 < progress.loss < 10 for progress in seen)
    assert scene == fit(levels)


@pytest.mark.usefixtures("kernels_there")
def test_the_callback_stops_the_fit(levels):
    seen = []

    def stop_at_second(progress):
        seen.append(progress.step)
        return progress.step == 2

    scene = fit(levels, callback=stop_at_second)
    assert seen == [1, 2]
    assert scene.shape_count == 6
    assert scene != fit(levels)


def test_render_of_a_known_scene():
    pixels = sdf2vec.render(red_circle())
    assert pixels.shape == (16, 24, 3)
    assert pixels.dtype == np.float32
    assert pixels[0, 0].tolist() == [0, 0, 1]
    assert pixels[8, 12] == pytest.approx([0.5, 0, 0.5], abs=1e-3)
    assert sdf2vec.render(red_circle(), 48, 32).shape == (32, 48, 3)


def test_render_of_a_transparent_scene_has_straight_alpha():
    pixels = sdf2vec.render(red_circle(None))
    assert pixels.shape == (16, 24, 4)
    assert pixels[8, 12] == pytest.approx([1, 0, 0, 0.5], abs=1e-3)
    assert pixels[0, 0].tolist() == [0, 0, 0, 0]
    with Image.open(io.BytesIO(_bytes(sdf2vec.export(red_circle(None), "png")))) as png:
        assert np.asarray(png)[8, 12].tolist() == [255, 0, 0, 128]


def _bytes(data):
    assert isinstance(data, bytes)
    return data


@pytest.mark.parametrize("target", EXPORTERS)
def test_an_export_is_text_or_bytes(target):
    scene = red_circle()
    data = sdf2vec.export(scene, target)
    assert data == sdf2vec.export(sdf2vec.loads(sdf2vec.dumps(scene)), target)
    assert isinstance(data, bytes if target in ("png", "jpg", "webp", "sdf", "pdf") else str)


def test_export_options_have_the_words_of_the_command_line():
    scene = red_circle()
    with Image.open(io.BytesIO(_bytes(sdf2vec.export(scene, "png", size=32)))) as png:
        assert png.size == (48, 32)
    assert str(sdf2vec.export(scene, "glsl", glsl="330")).startswith("#version 330")
    assert "vec4 table0[" in str(sdf2vec.export(scene, "glsl", layout="table"))
    assert "<title>my cat</title>" in str(sdf2vec.export(scene, "svg", title="my cat"))


@pytest.mark.parametrize(
    ("target", "options", "words"),
    [
        ("pdf2", {}, "unknown target 'pdf2'; choose from glsl"),
        ("", {}, "unknown target ''"),
        ("glsl", {"glsl": "110"}, "unknown GLSL version '110'"),
        ("glsl", {"layout": "loose"}, "unknown layout 'loose'"),
        ("png", {"size": 0}, "size in pixels must be a whole number between 1 and 16384, got 0"),
        ("png", {"size": 16384}, "png: 24576 x 16384 is more than 200 megapixels"),
    ],
)
def test_impossible_exports(target, options, words):
    with pytest.raises(Sdf2vecError, match=words) as caught:
        sdf2vec.export(red_circle(), target, **options)
    assert "\n" not in str(caught.value)


def test_check_redraws_exports(require_engine):
    require_engine("opengl")
    results = sdf2vec.check(red_circle(), ["glsl"], [(24, 16), (30, 40)])
    assert [(r.target, r.engine, r.width, r.height) for r in results] == [
        ("glsl", "opengl", 24, 16),
        ("glsl", "opengl", 30, 40),
    ]
    assert all(r.verdict == "same" and r.largest_error <= 0.25 and not r.missing for r in results)


def test_quality_is_that_of_the_8_bit_picture():
    """By hand: black against white is 0 dB, half grey against white 6.02; FLIP as in `test_flip`."""
    white = load(np.full((4, 4, 3), 255, np.uint8))
    black = quality.quality(Scene(4, 4, (), (0, 0, 0)), white)
    assert black[:2] == pytest.approx((0, 0.967389), abs=1e-4)
    assert black.flip_size == (4, 4)
    grey = quality.quality(Scene(4, 4, (), (0.5, 0.5, 0.5)), white)
    assert grey.psnr == pytest.approx(20 * np.log10(2))
    assert 0.5 < grey.flip < 0.967


def test_quality_of_a_transparent_scene():
    """Nothing against nothing, whatever colour it has; against white it is as black to white, over black only."""
    nothing, empty = np.zeros((4, 4, 4), np.uint8), Scene(4, 4, (), None)
    nothing[..., 0] = 200
    assert quality.quality(empty, load(nothing)).flip == 0
    white = np.full((4, 4, 4), 255, np.uint8)
    white[0, 0, 3] = 254  # else it counts as opaque
    assert quality.quality(empty, load(white)).flip == pytest.approx(0.967 / 2, abs=0.01)


def test_flip_of_a_large_picture_is_computed_on_a_smaller_one(monkeypatch):
    monkeypatch.setattr(quality, "FLIP_RESOLUTION", 20)
    picture = load(np.full((40, 90, 3), 128, np.uint8))
    result = quality.quality(Scene(90, 40, (), (0.5, 0.5, 0.5)), picture)
    assert result.flip_size == (30, 13)
    assert 0 < result.flip < 0.05


@pytest.mark.parametrize(
    ("loss", "expected"),
    [
        (None, None),
        ("flip", (("flip", 1.0),)),
        ("l1:0.8,ssim:.2", (("l1", 0.8), ("ssim", 0.2))),
        (" mse : 1e-3, flip", (("mse", 0.001), ("flip", 1.0))),
        ([("l1", 1), ("ssim", np.float32(0.5))], (("l1", 1.0), ("ssim", 0.5))),
        (["l1:2", ("flip", 1)], (("l1", 2.0), ("flip", 1.0))),
    ],
)
def test_losses_and_their_weights(loss, expected):
    assert losses_of(loss) == expected


def test_every_loss_has_a_name_here():
    from sdf2vec.fit.losses import LOSSES

    assert tuple(LOSSES) == LOSS_NAMES


def test_a_mixture_is_fitted(levels):
    mixture = fit(levels, loss="l1:0.5,flip:0.5")
    assert mixture == fit(levels, loss=[("l1", 0.5), ("flip", 0.5)])
    assert mixture != fit(levels, loss="l1")


def test_a_wrong_keyword_is_named_with_the_nearest_right_one(levels):
    with pytest.raises(TypeError, match="unknown option 'compositting'; did you mean 'compositing'"):
        fit(levels, compositting="over")
    with pytest.raises(TypeError, match="unknown option 'zzz'; known are shapes, kind"):
        fit(levels, zzz=1)
    with pytest.raises(TypeError, match="unknown option 'framming'; did you mean 'framing'"):
        sdf2vec.export(red_circle(), "glsl", framming="fit")  # type: ignore[call-arg]


def test_type_checkers_know_keywords_and_their_values(levels):
    """Here mypy would complain of a comment that hides nothing, so what is ignored is seen to be found."""
    with pytest.raises(TypeError, match="unknown option 'prset'; did you mean 'preset'"):
        sdf2vec.fit(levels, 1, prset="fast")  # type: ignore[call-arg]
    with pytest.raises(Sdf2vecError, match="unknown compositing 'ovr'"):
        sdf2vec.fitted(levels, 1, compositing="ovr")  # type: ignore[arg-type]
    with pytest.raises(Sdf2vecError, match="seed"):
        sdf2vec.fit(levels, 1, seed="1")  # type: ignore[arg-type]
    with pytest.raises(Sdf2vecError, match="layout"):
        sdf2vec.exported(red_circle(), "glsl", layout="radable")  # type: ignore[arg-type]


def test_the_keywords_of_type_checkers_are_those_that_are_declared():
    assert keyword_text.PLACE.read_text() == keyword_text.text(), "run python -m sdf2vec.keyword_text"
    assert set(keyword_text.READ) == set(READERS)
    written = {*keywords.ExportKeywords.__annotations__, *keywords.FitKeywords.__annotations__}
    assert written | {"shapes"} == {*options_of(Options), *options_of(Settings)}


@pytest.mark.parametrize(
    ("given", "shape"),
    [
        ({"width": 12}, (8, 12)),
        ({"height": 4}, (4, 6)),
        ({"width": 1}, (1, 1)),
        ({}, (16, 24)),
        ({"width": 5, "height": 9}, (9, 5)),
    ],
)
def test_a_render_of_one_side_keeps_the_proportions(given, shape):
    assert sdf2vec.render(red_circle(), **given).shape[:2] == shape


def test_a_notebook_shows_a_scene():
    """As the notebook's own formatter asks for it."""
    scene = red_circle()
    bundle = scene._repr_mimebundle_(include=None, exclude=None)
    assert list(bundle) == ["image/png"]
    with Image.open(io.BytesIO(base64.b64decode(bundle["image/png"]))) as image:
        assert image.size == (24, 16)
    drawing = scene._repr_mimebundle_(include={"image/svg+xml"})
    assert drawing == {"image/svg+xml": sdf2vec.export(scene, "svg", svg_size="fixed")}
    assert scene._repr_mimebundle_(exclude={"image/png"}) == {}
    wide = Scene(4000, 2000, scene.layers)
    with Image.open(io.BytesIO(base64.b64decode(wide._repr_mimebundle_()["image/png"]))) as image:
        assert image.size == (1024, 512)


def test_the_text_of_a_scene_is_short():
    layers = red_circle().layers * 300
    assert (
        repr(Scene(24, 16, layers, None))
        == "<Scene 24 × 16, 300 shapes in 300 layers: circle; over, transparent>"
    )
    assert repr(Scene(24, 16, ())) == "<Scene 24 × 16, 0 shapes in 0 layers; over>"


def test_the_package_is_typed():
    assert files("sdf2vec").joinpath("py.typed").is_file()


def test_functions_stay_functions():
    """They share their names with packages that are imported on the way."""
    code = """
import numpy, sdf2vec
scene = sdf2vec.fit(numpy.zeros((4, 4, 3)), 1, preset="fast", callback=lambda progress: True)
sdf2vec.render(scene), sdf2vec.export(scene, "svg"), sdf2vec.check(scene, ["glsl"], [(4, 4)])
import sdf2vec.fit.loop, sdf2vec.render.reference, sdf2vec.export.shader, sdf2vec.roundtrip
from types import FunctionType
print([isinstance(getattr(sdf2vec, name), FunctionType) for name in ("fit", "render", "export", "check")])
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "[True, True, True, True]\n"
    assert isinstance(sdf2vec.fit, FunctionType)


def test_importing_imports_nothing_heavy():
    code = "import sys, sdf2vec, sdf2vec.cli; print({'torch', 'numpy', 'llvmlite', 'PIL', 'jinja2'} & set(sys.modules))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "set()\n"


def test_scenes_are_exported_as_text_without_torch():
    code = """
import sys, sdf2vec
disc = sdf2vec.Shape.of("circle", (1, 0, 0), center=(0, 0), radius=0.2)
scene = sdf2vec.Scene(40, 30, (sdf2vec.Layer((disc,), 0.1),))
for target in ("svg", "glsl", "shadertoy", "wgsl", "three", "godot", "component"):
    sdf2vec.export(scene, target)
print("torch" in sys.modules)
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "False\n"


def test_everything_promised_is_there():
    assert all(hasattr(sdf2vec, name) for name in sdf2vec.__all__)
    assert issubclass(sdf2vec.SceneError, Sdf2vecError)

"""A target of one's own, and scenes that an exporter doesn't take as they are."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import sdf2vec
from sdf2vec import Exported, Scene, Sdf2vecError, cli, exports
from sdf2vec.export import EXPORTERS, Exporter
from sdf2vec.export.options import Accepts, Options
from sdf2vec.exports import Exports
from sdf2vec.fit import conversion, settling
from sdf2vec.fit.presets import PRESETS
from sdf2vec.image import Picture
from sdf2vec.metrics import psnr
from sdf2vec.render.draw import draw
from tests.scenes import random_scene

OVER = random_scene(("circle",), layers=2, seed=3)
ADDITIVE = random_scene(("circle",), "additive", layers=2, seed=3)
TRANSPARENT = replace(ADDITIVE, background=None)


@pytest.fixture
def toy(monkeypatch):
    """Counts shapes, under any compositing or under `over` only; with a file beside it."""

    def count(scene: Scene, options: Options) -> Exported:
        text = f"{options.title}: {scene.shape_count} {scene.compositing}"
        return Exported(text, {".toy.bin": b"\1\2"}, ("counted",), 0.5)

    accepts = {"filters": Accepts(), "portable": Accepts(("over",))}
    exporter = Exporter(".toy.txt", count, "how many", lambda options: accepts[options.svg_profile])
    monkeypatch.setitem(EXPORTERS, "toy", exporter)


@pytest.fixture
def converted(monkeypatch):
    """The scenes that were fitted again."""
    scenes: list[Scene] = []

    def over_of(scene):
        scenes.append(scene)
        return replace(OVER, background=scene.background), 31.25

    monkeypatch.setattr(exports, "_over_of", over_of)
    return scenes


@pytest.mark.usefixtures("toy")
def test_a_toy_target(tmp_path, capsys):
    made = sdf2vec.exported(OVER, "toy", title="cat")
    assert (made.data, made.raw, made.notes, made.error) == ("cat: 2 over", b"cat: 2 over", ("counted",), 0.5)
    assert sdf2vec.export(OVER, "toy", title="cat") == made.data
    sdf2vec.save(OVER, tmp_path / "cat.scene.json")
    with pytest.raises(SystemExit) as caught:
        cli.main(["export", str(tmp_path / "cat.scene.json"), "--emit", "toy", "-o", f"{tmp_path}/"])
    assert caught.value.code == 0
    assert (tmp_path / "cat.toy.txt").read_text() == "cat: 2 over"
    assert (tmp_path / "cat.toy.bin").read_bytes() == b"\1\2"
    assert capsys.readouterr().out.splitlines() == [
        f"  {tmp_path}/cat.toy.txt: 11 bytes",
        f"  {tmp_path}/cat.toy.bin: 2 bytes",
        "  counted",
    ]


@pytest.mark.usefixtures("toy")
@pytest.mark.parametrize(
    ("scene", "profile", "why"),
    [
        (OVER, "filters", ""),
        (OVER, "portable", ""),
        (replace(OVER, background=None), "filters", ""),
        (ADDITIVE, "filters", ""),
        (TRANSPARENT, "filters", ""),
        (ADDITIVE, "portable", "without blend modes"),
        (TRANSPARENT, "portable", "without blend modes"),
    ],
)
def test_what_is_not_accepted_is_converted(scene, profile, why, converted):
    made = sdf2vec.exported(scene, "toy", svg_profile=profile)
    assert str(made.data).endswith("over" if why else scene.compositing)
    assert converted == ([scene] if why else [])
    note = f"toy: nothing can be added up {why}: fitted again under over (31.2 dB from its render)"
    assert made.notes == ((note, "counted") if why else ("counted",))


@pytest.mark.usefixtures("toy")
def test_several_exports_convert_once(converted):
    several = Exports(TRANSPARENT)
    portable = Options(svg_profile="portable")
    assert {several.export(target, portable).data for target in ("toy", "toy")} == {"a picture: 2 over"}
    assert converted == [TRANSPARENT]


def test_svg_is_not_given_what_it_can_not_say(converted):
    for target in ("svg", "data-uri", "pdf"):
        assert "fitted again" in sdf2vec.exported(TRANSPARENT, target).notes[0]
    assert converted == [TRANSPARENT] * 3
    with pytest.raises(Sdf2vecError, match="takes scenes under over"):
        EXPORTERS["svg"].write(TRANSPARENT, Options())


def test_the_same_light_under_over(monkeypatch):
    phases = tuple(replace(phase, steps=20) for phase in PRESETS["balanced"].phases)
    monkeypatch.setitem(PRESETS, "balanced", replace(PRESETS["balanced"], phases=phases))
    for scene in (ADDITIVE, TRANSPARENT):
        over, decibels = conversion.over_of(scene)
        assert (over.compositing, over.width, over.height) == ("over", scene.width, scene.height)
        assert over.shape_count == scene.shape_count
        assert (over.background is None) == (scene.background is None)
        assert decibels > 20
        channels = 3 if scene.background else 4
        near = psnr(draw(over)[:channels], draw(scene)[:channels])
        assert decibels == pytest.approx(float(near), abs=1e-3)


def test_a_scene_without_shapes_needs_no_fit():
    over, decibels = conversion.over_of(Scene(4, 4, (), (0.5, 0.5, 0.5), "additive"))
    assert (over, decibels) == (Scene(4, 4, (), (0.5, 0.5, 0.5)), float("inf"))


def test_a_sketched_page_holds_a_small_drawing():
    scene = random_scene(("triangle",), layers=12, paints=("flat",), joins=())
    exports = Exports(scene, Picture(np.random.default_rng(0).random((40, 60, 3), np.float32)))
    sketched, made = (len(one.raw) for one in (exports.sketched("html", Options()), exports.export("html")))
    assert sketched == pytest.approx(made, rel=0.05)


@pytest.mark.parametrize(
    ("worth", "most", "is_small"), [(99.0, 99.0, True), (0.0, 99.0, False), (99.0, 0.0, False)]
)
def test_where_small_drawings_lose_much_bytes_decide(worth, most, is_small, monkeypatch):
    """One like the render is written where it says more with them, or where small ones lose more than a few dB."""
    monkeypatch.setattr(settling, "PHASES", [replace(phase, steps=2) for phase in settling.PHASES])
    monkeypatch.setattr(exports, "WORTH", worth)
    monkeypatch.setattr(exports, "MOST_LOST", most)
    monkeypatch.setattr(
        Exports,
        "_lost_by",
        lambda self, scene, found, error=0.0: 0.5 if error == exports.LIKE_RENDER_ERROR else 1.5,
    )
    monkeypatch.setattr(Exports, "_most_lost", lambda self, scene, grain: 1.0)
    monkeypatch.setattr(Exports, "_told", lambda self, scene, lost: f"{lost} dB lost")
    scene = random_scene(("circle", "box"), layers=12, seed=3, joins=(), paints=("flat",))
    picture = Picture(np.ascontiguousarray(sdf2vec.render(scene)[..., :3]))
    like = sdf2vec.exported(scene, "svg", svg_fidelity="render")
    made = sdf2vec.exported(scene, "svg", picture=picture)
    assert (len(made.raw) < 0.7 * len(like.raw)) is is_small
    assert (made.data == like.data) is not is_small
    assert made.notes == (("svg: drawn small, 1.5 dB lost",) if is_small else like.notes)

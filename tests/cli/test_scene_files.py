"""The command line on scene files: export, render, check."""

import json
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

import sdf2vec
from sdf2vec.engines import ENGINES
from sdf2vec.roundtrip import ROUND_TRIPS
from tests.cli.command import OUTPUTS, SHORT, assert_refused


def test_export_writes_what_the_conversion_wrote(folder, run, scene_file):
    """All but the SVG, which a conversion fits to the picture."""
    assert run("export", scene_file, "--emit", "glsl,shadertoy", "--emit", "wgsl,png,json").code == 0
    for suffix in set(OUTPUTS) - {"svg"}:
        assert (folder / f"photo.{suffix}").read_bytes() == (folder / f"made/photo.{suffix}").read_bytes()


def test_export_and_render_to_standard_output(folder, run, scene_file):
    scene = (folder / scene_file).read_bytes()
    outcome = run("export", "-", "--emit", "json", "-o", "-", stdin=scene)
    assert outcome == (0, scene, "")
    outcome = run("render", "-", "-o", "-", stdin=scene)
    assert outcome == (0, (folder / "made/photo.render.png").read_bytes(), "")


@pytest.mark.parametrize(("size", "expected"), [(100, (150, 100)), (1, (2, 1)), (None, (24, 16))])
def test_size_is_the_shortest_side(folder, run, scene_file, size, expected):
    more = [] if size is None else ["--size", size]
    assert run("render", scene_file, *more, "-o", "out.png").code == 0
    with Image.open(folder / "out.png") as rendered:
        assert rendered.size == expected
    assert run("export", scene_file, "--emit", "png", *more).code == 0
    assert (folder / "photo.render.png").read_bytes() == (folder / "out.png").read_bytes()


def test_options_reach_the_exporter(folder, run, scene_file):
    scene = sdf2vec.load(folder / scene_file)
    run("export", scene_file, "--emit", "glsl", "--glsl", "330", "--layout", "table", "-o", "a.glsl")
    text = (folder / "a.glsl").read_text()
    assert text.startswith("#version 330\n")
    assert text == sdf2vec.export(scene, "glsl", glsl="330", layout="table", title="photo")
    assert text != sdf2vec.export(scene, "glsl", glsl="330", layout="readable", title="photo")


def test_check_prints_a_table(folder, run, scene_file, require_engine):
    for engine in ("opengl", "webgpu"):
        require_engine(engine)
    outcome = run("check", scene_file, "--emit", "glsl,wgsl,godot")
    assert outcome.code == 0
    table, legend = outcome.out.decode().split("\n\n")
    assert [line.split(":")[0] for line in legend.splitlines()] == ["same", "close", "differs"]
    head, *rows = table.splitlines()
    assert " ".join(head.split()) == "target engine size PSNR dB largest error mean error verdict"
    assert [row.split()[:2] for row in rows] == [
        [target, engine]
        for target, engine in (("glsl", "opengl"), ("wgsl", "webgpu"), ("godot", "opengl"))
        for _ in range(3)
    ]
    assert all(row.split()[-1] == "same" for row in rows)
    assert rows[0].split()[2:5] == ["24", "x", "16"]


def test_check_says_what_differs(folder, run, scene_file, monkeypatch, require_engine):
    require_engine("opengl")

    def white(text, width, height, uniforms, texture):
        return np.ones((height, width, 4), np.float32)

    monkeypatch.setitem(ENGINES, "opengl", replace(ENGINES["opengl"], draw=white))
    outcome = run("check", scene_file, "--emit", "glsl")
    assert outcome.code == 1
    table = outcome.out.decode().split("\n\n")[0]
    assert [line.split()[-1] for line in table.splitlines()[1:]] == ["differs"] * 3


def test_check_of_written_files(folder, run, scene_file, require_engine):
    """Of the file, not of what would be written now: a shader that has been changed by hand differs."""
    for engine in ("opengl", "webgpu"):
        require_engine(engine)
    run("export", scene_file, "--emit", "glsl,wgsl", "--layout", "data", "-o", "made")
    outcome = run("check", "made/photo.wgsl", "made/photo.glsl", scene_file, "--json")
    assert outcome.code == 0
    results = json.loads(outcome.out)
    assert [(r["target"], r["verdict"]) for r in results] == [("glsl", "same")] * 3 + [("wgsl", "same")] * 3
    assert results[0]["width"] == 24
    assert results[0]["limit"] is None
    text = (folder / "made/photo.glsl").read_text()
    (folder / "made/photo.glsl").write_text(text.replace("fragColor = ", "fragColor = 0.9 * ", 1))
    assert run("check", "made/photo.glsl", scene_file, "-q") == (1, b"", "")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["photo.jpg", "made/photo.scene.json"], ["nothing to check"]),
        (["made/photo.svg", "made/photo.glsl"], ["scene file", "got 0"]),
        (["made/photo.svg", "made/photo.svg", "made/photo.scene.json"], ["a second svg"]),
        (["made/none.svg", "made/photo.scene.json"], ["made/none.svg: cannot read it"]),
        (["made/photo.svg", "made/photo.scene.json", "--emit", "glsl"], ["not both"]),
    ],
)
def test_what_can_not_be_checked(folder, run, scene_file, arguments, words):
    assert_refused(run("check", *arguments), *words)


@pytest.fixture
def no_engines(monkeypatch):
    def probe():
        raise ModuleNotFoundError(name="moderngl")

    for name, engine in ENGINES.items():
        monkeypatch.setitem(ENGINES, name, replace(engine, probe=probe))


@pytest.mark.usefixtures("no_engines")
def test_check_says_what_is_missing_and_how_to_get_it(folder, run, scene_file):
    advice = "the Python package moderngl is not installed: pip install 'sdf2vec[check]'"
    outcome = run("check", scene_file)
    assert outcome.code == 2
    assert outcome.out.decode().count(advice) == sum(map(len, ROUND_TRIPS.values()))
    assert outcome.err.count("\n") == 1
    assert advice in outcome.err


@pytest.mark.usefixtures("no_engines")
def test_a_conversion_needs_no_engine(folder, run):
    outcome = run("photo.jpg", *SHORT, "--emit", "glsl,svg")
    assert outcome.code == 0
    assert b"draws it" not in outcome.out


def test_a_compact_scene_is_written_and_taken_for_a_scene(folder, run):
    assert run("photo.jpg", *SHORT, "--emit", "sdf,json").code == 0
    assert (folder / "photo.sdf").stat().st_size < 140
    assert run("render", "photo.sdf", "-o", "out.png").code == 0
    assert run("export", "photo.sdf", "--emit", "glsl", "-o", "a.glsl").code == 0
    scene = sdf2vec.load(folder / "photo.sdf")
    assert (folder / "a.glsl").read_text() == sdf2vec.export(scene, "glsl", title="photo")
    assert run("photo.jpg", *SHORT, "--emit", "sdf").code == 0  # its own file is replaced
    (folder / "foreign.sdf").write_bytes(b"something else")
    assert_refused(run("photo.jpg", *SHORT, "-o", "foreign.sdf"), "foreign.sdf", "not made by sdf2vec")
    assert_refused(run("photo.sdf", *SHORT, "--emit", "svg"), "is a scene, not a picture")
    (folder / "short.sdf").write_bytes((folder / "photo.sdf").read_bytes()[:-20])
    assert_refused(run("render", "short.sdf"), "short.sdf: ")

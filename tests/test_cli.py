"""The command line: what it writes where, what it refuses, and how it stops."""

import io
import json
import os
import pty
import re
import select
import signal
import subprocess
import sys
import time
from dataclasses import replace
from typing import NamedTuple
from xml.etree import ElementTree

import numpy as np
import pytest
from PIL import Image

import sdf2vec
from sdf2vec import Layer, Scene, Shape, quality
from sdf2vec.cli import main
from sdf2vec.engines import ENGINES
from sdf2vec.fit import loop
from sdf2vec.fit.presets import PRESETS
from sdf2vec.roundtrip import ROUND_TRIPS

SHORT = ("--shapes", "3", "--preset", "fast")
ALL = "glsl,shadertoy,wgsl,svg,json,png"
OUTPUTS = ["glsl", "render.png", "scene.json", "shadertoy.glsl", "svg", "wgsl"]


class Outcome(NamedTuple):
    code: int
    out: bytes
    err: str


@pytest.fixture(autouse=True)
def short_fits(monkeypatch):
    """Three steps a phase: what is tested here is not the fit."""
    short = tuple(replace(phase, steps=3) for phase in PRESETS["fast"].phases)
    monkeypatch.setitem(PRESETS, "fast", replace(PRESETS["fast"], phases=short))


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """The current folder, with a picture in it."""
    monkeypatch.chdir(tmp_path)
    picture().save(tmp_path / "photo.jpg")
    return tmp_path


@pytest.fixture
def run(capfdbinary, monkeypatch):
    """Runs the program in this process, as its entry point does."""

    def run_main(*arguments, stdin=b""):
        monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(stdin)))
        with pytest.raises(SystemExit) as caught:
            main([str(argument) for argument in arguments])
        out, err = capfdbinary.readouterr()
        assert isinstance(caught.value.code, int)
        return Outcome(caught.value.code, out, err.decode())

    return run_main


def picture(width=24, height=16, seed=0):
    rows = np.random.default_rng(seed).integers(0, 256, (4, 4, 3), dtype=np.uint8)
    return Image.fromarray(rows).resize((width, height), Image.Resampling.BILINEAR)


def names(folder):
    return sorted(str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file())


def as_png(image):
    stream = io.BytesIO()
    image.save(stream, "PNG")
    return stream.getvalue()


def assert_refused(outcome, *words):
    """Exit code 2 and exactly one line on stderr, which names all the words."""
    assert outcome.code == 2
    assert outcome.err.count("\n") == 1
    assert outcome.err.startswith("sdf2vec: ")
    for word in words:
        assert word in outcome.err
    assert outcome.out == b""


# --- what goes where ---------------------------------------------------------------------------------------


def test_names_of_all_outputs(folder, run):
    before = (folder / "photo.jpg").read_bytes()
    outcome = run("photo.jpg", *SHORT, "--emit", ALL)
    assert outcome.code == 0
    assert outcome.err == ""
    assert names(folder) == sorted(["photo.jpg", *(f"photo.{suffix}" for suffix in OUTPUTS)])
    assert (folder / "photo.jpg").read_bytes() == before
    assert (folder / "photo.glsl").read_text().startswith("#version 300 es\n// photo in 3 shapes")
    assert "mainImage" in (folder / "photo.shadertoy.glsl").read_text()
    assert "@fragment" in (folder / "photo.wgsl").read_text()
    assert ElementTree.parse(folder / "photo.svg").getroot().get("width") == "24"
    assert sdf2vec.load(folder / "photo.scene.json").shape_count == 3
    with Image.open(folder / "photo.render.png") as rendered:
        assert (rendered.size, rendered.mode) == ((24, 16), "RGB")


def test_the_summary_names_the_quality_and_every_file(folder, run):
    lines = run("photo.jpg", *SHORT, "--emit", "json", "--emit", "svg,png").out.decode().splitlines()
    assert re.fullmatch(
        r"photo\.jpg: 24 x 16, 3 shapes, PSNR \d+\.\d\d dB, FLIP 0\.\d{4}, \d+\.\d s", lines[0]
    )
    assert [line.split(":")[0] for line in lines[1:]] == [
        "  photo.scene.json",
        "  photo.svg",
        "  photo.render.png",
    ]
    sizes = [int(line.split(": ")[1].split()[0].replace(",", "")) for line in lines[1:]]
    assert sizes == [os.path.getsize(name) for name in ("photo.scene.json", "photo.svg", "photo.render.png")]


def test_the_summary_says_at_which_size_flip_was_computed(folder, run, monkeypatch):
    monkeypatch.setattr(quality, "FLIP_RESOLUTION", 10)
    line = run("photo.jpg", *SHORT, "--emit", "json").out.decode().splitlines()[0]
    assert re.search(r"dB, FLIP 0\.\d{4} at 12 x 8, ", line)


def test_a_mixture_of_losses(folder, run):
    assert run("photo.jpg", *SHORT, "--emit", "json", "--loss", "l1:0.8,flip:0.2").code == 0
    mixture = (folder / "photo.scene.json").read_text()
    run("photo.jpg", *SHORT, "--emit", "json", "--loss", "l1")
    assert mixture != (folder / "photo.scene.json").read_text()


def test_the_summary_says_how_an_engine_draws_it(folder, run, require_engine):
    require_engine("opengl")
    out = run("photo.jpg", *SHORT).out.decode()
    figure = re.search(
        r"photo\.glsl: .* bytes; opengl draws it at ([\d.]+) dB, largest error (\S+) levels",
        out,
    )
    assert figure
    assert float(figure[1]) > 80
    assert float(figure[2]) <= 0.25


def test_the_options_of_a_fit(folder, run, monkeypatch):
    """All at once; then going on from what came out, with two colours."""
    monkeypatch.setattr(loop, "TRIAL_STEPS", 2)
    monkeypatch.setattr(loop, "REFIT_STEPS", 2)
    common = (
        "--preset",
        "fast",
        "--kind",
        "circle",
        "--union",
        "2",
        "--emit",
        "json",
        "--weights",
        "mask.png",
    )
    Image.new("L", (5, 5), 255).save(folder / "mask.png")
    options = (
        "--palette",
        "#134,#fa0b1c,#fff",
        "--min-area",
        "0.01",
        "--max-falloff",
        "0.02",
        "--trials",
        "1",
    )
    assert run("photo.jpg", *common, "--shapes", "4", *options, "-o", "first.json").code == 0
    first = sdf2vec.load(folder / "first.json")
    assert all(layer.falloff <= 0.02 for layer in first.layers)
    assert [len(layer.shapes) for layer in first.layers] == [2, 2]
    colors = {shape.color for layer in first.layers for shape in layer.shapes} | {first.background}
    levels = {tuple(round(255 * value) for value in color) for color in colors if color}
    assert levels <= {(17, 51, 68), (250, 11, 28), (255, 255, 255)}
    again = ("--shapes", "6", "--colors", "2", "--start", "first.json", "-o", "second.json")
    assert run("photo.jpg", *common, *again).code == 0
    second = sdf2vec.load(folder / "second.json")
    assert second.shape_count == 6
    assert len({shape.color for layer in second.layers for shape in layer.shapes} | {second.background}) <= 2


def test_quiet(folder, run):
    outcome = run("photo.jpg", *SHORT, "--quiet")
    assert outcome == (0, b"", "")
    assert (folder / "photo.glsl").exists()


def test_output_is_a_file_for_one_target(folder, run):
    assert run("photo.jpg", *SHORT, "--emit", "svg", "-o", "new/name.xml").code == 0
    assert names(folder) == ["new/name.xml", "photo.jpg"]


@pytest.mark.parametrize(
    ("emit", "out", "expected"),
    [
        ("svg", "there", "there/photo.svg"),
        ("svg", "new/", "new/photo.svg"),
        ("json,svg", "new", "new/photo.svg"),
    ],
)
def test_output_is_a_folder_otherwise(folder, run, emit, out, expected):
    (folder / "there").mkdir()
    assert run("photo.jpg", *SHORT, "--emit", emit, "-o", out).code == 0
    assert (folder / expected).exists()
    assert len(names(folder)) == 1 + len(emit.split(","))


def test_streams_carry_nothing_but_the_export(folder, run):
    to_file = run("photo.jpg", *SHORT, "--emit", "json")
    outcome = run("-", *SHORT, "--emit", "json", "-o", "-", stdin=(folder / "photo.jpg").read_bytes())
    assert outcome.code == 0
    assert outcome.out == (folder / "photo.scene.json").read_bytes()
    assert outcome.err.startswith("standard input: 24 x 16")
    assert to_file.err == ""
    png = run("photo.jpg", *SHORT, "--emit", "png", "-o", "-", "--quiet")
    assert png.err == ""
    assert Image.open(io.BytesIO(png.out)).size == (24, 16)
    assert names(folder) == ["photo.jpg", "photo.scene.json"]


def test_standard_input_has_a_name(folder, run):
    assert run("-", *SHORT, "--emit", "json", stdin=as_png(picture())).code == 0
    assert names(folder) == ["photo.jpg", "picture.scene.json"]


def test_a_bad_input_does_not_stop_the_others(folder, run):
    picture(seed=1).save(folder / "last.png")
    (folder / "bad.png").write_bytes(b"not a picture")
    outcome = run("photo.jpg", "bad.png", "last.png", *SHORT, "--emit", "json")
    assert outcome.code == 2
    assert outcome.err.count("\n") == 1
    assert outcome.err.startswith("sdf2vec: bad.png: ")
    assert names(folder) == ["bad.png", "last.png", "last.scene.json", "photo.jpg", "photo.scene.json"]


def test_names_with_strange_characters(folder, run):
    strange = ["two\nlines.png", "a b'\"<&>.png", os.fsdecode(b"caf\xe9.png")]
    for name in strange:
        picture().save(folder / "x.png")
        os.rename(folder / "x.png", folder / name)
    outcome = run(*strange, *SHORT, "--emit", "glsl,svg")
    assert outcome.code == 0
    assert outcome.out.count(b"\n") == 3 * 4
    for name in strange:
        stem = name.removesuffix(".png")
        ElementTree.parse(folder / f"{stem}.svg")
        lines = (folder / f"{stem}.glsl").read_text().splitlines()
        assert lines[1].startswith("// ")
        assert lines[2].startswith("// How to use")


def test_same_seed_same_bytes(folder, run):
    for out, seed in (("a", 7), ("b", 7), ("c", 8)):
        assert run("photo.jpg", *SHORT, "--quiet", "--emit", ALL, "-o", out, "--seed", seed).code == 0
    for suffix in OUTPUTS:
        first, second, other = ((folder / out / f"photo.{suffix}").read_bytes() for out in "abc")
        assert first == second
        assert first != other


# --- refusals ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ([], ["no picture given", "--help"]),
        (["photo.jpg", "--emit", "eps,glsl"], ["unknown target 'eps'", "glsl"]),
        (["photo.jpg", "--emit", ","], ["--emit"]),
        (["photo.jpg", "--kind", "star"], ["unknown kind 'star'", "circle"]),
        (["photo.jpg", "--kind", "mixed,star"], ["unknown kind 'star'"]),
        (["photo.jpg", "--kind", ","], ["kind"]),
        (["photo.jpg", "--preset", "slow"], ["unknown preset 'slow'", "balanced"]),
        (["photo.jpg", "--loss", "l3"], ["unknown loss 'l3'", "ssim"]),
        (["photo.jpg", "--loss", "l1:0.8,ssim:"], ["name:weight", "'ssim:'"]),
        (["photo.jpg", "--loss", "l1:0.8,flip:-1"], ["'flip'", "got -1"]),
        (["photo.jpg", "--compositing", "multiply"], ["unknown compositing 'multiply'", "additive"]),
        (["photo.jpg", "--glsl", "110"], ["unknown GLSL version '110'", "es300"]),
        (["photo.jpg", "--layout", "loose"], ["unknown layout 'loose'"]),
        (["photo.jpg", "--union", "2"], ["3 shapes can't be joined by 2"]),
        (["photo.jpg", "--union", "two"], ["--union", "'two'"]),
        (["photo.jpg", "--weights", "text.png"], ["text.png", "not a picture"]),
        (["photo.jpg", "--weights", "missing.png"], ["missing.png", "no such file"]),
        (["photo.jpg", "--weights", "black.png"], ["weights are black"]),
        (["photo.jpg", "--start", "missing.json"], ["missing.json"]),
        (["photo.jpg", "--start", "bad.scene.json"], ["bad.scene.json: layers[0].radius"]),
        (["photo.jpg", "--start", "good.scene.json", "--compositing", "additive"], ["is over, not additive"]),
        (["sub/photo.png", "--start", "tall.scene.json"], ["start scene has another shape", "1.5 to 1"]),
        (["photo.jpg", "--palette", "#12"], ["#rgb or #rrggbb, got '#12'"]),
        (["photo.jpg", "--palette", "#123", "--colors", "3"], ["either a palette or a number"]),
        (["photo.jpg", "--palette", "#123", "--preset", "thesis"], ["palette needs --compositing over"]),
        (["photo.jpg", "--colors", "0"], ["colours", "got 0"]),
        (["photo.jpg", "--colors", "few"], ["--colors", "'few'"]),
        (["photo.jpg", "--min-area", "1"], ["least area", "got 1"]),
        (["photo.jpg", "--min-area", "nan"], ["least area", "got nan"]),
        (["photo.jpg", "--max-falloff", "-1"], ["largest falloff", "got -1"]),
        (["photo.jpg", "--trials", "-1"], ["trials", "got -1"]),
        (["photo.jpg", "--preset", "thesis", "--compositing", "over"], ["thesis", "--compositing additive"]),
        (["photo.jpg", "--shapes", "0"], ["shapes", "got 0"]),
        (["photo.jpg", "--shapes", "-3"], ["shapes", "got -3"]),
        (["photo.jpg", "--shapes", "65537"], ["shapes", "65536"]),
        (["photo.jpg", "--shapes", "9" * 25], ["shapes"]),
        (["photo.jpg", "--shapes", "2.5"], ["--shapes", "'2.5'"]),
        (["photo.jpg", "--shapes", "many"], ["--shapes", "'many'"]),
        (["photo.jpg", "--shapes"], ["--shapes"]),
        (["photo.jpg", "--seed", "-1"], ["seed", "got -1"]),
        (["photo.jpg", "--seed", str(2**63)], ["seed"]),
        (["photo.jpg", "--size", "0", "--emit", "png"], ["size", "got 0"]),
        (["photo.jpg", "--size", "1e3", "--emit", "png"], ["--size"]),
        (["photo.jpg", "--no-such-option"], ["--no-such-option"]),
        (["missing.png"], ["missing.png", "no such file"]),
        (["two\nlines.png"], ["no such file"]),
        (["."], ["folder"]),
        (["text.png"], ["text.png", "not a picture"]),
        (["empty.png"], ["empty.png", "empty file"]),
        (["cut.png"], ["cut.png", "truncated"]),
        (["photo.jpg", "-o", "text.png/sub/photo.glsl"], ["text.png", "file, not a folder"]),
        (["photo.jpg", "-o", "text.png", "--emit", "glsl,wgsl"], ["text.png", "folder"]),
        (["photo.jpg", "-o", "folders/"], ["folders/photo.glsl", "is a folder"]),
        (["photo.jpg", "-o", "-", "--emit", "glsl,wgsl"], ["standard output"]),
        (["photo.jpg", "text.png", "-o", "-"], ["standard output"]),
        (["photo.jpg", "-o", "photo.jpg"], ["photo.jpg", "overwrite"]),
        (["photo.jpg", "-o", "sub/../link.jpg"], ["overwrite"]),
        (["photo.jpg", "--start", "good.scene.json", "-o", "good.scene.json"], ["overwrite"]),
        (["photo.jpg", "--weights", "sub/photo.png", "-o", "sub/photo.png"], ["overwrite"]),
        (["photo.jpg", "sub/photo.png"], ["photo.glsl", "photo.jpg", "sub/photo.png"]),
        (["photo.jpg", "photo.jpg"], ["photo.glsl"]),
        (["-", "-"], ["picture.glsl"]),
        (["-"], ["not a picture"]),
        (["render"], ["scene"]),
        (["render", "missing.json"], ["missing.json"]),
        (["render", "text.png"], ["text.png", "not valid JSON"]),
        (["render", "-"], ["standard input", "not valid JSON"]),
        (["render", "bad.scene.json"], ["bad.scene.json: layers[0].radius: must be > 0, got -3"]),
        (["render", "good.scene.json", "--size", "0"], ["size"]),
        (["render", "wide.scene.json"], ["megapixels"]),
        (["render", "good.scene.json", "-o", "good.scene.json"], ["overwrite"]),
        (["export", "good.scene.json", "--emit", "json"], ["overwrite"]),
        (["export", "good.scene.json", "--emit", "eps"], ["unknown target 'eps'"]),
        (
            ["export", "good.scene.json", "--emit", "svg", "--svg-profile", "flat"],
            ["SVG profile 'flat'", "portable"],
        ),
        (["export", "good.scene.json", "--emit", "svg", "--svg-size-limit", "90"], ["limit of 90"]),
        (["export", "bad.scene.json"], ["layers[0].radius"]),
        (["check", "bad.scene.json"], ["layers[0].radius"]),
        (["check", "good.scene.json", "--emit", "json"], ["nothing to check"]),
    ],
    ids=lambda item: " ".join(item)[:40] if isinstance(item, list) else None,
)
def test_refusals_leave_nothing_behind(folder, run, arguments, words):
    (folder / "sub").mkdir()
    picture().save(folder / "sub" / "photo.png")
    (folder / "link.jpg").symlink_to("photo.jpg")
    (folder / "text.png").write_text("just text, long enough to be no header of anything")
    (folder / "empty.png").touch()
    (folder / "cut.png").write_bytes(as_png(picture(40, 40))[:-60])
    circle = Layer((Shape.of("circle", (1, 0, 0), center=(0, 0), radius=0.25),), 0.1)
    good = sdf2vec.dumps(Scene(24, 16, (circle,)))
    (folder / "good.scene.json").write_text(good)
    (folder / "tall.scene.json").write_text(good.replace("24", "8"))
    Image.new("L", (5, 5)).save(folder / "black.png")
    (folder / "wide.scene.json").write_text(good.replace("24", "65000").replace("16", "65000"))
    (folder / "bad.scene.json").write_text(good.replace("0.25", "-3"))
    (folder / "folders" / "photo.glsl").mkdir(parents=True)
    before = {name: (folder / name).read_bytes() for name in names(folder)}
    converts = arguments and arguments[0] not in ("render", "export", "check")
    assert_refused(run(*(SHORT if converts else ()), *arguments, stdin=b"no header of anything"), *words)
    assert {name: (folder / name).read_bytes() for name in names(folder)} == before


def test_settings_are_refused_before_any_work(folder, run, monkeypatch):
    monkeypatch.setattr("sdf2vec.api.fit", lambda *_, **__: pytest.fail("the fit began"))
    for bad in (
        ["--emit", "eps"],
        ["--compositing", "additive", "--colors", "4"],
        ["--size", "-1"],
        ["-o", "photo.jpg/sub/"],
    ):
        assert_refused(run("photo.jpg", *SHORT, *bad))


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write anywhere")
def test_no_permission_to_write(folder, run):
    (folder / "locked").mkdir(mode=0o555)
    for out in ("locked", "locked/deeper/"):
        assert_refused(run("photo.jpg", *SHORT, "-o", out), "permission")
    assert names(folder) == ["photo.jpg"]


def test_a_full_disk_leaves_nothing_behind(folder, run, monkeypatch):
    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.fsync", full)
    outcome = run("photo.jpg", *SHORT)
    assert outcome.code == 2
    assert "No space left on device" in outcome.err
    assert outcome.err.count("\n") == 1
    assert names(folder) == ["photo.jpg"]


def test_closed_standard_input(folder, capfd, monkeypatch):
    monkeypatch.setattr("sys.stdin", None)
    for arguments in (["-", *SHORT], ["render", "-"]):
        with pytest.raises(SystemExit) as caught:
            main(arguments)
        assert caught.value.code == 2
        assert capfd.readouterr().err == "sdf2vec: standard input: is closed\n"


# --- pictures ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("size", "kind"),
    [((1, 1), "triangle"), ((1, 500), "triangle"), ((500, 1), "triangle"), ((1, 500), "mixed")],
)
def test_thin_pictures(folder, run, size, kind):
    picture(*size).save(folder / "thin.png")
    outcome = run("thin.png", *SHORT, "--shapes", "5", "--kind", kind, "--emit", ALL)
    assert outcome.err == ""
    assert outcome.code == 0
    scene = sdf2vec.load(folder / "thin.scene.json")
    assert (scene.width, scene.height) == size
    with Image.open(folder / "thin.render.png") as rendered:
        assert rendered.size == size


def test_a_large_picture(folder, run):
    Image.linear_gradient("L").resize((4000, 3000)).save(folder / "large.bmp")
    outcome = run("large.bmp", *SHORT, "--shapes", "2", "--kind", "circle", "--emit", "json,svg")
    assert outcome.code == 0
    assert outcome.out.startswith(b"large.bmp: 4000 x 3000, 2 shapes")
    assert sdf2vec.load(folder / "large.scene.json").height == 3000


def test_a_transparent_picture(folder, run):
    pixels = np.zeros((16, 24, 4), np.uint8)
    pixels[4:12, 6:18] = (255, 128, 0, 255)
    Image.fromarray(pixels).save(folder / "logo.png")
    assert run("logo.png", *SHORT, "--emit", "json,png,svg,glsl").code == 0
    assert json.loads((folder / "logo.scene.json").read_text())["background"] is None
    with Image.open(folder / "logo.render.png") as rendered:
        assert rendered.mode == "RGBA"
        alpha = np.asarray(rendered)[..., 3]
    assert alpha[0, 0] < alpha.max()
    assert "rect" not in (folder / "logo.svg").read_text()


@pytest.mark.parametrize(
    ("name", "image", "note"),
    [
        ("print.jpg", picture().convert("CMYK"), "CMYK without a colour profile"),
        ("deep.png", Image.fromarray(np.linspace(0, 65535, 384).reshape(16, 24).astype(np.uint16)), ""),
        ("grey.tif", picture().convert("L"), ""),
        ("moving.gif", picture().convert("P"), "2 frames, first one used"),
    ],
    ids=lambda item: item if isinstance(item, str) and "." in item else "",
)
def test_unusual_pictures(folder, run, name, image, note):
    more = {"save_all": True, "append_images": [picture(seed=9).convert("P")]} if name == "moving.gif" else {}
    image.save(folder / name, **more)
    outcome = run(name, *SHORT, "--emit", "json")
    assert outcome.code == 0
    assert outcome.err == ""
    lines = outcome.out.decode().splitlines()
    if note:
        assert lines[0].startswith(f"{name}: {note}")
    assert lines[-2].startswith(f"{name}: 24 x 16, 3 shapes")


def test_notes_stay_out_of_an_export_on_standard_output(folder, run):
    picture().convert("CMYK").save(folder / "print.jpg")
    outcome = run("print.jpg", *SHORT, "--emit", "json", "-o", "-")
    assert json.loads(outcome.out)["width"] == 24
    assert "CMYK" in outcome.err


# --- scene files -------------------------------------------------------------------------------------------


@pytest.fixture
def scene_file(folder, run):
    assert run("photo.jpg", *SHORT, "--emit", ALL, "-o", "made").code == 0
    return "made/photo.scene.json"


def test_export_writes_what_the_conversion_wrote(folder, run, scene_file):
    assert run("export", scene_file, "--emit", "glsl,shadertoy", "--emit", "wgsl,svg,png,json").code == 0
    for suffix in OUTPUTS:
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
    head, *rows = outcome.out.decode().splitlines()
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
    assert [line.split()[-1] for line in outcome.out.decode().splitlines()[1:]] == ["differs"] * 3


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


# --- as a process of its own -------------------------------------------------------------------------------

PROGRAM = [sys.executable, "-m", "sdf2vec.cli"]


def test_help_and_refusals_load_nothing_heavy():
    code = """
import sys
from sdf2vec.cli import main
for arguments in (["--help"], ["check", "--help"], ["render", "--help"], ["export", "--help"], ["--version"],
                  ["missing.png"], ["x.png", "--emit", "nonsense"], ["export", "missing.json"]):
    try:
        main(arguments)
    except SystemExit as end:
        print(end.code, *{"torch", "numba", "numpy"} & set(sys.modules), file=sys.stderr)
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    lines = [line for line in done.stderr.splitlines() if not line.startswith("sdf2vec: ")]
    assert lines == ["0"] * 5 + ["2 numpy", "2 numpy", "2 numpy"]
    assert "--shapes" in done.stdout
    assert all(target in done.stdout for target in ALL.split(","))
    assert f"sdf2vec {sdf2vec.__version__}" in done.stdout


def test_a_reader_that_leaves_early_is_no_error(folder, run, scene_file):
    command = [*PROGRAM, "export", scene_file, "--emit", "glsl", "-o", "-"]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    assert process.stdout
    assert process.stderr
    process.stdout.close()
    assert process.stderr.read() == b""
    process.stderr.close()
    assert process.wait() == 0


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="needs /dev/full")
def test_standard_output_that_takes_nothing(folder, run, scene_file):
    with open("/dev/full", "wb") as full:
        command = [*PROGRAM, "export", scene_file, "-o", "-"]
        done = subprocess.run(command, stdout=full, stderr=subprocess.PIPE, text=True, check=False)
    assert_refused(Outcome(done.returncode, b"", done.stderr), "standard output", "No space left")


def test_interruption_at_a_terminal(folder):
    """A bar on the terminal; Ctrl-C once the fit runs: exports what is there, exit code 130, no traceback."""
    noise = np.random.default_rng(0).integers(0, 256, (200, 200, 3), dtype=np.uint8)
    Image.fromarray(noise).save(folder / "noise.png")
    terminal, stderr = pty.openpty()
    command = [*PROGRAM, "noise.png", "--shapes", "64", "--preset", "best", "--emit", "json,glsl"]
    environment = {**os.environ, "TERM": "xterm", "COLUMNS": "120"}
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=stderr, env=environment) as process:
        os.close(stderr)
        bar = rb"coarse.*?step [1-9]\d*/\d{3,} +loss 0\.\d+"
        seen = _read_until(terminal, re.compile(bar, re.DOTALL), 120)
        process.send_signal(signal.SIGINT)
        seen += _read_until(terminal, None, 60)
        assert process.stdout
        out = process.stdout.read().decode()
    os.close(terminal)
    assert re.search(bar, seen, re.DOTALL)
    assert process.returncode == 130
    assert b"Traceback" not in seen
    # The summary is on standard output though the bar was on the terminal.
    assert re.match(r"noise\.png: 200 x 200, \d+ shapes, PSNR .* dB, .* s, stopped early\n", out)
    assert names(folder) == ["noise.glsl", "noise.png", "noise.scene.json", "photo.jpg"]
    assert sdf2vec.load(folder / "noise.scene.json").shape_count == 64
    assert (folder / "noise.glsl").read_text().endswith("}\n")


def _read_until(terminal, pattern, seconds):
    """What a terminal shows until the pattern comes, or the program ends."""
    seen, end = b"", time.monotonic() + seconds
    while time.monotonic() < end:
        if not select.select([terminal], [], [], 0.2)[0]:
            continue
        try:
            piece = os.read(terminal, 65536)
        except OSError:  # the other end is closed
            return seen
        seen += piece
        if not piece or (pattern and pattern.search(seen)):
            return seen
    pytest.fail(f"nothing like it within {seconds} s: {seen[-300:]!r}")

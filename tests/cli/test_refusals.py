"""The command line: what it refuses, in one line, leaving nothing behind."""

import os

import pytest
from PIL import Image

import sdf2vec
from sdf2vec import Layer, Scene, Shape
from sdf2vec.cli import main
from sdf2vec.export import EXPORTERS
from tests.cli.command import SHORT, as_png, assert_refused, names, picture


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
        (["photo.jpg", "--union", "2"], ["5 shapes can't be joined by 2"]),
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
        (["good.scene.json"], ["is a scene, not a picture; sdf2vec export good.scene.json"]),
        (["two\nlines.png"], ["no such file"]),
        (["folders"], ["folders: is a folder without pictures", ".webp", "--recursive"]),
        (["*.gif"], ["*.gif: no such file"]),
        (["photo.jpg", "--jobs", "0"], ["number of processes", "got 0"]),
        (["photo.jpg", "--report", "r.txt"], ["r.txt", ".jsonl, .csv, .parquet"]),
        (["photo.jpg", "--report", "bad.csv"], ["bad.csv", "no report of sdf2vec", "--force"]),
        (["photo.jpg", "--report", "bad.jsonl"], ["bad.jsonl", "no report of sdf2vec"]),
        (["text.png"], ["text.png", "not a picture"]),
        (["empty.png"], ["empty.png", "empty file"]),
        (["cut.png"], ["cut.png", "truncated"]),
        (["photo.jpg", "-o", "text.png/sub/photo.glsl"], ["text.png", "file, not a folder"]),
        (
            ["photo.jpg", "-o", "text.png", "--emit", "glsl,wgsl"],
            ["text.png", "ending says png", "glsl, wgsl"],
        ),
        (["photo.jpg", "-o", "folders/"], ["folders/photo.glsl", "is a folder"]),
        (["photo.jpg", "-o", "-", "--emit", "glsl,wgsl"], ["standard output"]),
        (["photo.jpg", "text.png", "-o", "-"], ["standard output"]),
        (["photo.jpg", "-o", "photo.jpg"], ["photo.jpg", "overwrite"]),
        (["photo.jpg", "-o", "sub/../link.jpg"], ["overwrite"]),
        (["photo.jpg", "--start", "good.scene.json", "-o", "good.scene.json"], ["overwrite"]),
        (["photo.jpg", "--weights", "sub/photo.png", "-o", "sub/photo.png"], ["overwrite"]),
        (["photo.jpg", "sub/photo.png"], ["photo.glsl", "photo.jpg", "sub/photo.png"]),
        (["photo.jpg", "photo.jpg"], ["photo.jpg", "twice"]),
        (["-", "-"], ["-: is given twice"]),
        (["-"], ["not a picture"]),
        (["render"], ["scene"]),
        (["render", "missing.json"], ["missing.json"]),
        (["render", "text.png"], ["text.png", "not valid JSON"]),
        (["render", "-"], ["standard input", "not valid JSON"]),
        (["render", "bad.scene.json"], ["bad.scene.json: layers[0].radius: must be > 0, got -3"]),
        (["render", "good.scene.json", "--size", "0"], ["size"]),
        (["render", "wide.scene.json"], ["megapixels"]),
        (["render", "good.scene.json", "-o", "good.scene.json"], ["what is it to be", ".png"]),
        (["export", "good.scene.json", "--emit", "json"], ["overwrite"]),
        (["export", "good.scene.json", "--emit", "eps"], ["unknown target 'eps'"]),
        (
            ["export", "good.scene.json", "--emit", "svg", "--svg-profile", "flat"],
            ["SVG profile 'flat'", "portable"],
        ),
        (["export", "good.scene.json", "--emit", "svg", "--max-bytes", "4k"], ["4000gz", "'4k'"]),
        (["photo.jpg", "--emit", "svg", "--max-bytes", "90"], ["bytes at least", "limit of 90 bytes"]),
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
    for name in ("bad.csv", "bad.jsonl"):
        (folder / name).write_text("mine,all mine\n1,2\n")
    (folder / "folders" / "photo.glsl").mkdir(parents=True)
    before = {name: (folder / name).read_bytes() for name in names(folder)}
    converts = arguments and arguments[0] not in ("render", "export", "check")
    assert_refused(run(*(SHORT if converts else ()), *arguments, stdin=b"no header of anything"), *words)
    assert {name: (folder / name).read_bytes() for name in names(folder)} == before


def test_settings_are_refused_before_any_work(folder, run, monkeypatch):
    monkeypatch.setattr("sdf2vec.api.fitted", lambda *_, **__: pytest.fail("the fit began"))
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

    assert run("photo.jpg", *SHORT, "-o", "first.svg").code == 0  # so that no kernel is left to be kept
    (folder / "first.svg").unlink()
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


# --- what --emit and -o say together ---------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--emit", "glsl", "-o", "a.svg"], ["a.svg", "ending says svg", "--emit says glsl"]),
        (["--emit", "glsl,svg", "-o", "a.svg"], ["glsl", "none of a.svg is for it"]),
        (["-o", "a.svg", "-o", "b.svg"], ["a.svg, b.svg", "both are for svg"]),
        (["-o", "a.xyz"], ["a.xyz", "--emit", ".svg"]),
        (["-o", "a.js"], ["a.js", "--emit"]),
        (["-o", "one", "-o", "two"], ["one, two", "one folder"]),
        (["-o", "a.glsl", "-o", "out/"], ["out/", "--emit"]),
        (["-o", "text"], ["text/photo.glsl", "file, not a folder"]),
        (["other.jpg", "-o", "out.svg"], ["out.svg", "2 inputs", "folder"]),
        (["--emit", "svg", "--animate"], ["--animate has no effect on svg", "shadertoy"]),
        (["--emit", "json", "--size", "9"], ["--size has no effect on json", "png, jpg, webp"]),
        (["--with-original"], ["--with-original has no effect on glsl", "html"]),
    ],
    ids=lambda item: " ".join(item)[:40],
)
def test_contradictions_are_named_before_any_work(folder, run, monkeypatch, arguments, words):
    monkeypatch.setattr("sdf2vec.api.fitted", lambda *_, **__: pytest.fail("the fit began"))
    picture().save(folder / "other.jpg")
    (folder / "text").write_text("mine")
    before = names(folder)
    assert_refused(run("photo.jpg", *SHORT, *arguments), *words)
    assert names(folder) == before


def test_render_draws_pictures_only(folder, run):
    circle = Layer((Shape.of("circle", (1, 0, 0), center=(0, 0), radius=0.25),), 0.1)
    sdf2vec.save(Scene(24, 16, (circle,)), "one.json")
    assert_refused(run("render", "one.json", "-o", "r.svg"), "r.svg", "what is it to be", ".jpeg")
    assert names(folder) == ["one.json", "photo.jpg"]


@pytest.mark.parametrize("target", EXPORTERS)
def test_only_what_this_program_made_is_replaced(folder, run, target):
    """Every target is known again by its mark; another file of that name stays, unless it is empty or forced."""
    circle = Layer((Shape.of("circle", (1, 0, 0), center=(0, 0), radius=0.25),), 0.1)
    (folder / "in").mkdir()
    sdf2vec.save(Scene(24, 16, (circle,)), "in/photo.scene.json")
    out = folder / f"photo{EXPORTERS[target].suffix}"
    layout = ("--layout", "data") if EXPORTERS[target].beside else ()
    export = ("export", "in/photo.scene.json", "--emit", target, *layout)
    assert run(*export).code == 0
    made = out.read_bytes()
    assert run(*export).code == 0
    out.write_bytes(b"made by hand with love")
    assert_refused(run(*export), out.name, "not made by sdf2vec", "--force")
    assert out.read_bytes() == b"made by hand with love"
    assert run(*export, "--force").code == 0
    assert out.read_bytes() == made
    for place in folder.glob(f"photo{EXPORTERS[target].suffix}*"):
        place.write_bytes(b"")
    assert run(*export, "--emit", target).code == 0
    assert out.read_bytes() == made
    for ending in EXPORTERS[target].beside:
        beside = folder / f"photo{ending}"
        out.unlink()
        beside.write_bytes(b"mine")
        assert_refused(run(*export), f"photo.{target}.", "not made by sdf2vec")
        assert beside.read_bytes() == b"mine"
        assert run(*export, "--force").code == 0


def test_places_that_can_not_be_written_are_found_before_the_fit(folder, run, monkeypatch):
    monkeypatch.setattr("sdf2vec.api.fitted", lambda *_, **__: pytest.fail("the fit began"))
    assert_refused(run("photo.jpg", *SHORT, "-o", f"{'long' * 99}.svg"), "cannot write it", "too long")
    if os.path.isdir("/proc/self/fd"):  # where the mode of a folder says more than is true
        assert_refused(run("photo.jpg", *SHORT, "-o", "/proc/self/fd/a.svg"), "/proc/self/fd/a.svg")

"""The command line: what it writes where, and what it says."""

import base64
import io
import json
import math
import os
import re
import time
from xml.etree import ElementTree

import numpy as np
import pytest
from PIL import Image

import sdf2vec
from sdf2vec import quality
from sdf2vec.engines import resvg
from sdf2vec.fit import loop
from sdf2vec.roundtrip import Check
from tests.cli.command import ALL, OUTPUTS, SHORT, as_png, names, picture

NOTE = "  svg: drawn small"  # and how much of the picture is lost


def test_names_of_all_outputs(folder, run):
    before = (folder / "photo.jpg").read_bytes()
    outcome = run("photo.jpg", *SHORT, "--emit", ALL)
    assert outcome.code == 0
    assert outcome.err == ""
    assert names(folder) == sorted(["photo.jpg", *(f"photo.{suffix}" for suffix in OUTPUTS)])
    assert (folder / "photo.jpg").read_bytes() == before
    assert (folder / "photo.glsl").read_text().startswith("#version 300 es\n// photo in 5 shapes")
    assert "mainImage" in (folder / "photo.shadertoy.glsl").read_text()
    assert "@fragment" in (folder / "photo.wgsl").read_text()
    assert ElementTree.parse(folder / "photo.svg").getroot().get("viewBox", "").startswith("0 0 ")
    assert sdf2vec.load(folder / "photo.scene.json").shape_count == 5
    with Image.open(folder / "photo.render.png") as rendered:
        assert (rendered.size, rendered.mode) == ((24, 16), "RGB")


def test_the_summary_names_the_quality_and_every_file(folder, run):
    lines = run("photo.jpg", *SHORT, "--emit", "json", "--emit", "svg,png").out.decode().splitlines()
    assert re.fullmatch(
        r"photo\.jpg: 24 x 16, 5 shapes, PSNR \d+\.\d\d dB, FLIP 0\.\d{4}, fitted in \d+\.\d s", lines[0]
    )
    files = [line for line in lines[1:-1] if not line.startswith(NOTE)]
    assert [line.split(":")[0] for line in files] == [
        "  photo.scene.json",
        "  photo.svg",
        "  photo.render.png",
    ]
    sizes = [int(line.split(": ")[1].split()[0].replace(",", "")) for line in files]
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


def test_the_summary_says_how_near_the_picture_a_drawing_is(folder, run, require_engine):
    """Pixel art is told exactly; how near another comes is measured here once more."""
    require_engine("resvg")
    pixels = np.kron(np.random.default_rng(1).random((9, 9, 1)) > 0.5, np.ones((4, 4, 3), bool))
    Image.fromarray(255 * pixels.astype(np.uint8)).save(folder / "code.png")
    assert "levels, exactly the picture" in run("code.png", "--emit", "svg").out.decode()
    out = run("photo.jpg", *SHORT, "--emit", "svg").out.decode()
    (said,) = re.findall(r"levels, ([\d.]+) dB from the picture", out)
    photo = np.asarray(Image.open(folder / "photo.jpg").convert("RGB")) / 255
    drawn = np.asarray(resvg.render((folder / "photo.svg").read_text(), photo.shape[1], photo.shape[0]))[
        ..., :3
    ]
    assert float(said) == pytest.approx(-10 * math.log10(np.mean((drawn - photo) ** 2)), abs=0.06)


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
    for flag, command in (("--quiet", ()), ("-q", ("--emit", "json"))):
        assert run("photo.jpg", *SHORT, flag, *command) == (0, b"", "")
    assert (folder / "photo.glsl").exists()
    assert run("export", "photo.scene.json", "-q", "-o", "a.glsl") == (0, b"", "")
    assert run("render", "photo.scene.json", "-q", "-o", "a.png") == (0, b"", "")
    assert {"a.glsl", "a.png"} <= set(names(folder))


def test_the_summary_ends_with_all_the_seconds(folder, run, monkeypatch):
    """Of the fit, the exports and the checks; `-v` says for what."""
    monkeypatch.setattr("sdf2vec.converting.figure", lambda *_: time.sleep(0.4))
    began = time.perf_counter()
    lines = run("photo.jpg", *SHORT, "--emit", "svg", "-v").out.decode().splitlines()
    took = time.perf_counter() - began
    total = re.fullmatch(r"  (\d+\.\d) s in all: .*\bcheck svg 0\.[4-9] s.*", lines[-1])
    assert total
    fitted = re.search(r"fitted in (\d+\.\d) s", lines[0])
    assert fitted
    assert float(fitted[1]) + 0.3 < float(total[1]) <= took + 0.1
    lines = run("photo.jpg", *SHORT, "--emit", "svg").out.decode().splitlines()
    assert re.fullmatch(r"  \d+\.\d s in all", lines[-1])
    monkeypatch.setattr("sdf2vec.converting.figure", lambda *_: pytest.fail("checked"))
    assert run("photo.jpg", *SHORT, "--emit", "svg", "--check", "off").code == 0


@pytest.mark.parametrize(("error", "shown"), [(261.4, "261"), (9.96, "10"), (1.24, "1.2"), (0.0312, "0.031")])
def test_errors_are_plain_numbers(folder, run, monkeypatch, error, shown):
    worst = Check("svg", "resvg", 24, 16, 40.0, error, 0.0)
    monkeypatch.setattr("sdf2vec.converting.figure", lambda *_: worst)
    out = run("photo.jpg", *SHORT, "--emit", "svg").out.decode()
    assert f"resvg draws it at 40.0 dB, largest error {shown} levels" in out


@pytest.mark.parametrize("name", ["photo.jpg", "photo.webp", "photo.png", "photo.bmp", "moving.webp"])
def test_a_page_holds_the_picture_as_it_was_given(folder, run, name):
    """Where browsers show it, and still; else as PNG."""
    more = {"save_all": True, "append_images": [picture(seed=9)]} if name == "moving.webp" else {}
    picture().save(folder / name, **more)
    assert run(name, *SHORT, "--with-original", "-o", "page.html").code == 0
    found = re.search(
        r'class="original" src="data:image/(\w+);base64,([^"]+)"', (folder / "page.html").read_text()
    )
    assert found
    held = base64.b64decode(found[2])
    with Image.open(io.BytesIO(held)) as image:
        assert str(image.format).lower() == found[1]
    kept = name in ("photo.jpg", "photo.webp", "photo.png")
    assert (held == (folder / name).read_bytes()) == kept
    assert kept or found[1] == "png"


def test_a_page_holds_what_came_by_standard_input_as_it_was(folder, run):
    data = (folder / "photo.jpg").read_bytes()
    assert run("-", *SHORT, "--with-original", "-o", "page.html", stdin=data).code == 0
    assert (
        f'src="data:image/jpeg;base64,{base64.b64encode(data).decode()}"'
        in (folder / "page.html").read_text()
    )


def test_a_title_and_a_description(folder, run):
    assert (
        run("photo.jpg", *SHORT, "--title", "My <cat>", "--alt", "asleep", "-o", "a.svg", "-o", "a.html").code
        == 0
    )
    root = ElementTree.parse(folder / "a.svg").getroot()
    assert [root.findtext(f"{{*}}{name}") for name in ("title", "desc")] == ["My <cat>", "asleep"]
    page = (folder / "a.html").read_text()
    assert "<title>My &lt;cat&gt;</title>" in page
    assert 'aria-label="asleep"' in page


def test_output_is_a_file_for_one_target(folder, run):
    assert run("photo.jpg", *SHORT, "--emit", "svg", "-o", "new/name.xml").code == 0
    assert names(folder) == ["new/name.xml", "photo.jpg"]


@pytest.mark.parametrize(
    ("emit", "out", "expected"),
    [
        ("svg", "there", "there/photo.svg"),
        ("svg", "new/", "new/photo.svg"),
        ("svg", "new", "new/photo.svg"),
        ("json,svg", "new", "new/photo.svg"),
    ],
)
def test_output_is_a_folder_otherwise(folder, run, emit, out, expected):
    (folder / "there").mkdir()
    assert run("photo.jpg", *SHORT, "--emit", emit, "-o", out).code == 0
    assert (folder / expected).exists()
    assert len(names(folder)) == 1 + len(emit.split(","))


def test_the_ending_of_an_output_says_what_it_is(folder, run):
    outs = ("a.svg", "b.JPG", "c.html", "d.json", "e.webp", "f.shadertoy.glsl", "g.wgsl", "rest/")
    outcome = run("photo.jpg", *SHORT, *(word for out in outs for word in ("-o", out)))
    assert outcome.code == 0
    assert names(folder) == sorted([*outs[:-1], "rest/photo.glsl", "photo.jpg"])
    ElementTree.parse(folder / "a.svg")
    assert [Image.open(folder / name).format for name in ("b.JPG", "e.webp")] == ["JPEG", "WEBP"]
    assert "<!DOCTYPE html>" in (folder / "c.html").read_text()
    assert sdf2vec.load(folder / "d.json").shape_count == 5
    assert "mainImage" in (folder / "f.shadertoy.glsl").read_text()
    assert "@fragment" in (folder / "g.wgsl").read_text()


def test_a_target_with_a_file_and_the_others_in_a_folder(folder, run):
    assert run("photo.jpg", *SHORT, "--emit", "glsl,svg,json", "-o", "x/y.svg", "-o", "out").code == 0
    assert names(folder) == ["out/photo.glsl", "out/photo.scene.json", "photo.jpg", "x/y.svg"]


def test_a_transparent_render_lies_on_white_where_there_is_no_alpha(folder, run):
    shape = sdf2vec.Shape.of("circle", (1, 0, 0), center=(0, 0), radius=0.25)
    sdf2vec.save(sdf2vec.Scene(24, 24, (sdf2vec.Layer((shape,), 0.01),), None), "disc.json")
    outcome = run("render", "disc.json", "-o", "disc.jpg", "--size", "48")
    assert outcome.code == 0
    assert b"on white" in outcome.out
    with Image.open("disc.jpg") as drawn:
        assert (drawn.format, drawn.mode, drawn.size) == ("JPEG", "RGB", (48, 48))
        assert np.abs(np.array(drawn, int)[[0, 24], [0, 24]] - [[255, 255, 255], [255, 0, 0]]).max() <= 3


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
    assert outcome.code == 3
    assert outcome.err.count("\n") == 1
    assert outcome.err.startswith("sdf2vec: bad.png: ")
    assert outcome.out.endswith(b"3 pictures: 2 done, 1 failed\n")
    assert names(folder) == ["bad.png", "last.png", "last.scene.json", "photo.jpg", "photo.scene.json"]


def test_names_with_strange_characters(folder, run):
    strange = ["two\nlines.png", "a b'\"<&>.png", os.fsdecode(b"caf\xe9.png")]
    for name in strange:
        picture().save(folder / "x.png")
        os.rename(folder / "x.png", folder / name)
    outcome = run(*strange, *SHORT, "--emit", "glsl,svg")
    assert outcome.code == 0
    told = [line for line in outcome.out.decode(errors="replace").splitlines() if not line.startswith(NOTE)]
    assert len(told) == 3 * 5 + 1
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
    Image.linear_gradient("L").resize((2000, 1500)).save(folder / "large.bmp")
    outcome = run("large.bmp", *SHORT, "--shapes", "5", "--kind", "circle", "--emit", "json,svg")
    assert outcome.code == 0
    assert outcome.out.startswith(b"large.bmp: 2000 x 1500, 5 shapes")
    assert sdf2vec.load(folder / "large.scene.json").height == 1500


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
    assert 'width="100%"' not in (folder / "logo.svg").read_text()
    assert 'width="24"' not in (folder / "logo.svg").read_text().partition("\n")[2]  # no ground


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
    assert lines[-3].startswith(f"{name}: 24 x 16, 5 shapes")


def test_notes_stay_out_of_an_export_on_standard_output(folder, run):
    picture().convert("CMYK").save(folder / "print.jpg")
    outcome = run("print.jpg", *SHORT, "--emit", "json", "-o", "-")
    assert json.loads(outcome.out)["width"] == 24
    assert "CMYK" in outcome.err


def test_a_size_limit_is_kept_to(folder, run):
    shapes = ("--kind", "circle", "--max-falloff", "0", "--min-area", "0.001", "--preset", "fast")
    done = run("photo.jpg", *shapes, "-o", "photo.svg", "--max-bytes", "900", "--check", "off")
    assert done.code == 0
    assert 600 <= len((folder / "photo.svg").read_bytes()) <= 900
    assert b"of the size limit" in done.out


def test_a_limit_that_a_number_of_shapes_does_not_keep_to(folder, run):
    """The smallest drawing is written, and the exit status says so."""
    done = run("photo.jpg", "--shapes", "5", "-o", "photo.svg", "--max-bytes", "250", "--preset", "fast")
    assert done.code == 4
    assert b"bytes at least, more than the limit of 250 bytes" in done.out
    assert (folder / "photo.svg").read_bytes()

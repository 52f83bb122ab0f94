"""`sdf2vec bench`: what it runs, that it goes on where it was, what it writes, how its page looks in a browser."""

import json
import stat
import subprocess
import sys
from xml.etree.ElementTree import fromstring

import numpy as np
import pytest

from sdf2vec.bench import measuring
from sdf2vec.bench.comparing import Plan, compare
from sdf2vec.bench.methods import method_of, methods_of
from sdf2vec.bench.pareto import Point, front
from sdf2vec.bench.peers import PEERS, Call, drawn_by, programs_of
from sdf2vec.engines import chromium
from sdf2vec.errors import Sdf2vecError
from sdf2vec.image import encode_png, load
from tests.bench.command import bench
from tests.fit.fitting import picture

GREY = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 48 32"><rect width="48" height="32" fill="#808080"/></svg>'


def test_methods_are_paces_changed_by_words():
    method = method_of("thesis:ssim:box:union4")
    assert method.pace
    assert (method.family, method.pace.preset, method.union) == ("thesis", "thesis", 4)
    assert method.options == {"compositing": "additive", "loss": "ssim", "kind": "box", "union": 4}
    assert method_of("fast").options == {"kind": "triangle"}
    assert [m.name for m in methods_of("thesis,fast:sharp,fast:sharp")] == [
        "thesis:mse",
        "thesis:ssim",
        "fast:sharp",
    ]


@pytest.mark.parametrize("text", ["fastest", "fast:red", "fast:union"])
def test_unknown_methods_are_refused(text):
    with pytest.raises(Sdf2vecError, match="unknown"):
        methods_of(text)


def test_fronts_hold_what_nothing_beats():
    """By hand: b costs more than a and is worse; d costs as much as c and is worse."""
    a, b, c, d = (
        Point(*p, name, "ours") for name, p in zip("abcd", [(1, 5), (2, 6), (3, 2), (3, 4)], strict=True)
    )
    assert front([d, c, b, a], lower_is_better=True) == [a, c]
    assert front([d, c, b, a], lower_is_better=False) == [a, b]


def test_scores_are_those_of_the_pixels():
    """A picture against itself with every third value 51 levels off: 10 log10(3 · 5²) dB."""
    pixels = np.full((12, 12, 3), 0.4, np.float32)
    drawn = np.ones((12, 12, 4), np.float32)
    drawn[..., :3] = 0.4
    drawn[..., 0] += 0.2
    near = measuring.score(drawn, load(pixels))
    assert near.psnr == pytest.approx(10 * np.log10(75), abs=1e-3)
    assert measuring.score(np.dstack([pixels, pixels[..., :1] / 0.4]), load(pixels)).flip == 0


@pytest.mark.parametrize("name", PEERS)
def test_programs_are_told_where_to_write(name):
    command = PEERS[name].command(Call("/opt/it", "in.png", "out.svg", (48, 32), 77))
    assert {"/opt/it", "in.png", "out.svg"} <= set(command)
    assert ("77" in command) == PEERS[name].counts


def test_geometrize_lays_one_ellipse_a_line_on_the_mean_colour(require_engine):
    require_engine("geometrize")
    pixels = np.zeros((12, 16, 3), np.float32)
    pixels[:, :8] = 0.5, 0.25, 1.0
    svg, _ = drawn_by("geometrize", encode_png(pixels), (16, 12), 3)
    *head, one, two, three, end = svg.strip().splitlines()
    assert 'fill="rgb(64,32,128)"' in head[-1]
    assert all(line.count("<ellipse") == 1 for line in (one, two, three))
    assert end == "</svg>"
    fromstring(svg)


def test_programs_that_are_none_are_refused():
    with pytest.raises(Sdf2vecError, match="is no program"):
        programs_of(["primitive=/nowhere/primitive"])
    with pytest.raises(Sdf2vecError, match="NAME=PATH"):
        programs_of(["inkscape=/bin/sh"])


def program(folder, text):
    """A program that does what a shell says; the SVG that it is to write is its fourth argument."""
    path = folder / "primitive"
    path.write_text(f"#!/bin/sh\n{text}\n")
    path.chmod(path.stat().st_mode | stat.S_IXUSR)
    return str(path)


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    """A draft of five shapes, and a program that draws grey: a folder."""
    folder = tmp_path_factory.mktemp("bench")
    (folder / "disc.png").write_bytes(encode_png(picture().pixels))
    grey = program(folder, f"echo run >> {folder}/calls; echo '{GREY}' > \"$4\"")
    methods = ("--methods", "draft,primitive,sqip", "--shapes", "5", "--peer", f"primitive={grey}")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(measuring, "warm_up", lambda method: None)  # takes a process more
        assert bench(folder / "disc.png", *methods, "-o", folder / "out") == 0
    return folder


@pytest.fixture(autouse=True)
def _engines(require_engine):
    require_engine("resvg")


def test_runs_are_not_done_twice(results):
    methods = tuple(methods_of("draft,primitive"))
    said: list[str] = []
    programs = {"primitive": str(results / "primitive")}
    again = Plan(
        (str(results / "disc.png"),), methods, (5,), 1, programs, results / "out", "sdf2vec bench again"
    )
    found = compare(again, said.append)
    assert (results / "calls").read_text() == "run\n"
    assert (len(found.runs), said) == (2, [])
    assert found.commands[-1] == "sdf2vec bench again"


def test_runs_are_scored(results):
    found = json.loads((results / "out" / "results.json").read_text())
    ours, grey = found["runs"]
    assert found["absent"] == ["sqip"]
    assert (ours["method"], grey["method"]) == ("draft", "primitive")
    flat = np.full((32, 48, 4), (128 / 255,) * 3 + (1.0,), np.float32)
    assert grey["psnr"] == pytest.approx(measuring.score(flat, load(results / "disc.png")).psnr, abs=1e-3)
    assert ours["psnr"] > grey["psnr"] + 3
    assert ours["drawn"] == 5
    assert 50 < ours["megabytes"] < 4000
    assert 0 < grey["megabytes"] < 50  # not that of what has called it
    assert 0 < ours["svg_gzip"] < ours["svg_bytes"]


def test_tables_and_charts_are_written(results):
    folder = results / "out"
    assert len((folder / "results.csv").read_text().splitlines()) == 3
    for name in ("flip-by-seconds", "psnr-by-bytes", "flip-by-numbers"):
        assert load(str(folder / f"{name}.png")).width > 100
        assert (folder / f"{name}.svg").read_bytes().startswith(b"<?xml")
    text = (folder / "benchmarks.md").read_text()
    assert "| draft | 5 |" in text
    assert str(results) not in text


def test_another_picture_of_the_same_name_is_refused(results, capsys):
    (results / "other").mkdir(exist_ok=True)
    (results / "other" / "disc.png").write_bytes(encode_png(picture(24, 24).pixels))
    assert bench(results / "other" / "disc.png", "--methods", "draft", "-o", results / "out") == 2
    assert "another picture" in capsys.readouterr().err


def test_a_program_that_fails_is_said(tmp_path):
    (tmp_path / "disc.png").write_bytes(encode_png(picture().pixels))
    bad = program(tmp_path, "echo no luck >&2; exit 3")
    source = measuring.source_of("disc", picture(), tmp_path)
    run, _ = measuring.measured(source, method_of("primitive"), bad, 5, 0)
    assert run.error == "ended with 3: no luck"


def test_the_page_in_a_browser(results, require_engine):
    require_engine("chromium")
    folder = results / "out"
    files = {str(p.relative_to(folder)): p.read_bytes() for p in folder.rglob("*") if p.is_file()}
    with chromium.opened(files, 900, 700) as page:
        rows = "[...document.querySelectorAll('tbody tr')].map(row => row.children[1].textContent)"
        assert page.evaluate(rows) == ["draft", "primitive"]
        psnr = page.locator("th button").filter(has_text="PSNR")
        psnr.click()
        assert page.evaluate(rows) == ["primitive", "draft"]
        psnr.click()
        assert page.evaluate(rows) == ["draft", "primitive"]
        loaded = "[...document.images].map(i => (i.loading = 'eager', i.decode().then(() => i.naturalWidth)))"
        widths = page.evaluate(f"Promise.all({loaded})")
        assert len(widths) == 8 + 3
        assert min(widths) >= 48
        assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")


def test_help_needs_nothing_heavy():
    """Of this process nothing can be told: it has loaded all."""
    code = (
        "import sys\nfrom sdf2vec.cli import main\ntry: main(['bench', '--help'])\nexcept SystemExit: pass\n"
        "print([name for name in ('torch', 'matplotlib', 'numpy') if name in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.endswith("[]\n")

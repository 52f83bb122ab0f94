"""Quality against the number of shapes and bytes."""

import csv
import io
import sys

import numpy as np
import pytest
from PIL import Image

from sdf2vec import Scene
from sdf2vec.curve import Point, Size, points_of, write_curve
from sdf2vec.export.options import Options
from sdf2vec.fit.settings import settings_of
from sdf2vec.image import Picture
from sdf2vec.quality import quality
from sdf2vec.render.draw import pixels_of
from sdf2vec.scene import Layer, Shape
from tests.cli.command import SHORT, assert_refused, names, picture


def disc(x, radius, color):
    return Layer((Shape.of("circle", color, center=(x, 0.0), radius=radius),))


LARGE, SMALL = disc(-0.2, 0.3, (0.8, 0.1, 0.1)), disc(0.4, 0.1, (0.1, 0.2, 0.9))
SCENE = Scene(48, 32, (SMALL, LARGE), (1.0, 1.0, 1.0))


def test_what_matters_least_is_left_out_first():
    seen = Picture(pixels_of(SCENE))
    first = Point(2, 99.0, 0.0, {"glsl": Size(9999, 9999)})
    found = points_of(first, SCENE, seen, settings_of(2), Options())
    assert [point.shapes for point in found] == [2, 1, 0]
    assert found[0] is first
    one = quality(Scene(48, 32, (LARGE,), (1.0, 1.0, 1.0)), seen)
    assert found[1].psnr >= one.psnr
    assert found[1].psnr > found[2].psnr
    assert found[1].sizes["glsl"].raw > found[2].sizes["glsl"].raw > found[2].sizes["glsl"].gzipped > 100


def test_a_table_begins_with_the_fewest(tmp_path):
    points = [Point(2, 30.0, 0.1, {"svg": Size(300, 200)}), Point(1, 20.0, 0.2, {"svg": Size(250, 180)})]
    write_curve(points, str(tmp_path / "c.csv"))
    rows = list(csv.DictReader(io.StringIO((tmp_path / "c.csv").read_text())))
    assert [(row["shapes"], row["psnr_db"], row["svg_gzip_bytes"]) for row in rows] == [
        ("1", "20.000", "180"),
        ("2", "30.000", "200"),
    ]


@pytest.mark.parametrize("targets", [(), ("svg",)])
def test_charts_are_pictures(tmp_path, targets):
    sizes = dict.fromkeys(targets, Size(300, 200))
    for ending in ("png", "svg"):
        path = tmp_path / f"c.{ending}"
        write_curve([Point(2, 30.0, 0.1, sizes), Point(1, 20.0, 0.2, sizes)], str(path))
        assert b"Made with sdf2vec" in path.read_bytes()
    with Image.open(tmp_path / "c.png") as chart:
        assert np.ptp(np.asarray(chart.convert("L"))) > 200
    assert ("gzipped" in (tmp_path / "c.svg").read_text()) == bool(targets)


def test_it_is_written_beside_the_exports(folder, run):
    curves = ["--curve", "c.csv", "--curve", "c.svg"]
    outcome = run("photo.jpg", *SHORT, "--emit", "json", *curves)
    assert outcome.code == 0, outcome.err
    rows = list(csv.DictReader((folder / "c.csv").read_text().splitlines()))
    assert [row["shapes"] for row in rows] == list("012345")
    assert int(rows[-1]["json_bytes"]) == (folder / "photo.scene.json").stat().st_size
    assert b"c.csv: 6 numbers of shapes, 0 to 5" in outcome.out
    assert run("photo.jpg", *SHORT, "--emit", "json", *curves).code == 0  # what is its own is replaced


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (["--curve", "c.txt"], "c.txt: a curve ends in .csv, .png, .svg"),
        (["--curve", "p.svg", "-o", "p.svg"], "would be written there"),
        (["--curve", "q.png", "--weights", "q.png"], "would overwrite an input"),
        (["--curve", "mine.csv"], "mine.csv: is there, and not made by sdf2vec; choose another --curve"),
        (
            ["--curve", "c.csv", "--report", "r.csv"],
            "--curve is for one picture that is fitted, --report for many",
        ),
        (["q.png", "--curve", "c.csv", "-o", "out/"], "c.csv: a curve is of one input, 2 are given"),
    ],
)
def test_what_is_refused(folder, run, given, said):
    picture().save("q.png")
    (folder / "mine.csv").write_text("my,own\n1,2\n")
    assert_refused(run("photo.jpg", *given), said)
    assert names(folder) == ["mine.csv", "photo.jpg", "q.png"]


def test_a_chart_needs_matplotlib(folder, run, monkeypatch):
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    assert_refused(run("photo.jpg", "--curve", "c.png"), "matplotlib", "pip install 'sdf2vec[bench]'")
    assert run("photo.jpg", *SHORT, "--curve", "c.csv").code == 0

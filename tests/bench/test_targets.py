"""The bench of what a FLIP takes: what lies between two measured numbers of shapes, and what is told of it."""

import numpy as np
import pytest

from sdf2vec.bench import targets
from sdf2vec.bench.measuring import Source
from sdf2vec.bench.methods import method_of
from sdf2vec.bench.results import Run
from sdf2vec.bench.targets import Point, needed, printed, told
from sdf2vec.image import Picture, encode_png, load
from tests.bench.command import bench

CURVE = Point(64, 0.2, 1000), Point(256, 0.1, 4000), Point(1024, 0.08, 16000)


def test_between_two_numbers_by_a_power_law():
    """A FLIP of 0.2 / sqrt 2 is halfway from 0.2 to 0.1 in logarithms: 128 shapes, 2000 bytes."""
    middle = 0.2 / 2**0.5
    assert needed(CURVE, middle) == Point(128, middle, 2000)
    assert needed(CURVE, 0.1) == Point(256, 0.1, 4000)
    assert needed(CURVE, 0.2) is None
    assert needed(CURVE, 0.07) is None


def test_what_is_told():
    assert told(CURVE, 0.2 / 2**0.5, ours=32) == "128 (2,000 B), × 4.0"
    assert told(CURVE, 0.25, ours=32) == "≤ 64"
    assert told(CURVE, 0.07, ours=512) == "> 1024, × > 2.0"


def test_printed_are_the_best_of_each_number():
    assert [point.flip for point in printed()] == [0.1721, 0.1537, 0.1265, 0.0949, 0.0781]
    assert needed(printed(), 0.1537) == Point(128, 0.1537)


def test_no_more_is_measured_than_needed(monkeypatch):
    """A method that halves FLIP with twice the shapes: 0.1 is reached with 128."""
    asked = []

    def run_of(source, method, program, shapes, seed):
        asked.append(shapes)
        return Run("a", "b", "c", shapes, seed, drawn=shapes, flip=12.8 / shapes, small_gzip=shapes), None

    monkeypatch.setattr(targets, "run_of", run_of)
    source = Source("disc", Picture(np.zeros((2, 2, 3), np.float32)), "disc.png")
    curve = targets.curve_of(source, method_of("fast"), "", [512, 256, 128, 64], 0.1)
    assert asked == [64, 128]
    assert curve == [Point(64, 0.2, 64), Point(128, 0.1, 128)]


@pytest.fixture
def disc(tmp_path):
    """A PNG of a red disc on white, 48 × 32 pixels."""
    y, x = np.mgrid[0:32, 0:48] + 0.5
    cover = np.clip(10.5 - np.hypot(x - 24, y - 16), 0, 1)[..., None]
    path = tmp_path / "disc.png"
    path.write_bytes(encode_png((cover * (0.8, 0.1, 0.1) + 1 - cover).astype(np.float32)))
    return path


def test_a_disc_takes_one_shape(disc, monkeypatch, tmp_path):
    monkeypatch.setattr(targets, "curve_of", lambda *given: CURVE)
    page = tmp_path / "targets.md"
    assert not bench("targets", disc, "--flips", "0.05", "--beside", "fast", "-o", page)
    text = page.read_text()
    cells = next(line for line in text.splitlines() if line.startswith("| disc")).split("|")
    assert cells[2:4] == [" 0.05 ", " 1 "]
    assert float(cells[4]) < 0.05
    assert cells[8:10] == ["  ", " > 1024, × > 1024.0 "]
    figure = load(tmp_path / "targets.png")
    assert (figure.height, figure.width) == (128, 2 * targets.COLUMN + targets.GUTTER)


@pytest.mark.parametrize(
    ("flag", "value", "said"),
    [
        ("--flips", "1.5", "between 0 and 1"),
        ("--flips", "near", "between 0 and 1"),
        ("--beside", "unheard", "unheard"),
        ("--beside", "sqip", "not on this machine"),
    ],
)
def test_what_makes_no_sense(disc, flag, value, said, capsys, monkeypatch):
    monkeypatch.setenv("PATH", "")
    assert bench("targets", disc, flag, value) == 2
    assert said in capsys.readouterr().err

"""The command: its table, its figure, other tools' files."""

import io

import numpy as np
import pytest
from PIL import Image

from sdf2vec import Scene, api
from sdf2vec.bench import known
from sdf2vec.bench.known import Case, Result, fitted
from sdf2vec.bench.known_drawing import svg_of
from sdf2vec.bench.recovery import Verdict, judged, psnr
from tests.bench.command import bench


def test_a_row_by_hand():
    """Ratios 1, 1, 1, 2: the 90th percentile lies between the last two. F1 is 2 · 7 / (8 + 10)."""
    good, more = Verdict(2, 2, 2, 2, 50.0, 1.0), Verdict(2, 4, 1, 2, 30.0, 5.0)
    cells = known.row("apart", "2", [good, good, good, more]).strip("| ").split(" | ")
    assert cells == ["apart", "2", "4", "1.00", "1.70", "50.0", "30.0", "75 %", "0.778", "0.889", "1.0"]


def result(mode, true, seed, value):
    return Result(
        Case(mode, true, seed), Verdict(true, true, true, true, 50, 0), np.full((5, 2, 3), value, np.float32)
    )


def test_a_row_for_each_mode_and_number_then_sums():
    results = [result("apart", 1, 0, 0), result("apart", 1, 1, 0), result("overlap", 4, 0, 0)]
    rows = [line.split(" | ")[:3] for line in known.table(results)][2:]
    assert rows == [
        ["| apart", "1", "2"],
        ["| overlap", "4", "1"],
        ["| apart, sharp", "all", "1"],
        ["| apart, soft", "all", "1"],
        ["| **apart**", "all", "2"],
        ["| overlap, sharp", "all", "1"],
        ["| **overlap**", "all", "1"],
    ]


def test_the_figure_holds_the_first_of_each():
    """Two columns and two rows, of which the second has one picture; what is missing is white."""
    results = [
        result("apart", 1, 0, 0.0),
        result("apart", 2, 0, 0.2),
        result("apart", 1, 2, 0.4),
        result("overlap", 1, 0, 0.6),
    ]
    pixels = np.asarray(Image.open(io.BytesIO(known.figure(results))))
    assert pixels.shape == (5 + 3 + 5, 2 + 3 + 2, 3)
    assert [pixels[0, 0, 0], pixels[0, 6, 0], pixels[12, 0, 0], pixels[12, 6, 0]] == [0, 51, 153, 255]


def test_the_command_writes_a_page_and_its_figure(require_engine, tmp_path):
    require_engine("resvg")
    output = tmp_path / "known.md"
    assert bench("known", "--tools", "truth", "--seeds", 2, "--counts", "0,2", "-o", output) == 0
    text = output.read_text()
    assert "    sdf2vec bench known --tools truth --seeds 2 --counts 0,2 -o known.md\n" in text
    rows = [line.split(" | ") for line in text.splitlines() if line.startswith("| **")]
    assert [(row[0], row[3], row[8], row[9]) for row in rows] == [
        ("| **apart**", "1.00", "1.000", "1.000"),
        ("| **overlap**", "1.00", "1.000", "1.000"),
    ]
    assert "(known.truth.png)" in text
    assert (tmp_path / "known.truth.png").read_bytes().startswith(b"\x89PNG")


def test_another_tools_files(require_engine, tmp_path, capsys):
    """The pictures are written; SVG files of the same names are judged, and one that is missing is named."""
    require_engine("resvg")
    assert bench("known", "--pictures", tmp_path, "--seeds", 1, "--counts", 2, "--modes", "apart") == 0
    (picture,) = tmp_path.iterdir()
    case = Case("apart", 2, 0)
    assert picture.name == "apart-02-00.png"
    np.testing.assert_allclose(np.asarray(Image.open(picture)) / 255, case.known.pixels, atol=1e-6)
    picture.with_suffix(".svg").write_text(svg_of(case.known))
    assert bench("known", "--svg", tmp_path, "--seeds", 1, "--counts", 2, "--modes", "apart") == 0
    assert "files, apart-02-00: 2 of 2 shapes, 2 right, 2 outlines, 99.0 dB" in capsys.readouterr().err
    assert bench("known", "--svg", tmp_path, "--seeds", 1, "--counts", 1, "--modes", "apart") == 2
    assert "apart-01-00.svg: No such file" in capsys.readouterr().err


@pytest.mark.parametrize(("words", "told"), [((), "auto"), (("--shapes", "true"), 2)])
def test_what_a_fit_is_told(monkeypatch, capsys, words, told):
    """Nothing, or how many shapes there are and of which kinds; its seed is the scene's."""
    asked = []

    def fit(picture, shapes, **options):
        asked.append((shapes, options))
        return Scene(picture.width, picture.height, ())

    monkeypatch.setattr(api, "fit", fit)
    asked_for = ("--seeds", 1, "--counts", 2, "--modes", "apart", "--preset", "fast")
    assert bench("known", *words, *asked_for) == 0
    kind = {} if told == "auto" else {"kind": known.KINDS}
    assert asked == [(told, {"seed": 0, "preset": "fast"} | kind)]
    assert "sdf2vec, apart-02-00: 0 of 2 shapes" in capsys.readouterr().err


def test_jagged_scenes_have_the_colours_of_their_shapes_alone(require_engine):
    """And the same shapes as with antialiasing, at the same place."""
    require_engine("resvg")
    jagged, smooth = (Case("apart", 4, 2, jagged).known for jagged in (True, False))
    assert jagged.shapes == smooth.shapes
    assert len(np.unique(jagged.pixels.reshape(-1, 3), axis=0)) == 5
    assert len(np.unique(smooth.pixels.reshape(-1, 3), axis=0)) > 5
    assert abs(np.mean(jagged.pixels - smooth.pixels)) < 1e-3
    assert Case("apart", 4, 3, True).edges == "jagged"


def test_a_jpeg_is_given_and_the_picture_judged(require_engine, monkeypatch):
    require_engine("resvg")
    case = Case("apart", 2, 0, quality=50)
    known = case.known
    assert np.array_equal(known.pixels, Case("apart", 2, 0).known.pixels)
    assert 25 < psnr(known.pixels, known.given) < 40
    given = []

    def fit(picture, shapes, **options):
        given.append(picture.pixels)
        return known.scene

    monkeypatch.setattr(api, "fit", fit)
    verdict = judged(known, fitted(known, "auto"))
    assert np.array_equal(given, [known.given])
    assert verdict.psnr > 45

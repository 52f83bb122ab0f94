"""Icons through the bench: what is counted of them, and who is nearer."""

import numpy as np
import pytest

from sdf2vec import Joint, Layer, Scene, Shape
from sdf2vec.bench import icons
from sdf2vec.bench.icons import Drawing, Icon
from sdf2vec.bench.recovery import BEST
from sdf2vec.engines import resvg
from tests.bench.command import bench

SVG = (
    '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 8 8">'
    '<rect width="4" height="8" fill="#f00"/><circle cx="6" cy="4" r="1" fill="#fff"/></svg>'
)


@pytest.fixture
def picture(require_engine):
    """Red on the left, a white disc on the right, transparent else; [64, 64, 4]."""
    require_engine("resvg")
    return resvg.render(SVG, 64, 64)


def test_the_artists_own_is_exact(picture):
    drawing, _ = icons.measured(SVG, picture, icons.elements(SVG))
    assert drawing[:3] == (2, 5, len(SVG))
    assert 0 < drawing.gzipped < drawing.bytes
    assert (drawing.psnr, drawing.error) == (BEST, 0)


def test_error_over_white(picture):
    """The white disc is not seen over white, but its alpha is. Red (53.2, 80.1, 67.2) and white differ by 45.8:
    lightness by 46.8 / 1.39, chroma by 104.6 / 3.35.
    """
    without = SVG.replace("<circle", '<circle opacity="0"')
    drawing, _ = icons.measured(without, picture, 1)
    assert drawing.error < 0.01
    assert drawing.psnr < 20
    nothing, _ = icons.measured(SVG.replace('width="4"', 'width="0"'), picture, 1)
    assert nothing.error == pytest.approx(45.8 / 2, abs=0.3)


def test_parameters_but_no_zeros():
    """Circle x and r; box half sizes and angle; falloff; smoothness: 2 + 3 + 1 + 1."""
    disc = Shape.of("circle", (1, 0, 0), center=(0.1, 0), radius=0.2)
    box = Shape.of("box", (1, 0, 0), center=(0, 0), half_size=(0.1, 0.2), angle=0.3, corner_radius=0)
    layers = (Layer((disc, box), 0.05, 1.0, (Joint("union", 0.1),)),)
    assert icons.parameters_of(Scene(8, 8, layers)) == 7
    assert icons.parameters_of(Scene(8, 8, (Layer((disc,)),))) == 2


def drawing(numbers=10, size=100, gzipped=50, error=1.0):
    return Drawing(1, numbers, size, gzipped, 30.0, error, 0.0)


def test_who_is_smaller_and_nearer():
    theirs = drawing()
    ours = [
        drawing(size=99),
        drawing(size=101, error=0.9),
        drawing(gzipped=49, error=1.1),
        drawing(size=9, error=2),
    ]
    made = [Icon("", {"sdf2vec": one, "vtracer": theirs}, np.zeros((2, 2, 3), np.float32)) for one in ours]
    assert icons.compared(made) == (
        "Of 4 icons, sdf2vec takes fewer bytes than vtracer on 2 (gzipped on 1), "
        "is as near or nearer by mean ΔE00 on 2, and is both on 1."
    )


def test_medians_in_the_table():
    hands = [{"artist": drawing(n), "sdf2vec": drawing(m)} for n, m in ((10, 20), (10, 30), (100, 100))]
    head, _, artist, ours = icons.table([Icon("", two, np.zeros((2, 2, 3), np.float32)) for two in hands])
    assert head.startswith("| 3 icons, medians | shapes |")
    assert artist == "| artist | 1 | 0 | 10 | 1.00 | 100 | 50 | 30.0 | 1.00 | 0.0 |"
    assert ours == "| sdf2vec | 1 | 0 | 30 | 2.00 | 100 | 50 | 30.0 | 1.00 | 0.0 |"


def test_without_the_artists_own_numbers_are_compared_with_none():
    *_, ours = icons.table([Icon("", {"sdf2vec": drawing(30)}, np.zeros((2, 2, 3), np.float32))])
    assert ours == "| sdf2vec | 1 | 0 | 30 | – | 100 | 50 | 30.0 | 1.00 | 0.0 |"


def test_which_icons_are_taken(tmp_path):
    """As many as asked for, from the first to the last; all where there are fewer."""
    for index in range(10):
        (tmp_path / f"{index}.svg").write_text(SVG)
    (tmp_path / "readme.md").write_text("no icon")
    assert [path.stem for path in icons.chosen(tmp_path, 4)] == ["0", "3", "6", "9"]
    assert len(icons.chosen(tmp_path, 100)) == 10
    assert icons.chosen(tmp_path / "none", 4) == []


def test_the_command_writes_a_page(require_engine, tmp_path):
    """One that resvg refuses and an empty one are left out."""
    require_engine("resvg")
    folder = tmp_path / "folder"
    folder.mkdir()
    texts = {"a": SVG, "b": "<svg", "c": SVG.replace("rect", "defs").replace("circle", "defs")}
    for name, text in texts.items():
        (folder / f"{name}.svg").write_text(text)
    output = tmp_path / "icons.md"
    assert bench("icons", folder, "--hands", "artist", "-o", output) == 0
    text = output.read_text()
    assert "| 1 icons, medians |" in text
    assert "| artist | 2 | 0 | 5 | 1.00 |" in text
    assert (tmp_path / "icons.png").read_bytes().startswith(b"\x89PNG")

"""`sdf2vec bench NAME`: what all benches have in common, whatever they measure."""

import json
import re
import subprocess
import sys

import pytest

from sdf2vec.bench import table
from sdf2vec.bench.benches import BENCHES, Bench
from sdf2vec.bench.choices import counts
from sdf2vec.bench.table import Asked, command_of
from sdf2vec.image import encode_png
from tests.bench.command import bench
from tests.fit.fitting import picture

HELP = """
import json, sys
from sdf2vec.cli import main
loaded = {}
for name in ["", *sys.argv[1:]]:
    try:
        main(["bench", *[name] * bool(name), "--help"])
    except SystemExit as end:
        loaded[name] = [end.code, "torch" in sys.modules]
print(json.dumps(loaded))
"""


def assert_refused(capsys, arguments, *words):
    """Exit status 2, and one line that names all the words."""
    assert bench(*arguments) == 2
    out, err = capsys.readouterr()
    assert (out, err.count("\n")) == ("", 1)
    for word in words:
        assert word in err


def test_help_needs_no_torch():
    """Of this process nothing can be told: it has loaded all."""
    call = [sys.executable, "-c", HELP, *BENCHES]
    done = subprocess.run(call, capture_output=True, text=True, check=True)
    *told, loaded = done.stdout.splitlines()
    assert json.loads(loaded) == {name: [0, False] for name in ("", *BENCHES)}
    for name, it in BENCHES.items():
        assert f"usage: sdf2vec bench {name} [-h]" in "\n".join(told)
        assert re.search(rf"^  {name} +{re.escape(it.about)}$", "\n".join(told), re.MULTILINE)


def test_names_that_are_unknown(capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert_refused(capsys, ["sped"], "sped: no such picture, and no bench", *BENCHES)
    assert_refused(capsys, ["-o", "x", "speed"], "the name of a bench comes first")
    assert_refused(capsys, [], "no picture and no bench")


@pytest.mark.parametrize("name", BENCHES)
def test_a_page_is_markdown(capsys, tmp_path, name):
    """Said before anything is measured, and before what is there is replaced."""
    source = tmp_path / "disc.png"
    source.write_bytes(encode_png(picture().pixels))
    takes_none = ("joins", "known", "many-shapes", "speed")
    arguments = [] if name in takes_none else [tmp_path if name == "icons" else source]
    assert_refused(capsys, [name, *arguments, "-o", source], "ends in .md")
    assert source.read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ("svg nowhere.png", ["nowhere.png: no such file", "sdf2vec bench svg --help"]),
        ("icons nowhere", ["nowhere: no such folder"]),
        ("svg --shapes 64,many", ["--shapes", "whole number", "'many'"]),
        ("svg --shapes ,", ["--shapes", "at least one"]),
        ("svg --kinds blob", ["--kinds", "unknown kind 'blob'", "triangle"]),
        ("joins --seeds 0", ["--seeds", "between 1 and"]),
        ("known --tools files", ["--svg FOLDER"]),
        ("known --counts -1", ["--counts"]),
        ("known --preset fastest --pictures made --seeds 1 --counts 0", ["unknown preset 'fastest'"]),
        ("patches --face 0.5,0.5", ["--face", "x,y,radius"]),
        ("many-shapes --forms poem", ["unknown form 'poem'", "shadertoy packed"]),
        ("icons . --max-bytes 4kb", ["--max-bytes", "4000gz"]),
        ("speed again", ["unrecognized arguments: again", "sdf2vec bench speed --help"]),
    ],
)
def test_bad_values(capsys, tmp_path, monkeypatch, arguments, words):
    """Before anything is measured or written."""
    monkeypatch.chdir(tmp_path)
    assert_refused(capsys, arguments.split(), *words)


def test_a_limit_that_is_none(capsys, tmp_path):
    (tmp_path / "disc.png").write_bytes(encode_png(picture().pixels))
    assert_refused(capsys, ["byte-limits", tmp_path / "disc.png", "--limits", "4kb"], "--limits", "4000gz")


def test_numbers_are_a_list():
    assert counts("64, 256,64") == [64, 256]


def test_a_picture_called_like_a_bench(capsys, tmp_path, monkeypatch):
    """It is what the path says, not the name: the comparison is asked for, which wants a folder."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "speed").write_bytes(encode_png(picture().pixels))
    assert_refused(capsys, ["./speed"], "-o DIR")


def test_commands_are_told_without_folders_of_this_machine():
    said = command_of(
        ["svg", "/home/me/a.png", "../b.png", "pictures/c.png", "--output=/tmp/d.md", "x=/opt/x"]
    )
    assert said == "sdf2vec bench svg a.png b.png pictures/c.png --output=d.md x=x"
    assert (
        command_of(["./speed", "--profiles", "small 512"]) == "sdf2vec bench ./speed --profiles 'small 512'"
    )


@pytest.fixture
def grows(monkeypatch):
    """A bench whose page is written twice, with a figure."""

    def pages(it, options, asked):
        for size in (1, 2):
            asked.say(f"row {size}")
            yield asked.page(
                "Grows", f"{size} rows", asked.figure(".chart.png", "rows"), figures={".chart.png": b"x"}
            )

    monkeypatch.setattr(Bench, "pages", pages)


def test_pages_grow_in_their_file(grows, capsys, tmp_path, monkeypatch):
    written: list[str] = []

    def keep(path, data):
        written.append(path.name)
        path.write_bytes(data)

    monkeypatch.setattr(table, "write_atomically", keep)
    assert bench("speed", "-o", tmp_path / "page.md") == 0
    assert written == ["page.chart.png", "page.md"] * 2
    title, command, machine, rows, figure = (tmp_path / "page.md").read_text().strip().split("\n\n")
    assert (title, command, rows) == ("# Grows", "    sdf2vec bench speed -o page.md", "2 rows")
    assert "cores; sdf2vec" in machine
    assert figure == "![rows](page.chart.png)"
    out, err = capsys.readouterr()
    assert (out.splitlines(), err) == (["row 1", "row 2", f"{tmp_path / 'page.md'}: written"], "")


def test_a_folder_takes_the_benchs_name(grows, tmp_path):
    (tmp_path / "pages.d").mkdir()
    assert bench("many-shapes", "-o", tmp_path / "pages.d") == 0
    assert bench("speed", "-o", f"{tmp_path}/new/") == 0
    assert sorted(path.name for path in tmp_path.rglob("*.md")) == ["many-shapes.md", "speed.md"]


def test_standard_output_takes_the_last_page_without_figures(grows, capsysbinary, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert bench("speed") == 0
    out, err = capsysbinary.readouterr()
    assert out.decode().startswith("# Grows\n\n    sdf2vec bench speed\n\n")
    assert out.decode().endswith(".\n\n2 rows\n")
    assert err == b"row 1\nrow 2\n"
    assert list(tmp_path.iterdir()) == []


def test_rows_are_said_as_they_come(capsys):
    rows = (row for row in ("| a |", "| b |"))
    assert Asked("sdf2vec bench speed").told(rows) == "| a |\n| b |"
    assert capsys.readouterr().err == "| a |\n| b |\n"


def test_a_bench_from_end_to_end(capsysbinary):
    """Two exports, each in a process of its own."""
    assert bench("many-shapes", "--shapes", "3,5", "--forms", "glsl,wgsl") == 0
    lines = capsysbinary.readouterr().out.decode().splitlines()
    assert "    sdf2vec bench many-shapes --shapes 3,5 --forms glsl,wgsl" in lines
    assert "| target | 3 shapes | 5 shapes |" in lines
    rows = [
        re.findall(r"[\d.]+ s, \d+ MB, [\d,]+ B", line)
        for line in lines
        if line.startswith(("| glsl", "| wgsl"))
    ]
    assert list(map(len, rows)) == [2, 2]

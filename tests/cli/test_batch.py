"""Many pictures: folders, reports, going on, several processes, what is left when it stops."""

import csv
import json
import os
import signal
import subprocess
import sys

import pyarrow.parquet
import pytest

import sdf2vec
from sdf2vec import batch, converting
from sdf2vec.cli import main
from tests.cli.command import SHORT, assert_refused, names, picture

JSON = ("--emit", "json")


@pytest.fixture
def album(folder):
    """Pictures in folders, and what is none of them."""
    os.remove("photo.jpg")
    for place in ("album/a.png", "album/b.jpg", "album/deep/c.png", "album/deep/er/a.webp"):
        (folder / place).parent.mkdir(parents=True, exist_ok=True)
        picture(seed=len(place)).save(folder / place)
    picture().save(folder / "album/a.render.png")
    picture().save(folder / "album/.hidden.png")
    (folder / "album/notes.txt").write_text("no picture")
    return folder


@pytest.fixture
def fits(monkeypatch):
    """The pictures that are fitted."""
    seen = []
    read = converting._read_picture

    def reading(source):
        seen.append(source)
        return read(source)

    monkeypatch.setattr(converting, "_read_picture", reading)
    return seen


def rows_of(path):
    if path.suffix == ".csv":
        with open(path, newline="") as stream:
            return list(csv.DictReader(stream))
    if path.suffix == ".parquet":
        return pyarrow.parquet.read_table(path).to_pylist()
    return [json.loads(line) for line in path.read_text().splitlines()]


def test_a_folder_with_those_inside(album, run, fits):
    assert run("album", *SHORT, *JSON, "-o", "out").code == 0
    assert fits == ["album/a.png", "album/b.jpg"]
    assert [name for name in names(album) if name.startswith("out")] == [
        "out/a.scene.json",
        "out/b.scene.json",
    ]
    fits.clear()
    outcome = run("album", *SHORT, *JSON, "-o", "out", "--recursive")
    assert fits == ["album/a.png", "album/b.jpg", "album/deep/c.png", "album/deep/er/a.webp"]
    assert {"out/deep/c.scene.json", "out/deep/er/a.scene.json"} <= set(names(album))
    assert outcome.out.endswith(b"4 pictures: 4 done\n")


def test_patterns_that_the_shell_has_left(album, run, fits):
    assert run("album/**/*.png", *SHORT, *JSON, "-o", "out").code == 0
    assert fits == ["album/a.png", "album/a.render.png", "album/deep/c.png"]
    odd = album / "[x].png"
    picture().save(odd)
    fits.clear()
    assert run("[x].png", *SHORT, *JSON, "-o", "out").code == 0
    assert fits == ["[x].png"]


def test_what_exists_is_left_out(album, run, fits):
    assert run("album", *SHORT, *JSON, "-o", "out").code == 0
    os.remove("out/b.scene.json")
    fits.clear()
    outcome = run("album", *SHORT, *JSON, "-o", "out", "--skip-existing")
    assert (outcome.code, fits) == (0, ["album/b.jpg"])
    assert outcome.out.endswith(b"2 pictures: 1 done, 1 skipped\n")


@pytest.mark.parametrize("form", ["jsonl", "csv", "parquet"])
def test_a_report_has_a_line_for_every_picture(album, run, fits, form):
    (album / "album/bad.png").write_bytes(b"no picture")
    outcome = run("album", *SHORT, "--emit", "json,svg", "-o", "out", "--report", f"r.{form}")
    assert outcome.code == 3
    rows = {row["file"]: row for row in rows_of(album / f"r.{form}")}
    assert list(rows) == ["album/a.png", "album/b.jpg", "album/bad.png"]
    assert [row["status"] for row in rows.values()] == ["ok", "ok", "failed"]
    assert "not a picture" in rows["album/bad.png"]["error"]
    good = rows["album/a.png"]
    assert int(good["shapes"]) == sdf2vec.load("out/a.scene.json").shape_count == 5
    assert int(good["bytes"]) == sum(os.path.getsize(f"out/a.{end}") for end in ("scene.json", "svg"))
    said = next(line for line in outcome.out.decode().splitlines() if line.startswith("album/a.png"))
    assert f"PSNR {float(good['psnr']):.2f} dB, FLIP {float(good['flip']):.4f}" in said
    assert 0 < float(good["seconds"]) < 60


@pytest.mark.parametrize("form", ["jsonl", "csv", "parquet"])
def test_a_batch_goes_on_where_it_was(album, run, fits, form):
    """What the report says to be done is not done again, unless picture, options or outputs have changed."""
    command = ("album", *SHORT, *JSON, "-o", "out", "--report", f"r.{form}")
    (album / "album/bad.png").write_bytes(b"no picture")
    run(*command)
    fits.clear()
    assert run(*command).code == 3
    assert fits == ["album/bad.png"]
    picture(seed=5).save("album/bad.png")
    os.remove("out/a.scene.json")
    fits.clear()
    assert run(*command).code == 0
    assert fits == ["album/a.png", "album/bad.png"]
    fits.clear()
    assert run(*command, "--seed", "4").code == 0
    assert fits == ["album/a.png", "album/b.jpg", "album/bad.png"]
    picture(seed=7).save("album/b.jpg")
    fits.clear()
    assert run(*command, "--seed", "4").code == 0
    assert fits == ["album/b.jpg"]


def test_all_that_fails_is_another_exit_code_than_some(album, run):
    for name in ("a.png", "b.jpg"):
        (album / "album" / name).write_bytes(b"no picture")
    outcome = run("album", *SHORT, *JSON, "-o", "out")
    assert outcome.code == 2
    assert outcome.err.count("\n") == 2


def test_interrupted_it_lists_what_is_not_done_and_keeps_its_report(album, run, monkeypatch):
    """Ctrl-C in the second of four fits: that one ends early, the third and fourth are named."""
    fit = sdf2vec.api.fitted

    def interrupted(picture, **options):
        if os.path.exists("out/a.scene.json"):
            signal.raise_signal(signal.SIGINT)
        return fit(picture, **options)

    command = ("album", "--recursive", *SHORT, *JSON, "-o", "out", "--report", "r.jsonl")
    with monkeypatch.context() as patched:
        patched.setattr("sdf2vec.api.fitted", interrupted)
        outcome = run(*command)
    assert outcome.code == 130
    assert outcome.err == (
        "sdf2vec: stopped; not done: album/deep/c.png, album/deep/er/a.webp; the same command goes on\n"
    )
    assert outcome.out.endswith(b"4 pictures: 2 done, 2 not begun\n")
    assert [row["status"] for row in rows_of(album / "r.jsonl")] == ["ok", "stopped"]
    assert run(*command).code == 0
    assert [row["status"] for row in rows_of(album / "r.jsonl")] == ["ok"] * 4


def test_interrupted_twice_it_still_says_what_is_not_done(album, capfd, monkeypatch):
    monkeypatch.setattr("sdf2vec.api.fitted", lambda *_, **__: (_ for _ in ()).throw(KeyboardInterrupt))
    with pytest.raises(SystemExit) as caught:
        main(["album", *SHORT, *JSON, "-o", "out"])
    assert caught.value.code == 130
    assert capfd.readouterr().err.splitlines() == [
        "sdf2vec: stopped; not done: album/a.png, album/b.jpg; the same command with --skip-existing goes on",
        "sdf2vec: interrupted",
    ]


SHORTER = """
from sdf2vec.cli import main
from sdf2vec.fit.presets import PRESETS

PRESETS["fast"] = PRESETS["fast"].paced(0.1)

if __name__ == "__main__":
    main()
"""
"""The program with a tenth of a fit's steps, also in the processes that it starts: they begin with this file, too."""


def test_two_processes_make_the_same_files_as_one(album):
    """So many shapes are fitted from one start."""
    (album / "album/bad.png").write_bytes(b"no picture")
    (album / "shorter.py").write_text(SHORTER)
    command = [sys.executable, "shorter.py", "album", "--shapes", "64", "--preset", "fast", *JSON]
    outcomes = [
        subprocess.run([*command, *more], capture_output=True, text=True, check=False)
        for more in (("-o", "one"), ("-o", "two", "--jobs", "2", "--report", "r.jsonl"))
    ]
    assert [outcome.returncode for outcome in outcomes] == [3, 3]
    for name in ("a", "b"):
        made = [(album / out / f"{name}.scene.json").read_bytes() for out in ("one", "two")]
        assert made[0] == made[1]
    assert sorted(row["status"] for row in rows_of(album / "r.jsonl")) == ["failed", "ok", "ok"]
    assert outcomes[1].stdout.splitlines()[-1] == "3 pictures: 2 done, 1 failed"
    assert outcomes[1].stdout.count("fitted in") == 2


def test_a_picture_that_kills_its_process_is_tried_some_times(folder, run, monkeypatch):
    picture(seed=1).save("other.png")
    monkeypatch.setattr(batch, "_converted", killed)
    outcome = run("photo.jpg", "other.png", *SHORT, *JSON, "--jobs", "2", "--report", "r.jsonl")
    assert outcome.code == 3
    assert "other.png: the process that converted it was killed" in outcome.err
    assert {row["file"]: row["status"] for row in rows_of(folder / "r.jsonl")} == {
        "photo.jpg": "ok",
        "other.png": "failed",
    }
    assert (folder / "tried").read_text() == "xxx"


def killed(shard, work, show):
    """In a process of its own."""
    if shard[0].source == "other.png":
        with open("tried", "a") as stream:
            stream.write("x")
        os.kill(os.getpid(), signal.SIGKILL)
    return [(converting.Done(3, 20.0, 0.1, 9, 0.1, False), [])]


def broken(*_):
    raise KeyError("what")


def test_a_bug_in_one_picture_leaves_the_others(album, run, monkeypatch):
    """Its row and the last line say so; the bug decides on the exit code, whatever else has failed."""
    load = converting.load_picture
    (album / "album/bad.png").write_bytes(b"no picture")
    with monkeypatch.context() as patched:
        patched.setattr(converting, "load_picture", lambda p: broken() if p == "album/a.png" else load(p))
        outcome = run("album", *SHORT, *JSON, "-o", "out", "--report", "r.jsonl")
    assert outcome.code == 70
    assert outcome.out.endswith(b"3 pictures: 1 done, 1 failed, 1 failed by a bug\n")
    rows = {row["file"]: row for row in rows_of(album / "r.jsonl")}
    assert [row["status"] for row in rows.values()] == ["bug", "ok", "failed"]
    assert rows["album/a.png"]["error"].startswith("this is a bug: KeyError: 'what' in _read_picture, line ")
    assert run("album", *SHORT, *JSON, "-o", "out", "--report", "r.jsonl").code == 3
    assert [row["status"] for row in rows_of(album / "r.jsonl")] == ["ok", "ok", "failed"]


@pytest.mark.parametrize("traceback", [False, True])
def test_a_bug_in_a_process(folder, run, monkeypatch, traceback):
    picture(seed=1).save("other.png")
    monkeypatch.setattr(batch, "_converted", with_a_bug)
    outcome = run("photo.jpg", "other.png", *SHORT, *JSON, "--jobs", "2", *["--traceback"] * traceback)
    assert outcome.code == 70
    assert "sdf2vec: this is a bug: KeyError: 'what'" in outcome.err
    assert (", in broken\n" in outcome.err) == traceback
    assert outcome.out == b"2 pictures: 1 done, 1 failed by a bug\n"


def with_a_bug(shard, work, show, really=batch._converted):
    """In a process of its own."""
    if shard[0].source != "other.png":
        return killed(shard, work, show)
    batch.convert = broken  # type: ignore[attr-defined]
    return really(shard, work, show)


def test_a_bad_report_is_refused(folder, run):
    (folder / "mine.csv").write_text("a,b\n1,2\n")
    assert_refused(run("photo.jpg", *SHORT, "--report", "mine.csv"), "mine.csv", "--force")
    assert run("photo.jpg", *SHORT, "--report", "mine.csv", "--force").code == 0
    assert rows_of(folder / "mine.csv")[0]["file"] == "photo.jpg"

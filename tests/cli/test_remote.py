"""Pictures at URLs: in fsspec's file system in memory, within a zip file, behind one that has no driver here."""

import json
import zipfile
from base64 import b64encode

import fsspec
import pytest

from sdf2vec import remote
from sdf2vec.outputs import stem_of
from tests.cli.command import SHORT, as_png, assert_refused, names, picture

JSON = ("--emit", "json", "-o", "out")


@pytest.fixture
def bucket(folder):
    """Pictures at memory://bucket, and what is none of them."""
    files = fsspec.filesystem("memory")
    for place in ("bucket/a.png", "bucket/deep/er/b.png", "bucket/.hidden.png", "bucket/a.render.png"):
        files.pipe(f"/{place}", as_png(picture(seed=len(place))))
    files.pipe("/bucket/notes.txt", b"no picture")
    yield files
    files.rm("/bucket", recursive=True)


@pytest.mark.parametrize(
    ("given", "found"),
    [
        (["memory://bucket"], {"memory://bucket/a.png": ""}),
        (["memory://bucket/a.png"], {"memory://bucket/a.png": ""}),
        (
            ["memory://bucket/", "--recursive"],
            {"memory://bucket/a.png": "", "memory://bucket/deep/er/b.png": "deep/er"},
        ),
        (
            ["memory://bucket/**/*.png"],
            {"memory://bucket/a.png": "", "memory://bucket/deep/er/b.png": ""},
        ),
    ],
)
def test_files_folders_and_patterns(bucket, run, folder, given, found):
    outcome = run(*given, *SHORT, *JSON, "--report", "r.jsonl")
    assert (outcome.code, outcome.err) == (0, "")
    rows = [json.loads(line) for line in (folder / "r.jsonl").read_text().splitlines()]
    assert [row["file"].replace(":///", "://") for row in rows] == list(found)
    wanted = [f"{within}/{stem_of(url)}.scene.json".lstrip("/") for url, within in found.items()]
    assert names(folder / "out") == sorted(wanted)


def test_a_batch_goes_on_until_a_file_changes(bucket, run):
    command = ("memory://bucket", "--recursive", *SHORT, *JSON, "--report", "r.jsonl")
    assert b"fitted in" in run(*command).out
    assert b"fitted in" not in run(*command).out
    bucket.pipe("/bucket/a.png", as_png(picture(seed=9)))
    assert run(*command).out.count(b"fitted in") == 1


def test_the_original_is_embedded_as_it_is(bucket, run, folder):
    data = bucket.cat("/bucket/a.png")
    assert run("memory://bucket/a.png", *SHORT, "-o", "a.html", "--with-original").code == 0
    assert b64encode(data).decode() in (folder / "a.html").read_text()


def test_a_zip_file_is_a_folder(folder, run):
    with zipfile.ZipFile("album.zip", "w") as made:
        made.writestr("in/c.png", as_png(picture(seed=3)))
    assert run(f"zip://in/*.png::{folder}/album.zip", *SHORT, *JSON).code == 0
    assert names(folder / "out") == ["c.scene.json"]


@pytest.mark.parametrize(
    ("url", "words"),
    [
        ("memory://bucket/none.png", ["memory://bucket/none.png: no such file"]),
        ("memory://bucket/x*.png", ["memory://bucket/x*.png: no such file"]),
        ("memory://bucket/deep", ["is a folder without pictures", "--recursive"]),
        ("memory://bucket/notes.txt", ["memory://bucket/notes.txt: not a picture"]),
        ("nosuch://a.png", ["nosuch://a.png: cannot be read (Protocol not known: nosuch)"]),
    ],
)
def test_what_can_not_be_read_is_named(bucket, run, url, words):
    assert_refused(run(url, *SHORT), *words)


@pytest.mark.parametrize("path", ["photo.jpg", "C:/photo.jpg", "a::b.jpg", "-", "./x://y.png", "://a"])
def test_what_is_no_url(path):
    assert not remote.is_url(path)


@pytest.mark.parametrize(
    ("url", "stem"),
    [
        ("https://a.org/b/c.png?size=3#x", "c"),
        ("s3://a/b.tar/c.jpeg", "c"),
        ("zip://in/c.png::s3://a/b.zip", "c"),
        ("https://a.org/photo/", "photo"),
    ],
)
def test_outputs_are_named_after_the_file(url, stem):
    assert stem_of(url) == stem

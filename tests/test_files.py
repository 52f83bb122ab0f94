"""Atomic writes: complete or untouched, and never anything left behind."""

import os
import resource
import stat
import tempfile
from contextlib import contextmanager
from pathlib import Path

import pytest

from sdf2vec.errors import Sdf2vecError
from sdf2vec.files import one_line, write_atomically


@pytest.fixture
def unprivileged_folder():
    """A folder of an ordinary user, as whom the test then runs (root may write anywhere)."""
    was_root = os.geteuid() == 0
    if was_root:
        try:
            os.seteuid(65534)
        except OSError:
            pytest.skip("cannot become an ordinary user here")
    folder = Path(tempfile.mkdtemp())
    yield folder
    folder.chmod(0o700)
    for child in folder.iterdir():
        child.unlink()
    folder.rmdir()
    if was_root:
        os.seteuid(0)


@contextmanager
def small_disk():
    """Writes of more than 1000 bytes fail part-way with an OSError, as on a full disk: pytest's own too."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (1000, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


def refusal(path, data=b"x"):
    with pytest.raises(Sdf2vecError) as caught:
        write_atomically(path, data)
    assert "\n" not in str(caught.value)
    return str(caught.value)


@pytest.mark.parametrize("as_type", [str, Path])
def test_writes_and_overwrites(tmp_path, as_type):
    target = tmp_path / "out.svg"
    for data in (b"first, longer", b"second", b""):
        write_atomically(as_type(target), data)
        assert target.read_bytes() == data
        assert os.listdir(tmp_path) == ["out.svg"]


def test_a_bare_name_goes_to_the_current_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write_atomically("out.svg", b"x")
    assert os.listdir(tmp_path) == ["out.svg"]


def test_missing_folders_are_created(tmp_path):
    write_atomically(tmp_path / "a" / "b" / "out.svg", b"x")
    assert (tmp_path / "a" / "b" / "out.svg").read_bytes() == b"x"


@pytest.mark.parametrize("mask", [0o022, 0o077, 0o002])
def test_permissions_follow_the_umask(tmp_path, mask):
    before = os.umask(mask)
    try:
        write_atomically(tmp_path / "out.svg", b"x")
    finally:
        os.umask(before)
    assert stat.S_IMODE((tmp_path / "out.svg").stat().st_mode) == 0o666 & ~mask


def test_a_write_that_fails_half_way_leaves_the_old_file_alone(tmp_path):
    target = tmp_path / "out.svg"
    write_atomically(target, b"old")
    with small_disk():
        message = refusal(target, b"x" * 100_000)
    assert "out.svg: cannot write it (File too large)" in message
    assert target.read_bytes() == b"old"
    assert os.listdir(tmp_path) == ["out.svg"]


def test_a_rename_that_is_interrupted_leaves_nothing(tmp_path, monkeypatch):
    def interrupted(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(os, "replace", interrupted)
    with pytest.raises(KeyboardInterrupt):
        write_atomically(tmp_path / "out.svg", b"x")
    assert os.listdir(tmp_path) == []


def test_the_target_is_never_seen_half_written(tmp_path, monkeypatch):
    target = tmp_path / "out.svg"
    target.write_bytes(b"old")
    real_fsync, seen = os.fsync, []

    def fsync(descriptor):
        seen.append(target.read_bytes())
        real_fsync(descriptor)

    monkeypatch.setattr(os, "fsync", fsync)
    write_atomically(target, b"new")
    assert seen == [b"old"]


def test_a_symbolic_link_stays_one(tmp_path):
    (tmp_path / "link").symlink_to(tmp_path / "real")
    for data in (b"1", b"2"):
        write_atomically(tmp_path / "link", data)
        assert (tmp_path / "link").is_symlink()
        assert (tmp_path / "real").read_bytes() == data


def test_a_pipe_is_written_to_and_not_replaced(tmp_path):
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    reader = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
    try:
        write_atomically(pipe, b"through")
        assert os.read(reader, 100) == b"through"
    finally:
        os.close(reader)
    assert pipe.is_fifo()


def test_a_folder_is_refused(tmp_path):
    assert refusal(tmp_path) == f"{tmp_path}: is a folder, not a file; choose another place"


def test_a_file_in_place_of_a_folder_is_refused(tmp_path):
    (tmp_path / "file").write_bytes(b"keep")
    assert "is a file, not a folder" in refusal(tmp_path / "file" / "out.svg")
    assert "is a file, not a folder" in refusal(tmp_path / "file" / "deeper" / "out.svg")
    assert (tmp_path / "file").read_bytes() == b"keep"


def test_no_permission_is_refused(unprivileged_folder):
    unprivileged_folder.chmod(0o500)
    assert "out.svg: no permission to write here; choose" in refusal(unprivileged_folder / "out.svg")
    assert "no permission" in refusal(unprivileged_folder / "sub" / "out.svg")
    assert os.listdir(unprivileged_folder) == []


@pytest.mark.parametrize("name", ["x" * 300, "nul\0.svg", "line\nbreak" + "x" * 300])
def test_impossible_names_are_refused_in_one_line(tmp_path, name):
    assert "cannot write it" in refusal(tmp_path / name)
    assert os.listdir(tmp_path) == []


def test_one_line():
    assert one_line("Grüße 图.png") == "Grüße 图.png"
    assert one_line("a\nb\x1b[31m\udc80") == r"a\nb\x1b[31m\udc80"
    assert one_line("") == "''"

"""Checkpoints: written while a fit runs, gone on from, removed at the end."""

import os

import pytest

import sdf2vec
from sdf2vec import checkpoint
from tests.cli.command import SHORT, assert_refused, names

JSON = (*SHORT, "--emit", "json")
BESIDE = "photo.checkpoint.scene.json"


class Killed(BaseException):
    """What no handler catches."""


@pytest.fixture
def killed(monkeypatch):
    """A checkpoint at every step, and an end as by SIGKILL at the fourth."""
    monkeypatch.setattr(checkpoint, "PAUSE", 0.0)
    see = checkpoint.Checkpoint.see

    def end(self, progress):
        see(self, progress)
        if progress.step == 4:
            raise Killed

    monkeypatch.setattr(checkpoint.Checkpoint, "see", end)
    return lambda: monkeypatch.setattr(checkpoint.Checkpoint, "see", see)


def test_a_killed_fit_has_saved_itself_and_goes_on(folder, run, killed):
    with pytest.raises(Killed):
        run("photo.jpg", *JSON)
    assert names(folder) == [BESIDE, "photo.jpg"]
    saved = sdf2vec.load(BESIDE)
    assert saved.shape_count == 5
    killed()
    told = run("photo.jpg", *JSON, "-o", "other/").out.decode()
    assert "left by" not in told  # it is of outputs elsewhere
    told = run("photo.jpg", *JSON, "--start", BESIDE).out.decode()
    assert "left by" not in told
    assert names(folder) == ["other/photo.scene.json", "photo.jpg", "photo.scene.json"]


def test_a_run_tells_of_a_checkpoint_that_was_left(folder, run, killed):
    with pytest.raises(Killed):
        run("photo.jpg", *JSON)
    killed()
    told = run("photo.jpg", *JSON).out.decode()
    assert f"{BESIDE}: left by a fit that was killed; --start {BESIDE} goes on from it" in told
    assert BESIDE not in names(folder)


def test_none_is_written_before_its_time_nor_where_it_is_off(folder, run, monkeypatch):
    saved: list[str] = []
    monkeypatch.setattr(checkpoint, "save", lambda scene, path: saved.append(path))
    run("photo.jpg", *JSON)
    assert saved == []
    monkeypatch.setattr(checkpoint, "PAUSE", 0.0)
    run("photo.jpg", *JSON, "--checkpoint", "off")
    run("photo.jpg", *SHORT, "--emit", "glsl", "-o", "-")
    assert saved == []
    run("photo.jpg", *JSON, "--checkpoint", "here.json")
    assert set(saved) == {"here.json"}
    assert "here.json" not in names(folder)


def test_one_that_can_not_be_written_costs_a_line_not_the_fit(folder, run, monkeypatch):
    monkeypatch.setattr(checkpoint, "PAUSE", 0.0)

    def refuse(scene, path):
        raise sdf2vec.Sdf2vecError(f"{path}: cannot write it")

    monkeypatch.setattr(checkpoint, "save", refuse)
    done = run("photo.jpg", *JSON)
    assert done.code == 0
    assert done.err.count("no checkpoint: photo.checkpoint.scene.json: cannot write it") == 1


def test_a_checkpoint_replaces_nothing_of_others(folder, run):
    assert_refused(run("photo.jpg", *JSON, "--checkpoint", "photo.jpg"), "photo.jpg", "overwrite an input")
    (folder / "notes.txt").write_text("mine")
    assert_refused(run("photo.jpg", *JSON, "--checkpoint", "notes.txt"), "notes.txt", "not made by sdf2vec")
    assert_refused(run("photo.jpg", *JSON, "--checkpoint", "photo.scene.json"), "photo.scene.json", "both")
    os.link("photo.jpg", "again.jpg")
    assert_refused(run("photo.jpg", "again.jpg", *JSON, "--checkpoint", "x.json"), "x.json", "one input")


def test_a_callback_may_take_the_scene(folder):
    seen: list[sdf2vec.Scene] = []

    def take(progress):
        seen.append(progress.scene())
        return len(seen) > 2

    sdf2vec.fit("photo.jpg", 5, preset="fast", callback=take)
    assert [scene.shape_count for scene in seen] == [2, 4, 5]

"""A folder with a picture, and the program run in this process."""

import io
import sys
from dataclasses import replace

import pytest

from sdf2vec.cli import main
from sdf2vec.fit.presets import PRESETS
from tests.cli.command import ALL, SHORT, Outcome, picture


@pytest.fixture(autouse=True)
def short_fits(monkeypatch, kernels_there):
    """Three steps a phase: what is tested here is not the fit. No line says that kernels are compiled."""
    short = tuple(replace(phase, steps=3) for phase in PRESETS["fast"].phases)
    monkeypatch.setitem(PRESETS, "fast", replace(PRESETS["fast"], phases=short))


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """The current folder, with a picture in it."""
    monkeypatch.chdir(tmp_path)
    picture().save(tmp_path / "photo.jpg")
    return tmp_path


@pytest.fixture
def run(capfdbinary, monkeypatch):
    """Runs the program in this process, as its entry point does."""

    def run_main(*arguments, stdin=b""):
        monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(stdin)))
        with pytest.raises(SystemExit) as caught:
            main([str(argument) for argument in arguments])
        out, err = capfdbinary.readouterr()
        assert isinstance(caught.value.code, int)
        return Outcome(caught.value.code, out, err.decode())

    return run_main


@pytest.fixture
def scene_file(folder, run):
    """A scene file, and beside it the other exports of the same conversion."""
    assert run("photo.jpg", *SHORT, "--emit", ALL, "-o", "made").code == 0
    return "made/photo.scene.json"

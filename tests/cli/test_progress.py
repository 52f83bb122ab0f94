"""The bar: what it says of a fit, of kernels that are compiled, of exports."""

import io
import math
import re
import sys
from importlib import import_module

from sdf2vec import Scene
from sdf2vec.fit.loop import Progress
from sdf2vec.kernel_cache import Assembly
from sdf2vec.layer import Part
from sdf2vec.paints import PAINTS
from sdf2vec.progress import Teller, telling
from sdf2vec.render import kernels, tiling
from sdf2vec.running import Running
from sdf2vec.shapes import KINDS
from tests.cli.command import SHORT


def scene():
    return Scene(8, 8, ())


def terminal(monkeypatch):
    """Makes stderr a terminal, from now on; what it shows."""
    stream = io.StringIO()
    stream.isatty = lambda: True  # type: ignore[method-assign]
    monkeypatch.setattr(sys, "stderr", stream)
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setenv("COLUMNS", "100")
    return stream


def test_the_bar_names_every_phase_and_never_a_number_that_is_none(monkeypatch, capsys):
    stream = terminal(monkeypatch)
    with telling(Running()) as teller:
        with teller.phase("fit"):
            teller.step(Progress("compiling kernels (once)", 0, 90, math.nan, scene))
            teller.bar.refresh()
            teller.step(Progress("coarse", 7, 90, 0.25, scene))
            teller.bar.refresh()
        for name in ("export svg", "check svg"):
            with teller.phase(name):
                teller.bar.refresh()
            teller.say(f"done: {name}")
    shown = re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", stream.getvalue())
    assert re.search(r"coarse on cpu .*step 7/90  loss 0\.25000", shown)
    for word in ("compiling kernels (once) on cpu", "export svg", "check svg"):
        assert word in shown
    assert "nan" not in shown
    assert capsys.readouterr().out == "done: export svg\ndone: check svg\n"
    assert set(teller.seconds) == {"fit", "export svg", "check svg"}


def test_the_time_of_a_phase_within_another_counts_once(monkeypatch):
    clock = iter([0.0, 1.0, 4.0, 5.0, 5.5, 8.0])
    monkeypatch.setattr("sdf2vec.progress.time.perf_counter", lambda: next(clock))
    teller = Teller(Running())
    with teller.phase("export svg"):
        with teller.phase("fit drawing"):
            pass
        with teller.phase("fit drawing"):
            pass
    assert teller.seconds == {"fit drawing": 3.5, "export svg": 4.5}


def test_a_quiet_run_has_no_bar(monkeypatch, capsys):
    stream = terminal(monkeypatch)
    with telling(Running(quiet=True)) as teller, teller.phase("fit"):
        teller.say("nothing")
        teller.step(Progress("coarse", 7, 90, 0.25, scene))
    assert stream.getvalue() + capsys.readouterr().out == ""


def test_without_a_terminal_a_line_says_that_kernels_are_compiled(folder, run, monkeypatch):
    monkeypatch.setattr(import_module("sdf2vec.render.kernels"), "is_compiled", lambda *arguments: False)
    said = b"compiling kernels (once): takes some seconds more"
    assert run("photo.jpg", *SHORT, "-o", "a.json").out.count(said) == 1
    assert said not in run("photo.jpg", *SHORT, "-o", "a.json", "-q").out


def test_warming_up_compiles_what_fits_of_every_kind_need(folder, run, monkeypatch):
    compiled: list[str] = []
    monkeypatch.setattr(Assembly, "code", lambda assembly: compiled.append(assembly.stem))
    lines = run("--warm-up").out.decode().splitlines()
    assert len(lines) == 1 + len(KINDS) * len(PAINTS)
    assert "circle, flat: 0.0 s" in lines[1]
    for kind in KINDS:
        entries = [*kernels.drawing((Part(kind),), "additive", 4), *kernels.measuring((Part(kind),))]
        assert {entry.assembly.stem for entry in entries} <= set(compiled)
    assert tiling.draw_tiles.assembly.stem in compiled
    assert len(set(compiled)) > 100

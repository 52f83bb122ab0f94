"""What goes wrong is one line and an exit status that says so; nothing else is lost."""

import os
import resource
import signal
import subprocess
import sys
import warnings
from pathlib import Path

import pytest

import sdf2vec
from sdf2vec import converting, guard
from sdf2vec.files import _OURS, _sweep
from sdf2vec.image import load
from sdf2vec.kernel_cache import _warn_once
from tests.cli.command import SHORT, Outcome, assert_refused, names

PROGRAM = [sys.executable, "-m", "sdf2vec.cli"]
START = Path(__file__).parents[2] / "sdf2vec_start.py"


@pytest.fixture
def scene(tmp_path, monkeypatch):
    """A scene file in the current folder."""
    monkeypatch.chdir(tmp_path)
    shape = sdf2vec.Shape.of("circle", (1, 0, 0), center=(0, 0), radius=0.3)
    sdf2vec.save(sdf2vec.Scene(30, 20, (sdf2vec.Layer((shape,), 0.1),)), "a.scene.json")
    return "a.scene.json"


def program(*arguments, environment=None, **options):
    """The program as a process of its own."""
    options = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, **options}
    given = {**os.environ, **(environment or {})}
    done = subprocess.run([*PROGRAM, *arguments], env=given, timeout=120, check=False, **options)
    return Outcome(done.returncode, done.stdout or b"", (done.stderr or b"").decode())


def left_pipe():
    """Something to write to that nobody reads."""
    reader, writer = os.pipe()
    os.close(reader)
    return writer


def test_files_are_written_though_nobody_reads_the_summary(scene):
    outcome = program("export", scene, "--emit", "png,json", "-o", "out", stdout=left_pipe())
    assert outcome == (0, b"", "")
    assert names(Path("out")) == ["a.render.png", "a.scene.json"]


def test_an_export_that_nobody_reads_is_not_reported_as_done(scene):
    outcome = program("export", scene, "--emit", "glsl", "-o", "-", stdout=left_pipe())
    assert outcome == (128 + signal.SIGPIPE, b"", "")


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="needs /dev/full")
def test_files_are_written_though_the_summary_can_not_be(scene):
    with open("/dev/full", "wb") as full:
        outcome = program("export", scene, "--emit", "png,json", "-o", "out", stdout=full)
    assert_refused(outcome, "standard output", "No space left")
    assert names(Path("out")) == ["a.render.png", "a.scene.json"]


@pytest.mark.parametrize("closed", [(1,), (2,), (0, 1, 2)])
def test_standard_streams_may_be_closed(scene, closed):
    outcome = program(
        "export", scene, "--emit", "png,json", "-o", "out", preexec_fn=lambda: list(map(os.close, closed))
    )
    assert (outcome.code, outcome.err) == (0, "")
    assert names(Path("out")) == ["a.render.png", "a.scene.json"]
    assert Path("out/a.render.png").read_bytes().endswith(b"IEND\xaeB`\x82")
    assert Path("out/a.scene.json").read_bytes() == Path(scene).read_bytes()


def test_an_export_to_closed_standard_output_is_refused(scene):
    outcome = program("export", scene, "-o", "-", preexec_fn=lambda: os.close(1))
    assert_refused(outcome, "standard output: is closed")


# ------------------------------------------------------------------------------------------------- bugs


def broken(problem):
    def load_or_break(source):
        if source == "bad.png":
            raise problem
        return load(source)

    return load_or_break


def test_a_bug_is_one_line_and_the_rest_goes_on(folder, run, monkeypatch):
    monkeypatch.setattr(converting, "load_picture", broken(KeyError("what\nelse")))
    outcome = run("bad.png", "photo.jpg", *SHORT, "--emit", "json", "-o", "out")
    assert outcome.code == 70
    assert outcome.err.count("\n") == 1
    assert outcome.err.startswith("sdf2vec: this is a bug: KeyError: ")
    assert "run it again with --traceback" in outcome.err
    assert names(folder / "out") == ["photo.scene.json"]


def test_a_bug_with_its_traceback(folder, run, monkeypatch):
    monkeypatch.setattr(converting, "load_picture", broken(KeyError("what")))
    outcome = run("--traceback", "bad.png", "-o", "x.glsl")
    assert outcome.code == 70
    assert outcome.err.startswith("Traceback (most recent call last)")
    assert "in load_or_break\n" in outcome.err


def test_a_lack_of_memory_is_no_bug(folder, run, monkeypatch):
    monkeypatch.setattr(converting, "load_picture", broken(MemoryError()))
    assert_refused(run("bad.png"), "not enough memory")


@pytest.mark.parametrize("text", ["5000", "²", "0", "many"])
def test_impossible_numbers_of_threads(folder, run, monkeypatch, text):
    monkeypatch.setenv("SDF2VEC_THREADS", text)
    assert_refused(
        run("photo.jpg", *SHORT), "SDF2VEC_THREADS: a whole number from 1 to 256 is needed, got", text
    )
    assert names(folder) == ["photo.jpg"]


# ---------------------------------------------------------------------------------------------- signals

INTERRUPTED_SOON = """
import os, signal, sys, threading
program = compile(open(sys.argv[1]).read(), sys.argv[1], "exec")
timer = threading.Timer(float(sys.argv[2]), os.kill, (os.getpid(), signal.SIGINT))
sys.argv = sys.argv[1:2] + ["missing.png"] * 3
timer.daemon = True  # where the program has ended before, there is nothing to interrupt
timer.start()
exec(program, {"__name__": "__main__"})
"""


@pytest.mark.parametrize("seconds", [0.06, 0.15, 0.3])
def test_an_interruption_while_modules_are_imported(seconds):
    command = [sys.executable, "-c", INTERRUPTED_SOON, str(START), str(seconds)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode in (-signal.SIGINT, 130, 2)
    assert "Traceback" not in done.stderr


def test_the_program_starts_there():
    done = subprocess.run([sys.executable, START, "--version"], capture_output=True, text=True, check=True)
    assert done.stdout == f"sdf2vec {sdf2vec.__version__}\n"


# ------------------------------------------------------------------------------------------------ disks


def test_a_full_disk_keeps_the_old_output(scene):
    Path("a.svg").write_text("old")
    outcome = program(
        "export",
        scene,
        "--emit",
        "svg",
        "--force",
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (100, 100)),
        environment={"PYTHONDONTWRITEBYTECODE": "1"},
    )
    assert_refused(outcome, "a.svg: cannot write it (File too large)")
    assert Path("a.svg").read_text() == "old"
    assert sorted(os.listdir()) == ["a.scene.json", "a.svg"]


def test_a_cache_that_can_not_be_written_to_is_one_line(capsys):
    def work(arguments):
        warnings.simplefilter("default")
        _warn_once(Path("/else/where"))
        warnings.warn("of a library", RuntimeWarning, stacklevel=1)
        return 0

    with pytest.raises(SystemExit) as caught:
        guard.run(work, [])
    assert caught.value.code == 0
    assert capsys.readouterr().err == (
        "sdf2vec: cannot write to /else/where: kernels are compiled anew in every run; "
        "SDF2VEC_CACHE names another folder\n"
    )


def test_what_killed_runs_have_left_is_swept(tmp_path, scene):
    ended = subprocess.Popen([sys.executable, "-c", ""])
    ended.wait()
    kept = [f"{_OURS}{os.getpid()}-1.tmp", ".sdf2vec-0123456789.tmp", ".sdf2vec-other-1-1.tmp", "my.tmp"]
    swept = [f"{_OURS}{ended.pid}-1.tmp", ".sdf2vec-old.tmp"]
    for name in (*kept, *swept):
        (tmp_path / name).write_bytes(b"")
    os.utime(tmp_path / ".sdf2vec-old.tmp", (1e9, 1e9))
    _sweep.cache_clear()
    assert program("export", scene, "--emit", "json", "-o", "b.json").code == 0
    assert sorted(os.listdir()) == sorted([*kept, scene, "b.json"])


# -------------------------------------------------------------------------------------------- the cache


def test_the_cache_command(tmp_path, run, monkeypatch):
    monkeypatch.setenv("SDF2VEC_CACHE", str(tmp_path))
    (tmp_path / "a.kernel").write_bytes(bytes(1234))
    (tmp_path / "mine.txt").write_bytes(b"")
    assert run("cache", "--path") == (0, f"{tmp_path}\n".encode(), "")
    assert run("cache", "--size") == (0, b"1 files, 1,234 bytes\n", "")
    assert run("cache", "--clear") == (0, b"1 files removed, 0 left\n", "")
    assert os.listdir(tmp_path) == ["mine.txt"]
    assert_refused(run("cache"), "--path", "--size", "--clear")


def test_the_package_runs_as_the_program_does():
    done = subprocess.run(
        [sys.executable, "-m", "sdf2vec", "nothing.png"], capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == "sdf2vec: nothing.png: no such file\n"

"""Batches beyond one process: a Dask cluster whose workers are killed, Ray's interface, what is missing."""

import json
import os
import subprocess
import sys
import time
import types
from pathlib import Path
from typing import Any

import pytest

from sdf2vec import batch
from sdf2vec.limits import THREADS
from sdf2vec.running import Running
from sdf2vec.workers import working
from tests.cli.command import SHORT, assert_refused, names
from tests.cli.conversion import DEADLY, conversion

PICTURES = [f"{number:02}.png" for number in range(12)]


@pytest.fixture
def album(folder):
    """Files that are only looked at by a conversion which is none."""
    (folder / "album").mkdir()
    (folder / "tries").mkdir()
    for name in PICTURES:
        (folder / "album" / name).write_bytes(name.encode())
    return folder


def test_killed_workers_lose_nothing(album, run, monkeypatch):
    """A Dask cluster of two processes, of which one is killed twice: the report is complete, each output is there
    once, and only the shard that a killed worker had is done again."""
    monkeypatch.setattr(batch, "_converted", conversion)
    command = ("album", *SHORT, "--emit", "json", "-o", "out", "--engine", "dask", "--jobs", 2, "--shard", 2)
    outcome = run(*command, "--report", "r.jsonl")
    assert (outcome.code, outcome.err) == (0, "")
    rows = [json.loads(line) for line in (album / "r.jsonl").read_text().splitlines()]
    assert sorted(row["file"] for row in rows) == [f"album/{name}" for name in PICTURES]
    assert {row["status"] for row in rows} == {"ok"}
    assert names(album / "out") == [f"{Path(name).stem}.scene.json" for name in PICTURES]
    assert all((album / f"out/{Path(name).stem}.scene.json").read_text().endswith(name) for name in PICTURES)
    tried = {name: len((album / "tries" / name).read_text()) for name in PICTURES}
    again = {name for name, count in tried.items() if count > 1}
    assert set(DEADLY) <= again
    assert len(again) <= len(DEADLY) * 2
    assert max(tried.values()) <= 2
    assert outcome.out.count(b": converted\n") == len(PICTURES)
    sums = json.loads((album / "r_stats.json").read_text())
    assert (sums["count"], sums["successes"], sums["failed"]) == (12, 12, 0)
    assert (sums["shapes"], sums["bytes"], sums["status_dict"]) == (60, 72, {"ok": 12})
    outcome = run(*command, "--report", "r.jsonl")
    assert (outcome.code, tried) == (
        0,
        {name: len((album / "tries" / name).read_text()) for name in PICTURES},
    )


def test_a_worker_that_never_got_a_picture_ends_with_its_run(tmp_path):
    """Killed as a system does that has no memory left: nobody tells the worker."""
    code = """
import os, signal
from sdf2vec.running import Running
from sdf2vec.workers.processes import Processes

if __name__ == "__main__":
    with open("worker", "w") as file:
        file.write(str(Processes(Running(), 1, 1).start(os.getpid).result()))
    os.kill(os.getpid(), signal.SIGKILL)
"""
    (tmp_path / "run.py").write_text(code)
    subprocess.run([sys.executable, "run.py"], cwd=tmp_path, stderr=subprocess.DEVNULL, check=False)
    worker = int((tmp_path / "worker").read_text())
    end = time.monotonic() + 20.0
    while is_there(worker):
        assert time.monotonic() < end
        time.sleep(0.01)


def is_there(process):
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    return True


class Reference:
    """What Ray gives for a task."""

    def __init__(self, result):
        self.result = result


@pytest.fixture
def ray(monkeypatch):
    """Ray's functions that are used, as its documentation has them: tasks run at once, killed ones raise."""
    made, asked = types.ModuleType("ray"), list[Any]()
    errors = types.SimpleNamespace(RayError=type("RayError", (Exception,), {}))
    errors.WorkerCrashedError = type("WorkerCrashedError", (errors.RayError,), {})
    errors.RayTaskError = type("RayTaskError", (errors.RayError,), {})

    def begin(task, *arguments):
        try:
            return Reference(task(*arguments))
        except ZeroDivisionError as error:
            return Reference(errors.RayTaskError(str(error)))
        except ConnectionError:
            return Reference(errors.WorkerCrashedError())

    def get(reference):
        if isinstance(reference.result, Exception):
            raise reference.result
        return reference.result

    def remote(**options):
        asked.append(options)
        return lambda task: types.SimpleNamespace(remote=lambda *arguments: begin(task, *arguments))

    functions = {
        "init": lambda **options: asked.append(options),
        "cluster_resources": lambda: {"CPU": 3.0},
        "remote": remote,
        "wait": lambda waiting, num_returns, timeout: (waiting[:num_returns], waiting[num_returns:]),
        "get": get,
        "cancel": lambda reference, force: asked.append("cancelled"),
        "shutdown": lambda: asked.append("shut down"),
        "exceptions": errors,
    }
    for name, value in functions.items():
        setattr(made, name, value)
    monkeypatch.setitem(sys.modules, "ray", made)
    return asked


def crash():
    raise ConnectionError


def test_ray_gets_tasks_and_tells_which_were_killed(ray):
    with working(Running(engine="ray", address="auto", jobs=5), 9) as workers:
        assert (workers.capacity, workers.is_elsewhere) == (5, True)
        tasks = [workers.start(divmod, 7, 2), workers.start(crash)]
        assert dict(workers.ended(0.2)) == {tasks[0]: (3, 1), tasks[1]: None}
        assert workers.start(divmod, 1, 0)
        with pytest.raises(Exception, match="division"):
            workers.ended(0.2)
        workers.start(divmod, 1, 1)
    assert ray[0]["address"] == "auto"
    assert ray[1] == {"max_retries": 0, "num_cpus": 1}
    assert ray[-2:] == ["cancelled", "shut down"]


def test_ray_shares_the_cores_of_this_machine(ray, monkeypatch):
    monkeypatch.delenv("SDF2VEC_THREADS", raising=False)
    monkeypatch.setattr(os, "cpu_count", lambda: 2000)
    with working(Running(engine="ray", jobs=2), 9) as workers:
        assert workers.capacity == 2
    assert ray[0]["num_cpus"] == 2
    assert ray[0]["runtime_env"] == {"env_vars": {"SDF2VEC_THREADS": str(THREADS)}}
    assert "address" not in ray[0]


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--engine", "dask"], ["--engine dask", "distributed", "pip install 'sdf2vec[dask]'"]),
        (["--engine", "ray"], ["--engine ray", "pip install 'sdf2vec[ray]'"]),
        (["--report", "r.parquet"], ["Parquet", "pyarrow", "pip install 'sdf2vec[parquet]'"]),
    ],
)
def test_what_is_missing_is_said_in_a_line(folder, run, monkeypatch, options, words):
    for name in ("distributed", "ray", "pyarrow"):
        monkeypatch.setitem(sys.modules, name, None)
    assert_refused(run("photo.jpg", *SHORT, *options), *words)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--address", "tcp://here:8786"], ["--address has no effect on processes"]),
        (["--shard", "3"], ["--shard has no effect on one process"]),
        (["-q", "-v"], ["either -q or -v"]),
        (["--engine", "dask", "-o", "-"], ["standard input and output belong to this process"]),
        (["-", "--jobs", "2"], ["standard input and output belong to this process"]),
        (["--engine", "spark"], ["unknown engine 'spark'; choose from processes, dask, ray"]),
        (["--engine", "dask", "--address", "here"], ["--address here: no Dask scheduler answers"]),
        (["--report", "r.txt"], ["r.txt: a report ends in .jsonl, .csv, .parquet"]),
    ],
)
def test_what_has_no_effect_is_refused(folder, run, monkeypatch, options, words):
    monkeypatch.setattr("sdf2vec.workers.dask.PATIENCE", 0.5)
    assert_refused(run("photo.jpg", *SHORT, *options), *words)


def test_sums_of_something_else_are_not_replaced(folder, run):
    (folder / "r_stats.json").write_text('{"mine": 1}')
    assert_refused(run("photo.jpg", *SHORT, "--report", "r.csv"), "r_stats.json", "not made by sdf2vec")
    assert run("photo.jpg", *SHORT, "--emit", "json", "--report", "r.csv", "--force").code == 0

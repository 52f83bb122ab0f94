"""SIGKILL at any moment, over outputs that are there: each is the old one or the new one, whole.

A third of the kills each for a fit, an export, and a batch of two pictures. Every other one comes just after the
first file in the folder has changed, the rest at any moment of the run. Runs are forks of this process, which has
imported everything: what is killed is work, not imports.
"""

import json
import os
import random
import shutil
import signal
import tempfile
import time
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
import torch
from PIL import Image

import sdf2vec
from sdf2vec import cli
from sdf2vec.image import load
from sdf2vec.quality import quality

TARGETS = "glsl,shadertoy,svg,json,png"
FIT = ["--shapes", "5", "--preset", "fast", "--emit", TARGETS, "--check", "off", "-q", "-o", "out"]
COMMANDS = {
    "fit": ["a.png", *FIT],
    "export": ["export", "a.scene.json", "--emit", TARGETS, "--check", "off", "-q", "-o", "out"],
    "batch": ["a.png", "b.png", *FIT, "--report", "out/report.jsonl"],
}
SEVERAL = 0.1  # share of the batches that are done in two processes, which import everything themselves
LATEST = 0.03  # seconds from the first change of a file to a kill
LONGEST = 120.0  # seconds that a run may take
LEFT = ".sdf2vec-*.tmp"


@dataclass(frozen=True)
class Ready:
    """A folder with inputs, the outputs of two versions of them, and how long each command takes."""

    folder: Path
    outputs: dict[str, dict[str, tuple[bytes, bytes]]]  # command → name → old and new bytes
    seconds: dict[str, float]


def started(command, folder):
    """The number of a process of its own, and of its group, that runs the program."""
    child = os.fork()
    if child:
        return child
    try:
        os.setsid()
        os.chdir(folder)
        os.environ["SDF2VEC_THREADS"] = "1"  # other threads have not come along
        torch.set_num_threads(1)
        null = os.open(os.devnull, os.O_RDWR)
        for number in range(3):
            os.dup2(null, number)
        cli.main(command)
    except SystemExit as end:
        os._exit(int(end.code or 0))
    finally:
        os._exit(99)


def run(command, folder):
    _, status = os.waitpid(started(command, folder), 0)
    assert os.waitstatus_to_exitcode(status) == 0, command


def files_of(folder):
    return {path.name: path.read_bytes() for path in Path(folder, "out").iterdir()}


@cache
def ready():
    """Made once in a process."""
    _import_all()
    folder = Path(tempfile.mkdtemp(prefix="sdf2vec-kills-"))
    made: dict[str, list[dict[str, bytes]]] = {name: [] for name in COMMANDS}
    seconds = {}
    for version in (1, 2):
        rows = np.random.default_rng(version).integers(0, 256, (2, 4, 4, 3), dtype=np.uint8)
        for name, pixels in zip("ab", rows, strict=True):
            Image.fromarray(pixels).resize((32, 24)).save(folder / f"{name}.png")
        for name in ("batch", "export"):
            shutil.rmtree(folder / "out", ignore_errors=True)
            begun = time.monotonic()
            run(COMMANDS[name], folder)
            seconds[name] = time.monotonic() - begun
            made[name].append(files_of(folder))
            if name == "batch":  # which makes of one picture what a fit of it does
                shutil.copy(folder / "out" / "a.scene.json", folder / "a.scene.json")
                made["fit"].append({file: data for file, data in made[name][-1].items() if file[0] == "a"})
                seconds["fit"] = seconds[name] / 2
    outputs = {name: {file: (old[file], new[file]) for file in new} for name, (old, new) in made.items()}
    return Ready(folder, outputs, seconds)


def _import_all():
    """What a run imports."""
    pixels = np.zeros((4, 4, 3), np.uint8)
    scene = sdf2vec.fit(pixels, 5, preset="fast", callback=lambda progress: True)
    quality(scene, load(pixels))
    for target in TARGETS.split(","):
        sdf2vec.export(scene, target)


def attack_kills(seed):
    """A run killed over old outputs; then another one, which leaves no temporary file."""
    r, made = random.Random(seed), ready()
    name = list(COMMANDS)[seed % len(COMMANDS)]
    out = made.folder / "out"
    shutil.rmtree(out, ignore_errors=True)
    out.mkdir()
    for file, (old, _) in made.outputs[name].items():
        if file != "report.jsonl":  # else nothing would be left to do
            (out / file).write_bytes(old)
    several = ["--jobs", "2"] if name == "batch" and r.random() < SEVERAL else []
    _kill([*COMMANDS[name], *several], made, r, made.seconds[name])
    for file, known in made.outputs[name].items():
        found = (out / file).read_bytes() if (out / file).exists() else b""
        if file == "report.jsonl":
            assert all(json.loads(line)["file"] in ("a.png", "b.png") for line in found.splitlines())
        elif file == "report_stats.json":  # it holds times
            assert json.loads(found or "{}").keys() in (set(), json.loads(known[0]).keys()), f"{name}: {file}"
        else:
            assert found in known, (
                f"{name}: {file} is neither the old one nor the new one, {len(found)} bytes"
            )
    run(COMMANDS["export"], made.folder)
    left = [path.name for path in out.glob(LEFT)] + [path.name for path in made.folder.glob(LEFT)]
    assert not left, f"{name}: {left}"
    strange = files_of(made.folder).keys() - made.outputs["batch"].keys()
    assert not strange, f"{name}: {strange}"


def _kill(command, made, r, seconds):
    """The whole group at once, or only the first process, as a system does that has no memory left."""
    watched, all_at_once = r.random() < 0.5, r.random() < 0.5
    wait, after = r.uniform(0.0, seconds), r.uniform(0.0, LATEST)
    before = _state(made.folder / "out")
    child = started(command, made.folder)
    end = time.monotonic() + (LONGEST if watched else wait)
    while time.monotonic() < end:
        if os.waitid(os.P_PID, child, os.WEXITED | os.WNOHANG | os.WNOWAIT):
            break  # it has done everything
        if watched and _state(made.folder / "out") != before:
            time.sleep(after)
            break
        time.sleep(0.0005)
    if all_at_once:
        _signal_group(child, signal.SIGKILL)
    os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)
    end = time.monotonic() + 20.0
    while _signal_group(child, 0):
        if time.monotonic() > end:
            _signal_group(child, signal.SIGKILL)
            raise AssertionError("workers of a killed batch go on")
        time.sleep(0.01)


def _signal_group(group, number):
    """Whether there is one to be signalled."""
    try:
        os.killpg(group, number)
    except (ProcessLookupError, PermissionError):
        return False
    return True


def _state(folder):
    try:
        return {entry.name: (entry.stat().st_ino, entry.stat().st_mtime_ns) for entry in os.scandir(folder)}
    except FileNotFoundError:  # renamed in between
        return None

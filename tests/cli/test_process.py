"""The command line as a process of its own: what it loads, readers that leave, interruptions."""

import os
import pty
import re
import select
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
from PIL import Image

import sdf2vec
from tests.cli.command import ALL, Outcome, assert_refused, names

PROGRAM = [sys.executable, "-m", "sdf2vec.cli"]


def test_help_and_refusals_load_nothing_heavy():
    code = """
import sys
from sdf2vec.cli import main
for arguments in (["--help"], ["check", "--help"], ["render", "--help"], ["export", "--help"], ["--version"],
                  ["missing.png"], ["x.png", "--emit", "nonsense"], ["export", "missing.json"]):
    try:
        main(arguments)
    except SystemExit as end:
        print(end.code, *{"torch", "llvmlite", "numpy"} & set(sys.modules), file=sys.stderr)
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    lines = [line for line in done.stderr.splitlines() if not line.startswith("sdf2vec: ")]
    assert lines == ["0"] * 5 + ["2 numpy", "2 numpy", "2 numpy"]
    assert "--shapes" in done.stdout
    assert all(target in done.stdout for target in ALL.split(","))
    assert f"sdf2vec {sdf2vec.__version__}" in done.stdout


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="needs /dev/full")
def test_standard_output_that_takes_nothing(folder, run, scene_file):
    with open("/dev/full", "wb") as full:
        command = [*PROGRAM, "export", scene_file, "-o", "-"]
        done = subprocess.run(command, stdout=full, stderr=subprocess.PIPE, text=True, check=False)
    assert_refused(Outcome(done.returncode, b"", done.stderr), "standard output", "No space left")


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_interruption_at_a_terminal(folder, number):
    """A bar on the terminal; Ctrl-C once the fit runs: exports what is there, exit code 130, no traceback."""
    noise = np.random.default_rng(0).integers(0, 256, (200, 200, 3), dtype=np.uint8)
    Image.fromarray(noise).save(folder / "noise.png")
    terminal, stderr = pty.openpty()
    command = [*PROGRAM, "noise.png", "--shapes", "64", "--preset", "best", "--emit", "json,glsl"]
    environment = {**os.environ, "TERM": "xterm", "COLUMNS": "120"}
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=stderr, env=environment) as process:
        os.close(stderr)
        bar = rb"coarse.*?step [1-9]\d*/\d{3,} +loss 0\.\d+"
        seen = _read_until(terminal, re.compile(bar, re.DOTALL), 120)
        process.send_signal(number)
        seen += _read_until(terminal, None, 60)
        assert process.stdout
        out = process.stdout.read().decode()
    os.close(terminal)
    assert re.search(bar, seen, re.DOTALL)
    assert process.returncode == 128 + number
    assert b"Traceback" not in seen
    # The summary is on standard output though the bar was on the terminal.
    assert re.match(r"noise\.png: 200 x 200, \d+ shapes, PSNR .* dB, .* fitted in .* s, stopped early\n", out)
    assert names(folder) == ["noise.glsl", "noise.png", "noise.scene.json", "photo.jpg"]
    assert sdf2vec.load(folder / "noise.scene.json").shape_count in (16, 32, 64)
    assert (folder / "noise.glsl").read_text().endswith("}\n")


def _read_until(terminal, pattern, seconds):
    """What a terminal shows until the pattern comes, or the program ends."""
    seen, end = b"", time.monotonic() + seconds
    while time.monotonic() < end:
        if not select.select([terminal], [], [], 0.2)[0]:
            continue
        try:
            piece = os.read(terminal, 65536)
        except OSError:  # the other end is closed
            return seen
        seen += piece
        if not piece or (pattern and pattern.search(seen)):
            return seen
    pytest.fail(f"nothing like it within {seconds} s: {seen[-300:]!r}")

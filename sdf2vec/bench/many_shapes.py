"""What the exports of many shapes take: seconds and memory of a process that makes one."""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from itertools import chain
from pathlib import Path
from typing import NamedTuple

from . import choices
from .export_worker import FORMS
from .table import Asked, Page

SHAPES = "256,1024,4096"


class Took(NamedTuple):
    """CPU seconds and megabytes of a process, and what it wrote, in bytes; `error`: why it wrote nothing."""

    seconds: float
    memory: float
    size: int
    error: str = ""


def took(form: str, count: int) -> Took:
    """An export in a process of its own."""
    with tempfile.TemporaryDirectory() as folder:
        output = Path(folder, "export")
        call = [sys.executable, "-m", f"{__package__}.export_worker", form, str(count), str(output)]
        process = subprocess.Popen(call, stderr=subprocess.PIPE, text=True)
        assert process.stderr is not None
        said = process.stderr.read()
        _, status, used = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        size = output.stat().st_size if output.exists() else 0
    error = said.strip().splitlines()[-1] if process.returncode else ""
    return Took(used.ru_utime + used.ru_stime, used.ru_maxrss / 1024, size, error)


def row(form: str, counts: list[int]) -> str:
    """A line of the table."""
    cells = []
    for count in counts:
        found = took(form, count)
        cells.append(
            f"{found.seconds:.1f} s, {found.memory:,.0f} MB, {found.size:,} B"
            if not found.error
            else found.error
        )
    return f"| {form} | {' | '.join(cells)} |"


def add_choices(parser: argparse.ArgumentParser) -> None:
    """The flags of `sdf2vec bench many-shapes`."""
    choices.add_shapes(parser, SHAPES)
    choices.add_list(parser, "--forms", choices.names("form", FORMS), ",".join(FORMS), "which exports")


def pages(options: argparse.Namespace, asked: Asked) -> Iterator[Page]:
    """One page: a row for each form."""
    counts = options.shapes
    head = (
        f"| target | {' | '.join(f'{count:,} shapes' for count in counts)} |",
        "|---|" + "---|" * len(counts),
    )
    about = (
        "Random soft triangles, the smaller the more there are, as those of a fit: CPU seconds, peak memory and bytes "
        "of a whole process, imports included."
    )
    table = asked.told(chain(head, (row(form, counts) for form in options.forms)))
    yield asked.page("What exports of many shapes take", about, table)

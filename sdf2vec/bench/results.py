"""What a benchmark has measured so far: in one file, written anew after each run, so that it can be gone on with."""

from __future__ import annotations

import csv
import hashlib
import io
import os
import platform
from collections import defaultdict
from collections.abc import Sequence
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from statistics import median

import msgspec
from msgspec import Struct

from .. import __version__
from ..errors import Sdf2vecError
from ..files import write_atomically

RESULTS, TABLE = "results.json", "results.csv"
PACKAGES = ("torch", "llvmlite", "numpy", "resvg_py")


class Machine(Struct, frozen=True):
    """Where and with what it was measured."""

    system: str
    processor: str
    cores: int
    versions: dict[str, str]

    @property
    def told(self) -> str:
        """In a line."""
        versions = ", ".join(f"{name} {found}" for name, found in self.versions.items())
        return f"{self.processor}, {self.cores} cores; {versions}"


class Run(Struct, frozen=True, omit_defaults=True):
    """One picture through one method, scored at the picture's own size.

    `seconds`, `cpu`, `megabytes`: of the whole process, from its start to its SVG. `psnr`, `ssim`, `flip`: of the
    scene's render, of another program's SVG by resvg. `svg_…`: the SVG as resvg draws it; `small_…`: its smallest form.
    """

    picture: str
    method: str
    family: str
    shapes: int  # asked for
    seed: int
    seconds: float = 0.0
    cpu: float = 0.0
    megabytes: float = 0.0
    psnr: float = 0.0
    ssim: float = 0.0
    flip: float = 0.0
    drawn: int = 0  # shapes that there are
    numbers: int = 0
    svg_bytes: int = 0
    svg_gzip: int = 0
    svg_psnr: float = 0.0
    svg_flip: float = 0.0
    small_bytes: int = 0
    small_gzip: int = 0
    small_psnr: float = 0.0
    small_flip: float = 0.0
    shader_bytes: int = 0
    shader_gzip: int = 0
    error: str = ""

    @property
    def key(self) -> tuple[str, str, int, int]:
        """What is not done twice."""
        return self.picture, self.method, self.shapes, self.seed


class Results(Struct):
    """All runs, of which pictures (by the hash of their bytes), and which programs were not there."""

    machine: Machine
    commands: list[str]
    pictures: dict[str, str]
    absent: list[str]
    runs: list[Run]

    @property
    def methods(self) -> list[str]:
        """The names of all methods that were run."""
        return list(dict.fromkeys(run.method for run in self.runs))

    @property
    def done(self) -> set[tuple[str, str, int, int]]:
        """The keys of all runs."""
        return {run.key for run in self.runs}

    def medians(self) -> list[Run]:
        """One run for each picture, method and number of shapes: the median of each figure over the seeds."""
        alike: dict[tuple[str, str, int], list[Run]] = defaultdict(list)
        for run in self.runs:
            if not run.error:
                alike[run.key[:3]].append(run)
        return [_median(runs) for runs in alike.values()]


def _median(runs: Sequence[Run]) -> Run:
    first = msgspec.structs.asdict(runs[0])
    middle = {
        name: type(value)(median(getattr(run, name) for run in runs))
        for name, value in first.items()
        if isinstance(value, int | float) and name != "seed"
    }
    return Run(**{**first, **middle})


def machine() -> Machine:
    """This one."""
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    found = {"sdf2vec": __version__, "python": platform.python_version()}
    for name in PACKAGES:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            found[name] = "not here"
    return Machine(f"{platform.system()} {platform.release()}", _processor(), cores, found)


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.processor() or platform.machine()
    names = (line.partition(":")[2].strip() for line in lines if line.startswith("model name"))
    return next(names, platform.machine())


def hash_of(path: str) -> str:
    """Of a picture's bytes. Raises Sdf2vecError for a file that can't be read."""
    try:
        return hashlib.sha256(Path(path).read_bytes()).hexdigest()[:16]
    except OSError as error:
        raise Sdf2vecError(f"{path}: cannot be read ({error.strerror})") from error


def begun(folder: Path, fresh: Results) -> Results:
    """What a folder holds already of these pictures, or nothing. Raises Sdf2vecError where it can't be gone on with."""
    path = folder / RESULTS
    if not path.exists():
        return fresh
    try:
        found = msgspec.json.decode(path.read_bytes(), type=Results)
    except (OSError, msgspec.MsgspecError) as error:
        raise Sdf2vecError(f"{path}: no results of a benchmark ({error}); choose another folder") from error
    if found.machine != fresh.machine:
        raise Sdf2vecError(
            f"{path}: measured on another machine or with other versions; choose another folder"
        )
    changed = [name for name, known in fresh.pictures.items() if found.pictures.get(name, known) != known]
    if changed:
        raise Sdf2vecError(f"{path}: {changed[0]} was another picture then; choose another folder")
    found.pictures |= fresh.pictures
    measured = {run.method for run in found.runs}
    found.absent = sorted({*found.absent, *fresh.absent} - measured)
    found.commands += [command for command in fresh.commands if command not in found.commands]
    return found


def keep(folder: Path, results: Results) -> None:
    """Writes all of it, as JSON and as a table."""
    write_atomically(folder / RESULTS, msgspec.json.format(msgspec.json.encode(results), indent=1))
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(Run.__struct_fields__)
    writer.writerows([getattr(run, name) for name in Run.__struct_fields__] for run in results.runs)
    write_atomically(folder / TABLE, text.getvalue().encode())

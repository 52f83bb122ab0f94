"""A comparison of methods on pictures: run after run, kept after each; then charts, tables and a page."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import product
from pathlib import Path

import numpy as np

from ..arrays import Float32Array
from ..errors import Sdf2vecError
from ..files import require_writable, write_atomically
from ..image import Picture, encode_png, load, resize
from ..outputs import stem_of
from . import fronts, page
from .measuring import Source, measured, source_of
from .methods import Method, described, method_of
from .peers import missing
from .results import Results, begun, hash_of, keep, machine

COLUMN = 168  # pixels across, of a picture of the figure
FIGURE = "side-by-side.png"


@dataclass(frozen=True)
class Plan:
    """What is to be compared, with which programs, and where the results go."""

    pictures: tuple[str, ...]
    methods: tuple[Method, ...]
    shapes: tuple[int, ...]
    seeds: int
    programs: dict[str, str]
    folder: Path
    command: str


@dataclass(frozen=True)
class Task:
    """One run that is to be done."""

    picture: str
    method: Method
    program: str
    shapes: int
    seed: int


def compare(plan: Plan, say: Callable[[str], None]) -> Results:
    """Runs what has not been run yet. Raises Sdf2vecError."""
    require_writable(plan.folder / "index.html")
    pictures = {stem_of(path): path for path in plan.pictures}
    if len(pictures) < len(plan.pictures):
        raise Sdf2vecError("two of the pictures have the same name; rename one")
    loaded = {name: load(path) for name, path in pictures.items()}
    absent = [method.name for method in plan.methods if method.peer and not _program(plan, method)]
    hashes = {name: hash_of(path) for name, path in pictures.items()}
    results = begun(plan.folder, Results(machine(), [plan.command], hashes, absent, []))
    for name in absent:
        say(missing(name))
    tasks = [task for task in _tasks(plan, loaded) if _key(task) not in results.done]
    with tempfile.TemporaryDirectory() as folder:
        sources = {name: source_of(name, picture, Path(folder)) for name, picture in loaded.items()}
        for number, task in enumerate(tasks, 1):
            _do(task, sources[task.picture], results, plan.folder)
            run = results.runs[-1]
            what = f"{task.picture}, {task.method.name}, {task.shapes} shapes, seed {task.seed}"
            near = run.error or f"{run.psnr:.2f} dB, FLIP {run.flip:.4f}, {run.cpu:.1f} CPU s"
            say(f"{number}/{len(tasks)} {what}: {near}")
    return results


def _program(plan: Plan, method: Method) -> str | None:
    return method.peer.among(plan.programs) if method.peer else None


def _tasks(plan: Plan, pictures: dict[str, Picture]) -> Iterator[Task]:
    """Those of all pictures with one method after each other: what is done early compares all of them."""
    for method in plan.methods:
        program = _program(plan, method) or ""
        if method.peer and not program:
            continue
        seeds = range(plan.seeds if method.peer is None else 1)
        counts = [count for count in (plan.shapes if method.counts else (0,)) if count % method.union == 0]
        for shapes, name, seed in product(counts, pictures, seeds):
            yield Task(name, method, program, shapes, seed)


def _key(task: Task) -> tuple[str, str, int, int]:
    return task.picture, task.method.name, task.shapes, task.seed


def _do(task: Task, source: Source, results: Results, folder: Path) -> None:
    run, pixels = measured(source, task.method, task.program, task.shapes, task.seed)
    results.runs.append(run)
    if task.seed == 0 and not run.error:
        write_atomically(folder / page.shot(run), encode_png(_small(pixels)))
        write_atomically(folder / page.original(source.name), encode_png(_small(source.picture.pixels)))
    keep(folder, results)


def _small(pixels: Float32Array) -> Float32Array:
    height, width = pixels.shape[:2]
    scale = min(1.0, page.SHOWN / max(width, height))
    return resize(pixels, max(1, round(width * scale)), max(1, round(height * scale)))


def write_page(results: Results, folder: Path) -> None:
    """Charts, the page, its tables in Markdown, and a figure, of all that there is."""
    runs = results.medians()
    if not runs:
        raise Sdf2vecError("nothing was measured: no run has ended well")
    about = described([method_of(name) for name in results.methods])
    fronts.write_all(runs, folder)
    write_atomically(folder / "index.html", page.html(results, about).encode())
    write_atomically(folder / "benchmarks.md", page.markdown(results, about).encode())
    write_atomically(folder / FIGURE, encode_png(_figure(results, folder)))


def _figure(results: Results, folder: Path) -> Float32Array:
    """A column a picture; below it what each method made with most shapes."""
    columns = []
    for name in results.pictures:
        largest = {
            run.method: run
            for run in sorted(results.medians(), key=lambda r: r.shapes)
            if run.picture == name
        }
        names = [page.original(name), *(page.shot(run) for run in largest.values())]
        images = [load(str(folder / path)).pixels[..., :3] for path in names]
        height = round(COLUMN * images[0].shape[0] / images[0].shape[1])
        columns.append(np.vstack([resize(np.ascontiguousarray(image), COLUMN, height) for image in images]))
    tallest = max(len(column) for column in columns)
    padded = [np.pad(c, ((0, tallest - len(c)), (0, 4), (0, 0)), constant_values=1.0) for c in columns]
    return np.hstack(padded).astype(np.float32)

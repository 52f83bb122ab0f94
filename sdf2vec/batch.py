"""Many pictures: which they are, what has been done of them, and the rest, one by one or in several processes."""

from __future__ import annotations

import glob
import hashlib
import math
import multiprocessing
import os
from collections.abc import Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

from . import guard
from .converting import Done, Work, convert
from .errors import Sdf2vecError
from .export import EXPORTERS
from .files import one_line
from .guard import Problem
from .limits import THREADS
from .outputs import STREAM, Job
from .progress import Stop, Teller, telling
from .report import BUG, FAILED, MISSED, OK, SKIPPED, STOPPED, Report, Row

PICTURES = (".png", ".jpg", ".jpeg", ".webp", ".avif", ".tif", ".tiff", ".gif", ".bmp")
LISTED = 10  # pictures that a line names
KILLED = "the process that converted it was killed (too little memory?)"


# --- which pictures -------------------------------------------------------------------------------------------


def sources_of(inputs: Sequence[str], recursive: bool) -> dict[str, str]:
    """Every picture, with the folder inside the output folder that its files go to.

    An input is a picture, a folder, or a pattern like `*.png` that the shell has left. Raises Sdf2vecError for one
    given twice, and for a folder or a pattern without pictures.
    """
    twice = next((source for source in inputs if inputs.count(source) > 1), None)
    if twice is not None:
        raise Sdf2vecError(f"{one_line(twice)}: is given twice")
    found: dict[str, str] = {}
    for source in inputs:
        if source != STREAM and os.path.isdir(source):
            found |= _in_folder(source, recursive)
        elif source != STREAM and glob.has_magic(source) and not os.path.exists(source):
            found |= dict.fromkeys(_matching(source), "")
        else:
            found[source] = ""
    return found


def _in_folder(folder: str, recursive: bool) -> dict[str, str]:
    paths = sorted(Path(folder).rglob("*") if recursive else Path(folder).iterdir())
    pictures = {
        str(path): str(path.parent.relative_to(folder))
        for path in paths
        if path.is_file() and _is_picture(path)
    }
    if not pictures:
        deeper = "" if recursive else "; --recursive looks into the folders inside it"
        raise Sdf2vecError(
            f"{one_line(folder)}: is a folder without pictures ({', '.join(PICTURES)}){deeper}"
        )
    return pictures


def _is_picture(path: Path) -> bool:
    """By its name; not hidden, and not one of our own renders."""
    name = path.name.lower()
    ours = any(name.endswith(exporter.suffix) for exporter in EXPORTERS.values())
    return name.endswith(PICTURES) and not name.startswith(".") and not ours


def _matching(pattern: str) -> list[str]:
    paths = sorted(path for path in glob.glob(pattern, recursive=True) if os.path.isfile(path))
    if not paths:
        raise Sdf2vecError(f"{one_line(pattern)}: no such file")
    return paths


# --- what is done with them -----------------------------------------------------------------------------------


@dataclass
class Batch:
    """The pictures of a run, and what became of them so far."""

    jobs: Sequence[Job]
    work: Work
    report: Report
    rows: dict[str, Row] = field(default_factory=dict)
    problems: list[Problem] = field(default_factory=list)

    def todo(self) -> list[Job]:
        """The pictures that neither the report nor `--skip-existing` says to be done."""
        left = []
        for job in self.jobs:
            there = STREAM not in job.outputs.values() and all(map(os.path.exists, job.outputs.values()))
            before = self.report.rows.get(job.source)
            if (
                there
                and before
                and before.status in (OK, MISSED)
                and before.settings == self.settings_of(job)
            ):
                self.rows[job.source] = before
            elif there and self.work.running.skip_existing:
                self._take(Row(job.source, SKIPPED))
            else:
                left.append(job)
        return left

    def settings_of(self, job: Job) -> str:
        """What stands for a picture as it is now and all that is done with it."""
        try:
            status = os.stat(job.source)
            picture = (status.st_size, status.st_mtime_ns)
        except OSError:
            picture = (0, 0)
        told = repr((sorted(self.work.fit.items()), self.work.export, sorted(job.outputs.items()), picture))
        return hashlib.sha256(told.encode("utf-8", "surrogatepass")).hexdigest()[:16]

    def done(self, job: Job, done: Done) -> None:
        """Takes up what came of a picture."""
        psnr = done.psnr if math.isfinite(done.psnr) else None
        status = STOPPED if done.stopped else OK if done.met else MISSED
        numbers = (done.shapes, psnr, done.flip, done.bytes, round(done.seconds, 3))
        self._take(Row(job.source, status, *numbers, settings=self.settings_of(job)))

    def failed(self, job: Job, problem: Problem) -> None:
        """Says what went wrong."""
        problem.complain()
        self.problems.append(problem)
        status = BUG if problem.status == guard.BUG else FAILED
        self._take(Row(job.source, status, error=one_line(problem.line)))

    def _take(self, row: Row) -> None:
        self.rows[row.file] = row
        self.report.add(row)

    def count(self, status: str) -> int:
        """How many pictures came out so."""
        return sum(row.status == status for row in self.rows.values())

    def left(self) -> list[str]:
        """The pictures of which nothing has been made."""
        return [job.source for job in self.jobs if job.source not in self.rows]


def run_batch(batch: Batch, stop: Stop) -> None:
    """Converts what is to be done, until a stop is asked for."""
    todo = batch.todo()
    several = min(batch.work.running.jobs, len(todo))
    try:
        if several > 1:
            _in_processes(batch, todo, several, stop)
        else:
            _one_by_one(batch, todo, stop)
    finally:
        batch.report.write()


def _one_by_one(batch: Batch, todo: list[Job], stop: Stop) -> None:
    running, everything = batch.work.running, len(batch.jobs)
    for job in todo:
        counted = f"{len(batch.rows) + 1}/{everything} " if everything > 1 else ""
        try:
            with telling(running, STREAM in job.outputs.values(), counted) as teller:
                done = convert(job, batch.work, teller, stop)
        except Exception as error:  # whatever it is, the other pictures can do without it
            batch.failed(job, guard.problem_of(error))
        else:
            batch.done(job, done)
        if stop.requested:
            return


# --- in several processes -------------------------------------------------------------------------------------


def _in_processes(batch: Batch, todo: list[Job], several: int, stop: Stop) -> None:
    """Keeps so many processes busy. Pictures under way when one is killed are begun anew, once, each alone."""
    waiting = list(reversed(todo))
    with telling(batch.work.running) as teller:
        while waiting and not stop.requested:
            with _workers(several) as pool:
                killed = _until_killed(batch, waiting, pool, several, stop, teller)
            for job in killed:
                with _workers(1) as pool:
                    again = _until_killed(batch, [job], pool, 1, stop, teller)
                if again:
                    batch.failed(job, Problem(f"{job.source}: {KILLED}"))


@contextmanager
def _workers(several: int) -> Iterator[ProcessPoolExecutor]:
    """So many processes, which share the cores, and leave Ctrl-C to this one."""
    threads = min(max(1, (os.cpu_count() or 1) // several), THREADS)
    context = multiprocessing.get_context("spawn")
    pool = ProcessPoolExecutor(several, context, _begin_worker, (threads, guard.Output.show))
    try:
        yield pool
    except KeyboardInterrupt:
        for process in multiprocessing.active_children():
            process.terminate()
        raise
    finally:
        pool.shutdown(cancel_futures=True)


def _begin_worker(threads: int, show: bool) -> None:
    guard.begin_worker(show)
    os.environ.setdefault("SDF2VEC_THREADS", str(threads))


def _until_killed(
    batch: Batch, waiting: list[Job], pool: ProcessPoolExecutor, several: int, stop: Stop, teller: Teller
) -> list[Job]:
    """Converts the last of the waiting pictures first; those that were under way when a process was killed."""
    under_way: dict[Future[tuple[Done | Problem, list[str]]], Job] = {}
    killed: list[Job] = []
    while (under_way or (waiting and not stop.requested)) and not (killed and not under_way):
        while waiting and len(under_way) < several and not stop.requested and not killed:
            job = waiting.pop()
            try:
                under_way[pool.submit(_converted, job, batch.work)] = job
            except BrokenProcessPool:
                killed.append(job)
        teller.counted(len(batch.rows), len(batch.jobs))
        for future in wait(under_way, 0.2, FIRST_COMPLETED).done:
            job = under_way.pop(future)
            try:
                done, lines = future.result()
            except BrokenProcessPool:
                killed.append(job)
                continue
            for line in lines:
                teller.say(line)
            if isinstance(done, Problem):
                batch.failed(job, done)
            else:
                batch.done(job, done)
    return killed


def _converted(job: Job, work: Work) -> tuple[Done | Problem, list[str]]:
    """In a process of its own: what came of a picture, or what went wrong; and the lines to say."""
    teller = Teller(work.running, lines=[])
    try:
        return convert(job, work, teller, Stop()), teller.lines or []
    except Exception as error:
        return guard.problem_of(error), teller.lines or []


# --- what is said at the end ----------------------------------------------------------------------------------


def about(batch: Batch) -> str:
    """One line on all pictures."""
    counts = {"done": batch.count(OK) + batch.count(STOPPED) + batch.count(MISSED)}
    counts |= {"of them short of the target": batch.count(MISSED)}
    counts |= {status: batch.count(status) for status in (SKIPPED, FAILED)}
    counts |= {"failed by a bug": batch.count(BUG), "not begun": len(batch.left())}
    told = ", ".join(f"{count} {name}" for name, count in counts.items() if count or name == "done")
    return f"{len(batch.jobs)} pictures: {told}"


def exit_status(batch: Batch) -> int:
    """0, 2 where nothing could be done, 3 where some pictures failed, 4 where a target was missed; more than that for
    what is graver."""
    missed = guard.MISSED if batch.count(MISSED) else guard.OK
    worst = max((problem.status for problem in batch.problems), default=missed)
    return guard.PARTLY if worst == guard.FAILED and len(batch.problems) < len(batch.jobs) else worst


def about_left(batch: Batch) -> str:
    """One line on the pictures that nothing has been made of; empty where there are none."""
    left = [one_line(source) for source in batch.left()]
    if not left:
        return ""
    more = f" and {len(left) - LISTED} more" if len(left) > LISTED else ""
    how = "" if batch.report.path else " with --skip-existing"
    return f"stopped; not done: {', '.join(left[:LISTED])}{more}; the same command{how} goes on"

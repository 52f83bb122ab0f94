"""Many pictures: what has been done of them, and the rest, one by one or by several workers."""

from __future__ import annotations

import hashlib
import math
import os
from collections import Counter, deque
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from . import guard
from .converting import Done, Work, convert
from .errors import Sdf2vecError
from .files import one_line
from .guard import Problem
from .outputs import STREAM, Job
from .progress import Stop, Teller, telling
from .report import BUG, FAILED, MISSED, OK, SKIPPED, STOPPED, Report, Row
from .running import PROCESSES, Running
from .sources import version_of, whole
from .workers import Workers, working

LISTED = 10  # pictures that a line names
READ_TOO = ("start", "weights")  # files that a fit reads beside the picture
TRIES = 3  # how often a picture is begun whose worker is killed
KILLED = "the process that converted it was killed (too little memory?)"


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
        version = version_of(job.source)
        told = repr((sorted(self.work.fit.items()), self.work.export, sorted(job.outputs.items()), version))
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


def check_streams(jobs: Sequence[Job], running: Running) -> None:
    """Raises Sdf2vecError where workers would have to read standard input or write standard output."""
    if not _is_alone(running, len(jobs)) and any(STREAM in (j.source, *j.outputs.values()) for j in jobs):
        raise Sdf2vecError("standard input and output belong to this process; workers take files and URLs")


def _is_alone(running: Running, pictures: int) -> bool:
    """Whether this process converts the pictures itself."""
    return running.engine == PROCESSES and min(running.jobs or 1, pictures) == 1


def run_batch(batch: Batch, stop: Stop) -> None:
    """Converts what is to be done, until a stop is asked for."""
    todo = batch.todo()
    running = batch.work.running
    try:
        if _is_alone(running, len(todo)):
            _one_by_one(batch, todo, stop)
        elif todo:
            _beside_each_other(batch, todo, stop)
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


# --- beside each other ----------------------------------------------------------------------------------------

Shard = tuple[Job, ...]  # pictures that a worker gets at once, and that are begun anew when it is killed
Result = tuple[Done | Problem, list[str]]  # of one picture, and what is to be said of it


def _beside_each_other(batch: Batch, todo: list[Job], stop: Stop) -> None:
    running = batch.work.running
    waiting = deque(tuple(todo[i : i + running.shard]) for i in range(0, len(todo), running.shard))
    with telling(running) as teller, working(running, len(waiting)) as workers:
        _hand_out(batch, waiting, workers, stop, teller)


def _hand_out(batch: Batch, waiting: deque[Shard], workers: Workers, stop: Stop, teller: Teller) -> None:
    """Keeps the workers busy; what a killed one had is begun anew, each picture by itself."""
    under_way: dict[Any, Shard] = {}
    killed: Counter[str] = Counter()
    while under_way or (waiting and not stop.requested):
        while waiting and len(under_way) < workers.capacity and not stop.requested:
            shard = waiting.popleft()
            under_way[workers.start(_converted, *_sent(shard, batch.work, workers.is_elsewhere))] = shard
        teller.counted(len(batch.rows), len(batch.jobs))
        for task, results in workers.ended(0.2):
            shard = under_way.pop(task)
            if results is None:
                waiting.extend(_again(batch, shard, killed))
            else:
                _take_all(batch, shard, results, teller)


def _take_all(batch: Batch, shard: Shard, results: Sequence[Result], teller: Teller) -> None:
    for job, (done, lines) in zip(shard, results, strict=True):
        for line in lines:
            teller.say(line)
        if isinstance(done, Problem):
            batch.failed(job, done)
        else:
            batch.done(job, done)


def _again(batch: Batch, shard: Shard, killed: Counter[str]) -> list[Shard]:
    """The pictures of a worker that was killed, each by itself; without those that it happened to too often."""
    killed.update(job.source for job in shard)
    for job in shard:
        if killed[job.source] >= TRIES:
            batch.failed(job, Problem(f"{job.source}: {KILLED}"))
    return [(job,) for job in shard if killed[job.source] < TRIES]


def _sent(shard: Shard, work: Work, is_elsewhere: bool) -> tuple[Shard, Work, bool]:
    """What a worker gets; where its current folder may be another one, with whole paths."""
    if is_elsewhere:
        fit = {name: whole(value) if name in READ_TOO else value for name, value in work.fit.items()}
        shard, work = tuple(map(_placed, shard)), replace(work, fit=fit)
    return shard, work, guard.Output.show


def _placed(job: Job) -> Job:
    outputs = {target: whole(path) for target, path in job.outputs.items()}
    checkpoint = job.checkpoint and whole(job.checkpoint)
    return replace(job, source=whole(job.source), outputs=outputs, checkpoint=checkpoint)


def _converted(shard: Shard, work: Work, show: bool) -> list[Result]:
    """In a worker: what came of each picture, or what went wrong; and the lines to say."""
    guard.begin_worker(show)
    return [_converted_alone(job, work) for job in shard]


def _converted_alone(job: Job, work: Work) -> Result:
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

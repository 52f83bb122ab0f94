"""What a run says while it works: lines, a bar on a terminal, how long each phase took; and how it is stopped."""

from __future__ import annotations

import math
import signal
import sys
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from types import FrameType
from typing import TYPE_CHECKING, Any

from . import guard
from .deferred import deferred
from .running import Running

if TYPE_CHECKING:
    from .fit.loop import Progress

Console = deferred("rich.console", "Console")
Bar, BarColumn = deferred("rich.progress", "Progress"), deferred("rich.progress", "BarColumn")
TextColumn = deferred("rich.progress", "TextColumn")
TimeRemainingColumn = deferred("rich.progress", "TimeRemainingColumn")


COMPILING = "compiling"  # in the name of a phase


@dataclass
class Teller:
    """Says what happens: lines on standard output (on stderr where that carries an export), a bar on a terminal."""

    running: Running
    to_stderr: bool = False
    bar: Any = None
    task: Any = None
    seconds: dict[str, float] = field(default_factory=dict)  # of each phase
    current: str = ""  # phase
    within: float = 0.0  # seconds of phases within it
    which: str = ""  # of many pictures: "3/40 "
    lines: list[str] | None = None  # where they are kept to be said later

    def say(self, line: str) -> None:
        """Prints a line, unless the run is quiet."""
        if self.running.quiet:
            return
        if self.lines is not None:
            self.lines.append(line)
            return
        with self._without_bar():
            guard.say(line, sys.stderr if self.to_stderr else sys.stdout)

    def say_all(self, text: str) -> None:
        """Prints several lines as they are, unless the run is quiet."""
        for line in text.splitlines():
            self.say(line)

    def name(self, name: str) -> None:
        """Shows on the bar what is being done."""
        if self.bar:
            self.bar.update(self.task, description=self.which + name, total=None, completed=0, detail="")

    @contextmanager
    def _without_bar(self) -> Iterator[None]:
        if self.bar:
            self.bar.stop()
        yield
        if self.bar:
            self.bar.start()

    def about_phases(self) -> str:
        """How long each phase took, the longest first."""
        found = sorted(self.seconds.items(), key=lambda item: -item[1])
        return ", ".join(f"{name} {seconds:.1f} s" for name, seconds in found if seconds >= 0.05)

    @contextmanager
    def phase(self, name: str) -> Iterator[None]:
        """A part of the work that has a name on the bar, and whose time is taken, less that of phases within it."""
        started, (around, before) = time.perf_counter(), (self.current, self.within)
        self.current, self.within = name, 0.0
        self.name(name)
        try:
            yield
        finally:
            taken = time.perf_counter() - started
            self.seconds[name] = self.seconds.get(name, 0.0) + taken - self.within
            self.current, self.within = around, before + taken
            if around:
                self.name(around)

    def counted(self, done: int, everything: int) -> None:
        """Shows how many pictures are done."""
        if self.bar:
            self.bar.update(
                self.task,
                description="pictures",
                completed=done,
                total=everything,
                detail=f"{done}/{everything}",
            )

    def step(self, progress: Progress) -> None:
        """Shows where a fit stands; where there is no bar, a line says why nothing seems to happen."""
        if not self.bar:
            if COMPILING in progress.phase:
                self.say(
                    f"  {progress.phase}: takes some seconds more; sdf2vec --warm-up does all of it beforehand"
                )
            return
        counted = f"step {progress.step}/{progress.steps}"
        loss = f"  loss {progress.loss:.5f}" if math.isfinite(progress.loss) else ""
        self.bar.update(
            self.task,
            description=f"{self.which}{progress.phase} on {progress.device}",
            completed=progress.step,
            total=progress.steps if loss else None,
            detail=counted + loss if loss else "",
        )


@contextmanager
def telling(running: Running, to_stderr: bool = False, which: str = "") -> Iterator[Teller]:
    """A teller whose bar is there for so long."""
    if running.quiet or not sys.stderr.isatty():
        yield Teller(running, to_stderr, which=which)
        return
    columns = (
        TextColumn("{task.description:>7}"),
        BarColumn(),
        TextColumn("{task.fields[detail]}"),
        TimeRemainingColumn(),
    )
    with Bar(*columns, console=Console(stderr=True), transient=True, redirect_stdout=False) as bar:
        yield Teller(
            running, to_stderr, bar, bar.add_task(f"{which}start", total=None, detail=""), which=which
        )


class Stop:
    """Set by the first Ctrl-C or SIGTERM; the second one interrupts as usual."""

    status = guard.OK

    @property
    def requested(self) -> bool:
        """Whether the run is to end."""
        return self.status != guard.OK


@contextmanager
def stopping() -> Iterator[Stop]:
    """The first Ctrl-C or SIGTERM within asks for an end."""
    stop = Stop()

    def request(number: int, frame: FrameType | None) -> None:
        stop.status = guard.SIGNALLED + number
        _restore(before)

    before = {number: signal.signal(number, request) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield stop
    finally:
        _restore(before)


def _restore(handlers: Mapping[signal.Signals, Any]) -> None:
    for number, handler in handlers.items():
        signal.signal(number, handler)

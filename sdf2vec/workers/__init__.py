"""Where pictures are converted beside this process: in processes, on a Dask cluster, on Ray.

Each is a small class with the same few things, and knows nothing of pictures: `batch` hands out the work, repeats what
a killed worker had, and writes the report.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, Protocol

from ..deferred import deferred
from ..limits import THREADS
from ..running import Running

Task = Callable[..., Any]  # importable by its name, with arguments that can be pickled


class Workers(Protocol):
    """What does tasks elsewhere. `capacity`: how many of them are worth having under way at once.

    `is_elsewhere`: it may have another current folder than this process.
    """

    capacity: int
    is_elsewhere: bool

    def start(self, task: Task, *arguments: Any) -> Any:
        """Begins a task; what stands for it (hashable)."""

    def ended(self, seconds: float) -> list[tuple[Any, Any]]:
        """The tasks that have ended, after at most so long, each with its result; None where its worker was killed."""

    def close(self) -> None:
        """Ends all that is still under way."""


_WORKERS: dict[str, Callable[..., Workers]] = {
    "processes": deferred("sdf2vec.workers.processes", "Processes"),
    "dask": deferred("sdf2vec.workers.dask", "Dask"),
    "ray": deferred("sdf2vec.workers.ray", "Ray"),
}


@contextmanager
def working(running: Running, tasks: int) -> Iterator[Workers]:
    """The workers that a run asks for, for so long; those that are started here share the cores of this machine.

    Raises Sdf2vecError where they can't be had.
    """
    several = min(running.jobs or 1, tasks)
    threads = min(max(1, (os.cpu_count() or 1) // several), THREADS)
    workers = _WORKERS[running.engine](running, several, threads)
    try:
        yield workers
    finally:
        workers.close()

"""Processes of this machine: each is a pool of its own, so that one that is killed takes no other task with it."""

from __future__ import annotations

import multiprocessing
import os
from collections.abc import Callable
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from typing import Any

from .. import guard
from ..running import Running

Slot = int  # which of the processes


class Processes:
    """So many processes, which share the cores, and leave Ctrl-C to this one."""

    is_elsewhere = False

    def __init__(self, running: Running, several: int, threads: int) -> None:
        self.capacity = several
        self._threads = threads
        self._pools: dict[Slot, ProcessPoolExecutor] = {}
        self._under_way: dict[Future[Any], Slot] = {}

    def start(self, task: Callable[..., Any], *arguments: Any) -> Future[Any]:
        """Begins a task in a process that has none."""
        free = next(slot for slot in range(self.capacity) if slot not in self._under_way.values())
        try:
            future = self._pool(free).submit(task, *arguments)
        except BrokenProcessPool:  # killed while it had nothing to do
            del self._pools[free]
            future = self._pool(free).submit(task, *arguments)
        self._under_way[future] = free
        return future

    def _pool(self, slot: Slot) -> ProcessPoolExecutor:
        if slot not in self._pools:
            context = multiprocessing.get_context("spawn")
            self._pools[slot] = ProcessPoolExecutor(1, context, _begin, (self._threads,))
        return self._pools[slot]

    def ended(self, seconds: float) -> list[tuple[Future[Any], Any]]:
        """See `Workers`."""
        done = wait(self._under_way, seconds, FIRST_COMPLETED).done
        return [(future, self._result(future)) for future in done]

    def _result(self, future: Future[Any]) -> Any:
        slot = self._under_way.pop(future)
        try:
            return future.result()
        except BrokenProcessPool:
            self._pools.pop(slot).shutdown(wait=False)
            return None

    def close(self) -> None:
        """Ends the processes: those that have a task at once."""
        if self._under_way:
            for process in multiprocessing.active_children():
                process.terminate()
        for pool in self._pools.values():
            pool.shutdown(cancel_futures=True)


def _begin(threads: int) -> None:
    """First of all in a process, which may be left alone before it gets a task."""
    guard.end_with_parent()
    os.environ.setdefault("SDF2VEC_THREADS", str(threads))

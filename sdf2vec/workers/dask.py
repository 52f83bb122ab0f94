"""A Dask cluster: that of an address, or one of processes that is started here."""

from __future__ import annotations

import logging
import os
from collections.abc import Callable
from concurrent.futures import CancelledError
from contextlib import suppress
from queue import Empty, SimpleQueue
from typing import Any

from ..errors import Sdf2vecError
from ..extras import needed
from ..files import one_line
from ..running import Running

PATIENCE = 30  # seconds until a cluster has to answer
AHEAD = 2  # tasks for each thread of a cluster elsewhere, so that none waits for the next one


class Dask:
    """Tasks as futures of `distributed`, in whose scheduler none is kept once it has ended."""

    is_elsewhere = True

    def __init__(self, running: Running, several: int, threads: int) -> None:
        self._distributed = needed("distributed", "dask", "--engine dask")
        self._dask = needed("dask", "dask", "--engine dask")
        _silence("distributed")
        self._cluster = None if running.address else self._started(several, threads)
        self._client = self._connected(running.address or self._cluster)
        self._under_way: set[Any] = set()
        self._ended: SimpleQueue[tuple[Any, Any]] = SimpleQueue()
        held = sum(self._client.nthreads().values())
        self.capacity = several if self._cluster else min(running.jobs or AHEAD * held, AHEAD * max(held, 1))

    def _started(self, several: int, threads: int) -> Any:
        """A cluster of processes with a task each. What a killed one had is told, not repeated: `batch` does that."""
        environment = {"SDF2VEC_THREADS": os.environ.get("SDF2VEC_THREADS", str(threads))}
        with self._dask.config.set({"distributed.scheduler.allowed-failures": 0}):
            return self._distributed.LocalCluster(
                n_workers=several,
                threads_per_worker=1,
                processes=True,
                dashboard_address=None,
                silence_logs=logging.CRITICAL,
                env=environment,
                preload=["sdf2vec.workers.dask_worker"],
            )

    def _connected(self, where: Any) -> Any:
        try:
            return self._distributed.Client(where, timeout=PATIENCE, set_as_default=False)
        except (OSError, ValueError) as error:
            reason = " ".join(str(error).split()) or type(error).__name__
            raise Sdf2vecError(
                f"--address {one_line(str(where))}: no Dask scheduler answers ({reason})"
            ) from None

    def start(self, task: Callable[..., Any], *arguments: Any) -> Any:
        """Begins a task wherever there is room; the same task twice is done twice."""
        future = self._client.submit(task, *arguments, pure=False)
        self._under_way.add(future)
        # In a thread, as soon as it ends: until it is fetched a result dies with the worker that holds it.
        future.add_done_callback(lambda ended: self._ended.put((ended, self._outcome(ended))))
        return future

    def ended(self, seconds: float) -> list[tuple[Any, Any]]:
        """See `Workers`. Raises Sdf2vecError where the cluster is gone."""
        found: list[tuple[Any, Any]] = []
        with suppress(Empty):
            found.append(self._ended.get(timeout=seconds))
            while True:
                found.append(self._ended.get_nowait())
        if not found and self._client.status != "running":
            raise Sdf2vecError("the Dask cluster is gone; the same command goes on where there is one")
        return [(future, self._result(future, outcome)) for future, outcome in found]

    def _outcome(self, future: Any) -> Any:
        try:
            return future.result()
        except Exception as error:
            return error

    def _result(self, future: Any, outcome: Any) -> Any:
        self._under_way.discard(future)
        lost = (self._distributed.KilledWorker, CancelledError)
        if isinstance(outcome, lost):
            return None
        if isinstance(outcome, Exception):
            raise outcome
        return outcome

    def close(self) -> None:
        """Lets go of the cluster, and ends it where it was started here."""
        for future in self._under_way:
            future.cancel()
        self._client.close()
        if self._cluster:
            self._cluster.close()


def _silence(package: str) -> None:
    """What goes wrong with workers is told in the report, in a line."""
    for name in list(logging.root.manager.loggerDict):
        if name.split(".")[0] == package:
            logging.getLogger(name).setLevel(logging.CRITICAL)

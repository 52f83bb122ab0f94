"""Ray: the cluster of an address, or one that is started here."""

from __future__ import annotations

import logging
import os
from collections.abc import Callable
from typing import Any

from ..errors import Sdf2vecError
from ..extras import needed
from ..files import one_line
from ..running import Running

AHEAD = 2  # tasks for each core of a cluster elsewhere, so that none waits for the next one


class Ray:
    """Tasks as Ray's, which are told when their worker dies, not repeated: `batch` does that."""

    is_elsewhere = True

    def __init__(self, running: Running, several: int, threads: int) -> None:
        self._ray = needed("ray", "ray", "--engine ray")
        options: dict[str, Any] = {"address": running.address}
        if not running.address:
            environment = {"SDF2VEC_THREADS": os.environ.get("SDF2VEC_THREADS", str(threads))}
            options = {"num_cpus": several, "runtime_env": {"env_vars": environment}}
        try:
            self._ray.init(
                include_dashboard=None if running.address else False,
                log_to_driver=False,
                logging_level=logging.CRITICAL,
                **options,
            )
        except (OSError, RuntimeError, ValueError) as error:
            reason = " ".join(str(error).split()) or type(error).__name__
            where = f"--address {one_line(running.address)}" if running.address else "--engine ray"
            raise Sdf2vecError(f"{where}: Ray does not start ({reason})") from None
        held = int(self._ray.cluster_resources().get("CPU", 1))
        self.capacity = min(running.jobs or AHEAD * held, AHEAD * held) if running.address else several
        self._under_way: set[Any] = set()

    def start(self, task: Callable[..., Any], *arguments: Any) -> Any:
        """Begins a task on a core."""
        reference = self._ray.remote(max_retries=0, num_cpus=1)(task).remote(*arguments)
        self._under_way.add(reference)
        return reference

    def ended(self, seconds: float) -> list[tuple[Any, Any]]:
        """See `Workers`."""
        waiting = list(self._under_way)
        done, _ = self._ray.wait(waiting, num_returns=len(waiting), timeout=0)
        if not done:
            done, _ = self._ray.wait(waiting, num_returns=1, timeout=seconds)
        return [(reference, self._result(reference)) for reference in done]

    def _result(self, reference: Any) -> Any:
        self._under_way.discard(reference)
        try:
            return self._ray.get(reference)
        except self._ray.exceptions.RayTaskError:
            raise
        except self._ray.exceptions.RayError:  # its worker, its node or its result is gone
            return None

    def close(self) -> None:
        """Lets go of the cluster, and ends it where it was started here."""
        for reference in self._under_way:
            self._ray.cancel(reference, force=True)
        self._ray.shutdown()

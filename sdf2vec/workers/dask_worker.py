"""What a worker of a cluster that is started here loads first."""

from __future__ import annotations

import signal
from typing import Any


def dask_setup(worker: Any) -> None:
    """Ctrl-C is for the process that hands out the work: what is under way is finished."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)

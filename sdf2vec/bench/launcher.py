"""Runs a program and writes down what it took; a small process of its own, for Linux counts a large parent's memory
to its child. Called by path, without the package: `python -I -S launcher.py REPORT SECONDS COMMAND...`."""

import json
import os
import signal
import subprocess
import sys
import time


def main() -> None:
    """Writes wall and CPU seconds, peak memory in MiB and the exit status to a file."""
    report, limit, *command = sys.argv[1:]
    started = time.perf_counter()
    process = subprocess.Popen(command, stdin=subprocess.DEVNULL, start_new_session=True)

    def end(*_: object) -> None:
        os.killpg(process.pid, signal.SIGKILL)

    for number in (signal.SIGALRM, signal.SIGINT, signal.SIGTERM):
        signal.signal(number, end)
    signal.setitimer(signal.ITIMER_REAL, float(limit))
    _, status, usage = os.wait4(process.pid, 0)
    took = {
        "seconds": time.perf_counter() - started,
        "cpu": usage.ru_utime + usage.ru_stime,
        "megabytes": usage.ru_maxrss / (1 << 20 if sys.platform == "darwin" else 1 << 10),
        "status": os.waitstatus_to_exitcode(status),
    }
    with open(report, "w", encoding="utf-8") as stream:
        json.dump(took, stream)


if __name__ == "__main__":
    main()

"""What every run of the program keeps to: one line for whatever goes wrong, an exit status that says so, signals."""

from __future__ import annotations

import multiprocessing
import os
import signal
import sys
import threading
import traceback
import warnings
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from multiprocessing.process import BaseProcess
from typing import Any, NoReturn, TextIO

from .errors import Sdf2vecError, Sdf2vecWarning
from .files import one_line

OK, FAILED, PARTLY, MISSED, BUG = 0, 2, 3, 4, 70
SIGNALLED = 128  # plus the signal's number
INTERRUPTED, UNREAD = (
    SIGNALLED + signal.SIGINT,
    SIGNALLED + 13,
)  # as shells say it: Ctrl-C; a reader that left
SHOW = "--traceback"
NO_MEMORY = "not enough memory; take fewer shapes, a smaller picture or a smaller --size"


class Output:
    """What has become of standard output in this run."""

    closed = False  # from the beginning
    lost: OSError | None = None  # why lines could not be printed
    show = False  # tracebacks, too


def run(work: Callable[[list[str]], int], arguments: Sequence[str]) -> NoReturn:
    """Runs the program and exits: with what `work` returns, 2 after one line on stderr for what the user can mend, 70
    after one for a bug, or 128 and the number of the signal that ended it."""
    Output.show, Output.lost = SHOW in arguments, None
    _open_what_is_closed()
    _catch_signals()
    status = _status_of(work, [argument for argument in arguments if argument != SHOW])
    sys.exit(status or _status_of_output())


def _status_of(work: Callable[[list[str]], int], arguments: list[str]) -> int:
    with warnings.catch_warnings():
        warnings.showwarning = _warn
        try:
            return _reported(work, arguments)
        except KeyboardInterrupt as error:
            complain("interrupted")
            return error.args[0] if error.args else INTERRUPTED


def _reported(work: Callable[[list[str]], int], arguments: list[str]) -> int:
    try:
        status = work(arguments)
        sys.stdout.flush()
        return status
    except Exception as error:
        return report(error)


def _status_of_output() -> int:
    return OK if Output.lost is None else report(Output.lost)


@dataclass(frozen=True)
class Problem:
    """What went wrong, in one line, and the exit status for it."""

    line: str
    status: int = FAILED

    def complain(self) -> None:
        """Says it, unless who reads standard output has seen enough."""
        if self.status != UNREAD:
            complain(self.line)


def report(error: Exception) -> int:
    """Says in one line what went wrong; the exit status for it."""
    problem = problem_of(error)
    problem.complain()
    return problem.status


def problem_of(error: Exception) -> Problem:
    """What an exception means to the user; its traceback is printed where that is asked for."""
    if Output.show:
        traceback.print_exception(error)
    if isinstance(error, Sdf2vecError):
        return Problem(str(error))
    if isinstance(error, MemoryError) or "can't allocate memory" in str(error):
        return Problem(NO_MEMORY)
    if isinstance(error, OSError):
        _mute_output()
        line = f"{error.filename or 'standard output'}: {error.strerror or error}"
        return Problem(line, UNREAD if isinstance(error, BrokenPipeError) else FAILED)
    return Problem(_bug(error), BUG)


@cache
def end_with_parent() -> None:
    """Once in a process that works for another one: it ends when that does."""
    if parent := multiprocessing.parent_process():
        threading.Thread(target=_end_with, args=(parent,), daemon=True).start()


@cache
def begin_worker(show: bool) -> None:
    """Once in a process that converts for another one: it leaves Ctrl-C to that, speaks for it, ends with it."""
    end_with_parent()
    Output.show, warnings.showwarning = show, _warn
    with suppress(ValueError):  # in a thread: whoever started the process looks after signals
        signal.signal(signal.SIGINT, signal.SIG_IGN)


def _end_with(parent: BaseProcess) -> NoReturn:
    """Else a worker of a run that was killed would wait for work for ever."""
    parent.join()
    os._exit(BUG)


def _bug(error: Exception) -> str:
    frames = traceback.extract_tb(error.__traceback__)
    ours = [frame for frame in frames if os.path.dirname(__file__) in frame.filename] or frames
    where = f" in {ours[-1].name}, line {ours[-1].lineno}" if ours else ""
    what = f"{type(error).__name__}: {error}"[:200]
    return f"this is a bug: {what}{where}; run it again with {SHOW} and report what it prints"


def complain(message: str) -> None:
    """One line on standard error."""
    try:
        sys.stderr.write(f"sdf2vec: {one_line(message)}\n")  # at once: what runs beside it writes there, too
    except OSError:  # nobody listens
        return


def say(line: str, stream: TextIO) -> None:
    """One line that nothing depends on: where it can't be printed, the run goes on."""
    if Output.lost is not None and stream is sys.stdout:
        return
    try:
        print(one_line(line), file=stream, flush=True)
    except BrokenPipeError:
        _mute_output()
    except OSError as error:
        Output.lost = error
        _mute_output()


def write_output(data: bytes) -> None:
    """An export to standard output. Raises OSError, and Sdf2vecError where that was closed from the beginning."""
    if Output.closed:
        raise Sdf2vecError("standard output: is closed")
    sys.stdout.buffer.write(data)
    sys.stdout.buffer.flush()


def _mute_output() -> None:
    """What is still to be printed goes nowhere, also when the interpreter flushes it at its end."""
    null = os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(null, sys.stdout.fileno())
    except (OSError, ValueError):  # no file is behind it
        return
    finally:
        os.close(null)


def _open_what_is_closed() -> None:
    """Standard streams that the caller has closed go nowhere: else the next file opened would take their place."""
    Output.closed = sys.stdout is None
    for number, name in enumerate(("stdin", "stdout", "stderr")):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, os.O_RDWR)  # takes the lowest number that is free: this one
        if getattr(sys, name) is None and number:
            setattr(sys, name, open(os.devnull, "w"))  # noqa: SIM115 (for the whole run)


def _catch_signals() -> None:
    try:
        signal.signal(signal.SIGINT, signal.default_int_handler)
        signal.signal(signal.SIGTERM, _terminate)
    except ValueError:  # in a thread: whoever started it looks after signals
        return


def _terminate(number: int, frame: Any) -> NoReturn:
    raise KeyboardInterrupt(SIGNALLED + number)


def _warn(message: Warning | str, category: type[Warning], *where: Any, **options: Any) -> None:
    """Our own warnings as one line; those of libraries are for who looks for a bug."""
    if Output.show or issubclass(category, Sdf2vecWarning):
        complain(str(message))

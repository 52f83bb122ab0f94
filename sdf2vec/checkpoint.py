"""A fit saved while it runs, so that little is lost where it is killed: `--start` goes on from there."""

from __future__ import annotations

import contextlib
import os
import time
from dataclasses import dataclass
from typing import TYPE_CHECKING

from . import guard
from .errors import Sdf2vecError
from .files import one_line
from .scene_file import save

if TYPE_CHECKING:
    from .fit.loop import Progress

PAUSE = 30.0  # seconds from one to the next, and before the first
SUFFIX = ".checkpoint.scene.json"
OFF = "off"


@dataclass
class Checkpoint:
    """A file that a fit is saved to now and then; without a path nowhere."""

    path: str
    saved: float = 0.0  # when

    def begin(self, start: str | None) -> str:
        """Takes the time. What to say of a checkpoint that an earlier run has left, unless it is gone on from."""
        self.saved = time.monotonic()
        left = bool(self.path) and os.path.isfile(self.path)
        if not left or (start is not None and os.path.realpath(start) == os.path.realpath(self.path)):
            return ""
        shown = one_line(self.path)
        return f"{shown}: left by a fit that was killed; --start {shown} goes on from it"

    def see(self, progress: Progress) -> None:
        """Saves the scene where the last time was long ago. Where it can't be saved, one line says so, once."""
        if not self.path or time.monotonic() - self.saved < PAUSE:
            return
        try:
            save(progress.scene(), self.path)
        except Sdf2vecError as error:
            guard.complain(f"no checkpoint: {error}")
            self.path = ""
        self.saved = time.monotonic()

    def remove(self) -> None:
        """Of a fit whose exports have been written."""
        if self.path:
            with contextlib.suppress(OSError):
                os.unlink(self.path)

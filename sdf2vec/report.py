"""The report of a batch: a line a picture, from which an interrupted batch goes on."""

from __future__ import annotations

import csv
import io
import json
import math
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any

from .errors import Sdf2vecError
from .files import one_line, require_writable, write_atomically

OK, SKIPPED, STOPPED, MISSED, FAILED, BUG = "ok", "skipped", "stopped", "missed", "failed", "bug"
EVERY = 1.0  # seconds between two writings of a report, at least


@dataclass(frozen=True)
class Row:
    """What became of one picture. `settings` stands for all that its outputs depend on."""

    file: str
    status: str
    shapes: int | None = None
    psnr: float | None = None  # dB
    flip: float | None = None
    bytes: int | None = None  # of all its files
    seconds: float | None = None
    error: str = ""
    settings: str = ""


NUMBERS: dict[str, Callable[[Any], Any]] = {
    "shapes": int,
    "bytes": int,
    "psnr": float,
    "flip": float,
    "seconds": float,
}


class Report:
    """The rows by file, written to a path (if there is one) again and again, each time whole."""

    def __init__(self, path: str | None, force: bool = False) -> None:
        self.path, self.rows, self.written = path, dict[str, Row](), -math.inf
        if path is None:
            return
        self.form = Path(path).suffix.lower()
        if self.form not in FORMS:
            raise Sdf2vecError(f"{one_line(path)}: a report ends in {' or '.join(FORMS)}")
        require_writable(path)
        self.rows = _read(path, self.form, force)

    def add(self, row: Row) -> None:
        """Takes up a row, and writes the report unless it just has."""
        self.rows[row.file] = row
        if time.monotonic() - self.written >= EVERY:
            self.write()

    def write(self) -> None:
        """Writes all rows. Raises Sdf2vecError."""
        if self.path is None:
            return
        write_atomically(self.path, FORMS[self.form][0]([asdict(row) for row in self.rows.values()]).encode())
        self.written = time.monotonic()


def _read(path: str, form: str, force: bool) -> dict[str, Row]:
    """The rows that a report has. Raises Sdf2vecError where it is none."""
    try:
        text = Path(path).read_bytes().decode()
        rows = [Row(**_typed(row)) for row in FORMS[form][1](text)]
    except FileNotFoundError:
        return {}
    except (OSError, UnicodeDecodeError, ValueError, TypeError, AttributeError):
        if force:
            return {}
        raise Sdf2vecError(
            f"{one_line(path)}: is there, and no report of sdf2vec; choose another --report, or replace it with --force"
        ) from None
    return {row.file: row for row in rows}


def _typed(row: dict[str, Any]) -> dict[str, Any]:
    return {name: NUMBERS.get(name, str)(value) for name, value in row.items() if value not in (None, "")}


def _jsonl(rows: list[dict[str, Any]]) -> str:
    return "".join(f"{json.dumps(row, ensure_ascii=True)}\n" for row in rows)


def _from_jsonl(text: str) -> list[dict[str, Any]]:
    return [json.loads(line) for line in text.splitlines() if line.strip()]


def _csv(rows: list[dict[str, Any]]) -> str:
    stream = io.StringIO()
    writer = csv.DictWriter(stream, [field.name for field in fields(Row)], lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return stream.getvalue()


def _from_csv(text: str) -> list[dict[str, Any]]:
    return list(csv.DictReader(io.StringIO(text)))


Writer = Callable[[list[dict[str, Any]]], str]
Reader = Callable[[str], list[dict[str, Any]]]
FORMS: dict[str, tuple[Writer, Reader]] = {".jsonl": (_jsonl, _from_jsonl), ".csv": (_csv, _from_csv)}

"""The report of a batch: a line a picture, from which an interrupted batch goes on; and beside it the sums."""

from __future__ import annotations

import csv
import io
import json
import math
import os
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, NamedTuple

from .errors import Sdf2vecError
from .extras import needed
from .files import one_line, require_writable, write_atomically

OK, SKIPPED, STOPPED, MISSED, FAILED, BUG = "ok", "skipped", "stopped", "missed", "failed", "bug"
DONE = (OK, STOPPED, MISSED)
MADE = "made with sdf2vec"  # by which the sums are known again
EVERY = 1.0  # seconds between two writings of a report, at least
WORTH = 20  # times as long as a writing takes until the next one
SHOWN = 100  # different errors that the sums name


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


Rows = list[dict[str, Any]]

NUMBERS: dict[str, Callable[[Any], Any]] = {
    "shapes": int,
    "bytes": int,
    "psnr": float,
    "flip": float,
    "seconds": float,
}


class Report:
    """The rows by file, written to a path (if there is one) again and again, each time whole.

    Beside them the sums, named and built as img2dataset names and builds those of its shards.
    """

    def __init__(self, path: str | None, force: bool = False) -> None:
        self.path, self.rows, self.next = path, dict[str, Row](), -math.inf
        if path is None:
            return
        ending = Path(path).suffix.lower()
        if ending not in FORMS:
            raise Sdf2vecError(f"{one_line(path)}: a report ends in {', '.join(FORMS)}")
        self.form, self.sums, self.began = (
            FORMS[ending](),
            f"{os.path.splitext(path)[0]}_stats.json",
            time.time(),
        )
        require_writable(path)
        require_writable(self.sums)
        self.rows = _read(path, self.form.read, force)
        if not force:
            _refuse_other(self.sums)

    def add(self, row: Row) -> None:
        """Takes up a row, and writes the report unless it just has."""
        self.rows[row.file] = row
        if time.monotonic() >= self.next:
            self.write()

    def write(self) -> None:
        """Writes all rows, and the sums. Raises Sdf2vecError."""
        if self.path is None:
            return
        started = time.monotonic()
        write_atomically(self.path, self.form.write([vars(row) for row in self.rows.values()]))
        write_atomically(self.sums, json.dumps(self._sums(), indent=1).encode())
        ended = time.monotonic()
        self.next = ended + max(EVERY, WORTH * (ended - started))

    def _sums(self) -> dict[str, Any]:
        rows, now = self.rows.values(), time.time()
        statuses = Counter(row.status for row in rows if not row.error)
        errors = Counter(row.error.removeprefix(f"{row.file}: ") for row in rows if row.error)
        return {
            MADE: "pictures",
            "count": len(rows),
            "successes": sum(row.status in DONE for row in rows),
            "failed": sum(row.status in (FAILED, BUG) for row in rows),
            "skipped": sum(row.status == SKIPPED for row in rows),
            "shapes": sum(row.shapes or 0 for row in rows),
            "bytes": sum(row.bytes or 0 for row in rows),
            "seconds": round(sum(row.seconds or 0.0 for row in rows), 3),
            "start_time": self.began,
            "end_time": now,
            "duration": round(now - self.began, 3),
            "status_dict": dict(statuses) | dict(errors.most_common(SHOWN)),
        }


def _read(path: str, read: Callable[[bytes], Rows], force: bool) -> dict[str, Row]:
    """The rows that a report has. Raises Sdf2vecError where it is none."""
    try:
        rows = [Row(**_typed(row)) for row in read(Path(path).read_bytes())]
    except FileNotFoundError:
        return {}
    except (OSError, ValueError, TypeError, AttributeError):
        if force:
            return {}
        raise Sdf2vecError(
            f"{one_line(path)}: is there, and no report of sdf2vec; choose another --report, or replace it with --force"
        ) from None
    return {row.file: row for row in rows}


def _refuse_other(path: str) -> None:
    """Raises Sdf2vecError where the file of the sums is something else."""
    try:
        is_ours = MADE in Path(path).read_text()[:100]
    except FileNotFoundError:
        return
    except (OSError, ValueError):
        is_ours = False
    if not is_ours:
        raise Sdf2vecError(
            f"{one_line(path)}: is there, and not made by sdf2vec; choose another --report, or replace it with --force"
        )


def _typed(row: dict[str, Any]) -> dict[str, Any]:
    return {name: NUMBERS.get(name, str)(value) for name, value in row.items() if value not in (None, "")}


class Form(NamedTuple):
    """How rows are written, and read again."""

    write: Callable[[Rows], bytes]
    read: Callable[[bytes], Rows]


def _jsonl(rows: Rows) -> bytes:
    return "".join(f"{json.dumps(row, ensure_ascii=True)}\n" for row in rows).encode()


def _from_jsonl(data: bytes) -> Rows:
    return [json.loads(line) for line in data.decode().splitlines() if line.strip()]


def _csv(rows: Rows) -> bytes:
    stream = io.StringIO()
    writer = csv.DictWriter(stream, [field.name for field in fields(Row)], lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return stream.getvalue().encode()


def _from_csv(data: bytes) -> Rows:
    return list(csv.DictReader(io.StringIO(data.decode())))


def _parquet() -> Form:
    """Rows as a Parquet file. Raises Sdf2vecError where pyarrow is missing."""
    arrow = needed("pyarrow", "parquet", "a report in Parquet")
    parquet = needed("pyarrow.parquet", "parquet", "a report in Parquet")
    types: dict[Any, Any] = {int: arrow.int64(), float: arrow.float64()}
    schema = arrow.schema(
        [(field.name, types.get(NUMBERS.get(field.name), arrow.string())) for field in fields(Row)]
    )

    def write(rows: Rows) -> bytes:
        stream = io.BytesIO()
        parquet.write_table(arrow.Table.from_pylist(rows, schema), stream)
        return stream.getvalue()

    def read(data: bytes) -> Rows:
        rows: Rows = parquet.read_table(io.BytesIO(data)).to_pylist()
        return rows

    return Form(write, read)


FORMS: dict[str, Callable[[], Form]] = {
    ".jsonl": lambda: Form(_jsonl, _from_jsonl),
    ".csv": lambda: Form(_csv, _from_csv),
    ".parquet": _parquet,
}

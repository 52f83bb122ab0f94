"""How large an export may be: bytes as written, or gzipped as a web server sends them."""

from __future__ import annotations

import gzip
import re
from typing import NamedTuple

from ..errors import Sdf2vecError


class ByteLimit(NamedTuple):
    """At most so many bytes."""

    most: int
    gzipped: bool = False

    @classmethod
    def of(cls, value: int | str) -> ByteLimit:
        """From 4000, "4000" or "4000gz". Raises Sdf2vecError for anything else."""
        said = re.fullmatch(r"(\d{1,15})(gz)?", str(value))
        if isinstance(value, bool) or not said or int(said[1]) < 1:
            raise Sdf2vecError(
                f"the size limit is a number of bytes, as 4000, or gzipped 4000gz, got {value!r}"
            )
        return cls(int(said[1]), bool(said[2]))

    def size(self, data: bytes) -> int:
        """How many bytes count."""
        return gzipped_size(data) if self.gzipped else len(data)

    def share(self, data: bytes) -> float:
        """Of the limit, above 1 for what is too large."""
        return self.size(data) / self.most

    def __str__(self) -> str:
        return f"{self.most:,} bytes{' gzipped' if self.gzipped else ''}"


def gzipped_size(data: bytes) -> int:
    """How many bytes a web server sends."""
    return len(gzip.compress(data, 9, mtime=0))

"""What an exporter returns."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

MARK = "Made with sdf2vec"  # what nearly every export says of itself: such files may be replaced


@dataclass(frozen=True)
class Exported:
    """An export: its text or bytes; files that belong beside it, by what takes the place of its suffix; what was chosen
    or given up, a line each.

    `error`: how far it is off from the scene by construction, in 8-bit levels: at most, of shader text; of a small
    drawing the root mean square, about. `met`: whether it keeps to the
    size limit.
    """

    data: str | bytes
    beside: Mapping[str, bytes] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    error: float = 0.0
    met: bool = True

    @property
    def raw(self) -> bytes:
        """The bytes to write; text as UTF-8."""
        return self.data.encode() if isinstance(self.data, str) else self.data

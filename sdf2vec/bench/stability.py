"""The catalogue of failures over many seeds: how often each method fails, how far FLIP spreads; table and chart."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from statistics import median

import msgspec
import torch
from matplotlib.figure import Figure
from msgspec import Struct

from ..declared import check_choice
from ..errors import Sdf2vecError
from ..files import require_writable, write_atomically
from ..threads import threads_of_its_own
from .attempts import Attempt, Outcome
from .catalogue import CASES, Case
from .chart import save
from .results import Machine, machine
from .table import spread

KEPT, PAGE, CHART = "stability.json", "stability.md", "stability.png"


class Tried(Struct):
    """How a method has done, seed after seed: whether it failed, and its FLIP (absent where there is no picture)."""

    failed: list[bool]
    flip: list[float | None]

    def add(self, outcome: Outcome) -> None:
        """One more seed."""
        self.failed.append(outcome.failed)
        self.flip.append(outcome.flip if math.isfinite(outcome.flip) else None)

    @property
    def flips(self) -> list[float]:
        """Those that there are."""
        return [value for value in self.flip if value is not None]


class Catalogue(Struct):
    """All that was tried, by the names of cases, theirs and ours."""

    machine: Machine
    theirs: dict[str, Tried]
    ours: dict[str, Tried]


def attempted(attempt: Attempt, seed: int) -> Outcome:
    """A seed of one method; what ends in an error has failed."""
    try:
        with threads_of_its_own():
            return attempt(seed)
    except (ArithmeticError, RuntimeError, ValueError):
        return Outcome(True)


def run(folder: Path, seeds: int, names: str, say: Callable[[str], None]) -> bool:
    """Tries what has not been tried yet, and writes table and chart. Whether any method of ours failed."""
    require_writable(folder / KEPT)
    cases = _chosen(names)
    found = _begun(folder / KEPT)
    for number, case in enumerate(cases, 1):
        for attempt, tried in ((case.theirs, found.theirs), (case.ours, found.ours)):
            kept = tried.setdefault(case.name, Tried([], []))
            for seed in range(len(kept.failed), seeds):
                kept.add(attempted(attempt, seed))
            write_atomically(folder / KEPT, msgspec.json.format(msgspec.json.encode(found), indent=1))
        theirs, ours = (sum(tried[case.name].failed) for tried in (found.theirs, found.ours))
        say(f"{number}/{len(cases)} {case.name}: theirs fails {theirs} times, ours {ours} of {seeds}")
    present = [case for case in CASES if case.name in found.ours]
    write_atomically(folder / PAGE, page(present, found).encode())
    for path in (folder / CHART, (folder / CHART).with_suffix(".svg")):
        save(chart(present, found), path)
    return any(any(found.ours[case.name].failed) for case in cases)


def _chosen(names: str) -> list[Case]:
    """The cases of these names, all without any. Raises Sdf2vecError for an unknown one."""
    wanted = [name.strip() for name in names.split(";") if name.strip()]
    for name in wanted:
        check_choice("case", name, [case.name for case in CASES])
    return [case for case in CASES if not wanted or case.name in wanted]


def _begun(path: Path) -> Catalogue:
    """What was tried before. Raises Sdf2vecError where that was on another machine."""
    if not path.exists():
        return Catalogue(machine(), {}, {})
    try:
        found = msgspec.json.decode(path.read_bytes(), type=Catalogue)
    except (OSError, msgspec.MsgspecError) as error:
        raise Sdf2vecError(f"{path}: no results of the catalogue ({error}); choose another folder") from error
    if found.machine != machine():
        raise Sdf2vecError(
            f"{path}: measured on another machine or with other versions; choose another folder"
        )
    return found


def page(cases: Sequence[Case], found: Catalogue) -> str:
    """All of it in Markdown."""
    failing = [case for case in cases if any(found.ours[case.name].failed)]
    named = [f"{case.name} ({case.left or 'not understood yet'})" for case in failing]
    said = f"Ours fails at: {'; '.join(named)}." if failing else "Ours fails at none."
    seeds = max(len(tried.failed) for tried in found.ours.values())
    return (
        "\n\n".join(
            (
                "# Where such methods fail",
                f"    sdf2vec bench --stability --seeds {seeds} -o DIR",
                "Each entry is a small picture, scene or set of numbers made from a seed; `theirs` is a textbook's way "
                "(`sdf2vec/bench/textbook.py`), `ours` this program. FLIP: the median over the seeds, and from the "
                f"least to the greatest. {found.machine.told}.",
                said,
                "\n".join(_rows(cases, found)),
                f"![How often each fails, and how far FLIP spreads]({CHART})",
            )
        )
        + "\n"
    )


def _rows(cases: Sequence[Case], found: Catalogue) -> Iterator[str]:
    yield "| where | why | theirs | failed is | theirs fails | ours fails | FLIP of theirs | FLIP of ours |"
    yield "|---|---|---|---|---:|---:|---|---|"
    for case in cases:
        theirs, ours = found.theirs[case.name], found.ours[case.name]
        counts = (f"{sum(tried.failed)} of {len(tried.failed)}" for tried in (theirs, ours))
        cells = (case.name, case.why, case.method, case.judge, *counts, _spread(theirs), _spread(ours))
        yield "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"


def _spread(tried: Tried) -> str:
    return spread(tried.flips, 3) if tried.flips else ""


def chart(cases: Sequence[Case], found: Catalogue) -> Figure:
    """On the left how often each succeeds, on the right the spread of FLIP."""
    figure = Figure(figsize=(11, 1.2 + 0.34 * len(cases)), layout="constrained")
    rates, spreads = figure.subplots(1, 2, sharey=True)
    places = torch.arange(len(cases)).tolist()
    for tried, shift, color, name in (
        (found.theirs, 0.2, "#d1495b", "theirs"),
        (found.ours, -0.2, "#0b61a4", "ours"),
    ):
        at = [place + shift for place in places]
        shares = [1 - sum(tried[c.name].failed) / max(1, len(tried[c.name].failed)) for c in cases]
        rates.barh(at, shares, height=0.36, color=color, label=name)
        for place, case in zip(at, cases, strict=True):
            flips = tried[case.name].flips
            if flips:
                spreads.plot([min(flips), max(flips)], [place] * 2, color=color, linewidth=2)
                spreads.plot(median(flips), place, "o", color=color, markersize=4)
    rates.set(yticks=places, yticklabels=[case.name for case in cases], xlabel="succeeds", xlim=(0, 1))
    rates.invert_yaxis()
    rates.legend(loc="lower left", fontsize=8)
    spreads.set(xlabel="FLIP: least, median, greatest")
    spreads.grid(alpha=0.3)
    return figure

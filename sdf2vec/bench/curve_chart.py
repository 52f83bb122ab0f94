"""The chart of a curve: PSNR and FLIP against the number of shapes, and against bytes."""

from __future__ import annotations

from collections.abc import Sequence
from operator import attrgetter

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..curve import Point

QUALITIES = {"PSNR (dB)": attrgetter("psnr"), "FLIP (0: looks the same)": attrgetter("flip")}


def figure_of(points: Sequence[Point]) -> Figure:
    """Both qualities, above each other; beside them against bytes, where an export was measured."""
    targets = list(points[0].sizes)
    figure = Figure(figsize=(10 if targets else 5.5, 6.4), layout="constrained")
    panels = figure.subplots(2, 2 if targets else 1, sharey="row", squeeze=False)
    for row, (name, of) in zip(panels, QUALITIES.items(), strict=True):
        up = [of(point) for point in points]
        row[0].plot([point.shapes for point in points], up, marker="o", markersize=4)
        _label(row[0], "shapes", name)
        for target in targets if len(row) > 1 else ():
            sizes = [point.sizes[target] for point in points]
            (line,) = row[1].plot([s.raw for s in sizes], up, marker="o", markersize=4, label=target)
            row[1].plot(
                [s.gzipped for s in sizes], up, "--", color=line.get_color(), label=f"{target} gzipped"
            )
        if len(row) > 1:
            _label(row[1], "bytes", "")
            row[1].set_xscale("log")
            row[1].legend(fontsize=8)
    return figure


def _label(axes: Axes, across: str, up: str) -> None:
    axes.set(xlabel=across, ylabel=up)
    axes.grid(alpha=0.3)

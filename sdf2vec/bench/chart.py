"""Line charts for the documentation, and charts of any kind as files."""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import matplotlib as mpl
from matplotlib.figure import Figure

from ..export.exported import MARK
from ..files import write_atomically

Points = Sequence[tuple[float, float]]


@dataclass(frozen=True)
class Chart:
    """What a chart shows; both axes are logarithmic. Dashed: names of lines to dash."""

    title: str
    across: str
    up: str
    lines: Mapping[str, Points]
    dashed: tuple[str, ...] = ()


def drawn(chart: Chart) -> Figure:
    """A chart as a figure; the same numbers give the same one."""
    figure = Figure(figsize=(7, 4.2), layout="constrained")
    axes = figure.add_subplot()
    for name, points in chart.lines.items():
        style = "--" if name in chart.dashed else "-"
        axes.plot(*zip(*points, strict=True), style, marker="o", markersize=4, label=name)
    axes.set(title=chart.title, xlabel=chart.across, ylabel=chart.up, xscale="log", yscale="log")
    ticks = sorted({x for points in chart.lines.values() for x, _ in points})
    if len(ticks) <= 8:
        axes.set_xticks(ticks, [f"{tick:g}" for tick in ticks])
        axes.minorticks_off()
    axes.grid(alpha=0.3)
    axes.legend(fontsize=8)
    return figure


def save(figure: Figure, path: Path) -> None:
    """Writes a figure as what its name's ending says."""
    write_atomically(path, encoded(figure, path.suffix[1:]))


def encoded(figure: Figure, form: str) -> bytes:
    """A figure as PNG or SVG; the same figure gives the same bytes."""
    file = io.BytesIO()
    metadata = {"Date": None, "Creator": MARK} if form == "svg" else {"Software": MARK}
    with mpl.rc_context({"svg.hashsalt": "sdf2vec", "svg.fonttype": "none"}):
        figure.savefig(file, format=form, metadata=metadata, dpi=110)
    return file.getvalue()

"""The charts of a benchmark: FLIP and PSNR by seconds, bytes, numbers; a panel a picture, each with its front."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from .chart import save
from .pareto import Point, front
from .results import Run

COLUMNS = 3
WIDE = 100.0  # times the least cost: of a panel that reaches farther, only 1, 10, 100, … have labels
ROOM = 0.16, 0.045  # of a panel, across and down, that the name of a point takes
COLORS = {"ours": "#0b61a4", "variant": "#57a0d3", "thesis": "#d1495b", "peer": "#e0a030"}
SIGNS = {"ours": "o", "variant": ".", "thesis": "s", "peer": "^"}
ABOUT = {
    "ours": "presets",
    "variant": "variants of them",
    "thesis": "the thesis' method",
    "peer": "other programs",
}


@dataclass(frozen=True)
class Across:
    """What a point costs: by a field of a run, and which fields say how near that comes."""

    name: str
    title: str
    field: str
    psnr: str = "psnr"
    flip: str = "flip"
    families: tuple[str, ...] = tuple(COLORS)


ACROSS = (
    Across("seconds", "CPU seconds of the whole process", "cpu"),
    Across("bytes", "bytes of the SVG, gzipped", "svg_gzip", "svg_psnr", "svg_flip"),
    Across("small", "bytes of the smallest SVG, gzipped", "small_gzip", "small_psnr", "small_flip"),
    Across("numbers", "numbers", "numbers"),
)
UP = {"flip": "FLIP", "psnr": "PSNR dB"}


def points(runs: Sequence[Run], picture: str, across: Across, up: str) -> list[Point]:
    """The runs of one picture as points of one chart; what has no such cost is left out."""
    field = across.flip if up == "flip" else across.psnr
    return [
        Point(getattr(run, across.field), getattr(run, field), name_of(run), run.family)
        for run in runs
        if run.picture == picture and getattr(run, across.field) > 0
    ]


def name_of(run: Run) -> str:
    """The method, and how many shapes there are."""
    return f"{run.method} {run.drawn}"


def files(across: Across, up: str) -> tuple[str, str]:
    """Names of a chart's files."""
    return f"{up}-by-{across.name}.png", f"{up}-by-{across.name}.svg"


def write_all(runs: Sequence[Run], folder: Path) -> None:
    """Writes every chart, as PNG and as SVG."""
    for across in ACROSS:
        for up in UP:
            chart = drawn(runs, across, up)
            for name in files(across, up):
                save(chart, folder / name)


def drawn(runs: Sequence[Run], across: Across, up: str) -> Figure:
    """One chart, a panel a picture."""
    pictures = list(dict.fromkeys(run.picture for run in runs))
    columns = min(COLUMNS, len(pictures))
    rows = -(-len(pictures) // columns)
    figure = Figure(figsize=(1.5 + 4.0 * columns, 0.8 + 3.4 * rows), layout="constrained")
    panels = figure.subplots(rows, columns, squeeze=False).flatten()
    for panel, picture in zip(panels, pictures, strict=False):
        _fill(panel, points(runs, picture, across, up), up)
        panel.set(title=picture, xlabel=across.title, ylabel=UP[up])
    for panel in panels[len(pictures) :]:
        panel.set_axis_off()
    present = {run.family for run in runs}
    for family in (family for family in COLORS if family in present):
        panels[0].plot([], [], SIGNS[family], color=COLORS[family], label=ABOUT[family])
    panels[0].plot([], [], color="#333333", label="what nothing beats")
    figure.legend(loc="outside lower center", ncols=5, fontsize=8)
    return figure


def _labelled(costs: Sequence[float]) -> tuple[float, ...]:
    """Which numbers of a decade have a label, so that labels have room."""
    wide = min(costs, default=1.0) * WIDE < max(costs, default=1.0)
    return (1.0,) if wide else (1.0, 2.0, 5.0)


def _apart(best: Sequence[Point], panel: Axes) -> list[Point]:
    """Those of a front whose names have room, from its beginning on."""
    places = panel.transAxes.inverted().transform(
        panel.transData.transform([(point.cost, point.value) for point in best])
    )
    named: list[int] = []
    for index, (x, y) in enumerate(places):
        if all(abs(x - places[other][0]) > ROOM[0] or abs(y - places[other][1]) > ROOM[1] for other in named):
            named.append(index)
    return [best[index] for index in named]


def _fill(panel: Axes, found: Sequence[Point], up: str) -> None:
    """All points, and the front with names."""
    panel.set_xscale("log")
    panel.xaxis.set_major_locator(LogLocator(subs=_labelled([point.cost for point in found])))
    panel.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:,.7g}"))
    panel.xaxis.set_minor_formatter(NullFormatter())
    panel.grid(alpha=0.25, which="both")
    panel.margins(x=1.25 * ROOM[0])
    for family in COLORS:
        own = [point for point in found if point.family == family]
        if own:
            xs, ys = [p.cost for p in own], [p.value for p in own]
            panel.plot(xs, ys, SIGNS[family], color=COLORS[family], markersize=5, alpha=0.8)
    best = front(found, up == "flip")
    if not best:
        return
    xs, ys = [p.cost for p in best], [p.value for p in best]
    panel.plot(xs, ys, color="#333333", linewidth=1, drawstyle="steps-post", zorder=1)
    below = up == "flip"  # on the side of the front where no points are
    for point in _apart(best, panel):
        panel.annotate(
            point.name,
            (point.cost, point.value),
            xytext=(-3, -3 if below else 3),
            textcoords="offset points",
            fontsize=5,
            color=COLORS[point.family],
            ha="right",
            va="top" if below else "bottom",
        )

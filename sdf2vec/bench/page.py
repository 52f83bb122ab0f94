"""The page of a benchmark, and its tables in Markdown."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

from ..templating import template
from .fronts import ACROSS, UP, Across, files, points
from .pareto import front
from .peers import PUBLISHED, Published
from .results import Results, Run

SHOWN = 256  # pixels of the longest side of a picture on the page
PICTURES = "pictures"  # folder of them
COLUMNS = {
    "picture": ("picture", ""),
    "method": ("method", ""),
    "shapes": ("drawn", ",d"),
    "PSNR dB": ("psnr", ".2f"),
    "SSIM": ("ssim", ".3f"),
    "FLIP": ("flip", ".4f"),
    "seconds": ("seconds", ".1f"),
    "CPU seconds": ("cpu", ".1f"),
    "MiB": ("megabytes", ".0f"),
    "numbers": ("numbers", ",d"),
    "SVG": ("svg_bytes", ",d"),
    "gzip": ("svg_gzip", ",d"),
    "its dB": ("svg_psnr", ".2f"),
    "smallest SVG": ("small_bytes", ",d"),
    "gzip ": ("small_gzip", ",d"),
    "its dB ": ("small_psnr", ".2f"),
    "shader": ("shader_bytes", ",d"),
    "gzip  ": ("shader_gzip", ",d"),
}
LEFT_OUT = ("picture", "SVG", "smallest SVG", "shader")  # of the tables in Markdown
IN_MARKDOWN = tuple(name for name in COLUMNS if name not in LEFT_OUT)
HEADS = {
    "gzip": "SVG gz",
    "its dB": "dB of it",
    "gzip ": "smallest SVG gz",
    "its dB ": "dB of it",
    "gzip  ": "shader gz",
}


def fronts_of(runs: Sequence[Run], across: Across, up: str) -> Iterator[tuple[str, list[str]]]:
    """For each picture the names on the front."""
    for picture in dict.fromkeys(run.picture for run in runs):
        found = front(points(runs, picture, across, up), up == "flip")
        yield picture, [point.name for point in found]


def html(results: Results, about: Sequence[str]) -> str:
    """The whole page."""
    runs = results.medians()
    seconds = dict(fronts_of(runs, ACROSS[0], "flip"))
    charts = [
        (f"{UP[up]} by {across.title}", *files(across, up), list(fronts_of(runs, across, up)))
        for across in ACROSS
        for up in UP
    ]
    rows = [(f"{run.method} {run.drawn}" in seconds[run.picture], list(_cells(run))) for run in runs]
    names = {run.picture for run in runs}
    return template("bench.html.jinja").render(
        results=results,
        about=about,
        charts=charts,
        columns=[name.strip() for name in COLUMNS],
        rows=rows,
        failed=[run for run in results.runs if run.error],
        published=published(names),
        pictures=[(name, list(_shots(results, name))) for name in results.pictures],
        shown=SHOWN,
    )


def published(pictures: Iterable[str]) -> list[Published]:
    """What others have published of these pictures."""
    return [figures for figures in PUBLISHED if figures.picture in set(pictures)]


def _cells(run: Run) -> Iterator[tuple[object, str]]:
    for field, form in COLUMNS.values():
        value = getattr(run, field)
        yield value, format(value, form) if value or not form else ""


def shot(run: Run) -> str:
    """Where a run's drawing is, beside the page."""
    return f"{PICTURES}/{run.picture}.{run.method.replace(':', '-')}.{run.shapes}.png"


def original(name: str) -> str:
    """Where a picture is, beside the page."""
    return f"{PICTURES}/{name}.png"


def _shots(results: Results, name: str) -> Iterator[tuple[str, str]]:
    yield original(name), "the picture"
    for run in results.medians():
        if run.picture == name:
            yield shot(run), f"{run.method} {run.drawn}: {run.psnr:.2f} dB, FLIP {run.flip:.4f}"


def markdown(results: Results, about: Sequence[str]) -> str:
    """All of it in Markdown; the charts lie beside it."""
    runs = results.medians()
    parts = [
        "# Speed against accuracy",
        "\n".join(f"    {command}" for command in results.commands),
        f"{results.machine.told}. Seconds, CPU seconds and memory are those of the whole process, from its start to "
        "its SVG; kernels were compiled before. Scored by the same code at the picture's own size: the render, or "
        "another program's SVG drawn by resvg. `dB of it`: the SVG before it, as resvg draws it.",
    ]
    if results.absent:
        parts.append(f"Not on this machine: {', '.join(results.absent)}.")
    parts += ["\n".join(f"- {line}" for line in about), "## Charts"]
    for across in ACROSS:
        for up in UP:
            png, _ = files(across, up)
            parts.append(f"![{UP[up]} by {across.title}]({png})")
    parts.append("## What nothing beats")
    parts.append("\n".join(_front_table(runs)))
    for picture in results.pictures:
        parts += [f"## {picture}", "\n".join(_table([run for run in runs if run.picture == picture]))]
    parts += ["## Published figures", "Not measured in this run.", "\n".join(_published_table(runs))]
    return "\n\n".join(parts) + "\n"


def _front_table(runs: Sequence[Run]) -> Iterator[str]:
    yield "| picture | FLIP by CPU seconds | FLIP by bytes of the smallest SVG, gzipped | FLIP by numbers |"
    yield "|---|---|---|---|"
    found = [dict(fronts_of(runs, across, "flip")) for across in (ACROSS[0], ACROSS[2], ACROSS[3])]
    for picture in found[0]:
        yield f"| {picture} | {' | '.join('; '.join(names[picture]) for names in found)} |"


def _table(runs: Sequence[Run]) -> Iterator[str]:
    yield "| " + " | ".join(HEADS.get(name, name) for name in IN_MARKDOWN) + " |"
    yield "|---|" + "---:|" * (len(IN_MARKDOWN) - 1)
    for run in runs:
        cells = dict(zip(COLUMNS, (text for _, text in _cells(run)), strict=True))
        yield "| " + " | ".join(cells[name] for name in IN_MARKDOWN) + " |"


def _published_table(runs: Sequence[Run]) -> Iterator[str]:
    yield "| what | picture | shapes | CPU seconds | PSNR dB | FLIP | SVG gz | source |"
    yield "|---|---|---:|---:|---:|---:|---:|---|"
    for figures in published({run.picture for run in runs}):
        yield "| " + " | ".join("" if value is None else str(value) for value in figures) + " |"

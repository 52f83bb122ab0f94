"""Known scenes found again: how many shapes, of which kinds, how near.

For another tool: `--pictures FOLDER` writes the pictures, `--svg FOLDER` judges the SVG of the same names.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from .. import api
from ..arrays import Float32Array
from ..errors import Sdf2vecError
from ..files import write_atomically
from ..fit.settings import AUTO
from ..image import Picture, encode_png
from . import choices
from .known_drawing import KnownScene
from .known_scenes import COUNTS, MODES, SIDE, known_scene
from .peers import drawn_by
from .recovery import ENOUGH, Answer, Verdict, f1, judged, scene_answer, svg_answer
from .sheet import spaced
from .table import Asked, Page

SEEDS = 20
KINDS = "circle,ellipse,box,triangle"
JAGGED = "jagged"
EDGES = ("sharp", "soft", JAGGED)


class Case(NamedTuple):
    """One scene, by what it is made from: a soft one for every odd seed, or all sharp and without antialiasing; and the
    quality of the JPEG that is given of it.
    """

    mode: str
    true: int
    seed: int
    jagged: bool = False
    quality: int | None = None

    @property
    def name(self) -> str:
        return f"{self.mode}-{self.true:02}-{self.seed:02}"

    @property
    def edges(self) -> str:
        return JAGGED if self.jagged else EDGES[self.seed % 2]

    @property
    def known(self) -> KnownScene:
        known = known_scene(self.true, self.mode, self.edges == "soft", self.seed)
        return replace(known, jagged=self.jagged, quality=self.quality)


class Result(NamedTuple):
    """What a tool made of a scene; the pictures, given and found, side by side for the figure."""

    case: Case
    verdict: Verdict
    pictures: Float32Array


# --- tools --------------------------------------------------------------------------------------------------


def fitted(known: KnownScene, shapes: int | str, **options: Any) -> Answer:
    """What this program finds; `options` as in `api.fit`."""
    started = time.process_time()
    scene = api.fit(Picture(known.given), shapes, **options)  # type: ignore[arg-type] # "auto", where it can
    return scene_answer(scene, time.process_time() - started)


def by_fit(case: Case, known: KnownScene, options: argparse.Namespace) -> Answer:
    """This program, told how many shapes there are or nothing."""
    chosen = choices.fit_of(options)
    if options.shapes == AUTO:
        return fitted(known, AUTO, seed=case.seed, **chosen)
    return fitted(known, max(case.true, 1), seed=case.seed, **({"kind": KINDS} | chosen))


def by_vtracer(case: Case, known: KnownScene, options: argparse.Namespace) -> Answer:
    """vtracer at its defaults."""
    svg, seconds = drawn_by("vtracer", encode_png(known.given))
    return svg_answer(svg, known.side, seconds)


def by_file(case: Case, known: KnownScene, options: argparse.Namespace) -> Answer:
    """An SVG that some tool has written."""
    path: Path = options.svg / f"{case.name}.svg"
    try:
        return svg_answer(path.read_text(encoding="utf-8"), known.side)
    except OSError as error:
        raise Sdf2vecError(
            f"{path}: {error.strerror}; --pictures writes what it is to be made from"
        ) from error


def by_truth(case: Case, known: KnownScene, options: argparse.Namespace) -> Answer:
    """The true shapes as this program draws them: no fit comes nearer with as many."""
    return scene_answer(known.scene)


TOOLS: dict[str, Callable[[Case, KnownScene, argparse.Namespace], Answer]] = {
    "sdf2vec": by_fit,
    "vtracer": by_vtracer,
    "files": by_file,
    "truth": by_truth,
}


def result(tool: str, case: Case, known: KnownScene, options: argparse.Namespace) -> Result:
    """One scene through one tool."""
    answer = TOOLS[tool](case, known, options)
    verdict = judged(known, answer)
    return Result(case, verdict, spaced([known.given, answer.pixels], across=False))


# --- the page -----------------------------------------------------------------------------------------------

COLUMNS = (
    "true",
    "scenes",
    "found / true",
    "90 %",
    "PSNR dB",
    "worst",
    "≥ 40 dB",
    "F1",
    "F1, any kind",
    "seconds",
)


def row(name: str, true: str, verdicts: list[Verdict]) -> str:
    """Some scenes together: one row of the table."""
    ratios = [verdict.ratio for verdict in verdicts]
    near = np.array([verdict.psnr for verdict in verdicts])
    return (
        f"| {name} | {true} | {len(verdicts)} | {np.median(ratios):.2f} | {np.quantile(ratios, 0.9):.2f} "
        f"| {np.median(near):.1f} | {near.min():.1f} | {100 * (near >= ENOUGH).mean():.0f} % | {f1(verdicts):.3f} "
        f"| {f1(verdicts, of_kind=False):.3f} | {np.median([v.seconds for v in verdicts]):.1f} |"
    )


def table(results: list[Result]) -> Iterator[str]:
    """A row for each mode and number of shapes, then what is sharp and what is soft of each mode, then all of it."""
    yield f"| shapes are | {' | '.join(COLUMNS)} |"
    yield "|---|" + "---:|" * len(COLUMNS)
    counts = sorted({r.case.true for r in results})
    modes = [mode for mode in MODES if any(r.case.mode == mode for r in results)]
    for mode, count in product(modes, counts):
        yield from _rows(mode, str(count), [r for r in results if r.case[:2] == (mode, count)])
    for mode in modes:
        own = [r for r in results if r.case.mode == mode]
        for edges in EDGES:
            yield from _rows(f"{mode}, {edges}", "all", [r for r in own if r.case.edges == edges])
        yield from _rows(f"**{mode}**", "all", own)


def _rows(name: str, true: str, results: list[Result]) -> Iterator[str]:
    if results:
        yield row(name, true, [r.verdict for r in results])


def figure(results: list[Result]) -> bytes:
    """A PNG: a column for each number of shapes; given above found, sharp and soft of each mode."""
    rows = []
    for mode, edges in product(MODES, EDGES):
        first: dict[int, Float32Array] = {}
        for r in results:
            if (r.case.mode, r.case.edges) == (mode, edges):
                first.setdefault(r.case.true, r.pictures)
        if first:
            rows.append(spaced([first[count] for count in sorted(first)], across=True))
    return encode_png(spaced(rows, across=False))


def page(found: dict[str, list[Result]], asked: Asked) -> Page:
    """The whole of it in Markdown."""
    parts, figures = [ABOUT.format(side=SIDE)], {}
    for tool, results in found.items():
        suffix = f".{tool}.png"
        figures[suffix] = figure(results)
        shown = asked.figure(
            suffix, "The first of each: the picture that was given above, what was found below"
        )
        parts += [f"## {tool}", "\n".join(table(results)), shown]
    return asked.page("Known scenes found again", *parts, figures=figures)


ABOUT = """Pictures of {side} × {side} pixels, made by code from so many circles, ellipses, boxes and triangles, \
upright and turned, opaque and translucent, some with a hole. Those of even seeds are sharp and drawn by resvg; \
in those of odd seeds about half of the shapes have soft edges, and they are drawn by samples in numpy: no \
renderer of this program has a part in it. With `--jagged` all are sharp, and drawn by resvg without antialiasing \
(`crispEdges`). With `--jpeg` the tools are given a JPEG of the picture, its colour at half the resolution; what they \
find is judged by the picture before. `apart`: no two touch; `overlap`: every second lies on others, and at \
least 60 % of each is not hidden.

Found / true: shapes found for each one that there is (layers, or elements of an SVG but for a background; of a \
flat picture, one more than were found), the median and the 90th percentile. PSNR: the median, the worst, how \
many have enough. F1: of shapes found again, those of all scenes together: of the same kind, and covering the \
same visible pixels with an IoU of at least 0.75, one for one; then the same without regard to the kind, for a \
tool that draws paths. A hole is judged by its pixels. Seconds are the median of user and system time. `truth` \
is the true shapes as this program draws them: what PSNR the antialiasing leaves. The rules are in \
`sdf2vec/bench/recovery.py`; `--pictures FOLDER` and `--svg FOLDER` put any tool to the same test."""


# --- the command --------------------------------------------------------------------------------------------


def add_choices(parser: argparse.ArgumentParser) -> None:
    """The flags of `sdf2vec bench known`."""
    parser.add_argument(
        "--shapes", choices=(AUTO, "true"), default=AUTO, help="what a fit is told (default: auto)"
    )
    known = ", ".join(TOOLS)
    parser.add_argument(
        "--tools",
        type=choices.names("tool", TOOLS),
        metavar="LIST",
        help=f"what finds them: {known} (default: sdf2vec, or files with --svg)",
    )
    parser.add_argument(
        "--svg", type=choices.folder, metavar="FOLDER", help="judge these files, as the tool `files`"
    )
    parser.add_argument(
        "--pictures", type=Path, metavar="FOLDER", help="write the pictures there, fit nothing"
    )
    choices.add_count(parser, "--seeds", SEEDS, "how many seeds")
    parser.add_argument(
        "--first-seed",
        type=choices.reader(choices.whole_number(0)),
        default=0,
        metavar="N",
        help="of so many: others are other scenes, which nothing was tuned on (default: 0)",
    )
    parser.add_argument(
        "--jagged", action="store_true", help="all sharp, and drawn by resvg without antialiasing"
    )
    parser.add_argument(
        "--jpeg",
        type=choices.reader(choices.whole_number(1, 95)),
        metavar="QUALITY",
        help="what is given is a JPEG of the picture, by which it is judged",
    )
    numbers = choices.reader(choices.several(choices.whole_number(0)))
    choices.add_list(parser, "--counts", numbers, ",".join(map(str, COUNTS)), "how many shapes there are")
    choices.add_list(parser, "--modes", choices.names("mode", MODES), ",".join(MODES), "how shapes lie")
    choices.add_fit(parser, "kind", "preset", "cuts")


def pages(options: argparse.Namespace, asked: Asked) -> Iterator[Page]:
    """A page after every seed: it takes long. None where only the pictures are wanted. Raises Sdf2vecError."""
    tools = _tools_of(options)
    found: dict[str, list[Result]] = {tool: [] for tool in tools}
    for seed in range(options.first_seed, options.first_seed + options.seeds):
        cases = [
            Case(mode, true, seed, options.jagged, options.jpeg)
            for mode, true in product(options.modes, options.counts)
        ]
        if options.pictures:
            for case in cases:
                write_atomically(options.pictures / f"{case.name}.png", encode_png(case.known.given))
            continue
        for case in cases:
            known = case.known
            for tool in tools:
                found[tool].append(result(tool, case, known, options))
                asked.say(f"{tool}, {case.name}: {found[tool][-1].verdict.told}")
        yield page(found, asked)


def _tools_of(options: argparse.Namespace) -> list[str]:
    """Those of `--tools`, or files where there are some. Raises Sdf2vecError where there are none for `files`."""
    choices.fit_of(options)
    tools: list[str] = options.tools or ["files" if options.svg else "sdf2vec"]
    if "files" in tools and not options.svg:
        raise Sdf2vecError("the tool `files` needs --svg FOLDER")
    return tools

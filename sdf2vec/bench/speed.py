"""How fast the fused renderer is, as a page: what `timing.py` measures."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING, Any

from ..deferred import deferred
from ..extras import needed
from .table import Asked, Page

if TYPE_CHECKING:
    from .chart import Chart
    from .timing import Grown

against_dense: Callable[[], Iterator[str]] = deferred("sdf2vec.bench.timing", "against_dense")
per_shape_pixel: Callable[[], Iterator[str]] = deferred("sdf2vec.bench.timing", "per_shape_pixel")
growth: Callable[[], Iterator[Grown]] = deferred("sdf2vec.bench.timing", "growth")
make_chart: Callable[..., Chart] = deferred("sdf2vec.bench.chart", "Chart")
drawn: Callable[[Chart], Any] = deferred("sdf2vec.bench.chart", "drawn")
encoded: Callable[[Any, str], bytes] = deferred("sdf2vec.bench.chart", "encoded")

CHART = ".growth.svg"


def growth_table(grown: Sequence[Grown]) -> Iterator[str]:
    """One row for each step that was measured."""
    yield "| shapes | size | step ms | layers a pixel | peak memory MB |"
    yield "|---:|---:|---:|---:|---:|"
    for g in grown:
        yield f"| {g.shapes} | {g.side} | {g.milliseconds:.1f} | {g.depth:.1f} | {g.megabytes:.0f} |"


def growth_chart(grown: Sequence[Grown]) -> Chart:
    """A line for each size of the picture; dashed, what shapes × pixels would cost from the first point on."""
    lines = {
        f"{side} px": [(g.shapes, g.milliseconds) for g in grown if g.side == side]
        for side in sorted({g.side for g in grown})
    }
    first = min((g for g in grown if g.side == 256), key=lambda g: g.shapes)
    dense = [(g.shapes, first.milliseconds * g.shapes / first.shapes) for g in grown if g.side == first.side]
    name = "in proportion to shapes, 256 px"
    return make_chart("One step of a fit", "shapes", "milliseconds", lines | {name: dense}, dashed=(name,))


def add_choices(parser: argparse.ArgumentParser) -> None:
    """`sdf2vec bench speed` has no flags of its own."""


def pages(options: argparse.Namespace, asked: Asked) -> Iterator[Page]:
    """One page. Growth is measured before dense torch takes memory."""
    needed("matplotlib", "bench", "sdf2vec bench speed")
    grown = []
    for step in growth():
        grown.append(step)
        asked.say(f"{step.shapes} shapes at {step.side} px: {step.milliseconds:.1f} ms")
    yield asked.page(
        "Speed of the fused renderer",
        "## One step of a fit against the same step in dense torch\n\n256 shapes at 256 × 256, `over`: forward, "
        "L1 and SSIM, backward, Adam.",
        asked.told(against_dense()),
        "## Time per shape-pixel\n\nForward and backward of 256 shapes at 256 px on one core, all overhead included. "
        "Extents are the boxes outside of which a shape covers nothing; of a triangle's box it covers about "
        "two thirds. The share of the peak counts what the pixels in the extents need.",
        asked.told(per_shape_pixel()),
        "## Growth\n\nOne step with triangles, as a fit starts with them; layers a pixel is the mean number of "
        "layers listed for a tile. Memory is that of the whole process, torch included.",
        asked.figure(CHART, "Growth"),
        "\n".join(growth_table(grown)),
        figures={CHART: encoded(drawn(growth_chart(grown)), "svg")},
    )

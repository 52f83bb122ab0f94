"""How near a fit comes to pictures, and what it costs. Writes tables in Markdown, a chart, and pictures beside them.

    python -m sdf2vec.bench.fit PICTURE... -o docs/fit.md

The first picture is fitted with several numbers of shapes, the others with 256.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from ..api import render
from ..files import write_atomically
from ..image import Picture, encode_png, load, resize
from ..threads import available_cores
from .chart import Chart, write
from .fits import Fitted, measured, median, warm_up

SEEDS = (0, 1, 2)
COUNTS = (64, 128, 256, 512, 1024)
SPREAD = 20  # seeds whose spread is looked at
SHOWN = 224  # pixels of the shortest side of a picture that is shown

Rows = list[tuple[int, Fitted]]


def by_count(picture: Picture, preset: str, counts: Sequence[int], seeds: Sequence[int]) -> Rows:
    """The median over the seeds for each number of shapes, triangles under `over`."""
    return [
        (n, median([measured(picture, n, preset=preset, seed=seed)[0] for seed in seeds])) for n in counts
    ]


def count_table(rows: Rows) -> Iterator[str]:
    """One row for each number of shapes."""
    yield "| shapes | PSNR dB | SSIM | FLIP | seconds | CPU seconds |"
    yield "|---:|---:|---:|---:|---:|---:|"
    for count, fit in rows:
        yield f"| {count} | {_figures(fit)} |"


def _figures(fit: Fitted) -> str:
    return f"{fit.psnr:.2f} | {fit.ssim:.3f} | {fit.flip:.4f} | {fit.seconds:.1f} | {fit.cpu:.1f}"


def picture_table(pictures: dict[str, Picture]) -> Iterator[str]:
    """Each picture with each preset, 256 triangles; the default preset's median over the seeds."""
    yield "| picture | preset | PSNR dB | SSIM | FLIP | seconds | CPU seconds |"
    yield "|---|---|---:|---:|---:|---:|---:|"
    for name, picture in pictures.items():
        for preset in ("fast", "balanced", "best"):
            seeds = SEEDS if preset == "balanced" else SEEDS[:1]
            fit = median([measured(picture, 256, preset=preset, seed=seed)[0] for seed in seeds])
            yield f"| {name} | {preset} | {_figures(fit)} |"


def spread(picture: Picture) -> str:
    """How much FLIP differs from seed to seed."""
    flips = np.array([measured(picture, 256, preset="balanced", seed=seed)[0].flip for seed in range(SPREAD)])
    middle, deviation = float(np.median(flips)), float(flips.std())
    return (
        f"{SPREAD} seeds, 256 triangles, `balanced`: median FLIP {middle:.4f}, from {flips.min():.4f} to "
        f"{flips.max():.4f}; standard deviation {deviation / middle:.1%} of the median. No run failed."
    )


def side_by_side(pictures: dict[str, Picture]) -> bytes:
    """A PNG: above the pictures, below their renders of 256 triangles."""
    columns = []
    for picture in pictures.values():
        scale = SHOWN / min(picture.width, picture.height)
        width, height = round(picture.width * scale), round(picture.height * scale)
        scene = measured(picture, 256, preset="balanced")[1]
        columns.append(np.vstack([resize(picture.pixels, width, height), render(scene, width, height)]))
    tallest = max(len(column) for column in columns)
    padded = [np.pad(c, ((0, tallest - len(c)), (0, 8), (0, 0)), constant_values=1.0) for c in columns]
    return encode_png(np.hstack(padded).astype(np.float32))


def page(names: Sequence[str], output: Path) -> str:
    """All sections; charts and pictures are written on the way."""
    pictures = {Path(name).stem: load(name) for name in names}
    first, picture = next(iter(pictures.items()))
    warm_up(picture)
    rows = {
        "fast": by_count(picture, "fast", COUNTS, SEEDS[:1]),
        "balanced": by_count(picture, "balanced", COUNTS, SEEDS),
        "best": by_count(picture, "best", COUNTS[::2], SEEDS[:1]),
    }
    chart, shown = output.with_suffix(".chart.svg"), output.with_suffix(".png")
    lines = {preset: [(fit.cpu, fit.flip) for _, fit in found] for preset, found in rows.items()}
    write(Chart(f"{first}: 64 to 1024 triangles", "CPU seconds", "FLIP", lines), chart)
    write_atomically(shown, side_by_side(pictures))
    return (
        "\n\n".join(
            (
                "# How near a fit comes, and what it costs",
                f"    python -m sdf2vec.bench.fit PICTURE... -o {output.as_posix()}",
                "Triangles under `over`, scored at the pictures' own size; on "
                f"{available_cores()} CPU cores, kernels compiled before. `balanced`: median of {len(SEEDS)} seeds; "
                "the others: one seed.",
                f"## By number of shapes: {first}\n\n![FLIP by CPU seconds]({chart.name})",
                *(f"`{preset}`\n\n" + "\n".join(count_table(found)) for preset, found in rows.items()),
                "## By picture, 256 shapes",
                "\n".join(picture_table(pictures)),
                f"![The pictures above, their renders of 256 triangles below]({shown.name})",
                "## From seed to seed",
                spread(picture),
            )
        )
        + "\n"
    )


def main() -> None:
    """Entry point of `python -m sdf2vec.bench.fit`."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("pictures", nargs="+", metavar="PICTURE")
    parser.add_argument("-o", "--output", type=Path, required=True)
    options = parser.parse_args()
    write_atomically(options.output, page(options.pictures, options.output).encode())


if __name__ == "__main__":
    main()

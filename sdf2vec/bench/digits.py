"""What digits cost: bytes of a fit with all of them, and with those that the picture needs.

python -m sdf2vec.bench.digits PICTURE [--shapes 64,256] [--preset balanced]
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator

from ..export.byte_limit import gzipped_size
from ..export.options import Options
from ..exports import Exports
from ..fit.digits import concise
from ..fit.loop import fit_picture
from ..fit.settings import settings_of
from ..image import Picture, load
from ..quality import psnr_of
from ..scene import Scene

TARGETS = ("json", "glsl", "shadertoy", "svg")


def rows(picture: Picture, shapes: int, preset: str) -> Iterator[str]:
    """Two rows of a table."""
    settings = settings_of(shapes, preset=preset)
    whole = fit_picture(picture, settings)
    for name, scene in (("all", whole), ("needed", concise(whole, picture, settings))):
        yield f"| {shapes} | {name} | {psnr_of(scene, picture):.3f} | {' | '.join(_sizes(scene, picture))} |"


def _sizes(scene: Scene, picture: Picture) -> Iterator[str]:
    """Bytes of each export, and gzipped."""
    for target in TARGETS:
        data = Exports(scene, picture).export(target, Options()).raw
        yield f"{len(data):,} ({gzipped_size(data):,})"


def main() -> None:
    """Entry point of `python -m sdf2vec.bench.digits`."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("picture")
    parser.add_argument("--shapes", default="64,256")
    parser.add_argument("--preset", default="balanced")
    options = parser.parse_args()
    print(f"| shapes | digits | PSNR dB | {' | '.join(f'{t} (gzipped)' for t in TARGETS)} |")
    print("|---:|---|---:|" + "---:|" * len(TARGETS))
    for count in options.shapes.split(","):
        for row in rows(load(options.picture), int(count), options.preset):
            print(row, flush=True)


if __name__ == "__main__":
    main()

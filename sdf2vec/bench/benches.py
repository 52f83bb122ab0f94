"""Which benches there are beside the comparison of pictures, each a module that is loaded when it is asked for.

A bench's module has two functions: `add_choices` adds its flags to a parser, `pages` does what they ask for and yields
its page, anew each time that more of it is known. It loads torch when it measures, not before: `--help` shall be quick.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from dataclasses import dataclass

from ..deferred import deferred
from .table import Asked, Page


@dataclass(frozen=True)
class Bench:
    """A bench: its module in this folder, and what it measures, in one line."""

    module: str
    about: str

    def add_choices(self, parser: argparse.ArgumentParser) -> None:
        """Adds its flags."""
        deferred(f"{__package__}.{self.module}", "add_choices")(parser)

    def pages(self, options: argparse.Namespace, asked: Asked) -> Iterator[Page]:
        """Its page, as far as it has come. Raises Sdf2vecError."""
        yield from deferred(f"{__package__}.{self.module}", "pages")(options, asked)


BENCHES: dict[str, Bench] = {
    "byte-limits": Bench(
        "byte_limits", "what so many bytes of an export can say of a picture, beside WebP's"
    ),
    "digits": Bench(
        "digits", "what digits cost: a fit with all of them, and with those that the picture needs"
    ),
    "exports": Bench("exports", "how near the exports of a fit come to its render, on every engine present"),
    "icons": Bench(
        "icons", "SVG icons fitted: numbers, bytes and error beside the artist's own and vtracer's"
    ),
    "joins": Bench("joins", "known pictures, each found again as one layer of joined shapes"),
    "known": Bench(
        "known", "known scenes found again by any tool: how many shapes, of which kinds, how near"
    ),
    "many-shapes": Bench("many_shapes", "what exports of many shapes take: CPU seconds, memory, bytes"),
    "patches": Bench("patches", "a portrait in additive Gabor patches, beside triangles"),
    "shaders": Bench(
        "shaders", "what the layouts of a shader cost on software engines, and how true they are"
    ),
    "speed": Bench("speed", "a step of a fit against dense torch, time per pixel, and how a step grows"),
    "svg": Bench("svg", "how near the SVG of a fit comes to its render in every renderer, and its bytes"),
    "targets": Bench(
        "targets", "how many shapes and bytes a FLIP takes, beside the thesis' method and other programs"
    ),
    "thesis": Bench("thesis", "the thesis' tables again: as printed, its method here, and ours"),
}

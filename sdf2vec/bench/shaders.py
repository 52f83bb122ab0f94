"""What the layouts of a shader cost on software engines, and how true they are."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator
from itertools import chain
from typing import TYPE_CHECKING

from .. import api
from ..deferred import deferred
from ..export.layouts import TEXT_LIMIT, fits_constants
from ..export.options import Options
from ..export.shader import shader
from ..scene import Scene
from . import choices
from .table import Asked, Page

if TYPE_CHECKING:
    from .shader_timing import Measured

in_time: Callable[..., Measured | str] = deferred("sdf2vec.bench.shader_timing", "in_time")

SHAPES = "16,64,256,768,1024,4096"  # 768: nearly the most that a constant table takes
SIDE = 512  # pixels of the square canvas
SHOWN = 256  # shapes whose text is told of
MOST_READABLE = 1024  # statements; more take minutes to compile
LAYOUTS = {
    "glsl": ("readable", "table", "tiled", "data"),
    "shadertoy": ("readable", "tiled", "packed"),
    "wgsl": ("readable", "data"),
}
ENGINES = {"glsl": ("llvmpipe", "Chromium"), "shadertoy": ("llvmpipe", "Chromium"), "wgsl": ("lavapipe",)}
HEAD = (
    "| target | layout | shapes | depth | bytes | engine | compile s | first frame s | frame s | error |",
    "|---|---|---:|---:|---:|---|---:|---:|---:|---:|",
)
ABOUT = f"""{{name}} in triangles, preset fast, at {SIDE} × {SIDE}, on software engines: read times as ratios. \
llvmpipe and lavapipe compile anew for every picture: compile is a picture of one pixel, frame what a whole one \
takes beyond that. Chromium (SwiftShader) compiles most of a shader in its first frame. Depth: layers that a pixel \
evaluates, on average; bytes: text and data; error: largest difference from the torch render, in 8-bit levels, over \
the whole square canvas. Packed text is made for a canvas of 16:9: below and above the picture, which that does not \
show, it may be off by more."""
BUFFER = """`--layout buffer` writes a Shadertoy of two tabs, marked `// --- Buffer A ---` and `// --- Image ---`, \
which both have Buffer A as iChannel0. Buffer A draws the picture in the first frame, and where `iResolution` is not \
what the alpha of its first two texels keeps beside the alpha itself; else it repeats itself. The Image tab shows \
it. So a frame costs two reads of a texture, however many shapes there are; nothing moves."""


def rows(scenes: dict[int, Scene], target: str) -> Iterator[str]:
    """Lines of the table for one target."""
    for layout in LAYOUTS[target]:
        for count, scene in scenes.items():
            if layout == "readable" and count > MOST_READABLE:
                continue
            if layout in ("table", "tiled") and not fits_constants(scene):
                continue
            yield from _rows_of(scene, target, layout)


def _rows_of(scene: Scene, target: str, layout: str) -> Iterator[str]:
    made = shader(scene, target, Options(layout=layout))
    size = len(made.text) + (0 if made.data is None else made.data.nbytes)
    tiles = made.choice.tiles
    depth = tiles.depth if tiles else float(len(scene.layers))
    for engine in ENGINES[target]:
        head = f"| {target} | {layout} | {scene.shape_count} | {depth:.1f} | {size:,} | {engine} |"
        found = in_time(scene, target, layout, SIDE, engine)
        if isinstance(found, str):
            yield f"{head} {found} | | | |"
        else:
            yield (
                f"{head} {found.compile:.2f} | {found.first:.2f} | {found.frame:.3f} | {found.error:.3f} |"
            )


def _default(scene: Scene | None, name: str) -> str:
    """How Shadertoy text is held unless told."""
    if scene is None:
        return ""
    made = shader(scene, "shadertoy", Options(title=name))
    return (
        f"Default Shadertoy text at {scene.shape_count} shapes: {len(made.text):,} bytes, {made.about}, measured on a "
        f"full HD canvas. Hosts are warned of above {TEXT_LIMIT // 1024} KiB."
    )


def add_choices(parser: argparse.ArgumentParser) -> None:
    """The flags of `sdf2vec bench shaders`."""
    parser.add_argument("picture", type=choices.picture, metavar="PICTURE")
    choices.add_shapes(parser, SHAPES)
    choices.add_list(
        parser, "--targets", choices.names("target", LAYOUTS), ",".join(LAYOUTS), "of these targets"
    )


def pages(options: argparse.Namespace, asked: Asked) -> Iterator[Page]:
    """One page: every layout of every target."""
    scenes = {count: api.fit(options.picture, count, preset="fast") for count in options.shapes}
    lines = (line for target in options.targets for line in rows(scenes, target))
    name = options.picture.stem
    default = _default(scenes.get(SHOWN), name)
    table = asked.told(chain(HEAD, lines))
    yield asked.page("Shader layouts", ABOUT.format(name=name), default, BUFFER, table)

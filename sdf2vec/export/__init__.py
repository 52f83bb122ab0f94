"""Exporters: each a plain function of a scene and the user's options. `EXPORTERS` lists all; see `sdf2vec.exports`."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

from ..compact_file import MAGIC
from ..deferred import deferred
from ..errors import Sdf2vecError
from ..grain import Drawable, Grain
from ..scene import MAX_SHAPES, Scene
from ..scene_file import FORMAT
from .exported import MARK, Exported
from .options import Accepts, Options
from .rounding import Rounding


@dataclass(frozen=True)
class Exporter:
    """`suffix` is what a file name gets in place of the picture's; `about` is one line for the user.

    `accepts` says which scenes `write` takes, `most_shapes` how many shapes they may have; `heeds` names the options
    that matter to it; other files that it may write end in `beside`. `forms(scene, options)`, where there are several,
    begin with that of `write` and take ever fewer bytes; each is made when it is called. Where it `draws` a scene,
    `draw` makes a small drawing of what a grain can say of one (`fit.drawable`), `sketch` one of about that size,
    quickly; where there is a `rounding` of a scene, that says how coarse its numbers may be (`fit.settling`).
    `holds_drawing`: an SVG is in it. A file that ends in one of `endings` is taken to be for it; one that holds `mark`
    was made by it. `is_text`: it writes text, not bytes; `is_picture`: the render.
    """

    suffix: str
    write: Callable[[Scene, Options], Exported]
    about: str
    accepts: Callable[[Options], Accepts] = lambda options: Accepts()
    heeds: tuple[str, ...] = ()
    other_endings: tuple[str, ...] = ()
    beside: tuple[str, ...] = ()
    mark: bytes = MARK.encode()
    forms: Callable[[Scene, Options], Sequence[Callable[[], Exported]]] | None = None
    draws: Callable[[Scene, Options], bool] = lambda scene, options: False
    draw: Callable[[Drawable, Options, Grain], Exported] | None = None
    sketch: Callable[[Drawable, Options, Grain], Exported] | None = None
    rounding: Callable[[Scene, Options], Rounding | None] = lambda scene, options: None
    holds_drawing: bool = False
    is_text: bool = True
    is_picture: bool = False
    most_shapes: Callable[[Options], int] = lambda options: MAX_SHAPES

    def from_finest(self, scene: Scene, options: Options) -> Sequence[Callable[[], Exported]]:
        """All forms of an export."""
        return self.forms(scene, options) if self.forms else [partial(self.write, scene, options)]

    @property
    def endings(self) -> tuple[str, ...]:
        """What its files may end in."""
        return (self.suffix, *self.other_endings)

    def check_count(self, count: int, options: Options) -> None:
        """Raises Sdf2vecError for more shapes than the target can serve."""
        most = self.most_shapes(options)
        if count > most:
            raise Sdf2vecError(
                f"{self.suffix[1:]}: {count} shapes are more than its text can hold ({most}); "
                "write glsl or wgsl to files, which hold data, or json, or fit fewer"
            )


def _shader(
    name: str,
    suffix: str,
    about: str,
    heeds: tuple[str, ...] = (),
    endings: tuple[str, ...] = (),
    beside: tuple[str, ...] = (),
) -> Exporter:
    module = "sdf2vec.export.shader"
    names = ("exported", "most_shapes", "forms", "rounding")
    write, most_shapes, forms, rounding = (deferred(module, name) for name in names)
    return Exporter(
        suffix,
        partial(write, name=name, suffix=suffix),
        about,
        heeds=("layout", *heeds, "max_bytes", "title"),
        other_endings=endings,
        beside=beside,
        forms=partial(forms, name=name, suffix=suffix),
        rounding=partial(rounding, name=name, suffix=suffix),
        most_shapes=partial(most_shapes, name=name),
    )


def _svg(name: str, suffix: str, about: str, endings: tuple[str, ...] = ()) -> Exporter:
    module = "sdf2vec.export.svg"
    heeds = ("svg_profile", "svg_fidelity", "svg_size", "max_bytes", "title", "alt")
    accepts, forms = deferred(module, "accepts"), deferred(module, f"{name}_forms")
    draws, draw, sketch = (deferred(module, name) for name in ("draws", f"small_{name}", f"sketch_{name}"))
    return Exporter(
        suffix,
        deferred(module, name),
        about,
        accepts,
        heeds,
        endings,
        forms=forms,
        draws=draws,
        draw=draw,
        sketch=sketch,
    )


def _compact(
    name: str, suffix: str, about: str, endings: tuple[str, ...] = (), is_text: bool = False
) -> Exporter:
    module = "sdf2vec.export.compact_scene"
    return Exporter(
        suffix,
        deferred(module, name),
        about,
        heeds=("max_bytes",),
        other_endings=endings,
        mark=MAGIC,
        rounding=deferred(module, f"{name}_rounding"),
        is_text=is_text,
    )


def _raster(name: str, about: str, *endings: str) -> Exporter:
    suffix = f".render.{name}"
    write = deferred("sdf2vec.export.raster", name)
    return Exporter(
        suffix,
        write,
        about,
        heeds=("size",),
        other_endings=(f".{name}", *endings),
        is_text=False,
        is_picture=True,
    )


EXPORTERS: dict[str, Exporter] = {
    "glsl": _shader(
        "glsl",
        ".glsl",
        "fragment shader, GLSL ES 3.00, ES 1.00 or 3.30",
        ("glsl", "framing"),
        (".frag",),
        (".glsl.bin", ".glsl.data.js"),
    ),
    "shadertoy": _shader(
        "shadertoy",
        ".shadertoy.glsl",
        "mainImage to paste into Shadertoy",
        ("framing", "animate"),
        (".glsl",),
    ),
    "wgsl": _shader(
        "wgsl", ".wgsl", "shader module for WebGPU", ("framing",), (), (".wgsl.bin", ".wgsl.data.js")
    ),
    "three": _shader("three", ".three.js", "three.js material, an ES module", (), (".js",)),
    "godot": _shader("godot", ".gdshader", "canvas item shader for Godot 4"),
    "svg": _svg("svg", ".svg", "SVG that looks the same in every renderer"),
    "data-uri": _svg("data_uri", ".uri.txt", "that SVG as a data URI", (".uri",)),
    "pdf": Exporter(
        ".pdf",
        deferred("sdf2vec.export.svg", "pdf"),
        "the portable SVG as PDF, by CairoSVG",
        lambda options: Accepts(("over",)),
        ("max_bytes", "title"),
        forms=deferred("sdf2vec.export.svg", "pdf_forms"),
        mark=b"/Producer (" + MARK.encode(),
        is_text=False,
    ),
    "html": Exporter(
        ".html",
        deferred("sdf2vec.export.page", "html"),
        "one page without dependencies: shader, drawing, copy buttons",
        heeds=("max_bytes", "title", "alt", "original"),
        other_endings=(".htm",),
        mark=b'<meta name="generator" content="sdf2vec">',
        holds_drawing=True,
    ),
    "component": Exporter(
        ".sdf-image.js",
        deferred("sdf2vec.export.component", "component"),
        "<sdf-image>, an element that shows scene files",
        other_endings=(".js",),
    ),
    "json": Exporter(
        ".scene.json",
        deferred("sdf2vec.export.raster", "json"),
        "the scene itself",
        other_endings=(".json",),
        mark=f'"format": "{FORMAT}"'.encode(),
    ),
    "sdf": _compact("sdf", ".sdf", "the scene in few bytes, for <sdf-image>"),
    "sdf-uri": _compact("sdf_uri", ".sdf.txt", "the same as a data URI", is_text=True),
    "png": _raster("png", "the render, at any --size"),
    "jpg": _raster("jpg", "the same as JPEG", ".jpeg"),
    "webp": _raster("webp", "the same as WebP"),
}

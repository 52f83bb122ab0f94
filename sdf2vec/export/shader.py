"""Shader exports. The formulas come lowered from expressions; the templates add loops, tables and comments."""

from __future__ import annotations

import base64
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from msgspec import structs

from ..arrays import Float32Array
from ..blend import COMPOSITING, CROP, FRAMINGS, cropped, display, grid_point, surface_point, within
from ..deferred import deferred
from ..errors import Sdf2vecError
from ..expr import Expr, const, var, vec2, vec4
from ..graph import opened, substitute
from ..layer import PIXEL, STILL, Formula, P, Structure, constant_row
from ..limits import TEXT_SHAPES
from ..lower.shader import GLSL, WGSL, Dialect, definition, expression, literal, statements, used_functions
from ..operation import VEC2, VEC4
from ..paints import FLAT
from ..scene import MAX_SHAPES, Layer, Scene
from ..templating import template
from .dense_text import brief, dense
from .exported import Exported
from .knobs import BREATH, GROUND, breath, dragged, knobs_of, turned
from .layouts import (
    EMBEDDED,
    FILE,
    MODULE,
    OLD,
    PASTED,
    TEXT_LIMIT,
    WORD,
    Choice,
    Host,
    choose,
)
from .options import BUFFER, GLSL_VERSIONS, Options
from .records import BELOW, COUNT, JOIN, OWN, Form, first_records, form_of, records, slot
from .rounding import Rounding
from .table_text import DATA_WIDTH, data_array, ivec4s, table_rows, words_of
from .tiles import COARSEST, Tiles

if TYPE_CHECKING:
    from .packing import Packed

packed_text: Callable[..., Any] = deferred(
    "sdf2vec.export.packed_text", "PackedText"
)  # needs torch, as all below
pack: Callable[[Scene, float], Packed] = deferred("sdf2vec.export.packing", "pack")
packed_rounding: Callable[..., Any] = deferred("sdf2vec.export.packed_rounding", "SmallestPacked")
FRAG, RESOLUTION = var("fragCoord", VEC2), var("resolution", VEC2)
SEEN = var("{seen}", VEC4)  # where a template puts the colour that is seen
MOST_READABLE = TEXT_LIMIT // 50  # shapes; none is said in so few bytes
TEXTS = ("readable", "table", "packed")  # layouts that may take few bytes
DENSE = "without comments, names and spaces"


@dataclass(frozen=True)
class Target:
    """A shader text: its template, dialect, and what may hold its shapes."""

    template: str
    dialect: Dialect
    host: Host
    has_knobs: bool = False  # names on top for people to change; it knows the time, and the mouse
    surface: str = ""  # what holds the place on a mesh, 0..1 with y down, where there is no canvas
    framing: str = "fit"  # unless told
    buffered: bool = False  # in two tabs, the first of which draws once for every size of the canvas


TARGETS = {
    "glsl": Target("glsl.jinja", GLSL, FILE),
    "shadertoy": Target("shadertoy.jinja", GLSL, PASTED, has_knobs=True, framing=CROP),
    "wgsl": Target("wgsl.jinja", WGSL, MODULE),
    "three": Target("three.js.jinja", GLSL, EMBEDDED, surface="place"),
    "godot": Target("godot.jinja", GLSL, OLD, surface="UV"),
}


@dataclass(frozen=True)
class Shader:
    """A shader text, how it holds its shapes, and the data beside it: [rows, DATA_WIDTH, 4] or None.

    `error` is the largest difference from the scene's picture that the layout makes, in 8-bit levels.
    """

    text: str
    choice: Choice
    data: Float32Array | None = None
    error: float = 0.0
    buffered: bool = False

    @property
    def about(self) -> str:
        """One line on the layout, with a warning where a host may refuse the text."""
        line = str(self.choice)
        if self.buffered:
            line += ", in Buffer A; its iChannel0 and that of the Image tab are Buffer A"
        if self.error:
            line += f", off by at most {self.error:.2f} levels"
        if len(self.text) > TEXT_LIMIT and self.choice.layout != "data":
            line += f"; warning: more than {TEXT_LIMIT // 1024} KiB of text, which some hosts refuse"
        return line


def exported(scene: Scene, options: Options, name: str, suffix: str) -> Exported:
    """A scene as a shader, with its data beside it. Raises Sdf2vecError for a layout that the target can't hold."""
    made = shader(scene, name, options)
    beside = {} if TARGETS[name].host is EMBEDDED else files_beside(made, suffix)
    return Exported(made.text, beside, (made.about,), made.error)


def forms(scene: Scene, options: Options, name: str, suffix: str) -> list[Callable[[], Exported]]:
    """The same, and the layout that takes the fewest bytes, as dense as can be; those without `rounding`."""
    target, rounded = TARGETS[name], _may_be_rounded(scene, options, name)
    layouts = [layout for layout in TEXTS if layout in _host(target, options).layouts]
    asked = layouts if options.layout == "auto" else [options.layout]
    tried = [layout for layout in asked if not (rounded and layout == "packed")]

    def densest() -> Exported:
        made = (shader(scene, name, structs.replace(options, layout=layout)) for layout in tried)
        texts = [(dense(one.text, renamed=target.host is PASTED), one) for one in made]
        text, best = min(texts, key=lambda found: len(found[0].encode()))
        return Exported(text, {}, (f"{best.about}; {DENSE}",), best.error)

    finest = partial(exported, scene, options, name, suffix)
    if not tried:
        return []
    return [finest] if target.host is EMBEDDED or options.layout == BUFFER else [finest, densest]


def _may_be_rounded(scene: Scene, options: Options, name: str) -> bool:
    """Whether a size limit may be kept to by coarser numbers."""
    asked = options.layout == "packed" or options.layout == "auto"
    can = asked and scene.layers and "packed" in _host(TARGETS[name], options).layouts
    return bool(can) and options.max_bytes is not None


def rounding(scene: Scene, options: Options, name: str, suffix: str) -> Rounding | None:
    """The packed text of a scene that suits it, as coarse as it may be; None where it is not to be packed."""
    target = TARGETS[name]
    if not (scene.layers and (options.layout == "packed" or _may_be_rounded(scene, options, name))):
        return None
    chosen = structs.replace(options, layout="packed")
    slack = BREATH if _moves(target, options) else 0.0

    def write(said: Scene, packed: Packed) -> Exported:
        made = _shader(said, target, chosen, packed)
        text = dense(made.text, renamed=target.host is PASTED)
        return Exported(text, {}, (f"{made.about}; {DENSE}",))

    made: Rounding = packed_rounding(scene, slack, write, options.max_bytes is not None)
    return made


def shader(scene: Scene, name: str, options: Options) -> Shader:
    """A scene as a shader: `name` is a key of TARGETS. Raises Sdf2vecError for a layout that the target can't hold.

    What is pasted is readable unless told, where a host takes so much text; else as small as can be.
    """
    target = TARGETS[name]
    if target.host is PASTED and options.layout == BUFFER:
        target, options = _buffered(target, options)
    if target.host is not PASTED or options.layout != "auto":
        return _shader(scene, target, options)
    if scene.shape_count <= MOST_READABLE:
        made = _shader(scene, target, structs.replace(options, layout="readable"))
        if len(made.text.encode()) <= TEXT_LIMIT:
            return made
    return _shader(scene, target, structs.replace(options, layout="packed"))


def _buffered(target: Target, options: Options) -> tuple[Target, Options]:
    """The target and the options for two tabs. Raises Sdf2vecError for what moves."""
    if options.animate:
        raise Sdf2vecError(
            f"what breathes is drawn in every frame; leave out --layout {BUFFER}, or --animate"
        )
    return replace(target, has_knobs=False, buffered=True), structs.replace(options, layout="auto")


def _shader(scene: Scene, target: Target, options: Options, packed: Packed | None = None) -> Shader:
    slack = BREATH if _moves(target, options) else 0.0
    choice = choose(scene, options.layout, _host(target, options), slack)
    job = _Job(scene, target, options, choice, slack, packed)
    parts = _BODIES[choice.layout if scene.layers else "readable"](job)
    data, error = parts.pop("array", None), parts.pop("error", 0.0)
    text = template(target.template).render(
        scene=scene,
        title="".join(c if c.isprintable() and c != "\\" else " " for c in options.title),
        size=expression(_size(scene), target.dialect),
        knobs=knobs_of(job.say(_background(scene)), choice.layout, bool(slack)) if target.has_knobs else [],
        background=job.say(job.ground),
        version=GLSL_VERSIONS[options.glsl],
        buffered=target.buffered,
        output="gl_FragColor" if options.glsl == "es100" else "fragColor",
        display="" if job.is_displayable else "display",
        cropped=job.say(cropped(SEEN, P, _size(scene), job.ground)) if job.framing == CROP else "",
        within=job.say(within(P, _size(scene))) if job.framing == CROP else "",
        framed=job.framed() if job.is_one_function else [],
        dragged=job.say(dragged(P, PIXEL)) if job.is_turned else "",
        place=expression(surface_point(var(target.surface, VEC2), _size(scene)), target.dialect),
        **(dict.fromkeys(("table", "packed", "tiles", "data")) | {"layers": []} | parts),
    )
    said = brief(text) if choice.layout == "packed" else text
    return Shader(said, choice, data, error, target.buffered)


def statements_of(scene: Scene, name: str, options: Options, first: int = 0) -> list[tuple[str, list[str]]]:
    """What a readable text says of each layer: a remark and statements; the shapes are numbered from `first` on."""
    target = TARGETS[name]
    chosen = structs.replace(options, layout="readable")
    job = _Job(scene, target, chosen, Choice("readable", None, 0, 0.0, 0.0), 0.0)
    return _statements(job, first)


def statements_text(layers: Iterable[tuple[str, list[str]]]) -> str:
    """The lines of a text that say the layers."""
    return template("layers.jinja").render(layers=list(layers))


def files_beside(made: Shader, suffix: str) -> dict[str, bytes]:
    """The data of a shader as little-endian float32, and as a JavaScript module, by suffix."""
    if made.data is None:
        return {}
    raw = made.data.astype("<f4").tobytes()
    module = template("data.js.jinja").render(
        data=base64.b64encode(raw).decode(), rows=len(made.data), width=DATA_WIDTH
    )
    return {f"{suffix}.bin": raw, f"{suffix}.data.js": module.encode()}


def most_shapes(options: Options, name: str) -> int:
    """How many shapes a target can serve."""
    return MAX_SHAPES if "data" in _host(TARGETS[name], options).layouts else TEXT_SHAPES


def _host(target: Target, options: Options) -> Host:
    if target.dialect is GLSL and options.glsl == "es100" and target.host is FILE:
        return OLD
    if options.alone:
        return replace(target.host, layouts=tuple(n for n in target.host.layouts if n != "data"))
    return target.host


def _moves(target: Target, options: Options) -> bool:
    if options.animate and not target.has_knobs:
        raise Sdf2vecError("only a Shadertoy can be animated; use --emit shadertoy")
    return options.animate


@dataclass(frozen=True)
class _Job:
    """What the body of a shader is made from."""

    scene: Scene
    target: Target
    options: Options
    choice: Choice
    slack: float
    packed: Packed | None = None  # where it is, already

    @property
    def dialect(self) -> Dialect:
        return self.target.dialect

    @property
    def tiles(self) -> Tiles:
        """The lists of a layout that has some."""
        assert self.choice.tiles is not None
        return self.choice.tiles

    def motion(self, index: Expr) -> Expr:
        """What is added to the distance of the layer whose first shape has an index."""
        return breath(index) if self.slack else STILL

    @property
    def is_turned(self) -> bool:
        """Whether the names on top change edges and the place, too."""
        return self.target.has_knobs and self.choice.layout == "readable"

    @property
    def ground(self) -> Expr:
        """What is seen where no shape is, by its name where it has one."""
        is_named = self.target.has_knobs and self.choice.layout != "packed"
        return var(GROUND, VEC4) if is_named else _background(self.scene)

    def say(self, expr: Expr) -> str:
        return expression(expr, self.dialect)

    def functions(self, roots: Iterable[Expr]) -> str:
        """Definitions of all functions that the formulas and the frame around them call."""
        shown = [] if self.is_displayable else [display(BELOW)]
        found = used_functions([*roots, *shown, *self._frame()])
        brief = self.choice.layout == "packed"
        return ("\n" if brief else "\n\n").join(
            definition(f, self.dialect, documented=not brief) for f in found
        )

    @property
    def is_displayable(self) -> bool:
        """Whether the scene's colours need no clamping: in the smallest text that is left out."""
        within = not COMPOSITING[self.scene.compositing].signed and self.scene.opaque
        return self.choice.layout == "packed" and within

    @property
    def is_one_function(self) -> bool:
        """Whether all that is drawn is drawn in the function that the host calls."""
        return self.choice.layout == "packed" and self.target.has_knobs and bool(self.scene.layers)

    def framed(self) -> list[str]:
        """Statements that find the size of a `pixel` and the point `p` of the pixel at `fragCoord`."""
        place, pixel_size = FRAMINGS[self.framing]
        at, size = vec2(FRAG.x, RESOLUTION.y - FRAG.y), _size(self.scene)  # y down
        pixel = pixel_size(RESOLUTION, size)
        found = opened(place(at, RESOLUTION, size), {place})
        point = substitute(found, {pixel: PIXEL})
        return [
            *statements("float pixel = {};", opened(pixel, {pixel_size}), self.dialect),
            *statements("vec2 p = {};", point, self.dialect),
        ]

    def _frame(self) -> list[Expr]:
        """From a pixel, or a place on a surface, to a point."""
        if self.is_one_function:
            return []
        if self.target.surface:
            return [surface_point(P, P)]
        place, pixel_size = FRAMINGS[self.framing]
        return [place(P, P, P), pixel_size(P, P), *([dragged(P, PIXEL)] if self.is_turned else [])]

    @property
    def framing(self) -> str:
        """How it fills a canvas of another shape."""
        return self.options.framing or self.target.framing


def _size(scene: Scene) -> Expr:
    width, height = map(const, scene.extent)
    return vec2(width) if width is height else vec2(width, height)


def _background(scene: Scene) -> Expr:
    return vec4(*(const(value) for value in scene.ground))


# --- readable: a line for every shape ----------------------------------------------------------------------


def _readable(job: _Job) -> dict[str, Any]:
    layers = [_layer(layer, first, job) for layer, first in _numbered(job)]
    return {"functions": job.functions(layers), "layers": _statements(job)}


def _numbered(job: _Job, first: int = 0) -> list[tuple[Layer, int]]:
    """The layers with the number of the first shape of each."""
    return list(zip(job.scene.layers, (first_records(job.scene.layers) + first).tolist(), strict=True))


def _statements(job: _Job, first: int = 0) -> list[tuple[str, list[str]]]:
    """For each layer a remark and statements."""
    return [
        (f"{index} {_named(layer.structure)}", statements("c = {};", _layer(layer, index, job), job.dialect))
        for layer, index in _numbered(job, first)
    ]


def _named(structure: Structure) -> str:
    """The kinds of a layer's shapes, with what is unusual about them."""
    return ", ".join(
        " ".join(word for word in (part.join, part.paint, part.kind) if word not in ("", FLAT))
        for part in structure
    )


def _layer(layer: Layer, first: int, job: _Job) -> Expr:
    """The colour after this layer is laid on `c`."""
    row = constant_row(layer.structure, layer.numbers)
    drawn = Formula(layer.structure, row).draw(BELOW, job.scene.compositing)
    return turned(drawn, first) if job.is_turned else drawn


# --- records: a loop over a table, with or without lists ----------------------------------------------------


def _table(job: _Job) -> dict[str, Any]:
    form = form_of(job.scene)
    return _loop(job, form) | {"table": _table_part(job, form) | {"rows": table_rows(job.scene)}}


def _tiled(job: _Job) -> dict[str, Any]:
    tiles = job.tiles
    entries = first_records(job.scene.layers)[tiles.entries]
    bits = max(1, int(entries.max(initial=0)).bit_length())
    per = WORD // bits
    part = _grid_part(job, tiles) | {
        "starts": ivec4s(tiles.starts.tolist()),
        "lists": ivec4s(words_of(entries.tolist(), bits, per)),
        "bits": bits,
        "per": per,
    }
    return _table(job) | _loop(job, form_of(job.scene), tiles) | {"tiles": part}


def _data(job: _Job) -> dict[str, Any]:
    tiles, form = job.tiles, form_of(job.scene)
    rows = records(job.scene, form).reshape(-1, 4)
    numbers = np.concatenate([tiles.starts, first_records(job.scene.layers)[tiles.entries]])
    array = data_array(rows, numbers)
    return _loop(job, form, tiles) | {
        "table": _table_part(job, form),
        "tiles": _grid_part(job, tiles),
        "data": {
            "width": DATA_WIDTH,
            "height": len(array),
            "lists": len(rows),
            "base64": base64.b64encode(array.astype("<f4").tobytes()).decode(),
        },
        "array": array,
    }


def _loop(job: _Job, form: Form, tiles: Tiles | None = None) -> dict[str, Any]:
    roots = [field for _, field in form.fields()]
    roots += [form.drawn(job.motion(var("float(i)"))), *([form.joined()] if form.joins else [])]
    return {"functions": job.functions([*roots, *([grid_point(P, P, P)] if tiles else [])])}


def _table_part(job: _Job, form: Form) -> dict[str, Any]:
    return {
        "count": job.scene.shape_count,
        **table_part(form, job.dialect, job.motion(var("float(i)"))),
    }


def table_part(form: Form, dialect: Dialect, motion: Expr = STILL) -> dict[str, Any]:
    """What the template of a loop over records takes, whatever the scene."""
    return {
        "stride": form.stride,
        "heads": range((form.head - 1) // 4 + 1),
        "owns": range(JOIN // 4 + 1),
        "own": OWN[0],
        "shapes": expression(slot(COUNT), dialect),
        "joined": expression(form.joined(), dialect) if form.joins else "",
        "drawn": expression(form.drawn(motion), dialect),
        "variant": expression(slot(form.variant_place), dialect),
        "variants": [
            (" ".join(word for word in variant if word != FLAT), expression(field, dialect))
            for variant, field in form.fields()
        ],
    }


def _grid_part(job: _Job, tiles: Tiles) -> dict[str, Any]:
    grid = tiles.grid
    low, cells = vec2(*map(const, grid.low)), vec2(const(grid.per_unit))
    return {
        "columns": grid.columns,
        "last_column": grid.columns - 1,
        "last_row": grid.rows - 1,
        "after": grid.cells + 1,
        "place": expression(grid_point(P, low, cells), job.dialect),
        "coarsest": literal(COARSEST),
    }


# --- packed: a stream of bits -------------------------------------------------------------------------------


def _packed(job: _Job) -> dict[str, Any]:
    packed = job.packed or pack(job.scene, job.slack)
    text = packed_text(packed, job.scene, job.dialect, job.motion(var("float(i)")))
    part = text.part() | {"coarsest": literal(COARSEST), "moving": bool(job.slack)}
    functions = job.functions(text.roots)
    return {"functions": functions, "packed": part, "error": packed.error}


_BODIES = {"readable": _readable, "table": _table, "tiled": _tiled, "packed": _packed, "data": _data}
